// SPDX-License-Identifier: GPL-3.0-or-later
// Dual quaternion iterative blending on lanes. A row is the real part and the dual part, each (w, x, y, z).
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/skinning/dib.h"

#include "sinew/deform/rigid_bones.h"
#include "sinew/deform/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/kernels/dib.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/dual-inl.h"
#include "sinew/deform/exponential-inl.h"
#include "sinew/deform/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// How many radians a blend may be off, and which share of lengths.
inline constexpr float kSettled = 2e-7f;

/// Unit dual quaternions: a real and a dual part, each (w, x, y, z).
template <class D>
struct Motion {
    Vec<D> real[4];
    Vec<D> dual[4];
};

/// a b
template <class D>
HWY_INLINE void multiply(const Vec<D>* a, const Vec<D>* b, Vec<D>* product) {
    product[0] =
        hn::NegMulAdd(a[3], b[3], hn::NegMulAdd(a[2], b[2], hn::NegMulAdd(a[1], b[1], hn::Mul(a[0], b[0]))));
    product[1] =
        hn::NegMulAdd(a[3], b[2], hn::MulAdd(a[2], b[3], hn::MulAdd(a[1], b[0], hn::Mul(a[0], b[1]))));
    product[2] =
        hn::NegMulAdd(a[1], b[3], hn::MulAdd(a[3], b[1], hn::MulAdd(a[2], b[0], hn::Mul(a[0], b[2]))));
    product[3] =
        hn::NegMulAdd(a[2], b[1], hn::MulAdd(a[1], b[2], hn::MulAdd(a[3], b[0], hn::Mul(a[0], b[3]))));
}

/// a* b
template <class D>
HWY_INLINE void multiply_conjugate(const Vec<D>* a, const Vec<D>* b, Vec<D>* product) {
    product[0] = hn::MulAdd(a[3], b[3], hn::MulAdd(a[2], b[2], hn::MulAdd(a[1], b[1], hn::Mul(a[0], b[0]))));
    product[1] =
        hn::MulAdd(a[3], b[2], hn::NegMulAdd(a[2], b[3], hn::NegMulAdd(a[1], b[0], hn::Mul(a[0], b[1]))));
    product[2] =
        hn::MulAdd(a[1], b[3], hn::NegMulAdd(a[3], b[1], hn::NegMulAdd(a[2], b[0], hn::Mul(a[0], b[2]))));
    product[3] =
        hn::MulAdd(a[2], b[1], hn::NegMulAdd(a[1], b[2], hn::NegMulAdd(a[3], b[0], hn::Mul(a[0], b[3]))));
}

template <class D>
HWY_INLINE Points<D> scaled_by(Vec<D> factor, const Points<D>& p) {
    return {hn::Mul(factor, p.x), hn::Mul(factor, p.y), hn::Mul(factor, p.z)};
}

template <class D>
HWY_INLINE Vec<D> squared(const Points<D>& p) {
    return hn::MulAdd(p.x, p.x, hn::MulAdd(p.y, p.y, hn::Mul(p.z, p.z)));
}

/// Logarithms: their angular and linear parts.
template <class D>
struct Twists {
    Points<D> angular;
    Points<D> linear;
};

/// The logarithm of `m`, along the shorter way, as in transform/twist.h.
template <class D>
HWY_INLINE Twists<D> logarithm(D d, const Motion<D>& m) {
    // Polynomials in u = 1 - w of the quaternion with w >= 0, both to 4e-8: angle / sin(angle / 2), and (1 -
    // (angle / 2) cot(angle / 2)) / angle^2.
    static constexpr float kAngle[] = {2.0f,
                                       0.6666707396507263f,
                                       0.26653313636779785f,
                                       0.11595560610294342f,
                                       0.040326979011297226f,
                                       0.06011835113167763f,
                                       -0.06710599362850189f,
                                       0.10195151716470718f,
                                       -0.0651833787560463f,
                                       0.022325647994875908f};
    static constexpr float kThird[] = {0.083333320915699f,     0.011112410575151443f,   0.003941489849239588f,
                                       0.001828863169066608f,  -5.928325481363572e-05f, 0.001786231528967619f,
                                       -0.001323370961472392f, 0.0007015004521235824f};
    const Vec<D> u = hn::Sub(hn::Set(d, 1.0f), hn::Abs(m.real[0]));
    const Vec<D> factor = hn::CopySignToAbs(polynomial(d, u, kAngle), m.real[0]);
    const Points<D> v{m.real[1], m.real[2], m.real[3]};
    const Points<D> angular = scaled_by<D>(factor, v);
    // The translation is 2 dual real*.
    const Points<D> dual{m.dual[1], m.dual[2], m.dual[3]};
    const Points<D> across_dual = cross<D>(v, dual);
    const auto along = [&](Vec<D> of_dual, Vec<D> of_v, Vec<D> of_cross) HWY_ATTR {
        const Vec<D> half = hn::NegMulAdd(m.dual[0], of_v, hn::MulAdd(m.real[0], of_dual, of_cross));
        return hn::Add(half, half);
    };
    const Points<D> translation{along(dual.x, v.x, across_dual.x), along(dual.y, v.y, across_dual.y),
                                along(dual.z, v.z, across_dual.z)};
    const Points<D> across = cross<D>(angular, translation);
    const Points<D> linear = add_scaled<D>(add_scaled<D>(translation, hn::Set(d, -0.5f), across),
                                           polynomial(d, u, kThird), cross<D>(angular, across));
    return {angular, linear};
}

