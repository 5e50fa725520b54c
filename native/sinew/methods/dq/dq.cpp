// SPDX-License-Identifier: GPL-3.0-or-later
// Dual quaternion skinning on lanes. A row is the real part and the dual part, each (w, x, y, z).
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/dq/dq.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/dq/dq.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct DqKernel {
    static constexpr std::size_t kNumbers = kRow;
    static constexpr std::size_t kSignedFloat4s = 2;

    /// Adds the displacement by the bone's scale to the dual part: + 1/2 real * displacement.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D>,
                                     Vec<D> signed_weight, const Points<D>& rest, Sum<D>& sum) {
        Points<D> added;
        if (!scaled(d, palette, bone, rest, added)) return;
        const float* const row = row_of(palette, bone);
        const Points<D> axis = in_all_lanes(d, row + 1);
        const Points<D> rotated = add_scaled<D>(cross<D>(axis, added), hn::Set(d, row[0]), added);
        const Vec<D> half = hn::Mul(signed_weight, hn::Set(d, 0.5f));
        sum.value[4] = hn::NegMulAdd(half, dot<D>(axis, added), sum.value[4]);
        sum.value[5] = hn::MulAdd(half, rotated.x, sum.value[5]);
        sum.value[6] = hn::MulAdd(half, rotated.y, sum.value[6]);
        sum.value[7] = hn::MulAdd(half, rotated.z, sum.value[7]);
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

namespace {

SINEW_RIGID_FUNCTIONS(DqKernel)

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}};

void write_bone(const Dq::Bone<double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.real);
    row[1] = float4(bone.rigid.dual);
    write_displacement(bone.scale, scale);
}

}  // namespace

SINEW_KERNEL(Dq, .rest_row = kRestRow, .signed_float4s = 2, .bone_rows = SINEW_TARGETS(bone_rows),
             .scaled_bone_rows = scaled_bone_rows<Dq, kRestRow, write_bone>)

}  // namespace sinew
#endif
