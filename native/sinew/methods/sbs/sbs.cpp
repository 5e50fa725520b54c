// SPDX-License-Identifier: GPL-3.0-or-later
// Spherical blend skinning on lanes. A row belongs to a bone of a set of bones: the rotation (w, x, y, z), the
// displacement of the set's centre of rotation by the bone (x, y, z, 0), and that centre (x, y, z, 0), the same
// in all rows of the set.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/sbs/sbs.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/sbs/sbs.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct SbsKernel {
    static constexpr std::size_t kNumbers = 12;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// Adds the bone's scale; Palette::scales holds displacements that are already rotated.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D, kNumbers>& sum) {
        Points<D> added;
        if (!scaled(d, palette, bone, rest, added)) return;
        sum.value[4] = hn::MulAdd(weight, added.x, sum.value[4]);
        sum.value[5] = hn::MulAdd(weight, added.y, sum.value[5]);
        sum.value[6] = hn::MulAdd(weight, added.z, sum.value[6]);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D, kNumbers>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Points<D> from_centre{hn::Sub(p.x, q[8]), hn::Sub(p.y, q[9]), hn::Sub(p.z, q[10])};
        return add<D>(p, add_rotation<D>(d, {q[4], q[5], q[6]}, q, from_centre));
    }
};

namespace {

void deform(const Frame& frame, std::size_t begin, std::size_t end) {
    deform_rigid<SbsKernel>(frame, begin, end);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}};

void set_rows(const Bones& bones, Palette& palette) {
    const BoneSets& sets = *bones.sets;
    for (std::size_t set = 0; set + 1 < sets.offsets.size(); ++set) {
        const std::size_t begin = sets.offsets[set];
        const std::size_t end = sets.offsets[set + 1];
        struct BoneAt {
            const QuatVec<double>& rigid;
            Vec3<double> head;
        };
        const auto bone_at = [&](std::size_t i) -> BoneAt {
            const std::size_t bone = sets.bones[begin + i];
            return {palette.posed[bone].rigid, bones.rest_bone(bone).translation};
        };
        const Vec3<double> centre = Sbs::rotation_centre(end - begin, bone_at);
        for (std::size_t i = begin; i < end; ++i) {
            const PosedBone& bone = palette.posed[sets.bones[i]];
            const Vec3<double> moved =
                rotation_displacement(bone.rigid.rotation, centre) + bone.rigid.translation;
            Float4* const row = palette.bones + std::size(kRestRow) * i;
            row[0] = float4(bone.rigid.rotation);
            row[1] = float4(moved.x, moved.y, moved.z, 0.0);
            row[2] = float4(centre.x, centre.y, centre.z, 0.0);
            palette.sizes[i] = size_of(moved);
            if (!bone.has_scale) continue;
            const Mat3<double> rotation = to_mat3(bone.rigid.rotation);
            write_displacement(rotation * (bone.scale.linear - Mat3<double>(1.0)),
                               rotation * bone.scale.translation, palette.scales + kDisplacementRows * i);
            palette.has_scale[i] = 1;
        }
    }
}

}  // namespace

SINEW_KERNEL(Sbs, .rest_row = kRestRow, .signed_float4s = 1, .set_rows = set_rows)

}  // namespace sinew
#endif
