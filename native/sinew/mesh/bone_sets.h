// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sinew/mesh/packed_mesh.h"

namespace sinew {

/// The sets of bones that a mesh's vertices have, each once: for methods whose rows depend on them.
struct BoneSets {
    std::vector<std::uint32_t> offsets{0};  // [sets + 1] into `bones`
    std::vector<std::uint32_t> bones;       // [entries] indices into PackedMesh::used_bones
    // [PackedMesh::bones] an index into `bones` for each; where the weight is 0, any of its set
    std::vector<std::int32_t> entries;
};

/// Finds the sets, in the order of the mesh's blocks. The same bones in another order are another set.
[[nodiscard]] BoneSets find_bone_sets(const PackedMesh& mesh);

}  // namespace sinew
