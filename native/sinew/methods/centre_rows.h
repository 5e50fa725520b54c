// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/lanes/rigid_bones.h"

namespace sinew {

/// A bone that does not move, as rows of CentreRows (centre-inl.h).
inline constexpr Float4 kCentreRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}};

/// Stores one bone as such rows, and its scale apart.
inline void write_centre_bone(const ScaledRigid<QuatVec<double>, double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.rotation);
    write_displacement(to_affine(bone.rigid), row + 1);
    write_displacement(bone.scale, scale);
}

}  // namespace sinew