/// The exponential of `twist`, whose angle is at most 180 degrees, as in transform/twist.h.
template <class D>
HWY_INLINE Motion<D> exponential(D d, const Twists<D>& twist) {
    const ExponentialFactors<D> by(d, hn::Mul(hn::Set(d, 0.25f), squared<D>(twist.angular)));
    const Points<D> axis = scaled_by<D>(hn::Mul(hn::Set(d, 0.5f), by.sinc), twist.angular);
    const Points<D> across = cross<D>(twist.angular, twist.linear);
    const Points<D> first =
        add_scaled<D>(twist.linear, hn::Mul(hn::Set(d, 0.5f), hn::Mul(by.sinc, by.sinc)), across);
    const Points<D> translation = add_scaled<D>(first, by.third, cross<D>(twist.angular, across));
    Motion<D> m;
    m.real[0] = by.cosine;
    m.real[1] = axis.x;
    m.real[2] = axis.y;
    m.real[3] = axis.z;
    const Vec<D> half = hn::Set(d, 0.5f);
    const Vec<D> t[4] = {hn::Zero(d), hn::Mul(half, translation.x), hn::Mul(half, translation.y),
                         hn::Mul(half, translation.z)};
    multiply<D>(t, m.real, m.dual);
    return m;
}

/// Bones that all lanes have in common.
template <class D>
struct SharedBones {
    const Palette& palette;
    const std::int32_t* bones;

    HWY_INLINE Motion<D> at(D d, std::size_t k, const Points<D>& rest) const {
        const float* const row = row_of(palette, bones[k]);
        Motion<D> m;
        for (std::size_t i = 0; i < 4; ++i) m.real[i] = hn::Set(d, row[i]);
        for (std::size_t i = 0; i < 4; ++i) m.dual[i] = hn::Set(d, row[4 + i]);
        Sum<D> scale;
        for (std::size_t i = 4; i < kRow; ++i) scale.value[i] = m.dual[i - 4];
        DqKernel::add_scale(d, palette, bones[k], hn::Set(d, 1.0f), hn::Set(d, 1.0f), rest, scale);
        for (std::size_t i = 0; i < 4; ++i) m.dual[i] = scale.value[4 + i];
        return m;
    }
};

/// Each lane has its own bones, none of which has scale.
///
/// bones  of the first lane; those of the next lane are `influences` after them
template <class D>
struct OwnBones {
    const Palette& palette;
    const std::int32_t* bones;
    std::size_t influences;

    HWY_INLINE Motion<D> at(D d, std::size_t k, const Points<D>&) const {
        alignas(64) float numbers[kRow][kLanes];
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
            const float* const row = row_of(palette, bones[influences * lane + k]);
            for (std::size_t i = 0; i < kRow; ++i) numbers[i][lane] = row[i];
        }
        Motion<D> m;
        for (std::size_t i = 0; i < 4; ++i) m.real[i] = hn::Load(d, numbers[i]);
        for (std::size_t i = 0; i < 4; ++i) m.dual[i] = hn::Load(d, numbers[4 + i]);
        return m;
    }
};

