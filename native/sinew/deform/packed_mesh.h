// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/skinning/influence.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// Vertices of a block: the float lanes of the widest vector there is; narrower ones take a block in steps.
inline constexpr std::size_t kLanes = 16;

/// One number of each vertex of a block.
template <class T>
struct alignas(kLanes * sizeof(T)) Lanes {
    std::array<T, kLanes> lane;
};

/// Up to kLanes vertices that are deformed together. Lanes beyond `vertices` repeat the last vertex.
struct Block {
    // Of PackedMesh::rows: x, y, z, then the weights of each influence; of the second on unless mixed.
    std::uint32_t first_row;
    std::uint32_t first_bone;  // of PackedMesh::bones: [influences], or if mixed [kLanes][influences]
    std::uint32_t influences;
    std::uint32_t output;  // consecutive: the first vertex; or else, where there are runs, the first of them
    std::uint8_t vertices;
    std::uint8_t runs;  // 0: too many to be worth it
    bool mixed;         // every lane has bones of its own; fewer influences are filled up with weight 0
    bool consecutive;   // kLanes vertices that also follow each other in the mesh
};

/// Lanes of a block whose vertices follow each other in the mesh.
struct Run {
    std::int32_t origin;                  // the vertex that lane 0 would be
    std::array<std::uint16_t, 3> floats;  // a bit for each of the coordinates x y z x y z ... of the block
};

/// Which bones come first for some vertex, and with each of them which others: each pair once. Filled up to a multiple
/// of kLanes with a bone and itself.
struct BonePairs {
    std::vector<std::int32_t> first;
    std::vector<std::int32_t> later;
};

/// A bound mesh in the order in which it is deformed: vertices with the same bones in the same order are
/// neighbours, so that a bone is read once for many.
struct PackedMesh {
    std::vector<Block> blocks;
    std::vector<Lanes<float>> rows;
    std::vector<Lanes<float>> first_weights;  // [blocks] apart, as they are seldom read; not of mixed blocks
    std::vector<Lanes<std::int32_t>> vertices;  // [blocks] the vertex of each lane
    std::vector<Run> runs;
    std::vector<std::int32_t> bones;       // indices into used_bones
    std::vector<std::int32_t> used_bones;  // rising, each once: bones as the caller numbers them
    BonePairs pairs;
};

/// rest_points  [vertices]
/// offsets      [vertices + 1] into `influences`
/// influences   of each vertex, or none; of positive weights, of sum 1
/// more_bones   to be among the used bones besides those of the influences, in any order
[[nodiscard]] PackedMesh pack(std::span<const Vec3<float>> rest_points,
                              std::span<const std::uint32_t> offsets,
                              std::span<const Influence<float>> influences,
                              std::span<const std::int32_t> more_bones = {});

/// Writes other rest points [vertices] to `rows`, which are those of `mesh` or a copy of them.
void repack_points(const PackedMesh& mesh, std::span<const Vec3<float>> rest_points,
                   std::span<Lanes<float>> rows) noexcept;

/// What a mesh was packed of.
struct UnpackedMesh {
    std::vector<Vec3<float>> rest_points;
    std::vector<std::uint32_t> offsets;
    std::vector<Influence<float>> influences;
};

/// Undoes pack(), but for weights of 0.
///
/// rows  of `mesh`, or with other rest points
[[nodiscard]] UnpackedMesh unpack(const PackedMesh& mesh, std::span<const Lanes<float>> rows,
                                  std::size_t vertices);

/// Undoes pack_values().
[[nodiscard]] std::vector<float> unpack_values(const PackedMesh& mesh, std::span<const Lanes<float>> packed,
                                               std::size_t vertices, std::size_t count = 1);

/// Numbers of each vertex [vertices][count] in the order of the mesh: [blocks][count]. Lanes without a vertex repeat the
/// last.
[[nodiscard]] std::vector<Lanes<float>> pack_values(const PackedMesh& mesh, std::span<const float> values,
                                                    std::size_t count = 1);

}  // namespace sinew
