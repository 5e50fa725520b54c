// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/twist_spread/twist_spread.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sinew/stages/stage_state.h"
#include "sinew/transform/split_scale.h"

#define SINEW_THIS_FILE "sinew/stages/twist_spread/twist_spread.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/exponential-inl.h"
#include "sinew/lanes/gather-inl.h"

#ifndef SINEW_TWIST_FRAME
#define SINEW_TWIST_FRAME
namespace sinew {

/// A line, and two axes of length 1 that are perpendicular to it and to each other.
struct TwistLine {
    float origin[3];
    float axes[2][3];
};

/// A bone at rest, whose vertices may be twisted.
struct TwistRest {
    TwistLine line;
    float share[4];  // of a rest point (x, y, z, 1): 0 at the head, 1 at the tail
};

/// A bone of TwistRest in one frame.
struct TwistedBone {
    bool is_twisted = false;  // if not, nothing else is set
    bool is_scaled;
    bool has_axis;       // the posed axis has a direction
    bool is_short;       // no vertex goes beyond half a turn
    float images[2][3];  // of the axes at rest, by the linear part of the bone's motion
    TwistLine posed;
    float displacement[12];  // the bone's motion, as in write_displacement()
    float curve;
    float angle;   // half of it, radians
    float offset;  // radians, added to the angle times the share
    float around;  // as in TwistSpreadDefinition::Bone
    float part;    // as in TwistSpreadDefinition::Bone
};

/// What a twist has to do with the vertices of a block.
struct BlockTwist {
    Lanes<float> share{};     // 0 at the bone's head, 1 at its tail
    Lanes<float> arms[2]{};   // the vertex's distances from the line along the axes, times `weight`
    Lanes<float> weight{};    // of the bone
    Lanes<float> below{};     // argument of TwistSpreadDefinition::missing_turns()
    std::size_t twist;        // into TwistFrame::twisted
    bool has_weight = false;  // else bones beyond the twist share vertices with others
};

/// A block, and its twists: those that other bones carry first.
struct TwistBlock {
    std::size_t block;
    std::size_t begin;  // into TwistFrame::block_twists
    std::size_t end;
};

/// The arguments of one call of the kernel.
struct TwistFrame : StageFrame {
    std::span<const TwistBlock> blocks;
    const BlockTwist* block_twists;
    const TwistedBone* twisted;  // [twists]
    const Lanes<float>* mix;     // [PackedMesh::blocks]; null if all are 0
    TwistBlend blend = TwistBlend::linear;
    TwistBlend mix_blend = TwistBlend::linear;  // equals `blend` without a mix, and where it would not matter
    bool is_linear = true;                      // all blends are
    bool goes_around = false;  // a bone is farther than the shorter way, and a method blends the shorter way
};

}  // namespace sinew
#endif

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

/// Sine and 1 - cosine of an angle.
template <class D>
struct Turned {
    Vec<D> sine;
    Vec<D> versine;

    /// half_angle  radians, at most a quarter turn
    HWY_INLINE Turned(D d, Vec<D> half_angle) {
        // To 1.2e-7 for these angles, with two operations less than in ExponentialFactors.
        static constexpr float kCosine[] = {0.9999999403953552f, -0.4999990463256836f, 0.04166358336806297f,
                                            -0.0013853703858330846f, 2.315393248863984e-05f};
        const Vec<D> y = hn::Mul(half_angle, half_angle);
        const Vec<D> half_sine = hn::Mul(half_angle, ExponentialFactors<D>(d, y).sinc);
        const Vec<D> twice = hn::Add(half_sine, half_sine);
        sine = hn::Mul(twice, polynomial(d, y, kCosine));
        versine = hn::Mul(twice, half_sine);
    }
};

/// The half angle of the same rotation within half a turn.
template <class D>
HWY_INLINE Vec<D> shortest(D d, Vec<D> half_angle) {
    const Vec<D> turns = hn::Round(hn::Mul(half_angle, hn::Set(d, std::numbers::inv_pi_v<float>)));
    return hn::NegMulAdd(turns, hn::Set(d, std::numbers::pi_v<float>), half_angle);
}

/// What a rotation adds to the point with these distances along two axes, as `images` of the axes.
template <class D>
HWY_INLINE Points<D> swept(D d, const float (&images)[2][3], const Turned<D>& rotation, Vec<D> a, Vec<D> b) {
    const Vec<D> more_a = hn::NegMulSub(rotation.versine, a, hn::Mul(rotation.sine, b));
    const Vec<D> more_b = hn::MulSub(rotation.sine, a, hn::Mul(rotation.versine, b));
    return add_scaled<D>(times<D>(more_b, in_all_lanes(d, images[1])), more_a, in_all_lanes(d, images[0]));
}

