// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/twist_spread.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>

#include "sinew/base/fork_safe.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/stages/twist_spread/twist_kernel.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

void check_twists(std::span<const TwistBone> twists, std::span<const Affine<float>> rest_bones) {
    std::vector<bool> is_listed(rest_bones.size());
    for (std::size_t i = 0; i < twists.size(); ++i) {
        const TwistBone& twist = twists[i];
        const std::string at = " at twist " + std::to_string(i);
        for (const std::int32_t bone : {twist.bone, twist.base, twist.tip}) {
            if (bone < 0 || static_cast<std::size_t>(bone) >= rest_bones.size()) {
                fail("twists", "bones from 0 to " + std::to_string(rest_bones.size()) + " - 1",
                     std::to_string(bone) + at);
            }
        }
        const auto bone = static_cast<std::size_t>(twist.bone);
        if (is_listed[bone])
            fail("twists", "each bone at most once", "bone " + std::to_string(bone) + at + " again");
        is_listed[bone] = true;
        if (!is_finite(twist.head) || !is_finite(twist.tail))
            fail("twists", "finite ends", "NaN or infinity" + at);
        if (!(glm::length(Vec3<double>(rest_bones[bone].linear[1])) > 0.0)) {
            fail("rest_bones", "a Y axis of each twisted bone",
                 "a length of 0 at bone " + std::to_string(bone));
        }
    }
}

void check_parents(std::span<const std::int32_t> parents, std::size_t bone_count) {
    check_optional("parents", parents.size(), bone_count, "rest bones");
    for (std::size_t bone = 0; bone < parents.size(); ++bone) {
        if (parents[bone] < -1 || parents[bone] >= static_cast<std::int32_t>(bone_count)) {
            fail("parents", "-1, or bones below " + std::to_string(bone_count),
                 std::to_string(parents[bone]) + " at bone " + std::to_string(bone));
        }
    }
}

/// For each used bone, whether it is `tip` or one that `tip` carries.
std::vector<std::uint8_t> below(std::int32_t tip, std::span<const std::int32_t> parents,
                                std::span<const std::int32_t> used_bones) {
    std::vector<std::uint8_t> result;
    for (std::int32_t bone : used_bones) {
        // At most as many steps as bones, so that parents in a circle end.
        for (std::size_t step = 0; bone >= 0 && bone != tip && step < parents.size(); ++step) {
            bone = parents[static_cast<std::size_t>(bone)];
        }
        result.push_back(bone == tip ? 1 : 0);
    }
    return result;
}

/// The line that a bone is twisted about, at rest: the axis has a length of 1.
struct AxisAtRest {
    Vec3<double> head;
    Vec3<double> direction;
};

AxisAtRest axis_at_rest(const TwistBone& twist, std::span<const Affine<float>> rest_bones) {
    const Vec3<double> head(twist.head);
    const Vec3<double> along = Vec3<double>(twist.tail) - head;
    if (glm::dot(along, along) > 0.0) return {head, glm::normalize(along)};
    return {head, glm::normalize(Vec3<double>(rest_bones[static_cast<std::size_t>(twist.bone)].linear[1]))};
}

float within(float value, float least, float most, float otherwise) {
    return std::isnan(value) ? otherwise : std::clamp(value, least, most);
}

/// The rotation of a bone relative to another, of length 1. The other's scale is taken off both.
Quat<double> rotation_between(const Mat3<double>& base, const Mat3<double>& tip,
                              const Mat3<double>& tip_rest) {
    const Affine<double> rest{tip_rest};
    const bool is_flat = glm::determinant(base) == 0.0;
    const Mat3<double> of_base = is_flat ? split_scale(Affine<double>{base}, rest).rigid.linear : base;
    const Affine<double> relative{glm::inverse(of_base) * tip};
    return glm::normalize(to_quat(split_scale(relative, rest).rigid.linear));
}

}  // namespace

