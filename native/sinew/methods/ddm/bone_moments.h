// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/lanes/kernel.h"
#include "sinew/methods/ddm/moments.h"

namespace sinew {

/// Rows of moments are stored in parts, each with the rows of all blocks one after the other, so that a variant
/// reads only the parts that it needs:
///
///     first_weight  the weight of the first bone, which is rarely read
///     weight        the centroid of each neighbourhood (x, y, z), then the weights of the other bones
///     first         the first moments of each bone
///     second        the sum of the second moments over all bones, then those of each bone
enum class MomentPart : std::size_t { first_weight, weight, first, second };
inline constexpr std::size_t kMomentParts = 4;

/// The number of rows of each part, for a block whose vertices have moments of `bones` bones.
[[nodiscard]] constexpr std::array<std::size_t, kMomentParts> moment_rows(std::size_t bones) {
    return {1, 2 + bones, 3 * bones, 6 + 6 * bones};
}

/// The row of a block in which number `n` of a bone's Moments is stored.
struct MomentPosition {
    MomentPart part;
    std::size_t row;
};
[[nodiscard]] constexpr MomentPosition moment_position(std::size_t bone, std::size_t n) {
    if (n == 0 && bone == 0) return {MomentPart::first_weight, 0};
    if (n == 0) return {MomentPart::weight, 2 + bone};
    if (n < 4) return {MomentPart::first, 3 * bone + n - 1};
    return {MomentPart::second, 6 + 6 * bone + n - 4};
}

/// Numbers for each bone: weight, first moments, second moments.
inline constexpr std::size_t kMomentNumbers = kMomentFloats - 2;

/// The moments of one block of a packed mesh.
struct MomentBlock {
    std::array<std::uint32_t, kMomentParts> first_rows;  // into BoneMoments::parts
    std::uint32_t first_bone;  // into BoneMoments::bones: [bones], or with own bones [kLanes][bones]
    std::uint32_t bones;       // ascending; a vertex without one of them has moments of 0
    bool own_bones;            // every lane has its own
};

/// The moments of a mesh's vertices, in the order of its blocks. Consecutive blocks with the same bones share one
/// list of them.
struct BoneMoments final : PackedVertexData {
    /// Without rows that are all 0.
    [[nodiscard]] std::vector<float> unpack(const PackedMesh& mesh, std::size_t vertices) const override;

    std::vector<MomentBlock> blocks;  // [blocks]
    std::array<std::vector<Lanes<float>>, kMomentParts> parts;
    std::vector<std::int32_t> bones;  // indices into PackedMesh::used_bones
};

/// The index into BoneMoments::parts of a row of a block.
[[nodiscard]] inline std::size_t row_of(const MomentBlock& block, const MomentPosition& position) {
    return block.first_rows[static_cast<std::size_t>(position.part)] + position.row;
}

/// Packs the moments in the order of the mesh's blocks.
///
/// rows  [any number][kMomentFloats] in ascending order of vertices and bones, each pair once; their bones are
///       among mesh.used_bones. The neighbourhood of a vertex without rows is its own rest point.
[[nodiscard]] std::unique_ptr<const PackedVertexData> pack_moments(const PackedMesh& mesh,
                                                                   std::span<const float> rows);

}  // namespace sinew