/// The distance of a point from a line along one of the axes.
template <class D>
HWY_INLINE Vec<D> arm_of(D d, const TwistLine& line, std::size_t axis, const Points<D>& p) {
    return dot<D>(in_all_lanes(d, line.axes[axis]), subtract<D>(p, in_all_lanes(d, line.origin)));
}

/// What a rotation about a line adds to a point.
template <class D>
HWY_INLINE Points<D> spun(D d, const TwistLine& line, const Turned<D>& rotation, const Points<D>& p) {
    return swept(d, line.axes, rotation, arm_of(d, line, 0, p), arm_of(d, line, 1, p));
}

/// TwistSpreadDefinition::missing_turns(), lane by lane: few frames need it.
template <class D>
HWY_INLINE Vec<D> missing_turns(D d, TwistBlend blend, const TwistedBone& bone, Vec<D> below, Vec<D> mask) {
    alignas(64) float values[kLanes];
    alignas(64) float masks[kLanes];
    hn::Store(below, d, values);
    hn::Store(mask, d, masks);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        values[i] = TwistSpreadDefinition::missing_turns(blend, bone.around, values[i], masks[i] * bone.part);
    }
    return hn::Load(d, values);
}

/// The vertices of some lanes.
template <class D>
struct Twisting {
    Points<D> point;  // in the space of the bones, as twisted so far
    Points<D> added;
    Vec<D> mask;
    Vec<D> mix;
};

/// Twists by one bone: TwistSpreadDefinition::deform_vertex().
///
/// kLinear  whether all blends are linear
/// rest_of  rest_of() returns the rest points, in the space of the bones
template <bool kLinear, class D, class RestOf>
HWY_INLINE void twist_by(D d, const TwistFrame& frame, const BlockTwist& twist, std::size_t lane,
                         const RestOf& rest_of, Twisting<D>& vertices) {
    const TwistedBone& bone = frame.twisted[twist.twist];
    const auto load = [d, lane](const Lanes<float>& numbers)
                          HWY_ATTR { return hn::Load(d, numbers.lane.data() + lane); };
    Vec<D> share = load(twist.share);
    if (bone.curve != 0.0f) {
        const Vec<D> more = hn::Mul(hn::Set(d, bone.curve), hn::NegMulAdd(share, share, share));
        share = hn::Add(share, more);
    }
    Vec<D> angle = hn::MulAdd(share, hn::Set(d, bone.angle), hn::Set(d, bone.offset));
    if (frame.weights != nullptr) angle = hn::Mul(vertices.mask, angle);
    const Turned<D> own(d, bone.is_short ? angle : shortest(d, angle));
    // Times the weight, as the arms are.
    const auto by_own = [&]() HWY_ATTR {
        return swept(d, bone.images, own, load(twist.arms[0]), load(twist.arms[1]));
    };
    if constexpr (kLinear) {
        vertices.added = add<D>(vertices.added, by_own());
        return;
    }
    const auto add_times = [&](Vec<D> factor, const Points<D>& more) HWY_ATTR {
        vertices.added = add_scaled<D>(vertices.added, factor, more);
        vertices.point = add_scaled<D>(vertices.point, factor, more);
    };
    const Points<D> before = vertices.point;
    const Vec<D> one = hn::Set(d, 1.0f);
    const bool are_alike = frame.blend == frame.mix_blend;
    for (std::size_t k = 0; k < (are_alike ? 1 : 2); ++k) {
        const TwistBlend blend = k == 0 ? frame.blend : frame.mix_blend;
        const Vec<D> portion = are_alike ? one : k == 0 ? hn::Sub(one, vertices.mix) : vertices.mix;
        if (blend == TwistBlend::linear) {
            add_times(portion, by_own());
            continue;
        }
        if (!bone.has_axis) continue;
        const Vec<D> weight = load(twist.weight);
        Vec<D> posed_angle = hn::Mul(weight, angle);
        if (frame.goes_around) {
            const Vec<D> turns = missing_turns(d, blend, bone, load(twist.below), vertices.mask);
            posed_angle = hn::MulAdd(turns, hn::Set(d, std::numbers::pi_v<float>), posed_angle);
        }
        const bool is_short = bone.is_short && !frame.goes_around;
        const Turned<D> posed(d, is_short ? posed_angle : shortest(d, posed_angle));
        Points<D> moved = spun(d, bone.posed, posed, before);
        if (bone.is_scaled) {
            const Points<D> alone = spun(d, bone.posed, own, displaced(d, bone.displacement, rest_of()));
            moved = add<D>(moved, subtract<D>(by_own(), times<D>(weight, alone)));
        }
        add_times(portion, moved);
    }
}

