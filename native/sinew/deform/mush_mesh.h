// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sinew/deform/delta_mush.h"
#include "sinew/deform/packed_mesh.h"
#include "sinew/deform/palette.h"

namespace sinew {

/// Vertices of as many neighbours that follow each other.
struct MushRun {
    std::uint32_t begin;
    std::uint32_t end;
    std::uint32_t valence;
    /// Each has its neighbours one place behind those of the vertex before, as on a grid.
    bool is_consecutive;
    std::size_t
        first_neighbour;  // of MushMesh::neighbours: [end - begin][valence], or [valence] of the first
};

/// Up to kLanes vertices of as many corners and spokes that follow each other.
///
/// A spoke leads from a vertex to another of its face. Corner k lies between spokes k and k + 1, the first again after
/// the last; where faces do not meet so, each corner has two spokes of its own: 2 k and 2 k + 1.
struct MushBlock {
    std::uint32_t first_vertex;
    std::uint32_t vertices;
    std::uint32_t corners;
    std::uint32_t spokes;
    bool is_consecutive;      // as of MushRun, in each spoke
    std::size_t first_spoke;  // of MushMesh::first_spokes where it is consecutive, else of MushMesh::spokes
    std::size_t first_detail;
};

/// What the smoothing takes from a corner of each vertex of a block, in the corner's frame. In the order of the kernels'
/// lanes.
struct MushDetails {
    Lanes<float> x;
    Lanes<float> y;
    Lanes<float> z;
};

/// A mesh in the order in which it is smoothed: neighbours are near each other in memory, and vertices of as many
/// neighbours and corners follow each other in each chunk.
struct MushMesh {
    static constexpr std::size_t kChunk = 2048;

    std::vector<std::uint32_t> vertices;  // [vertices] as the caller numbers them
    std::vector<MushRun> runs;
    std::vector<std::uint32_t> first_runs;  // [chunks + 1]
    std::size_t reach = 1;                  // neighbours are at most so many chunks away; at least 1
    std::vector<std::int32_t> neighbours;
    std::vector<MushBlock> blocks;
    std::vector<std::uint32_t> first_blocks;  // [chunks + 1]
    std::vector<Lanes<std::int32_t>> spokes;  // where they lead
    std::vector<std::int32_t> first_spokes;   // of a block's first vertex, where it is consecutive
    std::size_t detail_count = 0;             // of all blocks
    std::vector<std::uint8_t> on_boundary;    // [vertices] an edge of one face ends there

    [[nodiscard]] std::size_t chunk_count() const noexcept { return first_runs.size() - 1; }
};

/// Throws std::invalid_argument as DeltaMush does.
[[nodiscard]] MushMesh make_mush_mesh(const MeshTopology& topology, std::size_t vertex_count);

/// What the kernels of one call read and write. Points have four numbers, the last 0, and kLanes more than there are
/// vertices.
struct MushFrame {
    const MushMesh* mesh;
    const Float4* from;
    Float4* to;            // of smooth
    const float* factors;  // [vertices] of one iteration; by length, times 2; over the number of neighbours
    bool is_uniform;       // they differ by the number of neighbours alone
    const MushDetails* details;
    float scale;
    Vec3<float>* points;  // of finish: the caller's
};

/// Functions of chunks [begin, end), compiled once for each instruction set.
struct MushKernel {
    void (*smooth)(const MushFrame& frame, std::size_t begin, std::size_t end);
    void (*smooth_by_length)(const MushFrame& frame, std::size_t begin, std::size_t end);
    /// Adds the details to `from` and writes the caller's points.
    void (*finish)(const MushFrame& frame, std::size_t begin, std::size_t end);
    /// Takes the details out of the rest points, which `from` is after the smoothing.
    void (*take_details)(const MushFrame& frame, const Float4* rest, MushDetails* details, std::size_t begin,
                         std::size_t end);
};

/// For the instruction set in use.
[[nodiscard]] MushKernel mush_kernel() noexcept;

}  // namespace sinew
