// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid methods on lanes, agreeing with skinning/: compiled once for each instruction set, see
// kernels.cpp.
//
// `add` sums a bone's row by weight, `finish` makes points of the sums. There is no case for blends that
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

/// `weight`, negative where the quaternion of `row` points away from that of `sum`.
///
/// Products and sums of the dot product are rounded one by one, in the order of the mixed kernel: both
/// must decide a tie alike.
template <class D>
HWY_INLINE Vec<D> on_the_side_of(D d, const Sum<D>& sum, const float* row, Vec<D> weight) {
    const Vec<D> dot = hn::Add(
        hn::Add(hn::Mul(hn::Set(d, row[0]), sum.value[0]), hn::Mul(hn::Set(d, row[2]), sum.value[2])),
        hn::Add(hn::Mul(hn::Set(d, row[1]), sum.value[1]), hn::Mul(hn::Set(d, row[3]), sum.value[3])));
    return hn::IfThenElse(hn::Lt(dot, hn::Zero(d)), hn::Neg(weight), weight);
}

struct DqKernel {
    static constexpr std::size_t kSignedQuads = 2;

    template <class D>
    static HWY_INLINE void add(D d, const Palette& palette, std::size_t bone, Vec<D> weight,
                               const Points<D>& rest, Sum<D>& sum) {
        const float* const row = palette.bones[2 * bone].value.data();
        weight = on_the_side_of(d, sum, row, weight);
        add_row(d, weight, row, 0, 8, sum);
        if (palette.has_scale.empty() || palette.has_scale[bone] == 0) return;
        // The dual part that also moves by the scale: + 1/2 real * displacement.
        const Points<D> by = displacement(d, palette.scales[kDisplacementQuads * bone].value.data(), rest);
        const Points<D> axis{hn::Set(d, row[1]), hn::Set(d, row[2]), hn::Set(d, row[3])};
        const Points<D> turned = add_scaled<D>(cross<D>(axis, by), hn::Set(d, row[0]), by);
        const Vec<D> half = hn::Mul(weight, hn::Set(d, 0.5f));
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

    template <class D>
    static HWY_INLINE void add(D d, const Palette& palette, std::size_t bone, Vec<D> weight,
                               const Points<D>& rest, Sum<D>& sum) {
        const float* const row = palette.bones[2 * bone].value.data();
        add_row(d, on_the_side_of(d, sum, row, weight), row, 0, 4, sum);
        add_row(d, weight, row, 4, 7, sum);
        if (palette.has_scale.empty() || palette.has_scale[bone] == 0) return;
        const Points<D> by = displacement(d, palette.scales[kDisplacementQuads * bone].value.data(), rest);
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
