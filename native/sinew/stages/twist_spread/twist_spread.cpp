// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/twist_spread.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>
#include <utility>

#include "sinew/base/fork_safe.h"
#include "sinew/mesh/check_bind_data.h"
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
    if (parents.empty()) return;
    if (parents.size() != bone_count) {
        fail("parents", "none, or one for each of the " + std::to_string(bone_count) + " rest bones",
             std::to_string(parents.size()));
    }
    for (std::size_t bone = 0; bone < bone_count; ++bone) {
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

float within(float value, float least, float most, float otherwise) {
    return std::isnan(value) ? otherwise : std::clamp(value, least, most);
}

/// The rotation of a bone relative to another, of length 1. The other's scale is taken off both.
Quat<double> rotation_between(const Affine<double>& base, const Affine<double>& tip,
                              const Affine<double>& tip_rest) {
    const Affine<double> relative = glm::determinant(base.linear) != 0.0
                                        ? inverse(base) * tip
                                        : inverse(split_scale(base, tip_rest).rigid) * tip;
    return glm::normalize(to_quat(split_scale(relative, tip_rest).rigid.linear));
}

}  // namespace

struct TwistSpread::State {
    State(const Binding& binding, const TwistSpreadData& data);

    void set_rest_points(std::span<const Vec3<float>> points, const Affine<float>& space);
    [[nodiscard]] Affine<double> motion(std::span<const Affine<float>> posed,
                                        std::int32_t bone) const noexcept;
    [[nodiscard]] TwistSpreadStage::Reading<double> read(
        std::size_t twist, std::span<const Affine<float>> posed,
        std::span<const TwistChannels<float>> channels) const noexcept;
    /// Fills twisted and twisted_of_bone.
    void prepare(std::span<const Affine<float>> posed, const TwistSpreadOptions& options) const noexcept;

    std::shared_ptr<const PackedBinding> packed;
    const PackedMesh& mesh = packed->mesh;
    std::vector<TwistBone> twists;
    std::vector<Affine<float>> rest_bones;
    std::vector<std::int32_t> parents;
    std::vector<std::int32_t> used;  // for each of twists, its index in mesh.used_bones, or -1
    std::vector<std::vector<std::uint8_t>> are_below;  // for each of twists: see below()
    std::vector<Lanes<float>> own_rest_points;         // empty: use those of the binding
    std::vector<Lanes<float>> weights;                 // [blocks], or empty
    std::vector<Lanes<float>> mix;                     // [blocks], or empty
    Affine<float> bones_from_model;
    SpaceRows space_rows{Affine<float>{}};
    // Scratch for one call.
    mutable std::vector<TwistedBone> twisted;
    mutable std::vector<std::int32_t> twisted_of_bone;
    mutable ForkSafeMutex mutex;
};

TwistSpread::State::State(const Binding& binding, const TwistSpreadData& data)
    : packed(binding.packed()),
      twists(data.twists.begin(), data.twists.end()),
      rest_bones(data.rest_bones.begin(), data.rest_bones.end()),
      parents(data.parents.begin(), data.parents.end()),
      bones_from_model(data.bones_from_model) {
    check_rest_bones(rest_bones, packed->bone_count);
    check_twists(twists, rest_bones);
    check_parents(parents, rest_bones.size());
    if (!data.weights.empty()) check_weights("weights", data.weights, packed->vertex_count);
    if (!data.mix.empty()) check_weights("mix", data.mix, packed->vertex_count);
    check_space(bones_from_model);
    space_rows = SpaceRows(bones_from_model);
    weights = pack_weights(mesh, data.weights);
    mix = pack_weights(mesh, data.mix);
    for (const TwistBone& twist : twists) {
        const auto found = std::ranges::lower_bound(mesh.used_bones, twist.bone);
        const bool is_used = found != mesh.used_bones.end() && *found == twist.bone;
        used.push_back(is_used ? static_cast<std::int32_t>(found - mesh.used_bones.begin()) : -1);
        are_below.push_back(below(twist.tip, parents, mesh.used_bones));
    }
    twisted.reserve(twists.size());
    twisted_of_bone.resize(mesh.used_bones.size());
}

void TwistSpread::State::set_rest_points(std::span<const Vec3<float>> points, const Affine<float>& space) {
    own_rest_points.resize(kPointRows * mesh.blocks.size());
    pack_points(mesh, points, own_rest_points);
    bones_from_model = space;
    space_rows = SpaceRows(space);
}

Affine<double> TwistSpread::State::motion(std::span<const Affine<float>> posed,
                                          std::int32_t bone) const noexcept {
    const auto number = static_cast<std::size_t>(bone);
    return number < posed.size() ? cast<double>(posed[number]) : Affine<double>{};
}

TwistSpreadStage::Reading<double> TwistSpread::State::read(
    std::size_t twist, std::span<const Affine<float>> posed,
    std::span<const TwistChannels<float>> channels) const noexcept {
    const TwistBone& of = twists[twist];
    const auto tip_rest = cast<double>(rest_bones[static_cast<std::size_t>(of.tip)]);
    const Vec3<double> axis =
        glm::normalize(Vec3<double>(rest_bones[static_cast<std::size_t>(of.bone)].linear[1]));
    const Quat<double> rotation = rotation_between(motion(posed, of.base), motion(posed, of.tip), tip_rest);
    double expected = 0.0;
    if (!channels.empty() && channels[twist].rotation != Quat<float>(0.0f, 0.0f, 0.0f, 0.0f)) {
        const TwistChannels<double> told{glm::normalize(Quat<double>(channels[twist].rotation)),
                                         Vec3<double>(channels[twist].angles)};
        const Quat<double> axes = to_quat(rotation_keeping_y(tip_rest.linear));
        expected = TwistSpreadStage::expected(told, rotation, axes, axis);
    }
    return TwistSpreadStage::read(rotation, axis, expected);
}

