// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "sinew/export.h"
#include "sinew/transform/affine.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// The rotation of each bone as a quaternion that is in the hemisphere of its parent's, so that the rotations along
/// a chain add up beyond half a turn. Bones without a parent are in that of the identity.
///
/// parents          [bones] the parent of each bone, which precedes it, -1 for none; else throws
/// posed_from_rest  [bones] or fewer; scale and shear are left out
/// turns            [bones] or fewer: the rotation of each bone against its parent as its channels give it, in the
///                  space of `posed_from_rest`, unit length. Of q and -q it is the one that says whether the bone
///                  went the longer way, so that a single bone turns beyond half a turn, too. 0: unknown. One that
///                  is over kTurnsAgree from the bone is not used, as something else turns the bone.
///
/// A mirrored bone takes its parent's rotation. One that is half a turn from its parent may have either sign.
[[nodiscard]] SINEW_EXPORT std::vector<Quat<float>> continued_rotations(
    std::span<const std::int32_t> parents, std::span<const Affine<float>> posed_from_rest,
    std::span<const Quat<float>> turns = {});

/// Radians.
inline constexpr double kTurnsAgree = 5.0 / 180.0 * std::numbers::pi;

}  // namespace sinew
