// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/deform/packed_mesh.h"
#include "sinew/skinning/moments.h"

namespace sinew {

/// The parts that rows of moments are kept in, each of all blocks one after the other: a variant that needs less reads
/// less memory. They are
///
///     weight  the centroid of each neighbourhood (x, y, z), then of each bone its weight
///     first   of each bone its first moments
///     second  the sum of all bones' second moments, then those of each
enum class MomentPart : std::size_t { weight, first, second };
inline constexpr std::size_t kMomentParts = 3;

/// Rows of a block whose vertices have moments of `bones`, of each part.
[[nodiscard]] constexpr std::array<std::size_t, kMomentParts> moment_rows(std::size_t bones) {
    return {3 + bones, 3 * bones, 6 + 6 * bones};
}

/// Where number `n` of Moments is of the block's rows.
struct MomentPlace {
    MomentPart part;
    std::size_t row;
};
[[nodiscard]] constexpr MomentPlace moment_place(std::size_t bone, std::size_t n) {
    if (n == 0) return {MomentPart::weight, 3 + bone};
    if (n < 4) return {MomentPart::first, 3 * bone + n - 1};
    return {MomentPart::second, 6 + 6 * bone + n - 4};
}

/// Numbers of each bone: weight, first moment, second moment.
inline constexpr std::size_t kMomentNumbers = kMomentFloats - 2;

/// The moments of a block of a packed mesh.
struct MomentBlock {
    std::array<std::uint32_t, kMomentParts> first_rows;  // of BoneMoments::parts
    std::uint32_t first_bone;  // of BoneMoments::bones: [bones], or if mixed [kLanes][bones]
    std::uint32_t bones;       // rising; a vertex that lacks one has 0 of it
    bool mixed;                // every lane has bones of its own
};

/// What a mesh's vertices have of moments, in the order of its blocks. Blocks that follow each other and have the same
/// bones name them once.
struct BoneMoments {
    std::vector<MomentBlock> blocks;  // [blocks]; empty: the method has none
    std::array<std::vector<Lanes<float>>, kMomentParts> parts;
    std::vector<std::int32_t> bones;  // indices into PackedMesh::used_bones
};

/// The row of a block.
[[nodiscard]] inline std::size_t row_of(const MomentBlock& block, const MomentPlace& place) {
    return block.first_rows[static_cast<std::size_t>(place.part)] + place.row;
}

/// The bones of the rows, in any order, any number of times. Those of rows of 0 alone are left out.
[[nodiscard]] std::vector<std::int32_t> bones_of_moments(std::span<const float> rows);

/// rows  [any number][kMomentFloats] by rising vertices and bones, each once; these bones are used ones of `mesh`. A
///       vertex without rows has its rest point as its neighbourhood.
[[nodiscard]] BoneMoments pack_moments(const PackedMesh& mesh, std::span<const float> rows);

/// Undoes pack_moments(), but for rows of 0 alone.
[[nodiscard]] std::vector<float> unpack_moments(const PackedMesh& mesh, const BoneMoments& moments);

}  // namespace sinew
