// SPDX-License-Identifier: GPL-3.0-or-later
// Spherical blend skinning on lanes. A row belongs to a bone of a set of bones: the rotation (w, x, y, z), the
// displacement of the set's centre of rotation by the bone (x, y, z, 0), and that centre (x, y, z, 0), the same
// in all rows of the set.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/sbs/sbs.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"
#include "sinew/mesh/bone_sets.h"

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
    static constexpr std::size_t kVertexFloats = 0;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// Adds the bone's scale; Palette::scales holds displacements that are already rotated.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D, kNumbers>& sum) {
        Points<D> by;
        if (!scaled(d, palette, bone, rest, by)) return;
        sum.value[4] = hn::MulAdd(weight, by.x, sum.value[4]);
        sum.value[5] = hn::MulAdd(weight, by.y, sum.value[5]);
        sum.value[6] = hn::MulAdd(weight, by.z, sum.value[6]);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D, kNumbers>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Points<D> from_centre{hn::Sub(p.x, q[8]), hn::Sub(p.y, q[9]), hn::Sub(p.z, q[10])};
        return add<D>(p, add_rotation<D>(d, {q[4], q[5], q[6]}, q, from_centre));
    }
};

void deform_sbs(const Frame& frame, std::size_t begin, std::size_t end) {
    deform_rigid<SbsKernel>(frame, begin, end);
}

/// Does nothing: rows depend on sets, so prepare_sets() makes them.
void prepare_sbs(std::span<const std::int32_t>, std::span<const Affine<float>>, Palette&) {}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}};

void prepare_sets(const Kernel& kernel, const Bones& bones, Palette& palette) {
    const BoneSets& sets = *bones.sets;
    const std::size_t entries = sets.bones.size();
    const auto prepared = [&bones](std::size_t bone) {
        const auto number = static_cast<std::size_t>(bones.used[bone]);
        const Affine<float> rest_bone = bones.rest_bones.empty() ? Affine<float>{} : bones.rest_bones[bone];
        // Bones that the pose lacks stay at rest.
        if (number >= bones.posed_from_rest.size()) {
            return Sbs::Bone<double>{{}, Vec3<double>(rest_bone.translation)};
        }
        return Sbs::prepare(cast<double>(bones.posed_from_rest[number]), cast<double>(rest_bone));
    };
    auto* const of_bones = reinterpret_cast<Sbs::Bone<double>*>(palette.set_bones);
    for (std::size_t bone = 0; bone < bones.used.size(); ++bone) {
        of_bones[bone] = prepared(bone);
        palette.any_scale = palette.any_scale || of_bones[bone].has_scale;
    }
    if (palette.any_scale) std::fill_n(palette.has_scale, entries, std::uint8_t{0});
    for (std::size_t set = 0; set + 1 < sets.offsets.size(); ++set) {
        const std::size_t begin = sets.offsets[set];
        const std::size_t end = sets.offsets[set + 1];
        const auto bone_at = [&](std::size_t i) -> const Sbs::Bone<double>& {
            return of_bones[sets.bones[begin + i]];
        };
        const Vec3<double> centre = Sbs::rotation_centre(end - begin, bone_at);
        for (std::size_t i = begin; i < end; ++i) {
            const Sbs::Bone<double>& bone = of_bones[sets.bones[i]];
            const Vec3<double> moved =
                rotation_displacement(bone.rigid.rotation, centre) + bone.rigid.translation;
            Float4* const row = palette.bones + kernel.rest_row.size() * i;
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

constexpr Kernel kKernel{kRestRow, true, sizeof(Sbs::Bone<double>), prepare_sets,
                         SINEW_TARGETS(deform_sbs, prepare_sbs)};

}  // namespace

const Kernel& Sbs::kernel() noexcept { return kKernel; }

}  // namespace sinew

#endif
