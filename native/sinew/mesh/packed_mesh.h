// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/base/status.h"
#include "sinew/base/thread_pool.h"
#include "sinew/mesh/influence.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// Vertices of a block: the float lanes of the widest vectors. Narrower vectors process a block in several steps.
inline constexpr std::size_t kLanes = 16;

/// Lanes of a block's points: x, y and z.
inline constexpr std::size_t kPointRows = 3;

/// Below this, waking a second thread to deform a mesh costs more than it saves.
inline constexpr std::size_t kVerticesWorthAThread = 32768;

/// Of a thread: few enough to balance threads of unequal speed, many enough that fetching a chunk costs nothing.
inline constexpr std::size_t kBlocksOfAChunk = 256;

/// One number for each vertex of a block.
template <class T>
struct alignas(kLanes * sizeof(T)) Lanes {
    std::array<T, kLanes> lane;
};

/// Up to kLanes vertices that are deformed together. Lanes beyond `vertices` repeat the last vertex.
struct Block {
    // Into PackedMesh::weights, in the order of the blocks: [influences]; unless it has own bones, without the first.
    std::uint32_t first_weight;
    std::uint32_t first_bone;  // into PackedMesh::bones: [influences], or with own bones [kLanes][influences]
    std::uint32_t influences;
    std::uint32_t output;  // if consecutive, the first vertex; otherwise the first run
    std::uint8_t vertices;
    std::uint8_t runs;  // 0: too many runs to be worthwhile
    bool own_bones;     // every lane has its own; vertices with fewer influences are padded with weight 0
    bool consecutive;   // kLanes vertices that are consecutive in the mesh as well
};

/// Lanes of a block whose vertices are consecutive in the mesh.
struct Run {
    std::int32_t origin;                  // the vertex of lane 0, extrapolated if the run starts later
    std::array<std::uint16_t, 3> floats;  // a bit for each of the block's coordinates x y z x y z ...
};

/// Each pair of a bone that is the first of some vertex, and another bone of that vertex, once. Padded to a
/// multiple of kLanes with pairs of a bone with itself.
struct BonePairs {
    std::vector<std::int32_t> first;
    std::vector<std::int32_t> later;
};

/// A bound mesh in the order in which it is deformed: vertices with the same bones in the same order are
/// adjacent, so that a bone is read once for many vertices.
struct PackedMesh {
    std::vector<Block> blocks;
    // Rest points and weights are stored separately: other rest points may replace these, and a method that keeps
    // weights of its own reads only the points.
    std::vector<Lanes<float>> rest_points;  // [blocks][kPointRows]
    std::vector<Lanes<float>> weights;      // and one more row, which blocks without weights point to
    std::vector<Lanes<float>>
        first_weights;  // [blocks] separate, as rarely read; unused for blocks with own bones
    std::vector<Lanes<std::int32_t>> vertices;  // [blocks] the vertex of each lane
    std::vector<Run> runs;
    std::vector<std::int32_t> bones;       // indices into used_bones
    std::vector<std::int32_t> used_bones;  // ascending, each once: bones in the caller's numbering
    BonePairs pairs;
};

/// Influence k of the vertex in a lane of block `b`, by the index of its bone in used_bones. One of weight 0 is padding in
/// a block with own bones.
[[nodiscard]] inline Influence<float> influence_at(const PackedMesh& mesh, std::size_t b, std::size_t lane,
                                                   std::size_t k) noexcept {
    const Block& block = mesh.blocks[b];
    const Lanes<float>* const weights = &mesh.weights[block.first_weight];
    if (block.own_bones) {
        return {mesh.bones[block.first_bone + lane * block.influences + k], weights[k].lane[lane]};
    }
    return {mesh.bones[block.first_bone + k], (k == 0 ? mesh.first_weights[b] : weights[k - 1]).lane[lane]};
}

/// The sets of bones that a mesh's vertices have, each once: for methods whose rows depend on them.
struct BoneSets {
    std::vector<std::uint32_t> offsets{0};  // [sets + 1] into `bones`
    std::vector<std::uint32_t> bones;       // [entries] indices into PackedMesh::used_bones
    // [PackedMesh::bones] an index into `bones` for each; where the weight is 0, any of its set
    std::vector<std::int32_t> entries;
};

/// Finds the sets, in the order of the mesh's blocks. The same bones in another order are another set.
[[nodiscard]] BoneSets find_bone_sets(const PackedMesh& mesh);

/// Packs a mesh.
///
/// rest_points  [vertices]
/// offsets      [vertices + 1] into `influences`
/// influences   of each vertex, possibly none; positive weights with sum 1
/// more_bones   bones to be among the used bones besides those of the influences, in any order
[[nodiscard]] PackedMesh pack(std::span<const Vec3<float>> rest_points,
                              std::span<const std::uint32_t> offsets,
                              std::span<const Influence<float>> influences,
                              std::span<const std::int32_t> more_bones = {});

/// Packs other rest points [vertices] in the form of PackedMesh::rest_points, into memory that the first call
/// allocates.
Status set_own_points(const PackedMesh& mesh, std::span<const Vec3<float>> rest_points,
                      std::vector<Lanes<float>>& packed) noexcept;

/// The form of PackedMesh::rest_points for rest points [vertices].
void pack_points(const PackedMesh& mesh, std::span<const Vec3<float>> rest_points,
                 std::span<Lanes<float>> packed) noexcept;

/// What a mesh was packed from.
struct UnpackedMesh {
    std::vector<Vec3<float>> rest_points;
    std::vector<std::uint32_t> offsets;
    std::vector<Influence<float>> influences;
};

/// The inverse of pack(), without influences of weight 0.
///
/// rest_points  mesh.rest_points, or others
[[nodiscard]] UnpackedMesh unpack(const PackedMesh& mesh, std::span<const Lanes<float>> rest_points,
                                  std::size_t vertices);

/// The inverse of pack_values().
[[nodiscard]] std::vector<float> unpack_values(const PackedMesh& mesh, std::span<const Lanes<float>> packed,
                                               std::size_t vertices, std::size_t count = 1);

/// Arranges numbers of each vertex [vertices][count] in the order of the mesh's blocks: [blocks][count]. Lanes
/// without a vertex repeat the last one.
[[nodiscard]] std::vector<Lanes<float>> pack_values(const PackedMesh& mesh, std::span<const float> values,
                                                    std::size_t count = 1);

/// pack_values() of weights [vertices], clamped to 0..1; empty if there are none.
[[nodiscard]] std::vector<Lanes<float>> pack_weights(const PackedMesh& mesh, std::span<const float> weights);

/// Calls work(begin, end) for all blocks, on `threads` threads as everywhere.
///
/// vertices  of the mesh
template <class Work>
void parallel_for_blocks(const PackedMesh& mesh, std::size_t vertices, std::size_t threads,
                         const Work& work) {
    parallel_for(mesh.blocks.size(), useful_threads(threads, vertices, kVerticesWorthAThread), work,
                 kBlocksOfAChunk);
}

}  // namespace sinew
