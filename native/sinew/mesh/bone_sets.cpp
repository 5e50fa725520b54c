// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/bone_sets.h"

#include <algorithm>
#include <map>
#include <span>

namespace sinew {

BoneSets find_bone_sets(const PackedMesh& mesh) {
    BoneSets sets;
    sets.entries.resize(mesh.bones.size());
    std::map<std::vector<std::int32_t>, std::size_t> known;
    // Adds the set of the `count` bones from `first` on, and its entries, which are `length` in all with padding.
    const auto add = [&](std::size_t first, std::size_t count, std::size_t length) {
        const auto of = std::span(mesh.bones).subspan(first, count);
        const auto [set, is_new] = known.try_emplace({of.begin(), of.end()}, known.size());
        if (is_new) {
            sets.bones.insert(sets.bones.end(), of.begin(), of.end());
            sets.offsets.push_back(static_cast<std::uint32_t>(sets.bones.size()));
        }
        const std::uint32_t begin = sets.offsets[set->second];
        for (std::size_t k = 0; k < length; ++k) {
            sets.entries[first + k] = static_cast<std::int32_t>(begin + std::min(k, count - 1));
        }
    };
    for (const Block& block : mesh.blocks) {
        if (block.influences == 0) continue;
        if (!block.own_bones) {
            add(block.first_bone, block.influences, block.influences);
            continue;
        }
        const Lanes<float>* const weights = &mesh.weights[block.first_weight];
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            std::size_t count = block.influences;
            // Vertices with fewer influences are padded with weight 0.
            while (count > 1 && weights[count - 1].lane[lane] == 0.0f) --count;
            add(block.first_bone + block.influences * lane, count, block.influences);
        }
    }
    sets.bones.shrink_to_fit();
    return sets;
}

}  // namespace sinew
