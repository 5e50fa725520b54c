// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/deform/packed_mesh.h"
#include "sinew/skinning/moments.h"

namespace sinew {

/// The rows of a block's vertices: the centroid of each neighbourhood (x, y, z), then of each of `bones` the weight, then
/// their first moments, then the sum of all bones' second moments, then these of each. So a variant that needs less reads
/// the beginning alone.
struct MomentLayout {
    std::size_t bones;

    [[nodiscard]] constexpr std::size_t weight(std::size_t bone) const { return 3 + bone; }
    [[nodiscard]] constexpr std::size_t first(std::size_t bone) const { return 3 + bones + 3 * bone; }
    [[nodiscard]] constexpr std::size_t total() const { return 3 + 4 * bones; }
    [[nodiscard]] constexpr std::size_t second(std::size_t bone) const { return 9 + 4 * bones + 6 * bone; }
    [[nodiscard]] constexpr std::size_t rows() const { return 9 + 10 * bones; }
    /// The row of number `n` of Moments.
    [[nodiscard]] constexpr std::size_t number(std::size_t bone, std::size_t n) const {
        return n == 0 ? weight(bone) : n < 4 ? first(bone) + n - 1 : second(bone) + n - 4;
    }
};

/// Numbers of each bone: weight, first moment, second moment.
inline constexpr std::size_t kMomentNumbers = kMomentFloats - 2;

/// The moments of a block of a packed mesh.
struct MomentBlock {
    std::uint32_t first_row;   // of BoneMoments::rows, as MomentLayout says
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

/// The bones of the rows, in any order, any number of times. Those of rows of 0 alone are left out.
[[nodiscard]] std::vector<std::int32_t> bones_of_moments(std::span<const float> rows);

/// rows  [any number][kMomentFloats] by rising vertices and bones, each once; these bones are used ones of `mesh`. A
///       vertex without rows has its rest point as its neighbourhood.
[[nodiscard]] BoneMoments pack_moments(const PackedMesh& mesh, std::span<const float> rows);

/// Undoes pack_moments(), but for rows of 0 alone.
[[nodiscard]] std::vector<float> unpack_moments(const PackedMesh& mesh, const BoneMoments& moments);

}  // namespace sinew
