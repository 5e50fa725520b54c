// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/bone_sets.h"

#include <algorithm>
#include <map>
#include <span>

namespace sinew {
namespace {

class Finder {
public:
    explicit Finder(const PackedMesh& mesh) : mesh_(mesh) { sets_.entries.resize(mesh.bones.size()); }

    BoneSets run() {
        for (const Block& block : mesh_.blocks) {
            if (block.influences == 0) continue;
            if (!block.own_bones) {
                add(block.first_bone, block.influences, block.influences);
                continue;
            }
            const Lanes<float>* const weights = &mesh_.weights[block.first_weight];
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                std::size_t count = block.influences;
                // Vertices with fewer influences are padded with weight 0.
                while (count > 1 && weights[count - 1].lane[lane] == 0.0f) --count;
                add(block.first_bone + block.influences * lane, count, block.influences);
            }
        }
        sets_.bones.shrink_to_fit();
        return std::move(sets_);
    }

private:
    /// Adds the set of the `count` bones from `first` on, and its entries, which are `length` in all with
    /// padding.
    void add(std::size_t first, std::size_t count, std::size_t length) {
        const std::span of(mesh_.bones.data() + first, count);
        const std::uint32_t begin = sets_.offsets[find(of)];
        for (std::size_t k = 0; k < length; ++k) {
            sets_.entries[first + k] = static_cast<std::int32_t>(begin + std::min(k, count - 1));
        }
    }

    std::size_t find(std::span<const std::int32_t> of) {
        const auto [known, is_new] = known_.try_emplace({of.begin(), of.end()}, known_.size());
        if (is_new) {
            sets_.bones.insert(sets_.bones.end(), of.begin(), of.end());
            sets_.offsets.push_back(static_cast<std::uint32_t>(sets_.bones.size()));
        }
        return known->second;
    }

    const PackedMesh& mesh_;
    BoneSets sets_;
    std::map<std::vector<std::int32_t>, std::size_t> known_;
};

}  // namespace

BoneSets find_bone_sets(const PackedMesh& mesh) { return Finder(mesh).run(); }

}  // namespace sinew
