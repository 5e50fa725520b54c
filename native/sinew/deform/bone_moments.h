// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/deform/packed_mesh.h"
#include "sinew/skinning/moments.h"

namespace sinew {

/// Rows of a block before those of its bones: the centroid of each neighbourhood (x, y, z), and the sum of its bones'
/// second moments (xx, yy, zz, yz, xz, xy).
inline constexpr std::size_t kNeighbourhoodRows = 9;

/// Rows of each bone: weight, first moment, second moment.
inline constexpr std::size_t kMomentRows = kMomentFloats - 2;

/// The moments of a block of a packed mesh.
struct MomentBlock {
    std::uint32_t first_row;   // of BoneMoments::rows: kNeighbourhoodRows, then kMomentRows of each bone
    std::uint32_t first_bone;  // of BoneMoments::bones: [bones], or if mixed [kLanes][bones]
    std::uint32_t bones;       // rising; a vertex that lacks one has 0 of it
    bool mixed;                // every lane has bones of its own
};

/// What a mesh's vertices have of moments, in the order of its blocks. Blocks that follow each other and have the same
/// bones name them once.
struct BoneMoments {
    std::vector<MomentBlock> blocks;  // [blocks]; empty: the method has none
    std::vector<Lanes<float>> rows;
    std::vector<std::int32_t> bones;  // indices into PackedMesh::used_bones
};

/// rows  [any number][kMomentFloats] by rising vertices and bones, each once. Those of bones that no vertex uses are left
///       out. A vertex without rows has its rest point as its neighbourhood.
[[nodiscard]] BoneMoments pack_moments(const PackedMesh& mesh, std::span<const float> rows);

/// Undoes pack_moments(), but for rows of 0 alone.
[[nodiscard]] std::vector<float> unpack_moments(const PackedMesh& mesh, const BoneMoments& moments);

}  // namespace sinew
