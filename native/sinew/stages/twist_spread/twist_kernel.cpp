// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `twist_spread` on lanes: see stages/twist_spread/twist_spread.h for what it computes.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/stages/twist_spread/twist_kernel.h"

#include <cmath>

#include "sinew/base/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/stages/twist_spread/twist_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/exponential-inl.h"
#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

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
HWY_INLINE Points<D> swept(D d, const float (&images)[2][3], const Turned<D>& by, Vec<D> a, Vec<D> b) {
    const Vec<D> more_a = hn::NegMulSub(by.versine, a, hn::Mul(by.sine, b));
    const Vec<D> more_b = hn::MulSub(by.sine, a, hn::Mul(by.versine, b));
    return add_scaled<D>(times<D>(more_b, in_all_lanes(d, images[1])), more_a, in_all_lanes(d, images[0]));
}

/// The distance of a point from a line along one of the axes.
template <class D>
HWY_INLINE Vec<D> arm_of(D d, const TwistLine& line, std::size_t axis, const Points<D>& p) {
    return dot<D>(in_all_lanes(d, line.axes[axis]), subtract<D>(p, in_all_lanes(d, line.origin)));
}

/// What a rotation about a line adds to a point.
template <class D>
HWY_INLINE Points<D> spun(D d, const TwistLine& line, const Turned<D>& by, const Points<D>& p) {
    return swept(d, line.axes, by, arm_of(d, line, 0, p), arm_of(d, line, 1, p));
}

/// TwistSpreadStage::missing_turns(), lane by lane: few frames need it.
template <class D>
HWY_INLINE Vec<D> missing_turns(D d, TwistBlend blend, const TwistedBone& bone, Vec<D> below, Vec<D> mask) {
    alignas(64) float values[kLanes];
    alignas(64) float masks[kLanes];
    hn::Store(below, d, values);
    hn::Store(mask, d, masks);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        values[i] = TwistSpreadStage::missing_turns(blend, bone.around, values[i], masks[i] * bone.part);
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

/// Twists by one bone: TwistSpreadStage::deform_vertex().
///
/// kLinear  whether all blends are linear
/// rest_of  rest_of() returns the rest points, in the space of the bones
template <bool kLinear, class D, class RestOf>
HWY_INLINE void twist_by(D d, const TwistFrame& frame, const BlockTwist& twist, std::size_t lane,
                         const RestOf& rest_of, Twisting<D>& of) {
    const TwistedBone& bone = frame.bones[twist.twist];
    const auto load = [d, lane](const Lanes<float>& numbers)
                          HWY_ATTR { return hn::Load(d, numbers.lane.data() + lane); };
    Vec<D> share = load(twist.share);
    if (bone.curve != 0.0f) {
        const Vec<D> more = hn::Mul(hn::Set(d, bone.curve), hn::NegMulAdd(share, share, share));
        share = hn::Add(share, more);
    }
    Vec<D> angle = hn::MulAdd(share, hn::Set(d, bone.angle), hn::Set(d, bone.offset));
    if (frame.weights != nullptr) angle = hn::Mul(of.mask, angle);
    const Turned<D> own(d, bone.is_short ? angle : shortest(d, angle));
    // Times the weight, as the arms are.
    const auto by_own = [&]() HWY_ATTR {
        return swept(d, bone.images, own, load(twist.arms[0]), load(twist.arms[1]));
    };
    if constexpr (kLinear) {
        of.added = add<D>(of.added, by_own());
        return;
    }
    const auto add_times = [&](Vec<D> factor, const Points<D>& by) HWY_ATTR {
        of.added = add_scaled<D>(of.added, factor, by);
        of.point = add_scaled<D>(of.point, factor, by);
    };
    const Points<D> before = of.point;
    const Vec<D> one = hn::Set(d, 1.0f);
    const bool are_alike = frame.blend == frame.mix_blend;
    for (std::size_t k = 0; k < (are_alike ? 1 : 2); ++k) {
        const TwistBlend blend = k == 0 ? frame.blend : frame.mix_blend;
        const Vec<D> portion = are_alike ? one : k == 0 ? hn::Sub(one, of.mix) : of.mix;
        if (blend == TwistBlend::linear) {
            add_times(portion, by_own());
            continue;
        }
        if (!bone.has_axis) continue;
        const Vec<D> weight = load(twist.weight);
        Vec<D> posed_angle = hn::Mul(weight, angle);
        if (frame.goes_around) {
            const Vec<D> turns = missing_turns(d, blend, bone, load(twist.below), of.mask);
            posed_angle = hn::MulAdd(turns, hn::Set(d, std::numbers::pi_v<float>), posed_angle);
        }
        const bool is_short = bone.is_short && !frame.goes_around;
        const Turned<D> posed(d, is_short ? posed_angle : shortest(d, posed_angle));
        Points<D> by = spun(d, bone.posed, posed, before);
        if (bone.is_scaled) {
            const Points<D> alone = spun(d, bone.posed, own, displaced(d, bone.displacement, rest_of()));
            by = add<D>(by, subtract<D>(by_own(), times<D>(weight, alone)));
        }
        add_times(portion, by);
    }
}

/// Whether a twist moves vertices of a block in this frame.
HWY_INLINE bool moves(const TwistFrame& frame, const BlockTwist& twist) {
    const TwistedBone& bone = frame.bones[twist.twist];
    return bone.is_twisted && (twist.has_weight || (frame.goes_around && bone.around != 0.0f));
}

MeshPointers pointers_of(const TwistFrame& frame) {
    const PackedMesh& mesh = *frame.mesh;
    return {mesh.blocks.data(),   frame.rest_points, mesh.weights.data(), nullptr,
            mesh.vertices.data(), mesh.runs.data(),  frame.points};
}

template <bool kLinear>
void spread_blocks(const TwistFrame& of, std::size_t begin, std::size_t end) {
    const Full d;
    const TwistFrame frame = of;
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
            const Points<Full> by = vector_to_model(d, frame.spaces, vertices.added);
            // A sum with 0 would change the sign of -0.
            const auto sum = [&](Vec<Full> number, Vec<Full> more) HWY_ATTR {
                return hn::IfThenElse(hn::Eq(more, zero), number, hn::Add(number, more));
            };
            store_points(d, pointers, b, lane,
                         Points<Full>{sum(point.x, by.x), sum(point.y, by.y), sum(point.z, by.z)});
        }
    }
}

void spread(const TwistFrame& frame, std::size_t begin, std::size_t end) {
    frame.is_linear ? spread_blocks<true>(frame, begin, end) : spread_blocks<false>(frame, begin, end);
}

void measure(const TwistFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    for (std::size_t i = begin; i < end; ++i) {
        const TwistBlock& block = frame.blocks[i];
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const Points<Full> rest = load_rest(d, pointers, frame.spaces, block.block, lane);
            for (std::size_t t = block.begin; t < block.end; ++t) {
                BlockTwist& twist = frame.block_twists[t];
                const TwistRest& bone = frame.rest[twist.twist];
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

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {

constinit const TwistKernel kTwistKernel{SINEW_TARGETS(spread), SINEW_TARGETS(measure)};

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

}  // namespace sinew

#endif