/// Whether the corrections after this one could sum to more than kSettled: each leaves at most the share (angle /
/// 180 degrees)^2 of the one before, for the largest angle.
///
/// widest, longest  squares of the largest angle and of the longest linear part
template <class D>
HWY_INLINE auto has_more_to_do(D d, const Twists<D>& correction, Vec<D> widest, Vec<D> longest,
                               const Motion<D>& blend) {
    const Vec<D> share = hn::Min(hn::Mul(hn::Set(d, 0.101321184f), widest), hn::Set(d, 0.99f));
    const Vec<D> settled = hn::Mul(hn::Set(d, kSettled), hn::Sub(hn::Set(d, 1.0f), share));
    const Vec<D> angle = hn::Sqrt(squared<D>(correction.angular));
    const Vec<D> length = hn::Sqrt(longest);
    const Vec<D> far = hn::Sqrt(hn::MulAdd(
        blend.dual[0], blend.dual[0],
        hn::MulAdd(blend.dual[1], blend.dual[1],
                   hn::MulAdd(blend.dual[2], blend.dual[2], hn::Mul(blend.dual[3], blend.dual[3])))));
    const Vec<D> by_angle = hn::Mul(angle, hn::Mul(hn::Set(d, 0.2f), hn::Mul(hn::Sqrt(widest), length)));
    const Vec<D> linear = hn::MulAdd(share, hn::Sqrt(squared<D>(correction.linear)), by_angle);
    return hn::Or(hn::Gt(hn::Mul(angle, share), settled),
                  hn::Gt(linear, hn::Mul(settled, hn::Add(length, far))));
}

/// Blends the lanes of one vector. Each lane gets as many corrections as it needs, so its result does not depend
/// on other lanes.
///
/// first_weight  of the first influence; those of the others are at `weights`, kLanes apart
template <class D, class BonesOf>
HWY_INLINE Points<D> blend_iteratively(D d, const BonesOf& bones, std::size_t count,
                                       const float* first_weight, const float* weights,
                                       const Points<D>& rest) {
    const auto weight_of = [&](std::size_t k) HWY_ATTR {
        return hn::Load(d, k == 0 ? first_weight : weights + kLanes * (k - 1));
    };
    Motion<D> blend;
    for (std::size_t i = 0; i < 4; ++i) blend.real[i] = blend.dual[i] = hn::Zero(d);
    for (std::size_t k = 0; k < count; ++k) {
        const Motion<D> m = bones.at(d, k, rest);
        const Vec<D> dot =
            hn::Add(hn::Add(hn::Mul(m.real[0], blend.real[0]), hn::Mul(m.real[2], blend.real[2])),
                    hn::Add(hn::Mul(m.real[1], blend.real[1]), hn::Mul(m.real[3], blend.real[3])));
        const Vec<D> weight = weight_of(k);
        const Vec<D> by = hn::IfThenElse(hn::Lt(dot, hn::Zero(d)), hn::Neg(weight), weight);
        for (std::size_t i = 0; i < 4; ++i) blend.real[i] = hn::MulAdd(by, m.real[i], blend.real[i]);
        for (std::size_t i = 0; i < 4; ++i) blend.dual[i] = hn::MulAdd(by, m.dual[i], blend.dual[i]);
    }
    // The component of the dual part along the real part may stay: neither logarithms nor points depend on it.
    const Vec<D> norm = hn::Sqrt(hn::MulAdd(
        blend.real[0], blend.real[0],
        hn::MulAdd(blend.real[1], blend.real[1],
                   hn::MulAdd(blend.real[2], blend.real[2], hn::Mul(blend.real[3], blend.real[3])))));
    const Vec<D> scale = hn::Div(hn::Set(d, 1.0f), norm);
    for (std::size_t i = 0; i < 4; ++i) {
        blend.real[i] = hn::Mul(scale, blend.real[i]);
        blend.dual[i] = hn::Mul(scale, blend.dual[i]);
    }
    auto active = hn::Ge(norm, hn::Zero(d));
    for (int step = 0; step < IterativeDq::kSteps && !hn::AllFalse(d, active); ++step) {
        const Vec<D> zero = hn::Zero(d);
        Twists<D> correction{{zero, zero, zero}, {zero, zero, zero}};
        Vec<D> widest = zero;
        Vec<D> longest = zero;
        for (std::size_t k = 0; k < count; ++k) {
            const Motion<D> m = bones.at(d, k, rest);
            Motion<D> difference;
            Vec<D> other[4];
            multiply_conjugate<D>(blend.real, m.real, difference.real);
            multiply_conjugate<D>(blend.real, m.dual, difference.dual);
            multiply_conjugate<D>(blend.dual, m.real, other);
            for (std::size_t i = 0; i < 4; ++i) difference.dual[i] = hn::Add(difference.dual[i], other[i]);
            const Twists<D> twist = logarithm(d, difference);
            const Vec<D> weight = weight_of(k);
            correction.angular = add_scaled<D>(correction.angular, weight, twist.angular);
            correction.linear = add_scaled<D>(correction.linear, weight, twist.linear);
            widest = hn::Max(widest, squared<D>(twist.angular));
            longest = hn::Max(longest, squared<D>(twist.linear));
        }
        const Motion<D> by = exponential(d, correction);
        Motion<D> next;
        Vec<D> other[4];
        multiply<D>(blend.real, by.real, next.real);
        multiply<D>(blend.real, by.dual, next.dual);
        multiply<D>(blend.dual, by.real, other);
        for (std::size_t i = 0; i < 4; ++i) {
            next.dual[i] = hn::Add(next.dual[i], other[i]);
            blend.real[i] = hn::IfThenElse(active, next.real[i], blend.real[i]);
            blend.dual[i] = hn::IfThenElse(active, next.dual[i], blend.dual[i]);
        }
        active = hn::And(active, has_more_to_do(d, correction, widest, longest, blend));
    }
    Sum<D> sum;
    for (std::size_t i = 0; i < 4; ++i) sum.value[i] = blend.real[i];
    for (std::size_t i = 0; i < 4; ++i) sum.value[4 + i] = blend.dual[i];
    return DqKernel::finish(d, sum, rest);
}

