// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sinew/deform/palette.h"

namespace sinew {

/// What normals of one frame are made of.
struct SkinnedNormalFrame {
    const Vec3<float>* points;                // [vertices] deformed
    std::array<const Vec3<float>*, 3> moved;  // [vertices] deformed, of points a step along each axis away
    float inverse_step;                       // of all three
    std::array<Float4*, 3> cofactors;         // [vertices] of each vertex's blend, by axis
    const Vec3<float>* rest_normals;          // [normals]
    const std::int32_t* vertices;             // [normals] the vertex of each
    Vec3<float>* normals;                     // [normals]
};

/// Each for elements [begin, end); no result depends on how they are divided.
struct SkinnedNormalKernel {
    using Compute = void(const SkinnedNormalFrame& frame, std::size_t begin, std::size_t end);

    Compute* of_vertices;  // normals, one for each vertex
    Compute* cofactors;    // of vertices
    Compute* of_frames;    // normals, by the cofactors of their vertices
};

/// For the processor's best instruction set.
SkinnedNormalKernel skinned_normal_kernel() noexcept;

}  // namespace sinew
