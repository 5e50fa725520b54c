// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid methods on lanes, agreeing with skinning/: compiled once for each instruction set, see
// kernels.cpp.
//
// Rows of bones are summed as Palette says; `finish` makes points of the sums. There is no case for blends that
// cancel: a term never points against the sum before it, so |sum|^2 >= the sum of squared weights
// >= 1 / influences, and kDegenerateBlend takes 1e12 influences.
#if defined(SINEW_DEFORM_RIGID_METHODS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_DEFORM_RIGID_METHODS_INL_H_
#undef SINEW_DEFORM_RIGID_METHODS_INL_H_
#else
#define SINEW_DEFORM_RIGID_METHODS_INL_H_
#endif

#include "sinew/deform/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// Numbers of a bone's row: two quads.
inline constexpr std::size_t kRow = 8;

/// The weighted sum of rows.
template <class D>
struct Sum {
    Vec<D> value[kRow];
};

template <class D>
HWY_INLINE void add_row(D d, Vec<D> weight, const float* row, std::size_t begin, std::size_t end,
                        Sum<D>& sum) {
    for (std::size_t i = begin; i < end; ++i) {
        sum.value[i] = hn::MulAdd(weight, hn::Set(d, row[i]), sum.value[i]);
    }
}

/// A weighted sum, and that of the quaternions alone up to here, which says on what side the next is added.
template <class D>
struct Blend {
    Sum<D> sum;
    Vec<D> side[4];
};

/// The base that rows are added without where they are added plainly.
inline constexpr float kNoBase[kRow] = {};

/// plain  whether the first row is added by its weight
template <class D>
HWY_INLINE Blend<D> begin_blend(D d, const float* row, Vec<D> weight, bool plain) {
    Blend<D> blend;
    for (std::size_t i = 0; i < kRow; ++i) blend.sum.value[i] = hn::Set(d, row[i]);
    for (std::size_t i = 0; i < 4; ++i) blend.side[i] = hn::Mul(weight, hn::Set(d, row[i]));
    if (plain) {
        for (std::size_t i = 0; i < kRow; ++i) blend.sum.value[i] = hn::Mul(weight, hn::Set(d, row[i]));
    }
    return blend;
}

/// Adds what `row`, turned to the side of the blend, differs from the `base`: the first row, or kNoBase; the
/// weight, negative where it was turned.
///
/// Products and sums of the dot product are rounded one by one, in the order of the mixed kernel: both
/// must decide a tie alike.
template <class Kernel, class D>
HWY_INLINE Vec<D> add_to_blend(D d, const float* base, const float* row, Vec<D> weight, Blend<D>& blend) {
    Vec<D>* const side = blend.side;
    const Vec<D> dot =
        hn::Add(hn::Add(hn::Mul(hn::Set(d, row[0]), side[0]), hn::Mul(hn::Set(d, row[2]), side[2])),
                hn::Add(hn::Mul(hn::Set(d, row[1]), side[1]), hn::Mul(hn::Set(d, row[3]), side[3])));
    const auto away = hn::Lt(dot, hn::Zero(d));
    const Vec<D> signed_weight = hn::IfThenElse(away, hn::Neg(weight), weight);
    for (std::size_t i = 0; i < kRow; ++i) {
        const Vec<D> difference = hn::Set(d, row[i] - base[i]);
        const Vec<D> turned = hn::Set(d, -row[i] - base[i]);
        const Vec<D> by =
            i < 4 * Kernel::kSignedQuads ? hn::IfThenElse(away, turned, difference) : difference;
        blend.sum.value[i] = hn::MulAdd(weight, by, blend.sum.value[i]);
    }
    for (std::size_t i = 0; i < 4; ++i) side[i] = hn::MulAdd(signed_weight, hn::Set(d, row[i]), side[i]);
    return signed_weight;
}

HWY_INLINE const float* row_of(const Palette& palette, std::int32_t bone) {
    return palette.bones[kRow / 4 * static_cast<std::size_t>(bone)].value.data();
}

