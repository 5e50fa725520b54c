// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/transform/affine.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// The bones of one frame.
struct Pose {
    /// [bones] finite; missing bones stay at rest.
    std::span<const Affine<float>> posed_from_rest{};
    /// Maps model space to the space of `posed_from_rest` and the rest bones, in which the bones are blended; the
    /// result is mapped back. Invertible.
    Affine<float> bones_from_model{};
    /// [bones] the quaternion of each bone whose sign is taken where the parameter `signs` is "hierarchy"; unit length.
    /// Empty, and for missing bones: the one nearer to the identity. See continued_rotations().
    std::span<const Quat<float>> rotations{};
};

}  // namespace sinew
