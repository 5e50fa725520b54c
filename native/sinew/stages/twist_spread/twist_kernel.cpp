// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `twist_spread` on lanes: see stages/twist_spread/twist_spread.h for what it computes.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/stages/twist_spread/twist_kernel.h"

#include <array>

#include "sinew/base/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/stages/twist_spread/twist_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/deformed-inl.h"
#include "sinew/lanes/exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// Sine and 1 - cosine of an angle in turns.
template <class D>
struct Turned {
    Vec<D> sine;
    Vec<D> versine;

    HWY_INLINE Turned(D d, Vec<D> turns) {
        const Vec<D> within = hn::Sub(turns, hn::Round(turns));
        const Vec<D> half = hn::Mul(within, hn::Set(d, std::numbers::pi_v<float>));
        const ExponentialFactors<D> factors(d, hn::Mul(half, half));
        const Vec<D> half_sine = hn::Mul(half, factors.sinc);
        const Vec<D> twice = hn::Add(half_sine, half_sine);
        sine = hn::Mul(twice, factors.cosine);
        versine = hn::Mul(twice, half_sine);
    }
};

/// What a spin adds to a point.
template <class D>
HWY_INLINE Points<D> spun(D d, const Spin& spin, const Turned<D>& by, const Points<D>& p) {
    const Points<D> arm{hn::Sub(p.x, hn::Set(d, spin.origin[0])), hn::Sub(p.y, hn::Set(d, spin.origin[1])),
                        hn::Sub(p.z, hn::Set(d, spin.origin[2]))};
    const auto product = [&](const float* row) HWY_ATTR {
        return hn::MulAdd(hn::Set(d, row[0]), arm.x,
                          hn::MulAdd(hn::Set(d, row[1]), arm.y, hn::Mul(hn::Set(d, row[2]), arm.z)));
    };
    const auto row = [&](std::size_t i) HWY_ATTR {
        return hn::MulAdd(by.sine, product(spin.sine + 3 * i),
                          hn::Mul(by.versine, product(spin.versine + 3 * i)));
    };
    return {row(0), row(1), row(2)};
}

/// TwistSpreadStage::left_out(), lane by lane: few frames need it.
template <class D>
HWY_INLINE Vec<D> left_out(D d, TwistBlend blend, const TwistedBone& bone, Vec<D> below, Vec<D> mask) {
    alignas(64) float values[kLanes];
    alignas(64) float masks[kLanes];
    hn::Store(below, d, values);
    hn::Store(mask, d, masks);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        values[i] = TwistSpreadStage::left_out(blend, bone.around, values[i], masks[i] * bone.part);
    }
    return hn::Load(d, values);
}

/// The vertices of some lanes.
template <class D>
struct Twisting {
    Points<D> rest;   // in the space of the bones
    Points<D> point;  // the same, as twisted so far
    Points<D> added;
    Vec<D> mask;
    Vec<D> mix;
};

