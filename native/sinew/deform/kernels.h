// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>

#include "sinew/skinning/influence.h"
#include "sinew/skinning/methods.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// A valid bound mesh: every influence has a positive weight and those of a vertex sum to 1.
struct MeshView {
    std::span<const Vec3<float>> rest_points;      // [vertices]
    std::span<const std::uint32_t> offsets;        // [vertices + 1]
    std::span<const Influence<float>> influences;  // [offsets.back()]
};

/// Deforms the whole mesh with one method; the seam at which kernels are made fast. What the method means
/// is in skinning/, and each kernel agrees with it.
void deform_mesh(MethodId method, const MeshView& mesh, std::span<const Affine<float>> posed_from_rest,
                 std::span<const Affine<float>> rest_bones, const Affine<float>& bones_from_model,
                 std::size_t threads, std::span<Vec3<float>> points);

}  // namespace sinew