/// Whether a twist moves vertices of a block in this frame.
HWY_INLINE bool moves(const TwistFrame& frame, const BlockTwist& twist) {
    const TwistedBone& bone = frame.twisted[twist.twist];
    return bone.is_twisted && (twist.has_weight || (frame.goes_around && bone.around != 0.0f));
}

template <bool kLinear>
void spread_blocks(const TwistFrame& shared, std::size_t begin, std::size_t end) {
    const Full d;
    const TwistFrame frame = shared;  // a copy, as stored points do not make the compiler read it again
    const MeshPointers pointers = pointers_of(frame);
    for (std::size_t i = begin; i < end; ++i) {
        const std::size_t b = frame.blocks[i].block;
        const std::size_t first = frame.blocks[i].begin;
        const std::size_t after = frame.blocks[i].end;
        std::size_t first_moving = first;
        while (first_moving < after && !moves(frame, frame.block_twists[first_moving])) ++first_moving;
        const std::size_t lanes = first_moving < after ? lanes_end(d, pointers.blocks[b]) : 0;
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            const Vec<Full> zero = hn::Zero(d);
            const Points<Full> point = load_deformed(d, pointers, b, lane);
            const auto load = [&](const Lanes<float>* numbers, Vec<Full> otherwise) HWY_ATTR {
                return numbers == nullptr ? otherwise : hn::Load(d, numbers[b].lane.data() + lane);
            };
            const auto rest_of = [&]() HWY_ATTR { return load_rest(d, pointers, frame.spaces, b, lane); };
            Twisting<Full> vertices{to_bones(d, frame.spaces, point),
                                    {zero, zero, zero},
                                    load(frame.weights, hn::Set(d, 1.0f)),
                                    load(frame.mix, zero)};
            for (std::size_t t = first_moving; t < after; ++t) {
                const BlockTwist& twist = frame.block_twists[t];
                if (moves(frame, twist)) twist_by<kLinear>(d, frame, twist, lane, rest_of, vertices);
            }
            const Points<Full> added = vector_to_model(d, frame.spaces, vertices.added);
            // A sum with 0 would change the sign of -0.
            const auto sum = [&](Vec<Full> number, Vec<Full> more) HWY_ATTR {
                return hn::IfThenElse(hn::Eq(more, zero), number, hn::Add(number, more));
            };
            store_points(d, pointers, b, lane,
                         Points<Full>{sum(point.x, added.x), sum(point.y, added.y), sum(point.z, added.z)});
        }
    }
}

void spread(const TwistFrame& frame, std::size_t begin, std::size_t end) {
    frame.is_linear ? spread_blocks<true>(frame, begin, end) : spread_blocks<false>(frame, begin, end);
}

/// Writes BlockTwist::share and arms of `twists` for the rest points.
///
/// at_rest  [twists]
void measure(const TwistFrame& frame, std::span<const TwistRest> at_rest, std::span<BlockTwist> twists) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    for (const TwistBlock& block : frame.blocks) {
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const Points<Full> rest = load_rest(d, pointers, frame.spaces, block.block, lane);
            for (std::size_t t = block.begin; t < block.end; ++t) {
                BlockTwist& twist = twists[t];
                const TwistRest& bone = at_rest[twist.twist];
                const Vec<Full> along =
                    hn::Add(dot<Full>(in_all_lanes(d, bone.share), rest), hn::Set(d, bone.share[3]));
                const Vec<Full> share = hn::Min(hn::Max(along, hn::Zero(d)), hn::Set(d, 1.0f));
                hn::Store(share, d, twist.share.lane.data() + lane);
                const Vec<Full> weight = hn::Load(d, twist.weight.lane.data() + lane);
                for (std::size_t axis = 0; axis < 2; ++axis) {
                    hn::Store(hn::Mul(weight, arm_of(d, bone.line, axis, rest)), d,
                              twist.arms[axis].lane.data() + lane);
                }
            }
        }
    }
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr OfTargets<void(const TwistFrame& frame, std::size_t begin, std::size_t end)> kSpread
    SINEW_TARGETS(spread);
constexpr OfTargets<void(const TwistFrame& frame, std::span<const TwistRest> at_rest,
                         std::span<BlockTwist> twists)>
    kMeasure SINEW_TARGETS(measure);