/// Twists by one bone: TwistSpreadStage::deform_vertex().
///
/// below  not read unless frame.goes_around
template <class D>
HWY_INLINE void twist_by(D d, const TwistFrame& frame, const TwistedBone& bone, Vec<D> weight, Vec<D> below,
                         Twisting<D>& of) {
    const Vec<D> one = hn::Set(d, 1.0f);
    const Points<D>& rest = of.rest;
    const Vec<D> along =
        hn::MulAdd(rest.x, hn::Set(d, bone.share[0]),
                   hn::MulAdd(rest.y, hn::Set(d, bone.share[1]),
                              hn::MulAdd(rest.z, hn::Set(d, bone.share[2]), hn::Set(d, bone.share[3]))));
    const Vec<D> e = hn::Min(hn::Max(along, hn::Zero(d)), one);
    const Vec<D> share = hn::Mul(e, hn::MulAdd(hn::Set(d, bone.curve), hn::Sub(one, e), one));
    const Vec<D> turns = hn::Mul(of.mask, hn::MulAdd(share, hn::Set(d, bone.angle), hn::Set(d, bone.offset)));
    const auto add = [&](Vec<D> factor, const Points<D>& by)
                         HWY_ATTR { of.added = add_scaled<D>(of.added, factor, by); };
    const bool first_is_linear = frame.blend == TwistBlend::linear;
    const bool second_is_linear =
        frame.mix == nullptr ? first_is_linear : frame.mix_blend == TwistBlend::linear;
    const bool is_linear = first_is_linear && second_is_linear;
    const Points<D> before = of.point;
    const Turned<D> own(d, turns);
    Vec<D> others = one;
    if (is_linear) {
        add(weight, spun(d, bone.rest, own, rest));
        return;
    }
    if (first_is_linear || second_is_linear) {
        others = second_is_linear ? hn::Sub(one, of.mix) : of.mix;
        const Vec<D> factor = hn::Mul(hn::Sub(one, others), weight);
        const Points<D> by = spun(d, bone.rest, own, rest);
        add(factor, by);
        of.point = add_scaled<D>(of.point, factor, by);
    }
    if (!bone.has_axis) return;
    Vec<D> posed_turns = hn::Mul(weight, turns);
    if (frame.goes_around) {
        const TwistBlend blend = first_is_linear ? frame.mix_blend : frame.blend;
        posed_turns = hn::Add(posed_turns, left_out(d, blend, bone, below, of.mask));
    }
    Points<D> by = spun(d, bone.posed, Turned<D>(d, posed_turns), before);
    if (bone.is_scaled) {
        const Points<D> posed = displaced(d, bone.displacement, rest);
        by = add_scaled<D>(by, weight,
                           subtract<D>(spun(d, bone.rest, own, rest), spun(d, bone.posed, own, posed)));
    }
    add(others, by);
    of.point = add_scaled<D>(of.point, others, by);
}

/// Twists some lanes of a block by all its bones.
///
/// bones      [count] of the vertices
/// weight_of  weight_of(k) returns the weight of the k-th in each lane
template <class D, class WeightOf>
HWY_INLINE void twist_lanes(D d, const TwistFrame& frame, const MeshPointers& pointers, std::size_t b,
                            std::size_t lane, const std::int32_t* bones, std::size_t count,
                            const WeightOf& weight_of) {
    Twisting<D> of;
    of.rest = load_rest(d, pointers, frame.spaces, b, lane);
    const Points<D> point = load_deformed(d, pointers, b, lane);
    of.point = to_bones(d, frame.spaces, point);
    of.added = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    of.mask = frame.weights == nullptr ? hn::Set(d, 1.0f) : hn::Load(d, frame.weights[b].lane.data() + lane);
    of.mix = frame.mix == nullptr ? hn::Zero(d) : hn::Load(d, frame.mix[b].lane.data() + lane);
    const auto sum_of = [&](const auto& counts) HWY_ATTR {
        Vec<D> sum = hn::Zero(d);
        for (std::size_t k = 0; k < count; ++k) {
            if (counts(bones[k])) sum = hn::Add(sum, weight_of(k));
        }
        return sum;
    };
    const auto by = [&](std::size_t number) HWY_ATTR {
        const TwistedBone& bone = frame.twisted[number];
        const Vec<D> weight = sum_of([&](std::int32_t used) {
            return frame.twisted_of_bone[used] == static_cast<std::int32_t>(number);
        });
        const Vec<D> below = frame.goes_around
                                 ? sum_of([&](std::int32_t used) { return bone.below[used] != 0; })
                                 : hn::Zero(d);
        twist_by(d, frame, bone, weight, below, of);
    };
    if (frame.goes_around) {
        for (std::size_t number = 0; number < frame.twisted_count; ++number) by(number);
    } else {
        // In the order of `twisted`, so that the order of a vertex's bones does not matter.
        for (std::int32_t last = -1;;) {
            std::int32_t next = -1;
            for (std::size_t k = 0; k < count; ++k) {
                const std::int32_t number = frame.twisted_of_bone[bones[k]];
                if (number > last && (next < 0 || number < next)) next = number;
            }
            if (next < 0) break;
            by(static_cast<std::size_t>(next));
            last = next;
        }
    }
    store_points(d, pointers, b, lane, add<D>(point, vector_to_model(d, frame.spaces, of.added)));
}

