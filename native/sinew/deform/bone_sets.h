// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sinew/deform/packed_mesh.h"

namespace sinew {

/// The sets of bones of a mesh, each once, for methods that work something out of each set.
struct BoneSets {
    std::vector<std::uint32_t> offsets{0};  // [sets + 1] into `bones`
    std::vector<std::uint32_t> bones;       // [entries] indices into PackedMesh::used_bones
    std::vector<std::int32_t> entries;  // [PackedMesh::bones] the entry of each; of weight 0 any of its set
};

/// In the order of the mesh's blocks. Bones in another order are another set.
///
/// rows  those of `mesh` or a copy of them
[[nodiscard]] BoneSets find_bone_sets(const PackedMesh& mesh, std::span<const Lanes<float>> rows);

}  // namespace sinew
