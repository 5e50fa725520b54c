// SPDX-License-Identifier: GPL-3.0-or-later
// Quaternion-vector blending on lanes. A row is the rotation (w, x, y, z), then the translation (x, y, z, 0).
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/qv/qv.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/qv/qv.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct QvKernel {
    static constexpr std::size_t kNumbers = kRow;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// Adds the displacement by the bone's scale, rotated, to the translation.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D>& sum) {
        Points<D> added;
        if (!scaled(d, palette, bone, rest, added)) return;
        const Points<D> rotated = rotated_by(d, row_of(palette, bone), added);
        sum.value[4] = hn::MulAdd(weight, rotated.x, sum.value[4]);
        sum.value[5] = hn::MulAdd(weight, rotated.y, sum.value[5]);
        sum.value[6] = hn::MulAdd(weight, rotated.z, sum.value[6]);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Points<D> rotated = add_rotation<D>(d, p, q, p);
        return {hn::Add(rotated.x, q[4]), hn::Add(rotated.y, q[5]), hn::Add(rotated.z, q[6])};
    }

    static HWY_INLINE void write_row(const Quats& rotation, const BonePoints& translation, BoneVec* row) {
        row[0] = rotation.w;
        row[1] = rotation.v.x;
        row[2] = rotation.v.y;
        row[3] = rotation.v.z;
        row[4] = translation.x;
        row[5] = translation.y;
        row[6] = translation.z;
        row[7] = hn::Zero(BoneTag());
    }
};

namespace {

SINEW_RIGID_FUNCTIONS(QvKernel)

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}};

void write_bone(const Qv::Bone<double>& bone, Float4* row, Float4* scale) {
    const Vec3<double>& translation = bone.rigid.translation;
    row[0] = float4(bone.rigid.rotation);
    row[1] = float4(translation.x, translation.y, translation.z, 0.0);
    write_displacement(bone.scale, scale);
}

}  // namespace

SINEW_KERNEL(Qv, .rest_row = kRestRow, .bone_rows = SINEW_TARGETS(bone_rows),
             .scaled_bone_rows = scaled_bone_rows<Qv, kRestRow, write_bone>)

}  // namespace sinew
#endif
