// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>

namespace sinew {

/// Faces and edges of a mesh, as vertices.
struct MeshTopology {
    std::span<const std::int32_t> face_offsets;     // [faces + 1] first corner of each face, then the end
    std::span<const std::int32_t> corner_vertices;  // [corners]
    std::span<const std::int32_t> edges;            // [edges][2] every edge of a face, and those without one
};

}  // namespace sinew
