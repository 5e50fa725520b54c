// SPDX-License-Identifier: GPL-3.0-or-later
// Spherical blend skinning on lanes. A row belongs to a bone of a set of bones: the rotation (w, x, y, z), the
// displacement of the set's centre of rotation by the bone (x, y, z, 0), and that centre (x, y, z, 0), the same
// in all rows of the set.
#include "sinew/methods/sbs/sbs.h"

#define SINEW_THIS_FILE "sinew/methods/sbs/sbs.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/rigid-inl.h"

namespace sinew {

/// Kernel::fill_palette, compiled once.
void fill_sets(const Bones& bones, bool keeps_signs, Palette& palette);

}  // namespace sinew

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

struct SbsKernel : TranslatedRows<12, 4, 1> {
    static constexpr std::size_t kSignedFloat4s = 1;
    static constexpr RowLayout kRows{.float4s = kNumbers / 4, .are_of_sets = true};

    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        deform_rigid<SbsKernel>(frame, begin, end);
    }

    static void fill_palette(const Bones& bones, bool keeps_signs, Palette& palette) {
        fill_sets(bones, keeps_signs, palette);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D, kNumbers>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Points<D> from_centre{hn::Sub(p.x, q[8]), hn::Sub(p.y, q[9]), hn::Sub(p.z, q[10])};
        return add<D>(p, add_rotation<D>(d, {q[4], q[5], q[6]}, q, from_centre));
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Sbs, SbsKernel)

#if HWY_ONCE
namespace sinew {

/// The rows of one set of bones: entries [begin, end) of `sets`.
static void write_set(const Bones& bones, std::size_t begin, std::size_t end, Palette& palette) {
    struct BoneAt {
        const QuatVec<double>& rigid;
        Vec3<double> head;
    };
    const auto bone_at = [&](std::size_t i) -> BoneAt {
        const std::size_t bone = bones.sets->bones[begin + i];
        return {palette.rigid_bones[bone].rigid, bones.rest_bone(bone).translation};
    };
    const Vec3<double> centre = Sbs::rotation_centre(end - begin, bone_at);
    for (std::size_t i = begin; i < end; ++i) {
        const RigidBone& bone = palette.rigid_bones[bones.sets->bones[i]];
        const Vec3<double> moved =
            rotation_displacement(bone.rigid.rotation, centre) + bone.rigid.translation;
        Float4* const row = palette.bones + HWY_NAMESPACE::SbsKernel::kRows.float4s * i;
        row[0] = float4(bone.rigid.rotation);
        row[1] = float4(moved.x, moved.y, moved.z, 0.0);
        row[2] = float4(centre.x, centre.y, centre.z, 0.0);
        palette.sizes[i] = size_of(moved);
        if (palette.any_scale) palette.has_scale[i] = bone.has_scale ? 1 : 0;
        if (!bone.has_scale) continue;
        write_rotated_scale(bone.rigid.rotation, bone.scale, palette.scales + kDisplacementRows * i);
    }
}

void fill_sets(const Bones& bones, bool keeps_signs, Palette& palette) {
    palette.any_scale = false;
    palette.keeps_signs = keeps_signs;
    for (std::size_t i = 0; i < bones.used.size(); ++i) {
        RigidBone& bone = palette.rigid_bones[i];
        bone = {};
        if (i >= bones.posed) continue;
        bone = scaled_rigid(cast<double>(bones.motion(i)), bones.rest_bone(i));
        palette.any_scale = palette.any_scale || bone.has_scale;
        if (keeps_signs && is_away(bones, i, bone.rigid.rotation)) bone.rigid.rotation = -bone.rigid.rotation;
    }
    const std::vector<std::uint32_t>& offsets = bones.sets->offsets;
    for (std::size_t set = 0; set + 1 < offsets.size(); ++set) {
        write_set(bones, offsets[set], offsets[set + 1], palette);
    }
    // Pairs are pairs of bones, but these rows belong to sets, so each set has to be tested.
    std::fill_n(palette.may_need_absolute_sum, bones.sets->bones.size(), std::uint8_t{1});
}

}  // namespace sinew
#endif
