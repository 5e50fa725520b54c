// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <iterator>

#include "sinew/lanes/kernel.h"

namespace sinew {

/// Kernel::scaled_bone_rows for a method that blends rotations, with Method::prepare.
///
/// rest_row  Kernel::rest_row
/// write     stores one prepared bone: write(bone, row, scale)
template <class Method, const auto& rest_row, auto write>
void scaled_bone_rows(const Bones& bones, Palette& palette) {
    for (const std::int32_t index : std::span(palette.scaled, palette.scaled_count)) {
        const auto bone = static_cast<std::size_t>(index);
        const auto number = static_cast<std::size_t>(bones.used[bone]);
        const auto motion =
            Method::prepare(cast<double>(bones.pose.posed_from_rest[number]), bones.rest_bone(bone));
        write(motion, palette.bones + std::size(rest_row) * bone, palette.scales + kDisplacementRows * bone);
        palette.sizes[bone] = size_of(to_quat_vec(motion.rigid).translation);
        if (!motion.has_scale) continue;
        if (!palette.any_scale) {
            std::fill_n(palette.has_scale, bones.used.size(), std::uint8_t{0});
            palette.any_scale = true;
        }
        palette.has_scale[bone] = 1;
    }
}

/// A bone that does not move, as rows of CentreRows (bones-inl.h).
inline constexpr Float4 kCentreRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}};

/// Stores one bone as such rows, and its scale apart.
inline void write_centre_bone(const ScaledRigid<QuatVec<double>, double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.rotation);
    write_displacement(to_affine(bone.rigid), row + 1);
    write_displacement(bone.scale, scale);
}

}  // namespace sinew
