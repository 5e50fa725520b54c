// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sinew/export.h"
#include "sinew/skeleton/skeleton.h"
#include "sinew/transform/affine.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// The rotation of each bone as a quaternion that is in the hemisphere of its parent's, so that the rotations along
/// a chain add up beyond half a turn. Bones without a parent are in that of the identity.
///
/// posed_from_rest  [bones] as many as in the skeleton, or fewer; scale and shear are left out
///
/// A bone that mirrors has its parent's. One that is half a turn from its parent may have either sign.
[[nodiscard]] SINEW_EXPORT std::vector<Quat<float>> continued_rotations(
    const Skeleton& skeleton, std::span<const Affine<float>> posed_from_rest);

}  // namespace sinew