TwistLine twist_line(const Vec3<double>& origin, const Vec3<double>& axis) noexcept {
    const Vec3<double> aside =
        std::abs(axis.x) < 0.6 ? Vec3<double>(1.0, 0.0, 0.0) : Vec3<double>(0.0, 1.0, 0.0);
    const Vec3<double> across = glm::normalize(glm::cross(axis, aside));
    const Vec3<double> third = glm::cross(axis, across);
    TwistLine line{};
    for (int i = 0; i < 3; ++i) {
        line.origin[i] = static_cast<float>(origin[i]);
        line.axes[0][i] = static_cast<float>(across[i]);
        line.axes[1][i] = static_cast<float>(third[i]);
    }
    return line;
}

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

struct TwistSpread::State : BoneStage::State {
    State(const Binding& binding, const TwistSpreadData& data)
        : BoneStage::State(binding, data.rest_bones.size(), data.weights, data.bones_from_model),
          twists(data.twists.begin(), data.twists.end()),
          rest_bones(data.rest_bones.begin(), data.rest_bones.end()) {
        check_rest_bones(rest_bones, packed->bone_count);
        check_twists(twists, rest_bones);
        check_parents(data.parents, rest_bones.size());
        if (!data.mix.empty()) check_weights("mix", data.mix, packed->vertex_count);
        mix = pack_weights(mesh, data.mix);
        twisted.resize(twists.size());
        list_blocks(data.parents);
        for (const TwistBone& twist : twists) {
            axes.push_back(axis_at_rest(twist, rest_bones));
            TwistRest& at_rest = rest.emplace_back();
            at_rest.line = twist_line(axes.back().head, axes.back().direction);
            std::ranges::copy(position_along(Vec3<double>(twist.head), Vec3<double>(twist.tail)).value,
                              at_rest.share);
        }
        measure();
    }

    void measure() noexcept override { kMeasure[target_in_use()](twist_frame(nullptr), rest, block_twists); }

    [[nodiscard]] TwistFrame twist_frame(Vec3<float>* points) const noexcept {
        return {frame(points), blocks, block_twists.data(), twisted.data(),
                mix.empty() ? nullptr : mix.data()};
    }