void TwistSpread::State::prepare(std::span<const Affine<float>> posed,
                                 const TwistSpreadOptions& options) const noexcept {
    twisted.clear();
    std::ranges::fill(twisted_of_bone, -1);
    const double amount = within(options.amount, 0.0f, 1.0f, 1.0f);
    // The last first: those that other bones carry.
    for (std::size_t twist = twists.size(); twist-- > 0;) {
        const double own = options.amounts.empty() ? 1.0 : within(options.amounts[twist], 0.0f, 1.0f, 1.0f);
        if (used[twist] < 0 || amount * own == 0.0) continue;
        const auto [angle, around, part] = read(twist, posed, options.channels);
        if (angle == 0.0) continue;
        const TwistBone& of = twists[twist];
        const auto rest = cast<double>(rest_bones[static_cast<std::size_t>(of.bone)]);
        const Affine<double> by = motion(posed, of.bone);
        const Vec3<double> axis = glm::normalize(rest.linear[1]);
        const Vec3<double> posed_axis = by.linear * axis;
        const double length = glm::length(posed_axis);
        const double sign = glm::determinant(by.linear) < 0.0 ? -1.0 : 1.0;
        TwistedBone bone{};
        bone.rest = spin(rest.translation, axis, by.linear);
        bone.has_axis = length > 0.0;
        if (bone.has_axis) {
            bone.posed =
                spin(transform_point(by, rest.translation), sign / length * posed_axis, Mat3<double>(1.0));
        }
        std::array<Float4, kDisplacementRows> rows;
        write_displacement(by, rows.data());
        for (std::size_t row = 0; row < rows.size(); ++row) {
            std::ranges::copy(rows[row].value, bone.displacement + 4 * row);
        }
        const Vec3<double> along = Vec3<double>(of.tail) - Vec3<double>(of.head);
        const double squared = glm::dot(along, along);
        const Vec3<double> share = along * (squared > 0.0 ? 1.0 / squared : 0.0);
        for (int i = 0; i < 3; ++i) bone.share[i] = static_cast<float>(share[i]);
        bone.share[3] = static_cast<float>(-glm::dot(share, Vec3<double>(of.head)));
        bone.curve = options.curves.empty() ? 0.0f : within(options.curves[twist], -1.0f, 1.0f, 0.0f);
        bone.angle = static_cast<float>(amount * own * angle);
        bone.offset = of.is_from_parent ? -bone.angle : 0.0f;
        bone.around = static_cast<float>(around);
        bone.part = static_cast<float>(amount * own * part);
        bone.is_scaled = split_scale(by, rest).has_scale;
        bone.below = are_below[twist].data();
        twisted_of_bone[static_cast<std::size_t>(used[twist])] = static_cast<std::int32_t>(twisted.size());
        twisted.push_back(bone);
    }
}

TwistSpread::TwistSpread(const Binding& binding, const TwistSpreadData& data)
    : state_(make_owned<State>(binding, data)) {}

void TwistSpread::set_rest_points(std::span<const Vec3<float>> rest_points,
                                  const Affine<float>& bones_from_model) {
    check_points(rest_points, vertex_count());
    check_space(bones_from_model);
    const std::scoped_lock lock(state_->mutex);
    state_->set_rest_points(rest_points, bones_from_model);
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

bool TwistSpread::apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
                        const TwistSpreadOptions& options) const noexcept {
    const State& state = *state_;
    const auto fits = [&](std::size_t size) { return size == 0 || size == state.twists.size(); };
    if (points.size() != vertex_count() || !fits(options.amounts.size()) || !fits(options.curves.size()) ||
        !fits(options.channels.size())) {
        return false;
    }
    const std::scoped_lock lock(state.mutex);
    state.prepare(posed_from_rest, options);
    if (state.twisted.empty()) return true;
    const auto goes_short = [](TwistBlend blend) {
        return blend == TwistBlend::rotations || blend == TwistBlend::logarithms;
    };
    const bool blends_short =
        goes_short(options.blend) || (!state.mix.empty() && goes_short(options.mix_blend));
    const bool is_beyond =
        std::ranges::any_of(state.twisted, [](const auto& bone) { return bone.around != 0.0f; });
    const TwistFrame frame{
        &state.mesh,
        state.own_rest_points.empty() ? state.mesh.rest_points.data() : state.own_rest_points.data(),
        state.twisted.data(),
        state.twisted.size(),
        state.twisted_of_bone.data(),
        state.weights.empty() ? nullptr : state.weights.data(),
        state.mix.empty() ? nullptr : state.mix.data(),
        options.blend,
        options.mix_blend,
        blends_short && is_beyond,
        state.space_rows.spaces(),
        points.data()};
    parallel_for_blocks(state.mesh, points.size(), options.threads,
                        [&](std::size_t begin, std::size_t end) { spread_twists(frame, begin, end); });
    return true;
}

TwistSpread::Parts TwistSpread::parts() const {
    const State& state = *state_;
    const std::scoped_lock lock(state.mutex);
    const auto rest_points = state.own_rest_points.empty() ? std::span(state.mesh.rest_points)
                                                           : std::span(std::as_const(state.own_rest_points));
    Parts parts{bound_mesh(state.mesh, rest_points, vertex_count(), state.packed->bone_count),
                state.twists,
                state.rest_bones,
                state.parents,
                state.bones_from_model,
                {},
                {}};
    if (!state.weights.empty()) parts.weights = unpack_values(state.mesh, state.weights, vertex_count());
    if (!state.mix.empty()) parts.mix = unpack_values(state.mesh, state.mix, vertex_count());
    return parts;
}

}  // namespace sinew
