// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sinew/base/targets.h"
#include "sinew/pose/palette.h"

namespace sinew {

/// The input and output of one frame.
struct SkinnedNormalFrame {
    const Vec3<float>* points;  // [vertices] deformed
    // [vertices] deformed, from rest points one step away along each axis
    std::array<const Vec3<float>*, 3> moved;
    float inverse_step;                // 1 over that step, which is the same for all three axes
    std::array<Float4*, 3> cofactors;  // [vertices] of each vertex's blend, for each axis
    const Vec3<float>* rest_normals;   // [normals]
    const std::int32_t* vertices;      // [normals] the vertex of each
    Vec3<float>* normals;              // [normals]
};

/// Functions for elements [begin, end), compiled once for each instruction set. Results do not depend on how the
/// elements are divided.
struct SkinnedNormalKernel {
    using OfRange = OfTargets<void(const SkinnedNormalFrame& frame, std::size_t begin, std::size_t end)>;

    OfRange of_vertices;  // one normal for each vertex
    OfRange cofactors;    // of the vertices
    OfRange of_frames;    // normals of frames, from the cofactors of their vertices
};
extern const SkinnedNormalKernel kSkinnedNormalKernel;

}  // namespace sinew