    [[nodiscard]] TwistSpreadDefinition::Reading<double> read(
        std::size_t twist, std::span<const Affine<float>> posed_from_rest,
        std::span<const TwistChannels<float>> channels) const noexcept {
        const TwistBone& bones = twists[twist];
        const auto tip_rest = cast<double>(rest_bones[static_cast<std::size_t>(bones.tip)]);
        const Vec3<double>& axis = axes[twist].direction;
        const Quat<double> rotation =
            rotation_between(motion(posed_from_rest, bones.base).linear,
                             motion(posed_from_rest, bones.tip).linear, tip_rest.linear);
        double expected = 0.0;
        if (!channels.empty() && channels[twist].rotation != Quat<float>(0.0f, Vec3<float>(0.0f))) {
            const TwistChannels<double> told{glm::normalize(Quat<double>(channels[twist].rotation)),
                                             Vec3<double>(channels[twist].angles)};
            const Quat<double> tip_axes = to_quat(rotation_keeping_y(tip_rest.linear));
            expected = TwistSpreadDefinition::expected(told, rotation, tip_axes, axis);
        }
        return TwistSpreadDefinition::read(rotation, axis, expected);
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

    /// Fills `twisted`. Returns whether a bone is twisted.
    ///
    /// is_linear  as in TwistFrame: what other blends need is then left out
    bool prepare(std::span<const Affine<float>> posed_from_rest, const TwistSpreadOptions& options,
                 bool is_linear) const noexcept {
        bool any = false;
        const double amount = within(options.amount, 0.0f, 1.0f, 1.0f);
        for (std::size_t twist = 0; twist < twists.size(); ++twist) {
            TwistedBone& bone = twisted[twist];
            bone.is_twisted = false;
            const double factor =
                options.amounts.empty() ? 1.0 : within(options.amounts[twist], 0.0f, 1.0f, 1.0f);
            if (amount * factor == 0.0) continue;
            const auto [angle, around, part] = read(twist, posed_from_rest, options.channels);
            if (angle == 0.0) continue;
            any = bone.is_twisted = true;
            const TwistBone& listed = twists[twist];
            const Affine<double> posed = motion(posed_from_rest, listed.bone);
            const TwistLine& line = rest[twist].line;
            for (std::size_t k = 0; k < 2; ++k) {
                const Vec3<double> image =
                    posed.linear * Vec3<double>(line.axes[k][0], line.axes[k][1], line.axes[k][2]);
                for (int i = 0; i < 3; ++i) bone.images[k][i] = static_cast<float>(image[i]);
            }
            bone.curve = options.curves.empty() ? 0.0f : within(options.curves[twist], -1.0f, 1.0f, 0.0f);
            bone.is_short = std::abs(angle) <= 0.5;
            bone.angle = static_cast<float>(std::numbers::pi * amount * factor * angle);
            bone.offset = listed.is_from_parent ? -bone.angle : 0.0f;
            bone.around = static_cast<float>(around);
            bone.part = static_cast<float>(amount * factor * part);
            if (is_linear) continue;
            const auto at_rest = cast<double>(rest_bones[static_cast<std::size_t>(listed.bone)]);
            const Vec3<double> posed_axis = posed.linear * axes[twist].direction;
            const double length = glm::length(posed_axis);
            const double sign = glm::determinant(posed.linear) < 0.0 ? -1.0 : 1.0;
            bone.has_axis = length > 0.0;
            if (bone.has_axis) {
                bone.posed = twist_line(transform_point(posed, axes[twist].head), sign / length * posed_axis);
            }
            std::array<Float4, kDisplacementRows> rows;
            write_displacement(posed, rows.data());
            for (std::size_t row = 0; row < rows.size(); ++row) {
                std::ranges::copy(rows[row].value, bone.displacement + 4 * row);
            }
            bone.is_scaled = split_scale(posed, at_rest).has_scale;
        }
        return any;
    }

    std::vector<TwistBone> twists;
    std::vector<Affine<float>> rest_bones;
    std::vector<AxisAtRest> axes;  // [twists]
    std::vector<TwistRest> rest;   // [twists]
    std::vector<TwistBlock> blocks;
    std::vector<BlockTwist> block_twists;
    std::vector<Lanes<float>> mix;             // [PackedMesh::blocks], or empty
    mutable std::vector<TwistedBone> twisted;  // [twists] scratch for one call
};

TwistSpread::TwistSpread(const Binding& binding, const TwistSpreadData& data)
    : BoneStage(BoneStage::State::make<State>(binding, data)) {}

std::size_t TwistSpread::twist_count() const noexcept {
    return static_cast<const State&>(*state_).twists.size();
}

std::vector<float> TwistSpread::angles(std::span<const Affine<float>> posed_from_rest,
                                       std::span<const TwistChannels<float>> channels) const {
    if (!channels.empty() && channels.size() != twist_count()) {
        fail("channels", "none, or those of " + std::to_string(twist_count()) + " bones",
             std::to_string(channels.size()));
    }
    std::vector<float> angles;
    for (std::size_t twist = 0; twist < twist_count(); ++twist) {
        const double turns = static_cast<const State&>(*state_).read(twist, posed_from_rest, channels).angle;
        angles.push_back(static_cast<float>(2.0 * std::numbers::pi * turns));
    }
    return angles;
}

Status TwistSpread::apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
                          const TwistSpreadOptions& options) const noexcept {
    const auto& state = static_cast<const State&>(*state_);
    const auto fits = [&](std::size_t size) { return size == 0 || size == state.twists.size(); };
    if (points.size() != vertex_count() || !fits(options.amounts.size()) || !fits(options.curves.size()) ||
        !fits(options.channels.size())) {
        return Status::size;
    }
    const std::scoped_lock lock(state.mutex);
    TwistFrame frame = state.twist_frame(points.data());
    frame.blend = options.blend;
    frame.mix_blend = state.mix.empty() ? options.blend : options.mix_blend;
    frame.is_linear = frame.blend == TwistBlend::linear && frame.mix_blend == TwistBlend::linear;
    if (!state.prepare(posed_from_rest, options, frame.is_linear)) return Status::ok;
    const bool is_beyond = std::ranges::any_of(
        state.twisted, [](const auto& bone) { return bone.is_twisted && bone.around != 0.0f; });
    frame.goes_around = is_beyond && (TwistSpreadDefinition::is_short(frame.blend) ||
                                      TwistSpreadDefinition::is_short(frame.mix_blend));
    // Blends other than linear differ by the turns that they leave out alone.
    if (!frame.goes_around && frame.blend != TwistBlend::linear && frame.mix_blend != TwistBlend::linear)
        frame.mix_blend = frame.blend;
    const std::size_t vertices = kLanes * state.blocks.size();
    parallel_for(
        state.blocks.size(), useful_threads(options.threads, vertices, kVerticesWorthAThread),
        [&](std::size_t begin, std::size_t end) { kSpread[target_in_use()](frame, begin, end); },
        kBlocksOfAChunk);
    return Status::ok;
}

}  // namespace sinew

#endif