struct TwistSpread::State {
    State(const Binding& binding, const TwistSpreadData& data)
        : packed(binding.packed()),
          twists(data.twists.begin(), data.twists.end()),
          rest_bones(data.rest_bones.begin(), data.rest_bones.end()) {
        check_rest_bones(rest_bones, packed->bone_count);
        check_twists(twists, rest_bones);
        check_parents(data.parents, rest_bones.size());
        if (!data.weights.empty()) check_weights("weights", data.weights, packed->vertex_count);
        if (!data.mix.empty()) check_weights("mix", data.mix, packed->vertex_count);
        check_space(data.bones_from_model);
        weights = pack_weights(mesh, data.weights);
        mix = pack_weights(mesh, data.mix);
        bones.resize(twists.size());
        list_blocks(data.parents);
        for (const TwistBone& twist : twists) {
            const Vec3<double> along = Vec3<double>(twist.tail) - Vec3<double>(twist.head);
            const double squared = glm::dot(along, along);
            const Vec3<double> share = along * (squared > 0.0 ? 1.0 / squared : 0.0);
            const Float4 row = float4(share.x, share.y, share.z, -glm::dot(share, Vec3<double>(twist.head)));
            TwistRest& of = rest.emplace_back();
            axes.push_back(axis_at_rest(twist, rest_bones));
            of.line = twist_line(axes.back().head, axes.back().direction);
            std::ranges::copy(row.value, of.share);
        }
        measure(data.bones_from_model);
    }

    /// Measures the vertices' shares and arms in the space of the bones.
    void measure(const Affine<float>& space) {
        space_rows = SpaceRows(space);
        kTwistKernel.measure[target_in_use()](frame(nullptr), 0, blocks.size());
    }

    [[nodiscard]] TwistFrame frame(Vec3<float>* points) const noexcept {
        return {.mesh = &mesh,
                .rest_points = own_rest_points.empty() ? mesh.rest_points.data() : own_rest_points.data(),
                .blocks = blocks.data(),
                // measure() alone writes them, and no other call runs at the same time.
                .block_twists = const_cast<BlockTwist*>(block_twists.data()),
                .rest = rest.data(),
                .bones = bones.data(),
                .weights = weights.empty() ? nullptr : weights.data(),
                .mix = mix.empty() ? nullptr : mix.data(),
                .spaces = space_rows.spaces(),
                .points = points};
    }

    [[nodiscard]] Affine<double> motion(std::span<const Affine<float>> posed,
                                        std::int32_t bone) const noexcept {
        const auto number = static_cast<std::size_t>(bone);
        return number < posed.size() ? cast<double>(posed[number]) : Affine<double>{};
    }

    [[nodiscard]] TwistSpreadStage::Reading<double> read(
        std::size_t twist, std::span<const Affine<float>> posed,
        std::span<const TwistChannels<float>> channels) const noexcept {
        const TwistBone& of = twists[twist];
        const auto tip_rest = cast<double>(rest_bones[static_cast<std::size_t>(of.tip)]);
        const Vec3<double>& axis = axes[twist].direction;
        const Quat<double> rotation =
            rotation_between(motion(posed, of.base).linear, motion(posed, of.tip).linear, tip_rest.linear);
        double expected = 0.0;
        if (!channels.empty() && channels[twist].rotation != Quat<float>(0.0f, Vec3<float>(0.0f))) {
            const TwistChannels<double> told{glm::normalize(Quat<double>(channels[twist].rotation)),
                                             Vec3<double>(channels[twist].angles)};
            const Quat<double> of_tip = to_quat(rotation_keeping_y(tip_rest.linear));
            expected = TwistSpreadStage::expected(told, rotation, of_tip, axis);
        }
        return TwistSpreadStage::read(rotation, axis, expected);
    }

