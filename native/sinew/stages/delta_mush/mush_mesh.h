// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sinew/base/targets.h"
#include "sinew/mesh/packed_mesh.h"
#include "sinew/pose/palette.h"
#include "sinew/stages/delta_mush/delta_mush.h"

namespace sinew {

/// Consecutive vertices with the same number of neighbours.
struct MushRun {
    std::uint32_t begin;
    std::uint32_t end;
    std::uint32_t valence;
    /// The neighbours of each vertex follow those of the vertex before by one index, as on a grid.
    bool is_consecutive;
    // into MushMesh::neighbours: [end - begin][valence], or [valence] of the first vertex if consecutive
    std::size_t first_neighbour;
};

/// Up to kLanes consecutive vertices with the same numbers of corners and spokes.
///
/// A spoke leads from a vertex to another vertex of one of its faces. Corner k lies between spokes k and k + 1,
/// cyclically. Where faces do not share spokes in this way, each corner has two spokes of its own: 2 k and 2 k +
/// 1.
struct MushBlock {
    std::uint32_t first_vertex;
    std::uint32_t vertices;
    std::uint32_t corners;
    std::uint32_t spokes;
    bool is_consecutive;      // as in MushRun, for each spoke
    std::size_t first_spoke;  // into MushMesh::first_spokes if consecutive, else into MushMesh::spokes
    std::size_t first_detail;
};

/// The details that smoothing removes, for one corner of each vertex of a block, in the corner's frame. In the
/// order of the kernels' lanes.
struct MushDetails {
    Lanes<float> x;
    Lanes<float> y;
    Lanes<float> z;
};

/// A mesh in the order in which it is smoothed: neighbours are close in memory, and in each chunk vertices with
/// the same numbers of neighbours and corners are consecutive.
struct MushMesh {
    static constexpr std::size_t kChunk = 2048;

    std::vector<std::uint32_t> vertices;  // [vertices] in the caller's numbering
    std::vector<MushRun> runs;
    std::vector<std::uint32_t> first_runs;  // [chunks + 1]
    std::size_t reach = 1;                  // largest distance to a neighbour in chunks, at least 1
    std::vector<std::int32_t> neighbours;
    std::vector<MushBlock> blocks;
    std::vector<std::uint32_t> first_blocks;  // [chunks + 1]
    std::vector<Lanes<std::int32_t>> spokes;  // vertices at the other ends
    std::vector<std::int32_t> first_spokes;   // for consecutive blocks, the spokes of the first vertex
    std::size_t detail_count = 0;             // over all blocks
    std::vector<std::uint8_t> on_boundary;    // [vertices] whether it is on an edge with a single face

    [[nodiscard]] std::size_t chunk_count() const noexcept { return first_runs.size() - 1; }
};

/// Throws std::invalid_argument as DeltaMush does.
[[nodiscard]] MushMesh make_mush_mesh(const MeshTopology& topology, std::size_t vertex_count);

/// The arguments of one call of the kernels. Points have four numbers, the last of them 0, and arrays of points
/// have room for kLanes more than there are vertices.
struct MushFrame {
    const MushMesh* mesh;
    const Float4* from;
    Float4* to = nullptr;  // output of smooth
    // [vertices] factor of one iteration, over the number of neighbours; for smooth_by_length also times 2
    const float* factors = nullptr;
    bool is_uniform = false;         // factors differ only by the number of neighbours
    MushDetails* details = nullptr;  // output of take_details
    const Float4* rest = nullptr;    // of take_details
    float scale = 0.0f;
    Vec3<float>* points = nullptr;  // output of finish: the caller's
};

/// Functions for chunks [begin, end), compiled once for each instruction set.
struct MushKernel {
    using OfChunks = OfTargets<void(const MushFrame& frame, std::size_t begin, std::size_t end)>;

    OfChunks smooth;
    OfChunks smooth_by_length;
    /// Adds the details to `from` and writes the result to the caller's points.
    OfChunks finish;
    /// Computes the details of the points `rest`, where `from` has them after smoothing.
    OfChunks take_details;
};
extern const MushKernel kMushKernel;

}  // namespace sinew