/// Whether a twist concerns one of these bones.
bool is_twisted(const TwistFrame& frame, const std::int32_t* bones, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
        if (frame.twisted_of_bone[bones[k]] >= 0) return true;
        for (std::size_t i = 0; frame.goes_around && count > 1 && i < frame.twisted_count; ++i) {
            if (frame.twisted[i].below[bones[k]] != 0) return true;
        }
    }
    return false;
}

void spread(const TwistFrame& frame, std::size_t begin, std::size_t end) {
    const PackedMesh& mesh = *frame.mesh;
    const MeshPointers pointers{mesh.blocks.data(),   frame.rest_points, mesh.weights.data(), nullptr,
                                mesh.vertices.data(), mesh.runs.data(),  frame.points};
    for_each_set(
        mesh, begin, end,
        [&](std::size_t first, std::size_t after) HWY_ATTR {
            const Full d;
            const Block& block = pointers.blocks[first];
            const std::int32_t* const bones = mesh.bones.data() + block.first_bone;
            if (!is_twisted(frame, bones, block.influences)) return;
            for (std::size_t b = first; b < after; ++b) {
                const float* const weights = weights_of(pointers, b);
                const float* const first_weights = mesh.first_weights[b].lane.data();
                const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
                for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
                    twist_lanes(
                        d, frame, pointers, b, lane, bones, block.influences, [&](std::size_t k) HWY_ATTR {
                            return hn::Load(d, (k == 0 ? first_weights : weights + kLanes * (k - 1)) + lane);
                        });
                }
            }
        },
        [&](std::size_t b) HWY_ATTR {
            const One d;
            const Block& block = pointers.blocks[b];
            for (std::size_t lane = 0; lane < block.vertices; ++lane) {
                const float* const weights = weights_of(pointers, b) + lane;
                const std::int32_t* const bones =
                    mesh.bones.data() + block.first_bone + block.influences * lane;
                if (!is_twisted(frame, bones, block.influences)) continue;
                twist_lanes(d, frame, pointers, b, lane, bones, block.influences,
                            [&](std::size_t k) HWY_ATTR { return hn::Load(d, weights + kLanes * k); });
            }
        });
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {

void spread_twists(const TwistFrame& frame, std::size_t begin, std::size_t end) noexcept {
    using OfBlocks = void(const TwistFrame& frame, std::size_t begin, std::size_t end);
    static constexpr std::array<OfBlocks*, kTargetCount> kSpread SINEW_TARGETS(spread);
    kSpread[target_in_use()](frame, begin, end);
}

Spin spin(const Vec3<double>& origin, const Vec3<double>& axis, const Mat3<double>& then) noexcept {
    // Of p: axis x p, and the part of p across the axis, which 1 - cosine takes away.
    const Mat3<double> sine(Vec3<double>(0.0, axis.z, -axis.y), Vec3<double>(-axis.z, 0.0, axis.x),
                            Vec3<double>(axis.y, -axis.x, 0.0));
    const Mat3<double> of_sine = then * sine;
    const Mat3<double> of_versine = of_sine * sine;
    Spin result{};
    for (int row = 0; row < 3; ++row) {
        result.origin[row] = static_cast<float>(origin[row]);
        for (int column = 0; column < 3; ++column) {
            result.sine[3 * row + column] = static_cast<float>(of_sine[column][row]);
            result.versine[3 * row + column] = static_cast<float>(of_versine[column][row]);
        }
    }
    return result;
}

}  // namespace sinew

#endif