    /// Lists blocks and block_twists.
    ///
    /// parents  TwistSpreadData::parents
    void list_blocks(std::span<const std::int32_t> parents) {
        std::vector<std::vector<std::uint8_t>> are_below;
        are_below.reserve(twists.size());
        for (const TwistBone& twist : twists) are_below.push_back(below(twist.tip, parents, mesh.used_bones));
        for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
            const std::size_t first = block_twists.size();
            // The last first: those that other bones carry.
            for (std::size_t i = twists.size(); i-- > 0;) {
                BlockTwist twist{.twist = i};
                bool is_shared = false;
                for (std::size_t lane = 0; lane < kLanes; ++lane) {
                    bool has_others = false;
                    for (std::size_t k = 0; k < mesh.blocks[b].influences; ++k) {
                        const auto [bone, weight] = influence_at(mesh, b, lane, k);
                        if (weight == 0.0f) continue;
                        const bool is_below = are_below[i][static_cast<std::size_t>(bone)] != 0;
                        if (is_below) twist.below.lane[lane] += weight;
                        has_others = has_others || !is_below;
                        if (mesh.used_bones[static_cast<std::size_t>(bone)] != twists[i].bone) continue;
                        twist.weight.lane[lane] += weight;
                        twist.has_weight = true;
                    }
                    is_shared = is_shared || (has_others && twist.below.lane[lane] > 0.0f);
                }
                if (twist.has_weight || is_shared) block_twists.push_back(twist);
            }
            if (block_twists.size() > first) blocks.push_back({b, first, block_twists.size()});
        }
    }

    /// Fills `bones`. Returns whether one is twisted.
    ///
    /// is_linear  as in TwistFrame: what other blends need is then left out
    bool prepare(std::span<const Affine<float>> posed, const TwistSpreadOptions& options,
                 bool is_linear) const noexcept {
        bool any = false;
        const double amount = within(options.amount, 0.0f, 1.0f, 1.0f);
        for (std::size_t twist = 0; twist < twists.size(); ++twist) {
            TwistedBone& bone = bones[twist];
            bone.is_twisted = false;
            const double own =
                options.amounts.empty() ? 1.0 : within(options.amounts[twist], 0.0f, 1.0f, 1.0f);
            if (amount * own == 0.0) continue;
            const auto [angle, around, part] = read(twist, posed, options.channels);
            if (angle == 0.0) continue;
            any = bone.is_twisted = true;
            const TwistBone& of = twists[twist];
            const Affine<double> by = motion(posed, of.bone);
            const TwistLine& line = rest[twist].line;
            for (std::size_t k = 0; k < 2; ++k) {
                const Vec3<double> image =
                    by.linear * Vec3<double>(line.axes[k][0], line.axes[k][1], line.axes[k][2]);
                for (int i = 0; i < 3; ++i) bone.images[k][i] = static_cast<float>(image[i]);
            }
            bone.curve = options.curves.empty() ? 0.0f : within(options.curves[twist], -1.0f, 1.0f, 0.0f);
            bone.is_short = std::abs(angle) <= 0.5;
            bone.angle = static_cast<float>(std::numbers::pi * amount * own * angle);
            bone.offset = of.is_from_parent ? -bone.angle : 0.0f;
            bone.around = static_cast<float>(around);
            bone.part = static_cast<float>(amount * own * part);
            if (is_linear) continue;
            const auto at_rest = cast<double>(rest_bones[static_cast<std::size_t>(of.bone)]);
            const Vec3<double> posed_axis = by.linear * axes[twist].direction;
            const double length = glm::length(posed_axis);
            const double sign = glm::determinant(by.linear) < 0.0 ? -1.0 : 1.0;
            bone.has_axis = length > 0.0;
            if (bone.has_axis) {
                bone.posed = twist_line(transform_point(by, axes[twist].head), sign / length * posed_axis);
            }
            std::array<Float4, kDisplacementRows> rows;
            write_displacement(by, rows.data());
            for (std::size_t row = 0; row < rows.size(); ++row) {
                std::ranges::copy(rows[row].value, bone.displacement + 4 * row);
            }
            bone.is_scaled = split_scale(by, at_rest).has_scale;
        }
        return any;
    }

    std::shared_ptr<const PackedBinding> packed;
    const PackedMesh& mesh = packed->mesh;
    std::vector<TwistBone> twists;
    std::vector<Affine<float>> rest_bones;
    std::vector<AxisAtRest> axes;  // [twists]
    std::vector<TwistRest> rest;   // [twists]
    std::vector<TwistBlock> blocks;
    std::vector<BlockTwist> block_twists;
    std::vector<Lanes<float>> own_rest_points;  // empty: use those of the binding
    std::vector<Lanes<float>> weights;          // [PackedMesh::blocks], or empty
    std::vector<Lanes<float>> mix;              // [PackedMesh::blocks], or empty
    SpaceRows space_rows{Affine<float>{}};
    mutable std::vector<TwistedBone> bones;  // [twists] scratch for one call
    mutable ForkSafeMutex mutex;
};

