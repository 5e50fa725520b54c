// SPDX-License-Identifier: GPL-3.0-or-later
// Dual quaternion skinning on lanes. A row is the real part and the dual part, each (w, x, y, z).
#include "sinew/methods/dq/dq.h"

#define SINEW_THIS_FILE "sinew/methods/dq/dq.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

struct DqKernel : RigidFunctions<Dq, DqKernel> {
    static constexpr std::size_t kNumbers = kRow;
    static constexpr RowLayout kRows{kNumbers / 4};
    static constexpr std::size_t kSignedFloat4s = 2;

    /// Adds to the dual part + 1/2 added * real, for what the bone's scale adds.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D>,
                                     Vec<D> signed_weight, const Points<D>& rest, Sum<D>& sum) {
        Points<D> added;
        if (!scaled(d, palette, bone, rest, added)) return;
        const float* const real = row_of(palette, bone);
        const Points<D> axis = in_all_lanes(d, real + 1);
        const Points<D> vector = add_scaled<D>(cross<D>(added, axis), hn::Set(d, real[0]), added);
        const Vec<D> half = hn::Mul(signed_weight, hn::Set(d, 0.5f));
        sum.value[4] = hn::NegMulAdd(half, dot<D>(axis, added), sum.value[4]);
        sum.value[5] = hn::MulAdd(half, vector.x, sum.value[5]);
        sum.value[6] = hn::MulAdd(half, vector.y, sum.value[6]);
        sum.value[7] = hn::MulAdd(half, vector.z, sum.value[7]);
    }

    static void write_scale(const Quat<double>& rotation, const Affine<double>& scale, Float4* rows) {
        write_rotated_scale(rotation, scale, rows);
    }

    /// Divides once by the squared norm instead of taking a square root, as in methods/dq/dq.h.
    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Vec<D>* const real = sum.value;
        const Vec<D>* const dual = sum.value + 4;
        const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), squared_length(d, real));
        const Points<D> axis{real[1], real[2], real[3]};
        const Points<D> translation{dual[1], dual[2], dual[3]};
        const Points<D> inner = add_cross<D>(add_scaled<D>(translation, real[0], p), axis, p);
        const Points<D> moved{hn::NegMulAdd(dual[0], axis.x, hn::Mul(real[0], translation.x)),
                              hn::NegMulAdd(dual[0], axis.y, hn::Mul(real[0], translation.y)),
                              hn::NegMulAdd(dual[0], axis.z, hn::Mul(real[0], translation.z))};
        return add_scaled<D>(p, scale, add_cross<D>(moved, axis, inner));
    }

    static HWY_INLINE void write_row(const Quats& real, const BonePoints& translation, BoneVec* row) {
        const BoneTag d;
        const BonePoints half = times<BoneTag>(hn::Set(d, 0.5), translation);
        const BonePoints dual = add_scaled<BoneTag>(cross<BoneTag>(half, real.v), real.w, half);
        row[0] = real.w;
        row[1] = real.v.x;
        row[2] = real.v.y;
        row[3] = real.v.z;
        row[4] = hn::Neg(dot<BoneTag>(half, real.v));
        row[5] = dual.x;
        row[6] = dual.y;
        row[7] = dual.z;
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Dq, DqKernel)
