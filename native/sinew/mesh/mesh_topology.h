// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>

namespace sinew {

/// The faces and edges of a mesh, as indices of vertices.
struct MeshTopology {
    std::span<const std::int32_t> face_offsets;     // [faces + 1] first corner of each face, then the end
    std::span<const std::int32_t> corner_vertices;  // [corners]
    std::span<const std::int32_t> edges;            // [edges][2] all edges of faces, and edges without faces
};

}  // namespace sinew