TwistSpread::TwistSpread(const Binding& binding, const TwistSpreadData& data)
    : state_(make_owned<State>(binding, data)) {}

Status TwistSpread::set_rest_points(std::span<const Vec3<float>> rest_points,
                                    const Affine<float>& bones_from_model) noexcept {
    Status status = status_of_rest(rest_points, vertex_count(), bones_from_model);
    if (status != Status::ok) return status;
    const std::scoped_lock lock(state_->mutex);
    status = set_own_points(state_->mesh, rest_points, state_->own_rest_points);
    if (status != Status::ok) return status;
    state_->measure(bones_from_model);
    return Status::ok;
}

std::size_t TwistSpread::vertex_count() const noexcept { return state_->packed->vertex_count; }
std::size_t TwistSpread::bone_count() const noexcept { return state_->rest_bones.size(); }
std::size_t TwistSpread::twist_count() const noexcept { return state_->twists.size(); }

std::vector<float> TwistSpread::angles(std::span<const Affine<float>> posed_from_rest,
                                       std::span<const TwistChannels<float>> channels) const {
    if (!channels.empty() && channels.size() != twist_count()) {
        fail("channels", "none, or those of " + std::to_string(twist_count()) + " bones",
             std::to_string(channels.size()));
    }
    std::vector<float> angles;
    for (std::size_t twist = 0; twist < twist_count(); ++twist) {
        const double turns = state_->read(twist, posed_from_rest, channels).angle;
        angles.push_back(static_cast<float>(2.0 * std::numbers::pi * turns));
    }
    return angles;
}

Status TwistSpread::apply(std::span<Vec3<float>> points, const Pose& pose,
                          const TwistSpreadOptions& options) const noexcept {
    const State& state = *state_;
    const auto fits = [&](std::size_t size) { return size == 0 || size == state.twists.size(); };
    if (points.size() != vertex_count() || !fits(options.amounts.size()) || !fits(options.curves.size()) ||
        !fits(options.channels.size())) {
        return Status::size;
    }
    const std::scoped_lock lock(state.mutex);
    TwistFrame frame = state.frame(points.data());
    frame.blend = options.blend;
    frame.mix_blend = state.mix.empty() ? options.blend : options.mix_blend;
    frame.is_linear = frame.blend == TwistBlend::linear && frame.mix_blend == TwistBlend::linear;
    if (!state.prepare(pose.posed_from_rest, options, frame.is_linear)) return Status::ok;
    const auto goes_short = [](TwistBlend blend) {
        return blend == TwistBlend::rotations || blend == TwistBlend::logarithms;
    };
    const bool is_beyond = std::ranges::any_of(
        state.bones, [](const auto& bone) { return bone.is_twisted && bone.around != 0.0f; });
    frame.goes_around = is_beyond && (goes_short(frame.blend) || goes_short(frame.mix_blend));
    // Blends other than linear differ by the turns that they leave out alone.
    if (!frame.goes_around && frame.blend != TwistBlend::linear && frame.mix_blend != TwistBlend::linear)
        frame.mix_blend = frame.blend;
    const std::size_t vertices = kLanes * state.blocks.size();
    parallel_for(
        state.blocks.size(), useful_threads(options.threads, vertices, kVerticesWorthAThread),
        [&](std::size_t begin, std::size_t end) { kTwistKernel.spread[target_in_use()](frame, begin, end); },
        kBlocksOfAChunk);
    return Status::ok;
}

}  // namespace sinew