template <class D, class BonesOf>
HWY_INLINE void deform_lanes_of_dib(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                                    std::size_t lane, const BonesOf& bones, std::size_t count,
                                    const float* first_weight, const float* weights) {
    const Points<D> rest = load_rest(d, pointers, spaces, b, lane);
    Points<D> points = blend_iteratively(d, bones, count, first_weight, weights, rest);
    if (spaces.model_from_bones != nullptr) points = displaced(d, spaces.model_from_bones, points);
    store_points(d, pointers, b, lane, points);
}

void deform_dib_block(const Frame& frame, std::size_t b) {
    const Full d;
    const One one;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = spaces_of(frame);
    const Block& block = pointers.blocks[b];
    const float* const weights = weights_of(pointers, b);
    const std::int32_t* const bones = frame.bones + block.first_bone;
    if (!block.mixed) {
        const std::size_t lanes = lanes_end(d, block);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            deform_lanes_of_dib(d, pointers, spaces, b, lane, SharedBones<Full>{*frame.palette, bones},
                                block.influences, first_weights_of(frame, b) + lane, weights + lane);
        }
    } else if (frame.palette->any_scale) {
        for (std::size_t lane = 0; lane < block.vertices; ++lane) {
            const std::int32_t* const of_vertex = bones + block.influences * lane;
            deform_lanes_of_dib(one, pointers, spaces, b, lane, SharedBones<One>{*frame.palette, of_vertex},
                                block.influences, weights + lane, weights + kLanes + lane);
        }
    } else {
        const std::size_t lanes = lanes_end(d, block);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            const std::int32_t* const of_lanes = bones + block.influences * lane;
            deform_lanes_of_dib(d, pointers, spaces, b, lane,
                                OwnBones<Full>{*frame.palette, of_lanes, block.influences}, block.influences,
                                weights + lane, weights + kLanes + lane);
        }
    }
}

void deform_dib(const Frame& frame, std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
        frame.mesh->blocks[b].influences == 0 ? keep_blocks(frame, b, b + 1) : deform_dib_block(frame, b);
    }
}

void prepare_dib(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                 Palette& palette) {
    prepare_rigid<DqKernel>(used, posed_from_rest, palette);
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}};

void write_bone(const IterativeDq::Bone<double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.real);
    row[1] = float4(bone.rigid.dual);
    write_displacement(bone.scale, scale);
}

constexpr Kernel kKernel{kRestRow, true, 0, prepare_rigid_method<IterativeDq, write_bone>,
                         SINEW_TARGETS(deform_dib, prepare_dib)};

}  // namespace

const Kernel& IterativeDq::kernel() noexcept { return kKernel; }

}  // namespace sinew

#endif