/// What the scale of `bone` adds to `rest`, or false where it has none.
template <class D>
HWY_INLINE bool scaled(D d, const Palette& palette, std::int32_t bone, const Points<D>& rest, Points<D>& by) {
    const auto index = static_cast<std::size_t>(bone);
    if (!palette.any_scale || palette.has_scale[index] == 0) return false;
    by = displacement(d, palette.scales[kDisplacementQuads * index].value.data(), rest);
    return true;
}

struct DqKernel {
    static constexpr std::size_t kSignedQuads = 2;

    /// The dual part that also moves by the scale: + 1/2 real * displacement.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D>,
                                     Vec<D> signed_weight, const Points<D>& rest, Sum<D>& sum) {
        Points<D> by;
        if (!scaled(d, palette, bone, rest, by)) return;
        const float* const row = row_of(palette, bone);
        const Points<D> axis{hn::Set(d, row[1]), hn::Set(d, row[2]), hn::Set(d, row[3])};
        const Points<D> turned = add_scaled<D>(cross<D>(axis, by), hn::Set(d, row[0]), by);
        const Vec<D> half = hn::Mul(signed_weight, hn::Set(d, 0.5f));
        const Vec<D> along = hn::MulAdd(axis.x, by.x, hn::MulAdd(axis.y, by.y, hn::Mul(axis.z, by.z)));
        sum.value[4] = hn::NegMulAdd(half, along, sum.value[4]);
        sum.value[5] = hn::MulAdd(half, turned.x, sum.value[5]);
        sum.value[6] = hn::MulAdd(half, turned.y, sum.value[6]);
        sum.value[7] = hn::MulAdd(half, turned.z, sum.value[7]);
    }

    /// Division by the squared norm replaces the square root, as in skinning/dq.h.
    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Vec<D>* const real = sum.value;
        const Vec<D>* const dual = sum.value + 4;
        const Vec<D> squared_norm =
            hn::MulAdd(real[0], real[0],
                       hn::MulAdd(real[1], real[1], hn::MulAdd(real[2], real[2], hn::Mul(real[3], real[3]))));
        const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), squared_norm);
        const Points<D> axis{real[1], real[2], real[3]};
        const Points<D> shift{dual[1], dual[2], dual[3]};
        const Points<D> inner = add_cross<D>(add_scaled<D>(shift, real[0], p), axis, p);
        const Points<D> moved{hn::NegMulAdd(dual[0], axis.x, hn::Mul(real[0], shift.x)),
                              hn::NegMulAdd(dual[0], axis.y, hn::Mul(real[0], shift.y)),
                              hn::NegMulAdd(dual[0], axis.z, hn::Mul(real[0], shift.z))};
        return add_scaled<D>(p, scale, add_cross<D>(moved, axis, inner));
    }
};

struct QvKernel {
    static constexpr std::size_t kSignedQuads = 1;

    /// The translation that also moves by the turned scale.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D>& sum) {
        Points<D> by;
        if (!scaled(d, palette, bone, rest, by)) return;
        const float* const row = row_of(palette, bone);
        const Points<D> axis{hn::Set(d, row[1]), hn::Set(d, row[2]), hn::Set(d, row[3])};
        const Points<D> inner = add_scaled<D>(cross<D>(axis, by), hn::Set(d, row[0]), by);
        const Points<D> turned = add_scaled<D>(by, hn::Set(d, 2.0f), cross<D>(axis, inner));
        sum.value[4] = hn::MulAdd(weight, turned.x, sum.value[4]);
        sum.value[5] = hn::MulAdd(weight, turned.y, sum.value[5]);
        sum.value[6] = hn::MulAdd(weight, turned.z, sum.value[6]);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Vec<D> squared_norm =
            hn::MulAdd(q[0], q[0], hn::MulAdd(q[1], q[1], hn::MulAdd(q[2], q[2], hn::Mul(q[3], q[3]))));
        const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), squared_norm);
        const Points<D> axis{q[1], q[2], q[3]};
        const Points<D> inner = add_scaled<D>(cross<D>(axis, p), q[0], p);
        const Points<D> turned = add_scaled<D>(p, scale, cross<D>(axis, inner));
        return {hn::Add(turned.x, q[4]), hn::Add(turned.y, q[5]), hn::Add(turned.z, q[6])};
    }
};

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
