// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/packed_mesh.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <map>
#include <new>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "sinew/base/thread_pool.h"

namespace sinew {
namespace {

// A block costs the same however few of its lanes are used: as much as two to six vertices with own bones,
// depending on the processor. This also bounds the memory: 16 / 6 of 24 bytes for each vertex with four
// influences.
constexpr std::size_t kMinLanes = 6;

// A run takes three masked stores. With more runs than this, one store for each vertex is as fast.
constexpr std::size_t kMaxRuns = 5;

class VertexSets {
public:
    VertexSets(std::span<const std::uint32_t> offsets, std::span<const Influence<float>> influences)
        : offsets_(offsets), influences_(influences), set_of_(offsets.size() - 1), slots_(1024, kNone) {
        for (std::size_t vertex = 0; vertex < set_of_.size(); ++vertex) {
            // Adjacent vertices mostly have the same bones.
            const bool as_before = vertex > 0 && equal(vertex, vertex - 1);
            const std::uint32_t set = as_before ? set_of_[vertex - 1] : find_or_add(vertex);
            set_of_[vertex] = set;
            ++sizes_[set];
        }
    }

    [[nodiscard]] std::size_t count() const { return sizes_.size(); }

    /// Lists the vertices by set, with sets in the order of their first vertex, and where each set starts.
    void order(std::vector<std::uint32_t>& vertices, std::vector<std::uint32_t>& starts) const {
        starts.assign(sizes_.size() + 1, 0);
        std::partial_sum(sizes_.begin(), sizes_.end(), starts.begin() + 1);
        std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
        vertices.resize(set_of_.size());
        for (std::size_t vertex = 0; vertex < set_of_.size(); ++vertex) {
            vertices[next[set_of_[vertex]]++] = static_cast<std::uint32_t>(vertex);
        }
    }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    [[nodiscard]] std::span<const Influence<float>> of(std::size_t vertex) const {
        return influences_.subspan(offsets_[vertex], offsets_[vertex + 1] - offsets_[vertex]);
    }

    [[nodiscard]] bool equal(std::size_t a, std::size_t b) const {
        return std::ranges::equal(of(a), of(b), {}, &Influence<float>::bone, &Influence<float>::bone);
    }

    [[nodiscard]] std::size_t hash(std::size_t vertex) const {
        std::uint64_t h = 0;
        for (const Influence<float>& influence : of(vertex)) {
            h = (std::rotl(h, 23) ^ static_cast<std::uint64_t>(influence.bone)) * 0x9E3779B97F4A7C15u;
        }
        return static_cast<std::size_t>(h ^ (h >> 32));
    }

    std::uint32_t find_or_add(std::size_t vertex) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t slot = hash(vertex) & mask;
        for (; slots_[slot] != kNone; slot = (slot + 1) & mask) {
            if (equal(vertex, first_vertices_[slots_[slot]])) return slots_[slot];
        }
        const auto set = static_cast<std::uint32_t>(sizes_.size());
        slots_[slot] = set;
        sizes_.push_back(0);
        first_vertices_.push_back(static_cast<std::uint32_t>(vertex));
        if (2 * sizes_.size() > slots_.size()) grow();
        return set;
    }

    void grow() {
        slots_.assign(4 * slots_.size(), kNone);
        const std::size_t mask = slots_.size() - 1;
        for (std::uint32_t set = 0; set < first_vertices_.size(); ++set) {
            std::size_t slot = hash(first_vertices_[set]) & mask;
            while (slots_[slot] != kNone) slot = (slot + 1) & mask;
            slots_[slot] = set;
        }
    }

    std::span<const std::uint32_t> offsets_;
    std::span<const Influence<float>> influences_;
    std::vector<std::uint32_t> set_of_;
    std::vector<std::uint32_t> slots_;
    std::vector<std::uint32_t> sizes_;
    std::vector<std::uint32_t> first_vertices_;
};

class Packer {
public:
    Packer(std::span<const std::uint32_t> offsets, std::span<const Influence<float>> influences)
        : offsets_(offsets), influences_(influences) {}

    PackedMesh run(std::span<const Vec3<float>> rest_points, std::span<const std::int32_t> more_bones) {
        std::vector<std::uint32_t> order;
        std::vector<std::uint32_t> starts;
        VertexSets(offsets_, influences_).order(order, starts);
        mesh_.blocks.reserve(order.size() / kLanes + starts.size());
        mesh_.vertices.reserve(order.size() / kLanes + starts.size());
        std::vector<std::uint32_t> scattered;
        for (std::size_t set = 0; set + 1 < starts.size(); ++set) {
            add_set(std::span(order).subspan(starts[set], starts[set + 1] - starts[set]), scattered);
        }
        // Vertices with similar numbers of influences become adjacent, which minimises padding.
        std::ranges::stable_sort(scattered, {}, [this](std::uint32_t vertex) { return count(vertex); });
        for (std::size_t i = 0; i < scattered.size(); i += kLanes) {
            add_own_bones(std::span(scattered).subspan(i, std::min(kLanes, scattered.size() - i)));
        }
        fill(rest_points);
        number_used_bones(more_bones);
        list_bone_pairs();
        mesh_.blocks.shrink_to_fit();
        mesh_.vertices.shrink_to_fit();
        mesh_.runs.shrink_to_fit();
        mesh_.bones.shrink_to_fit();
        return std::move(mesh_);
    }

private:
    [[nodiscard]] std::size_t count(std::uint32_t vertex) const {
        return offsets_[vertex + 1] - offsets_[vertex];
    }

    void add_set(std::span<const std::uint32_t> vertices, std::vector<std::uint32_t>& scattered) {
        const std::size_t influences = count(vertices.front());
        const auto first_bone = static_cast<std::uint32_t>(mesh_.bones.size());
        bool named = false;
        for (std::size_t i = 0; i < vertices.size(); i += kLanes) {
            const auto part = vertices.subspan(i, std::min(kLanes, vertices.size() - i));
            if (part.size() < kMinLanes && influences > 0) {
                scattered.insert(scattered.end(), part.begin(), part.end());
                continue;
            }
            if (!named) {
                for (std::size_t k = 0; k < influences; ++k) {
                    mesh_.bones.push_back(influences_[offsets_[vertices.front()] + k].bone);
                }
                named = true;
            }
            add_block(part, first_bone, influences, false);
        }
    }

    void add_own_bones(std::span<const std::uint32_t> vertices) {
        const std::size_t influences = count(vertices.back());
        const auto first_bone = static_cast<std::uint32_t>(mesh_.bones.size());
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::uint32_t vertex = vertices[std::min(lane, vertices.size() - 1)];
            for (std::size_t k = 0; k < influences; ++k) {
                mesh_.bones.push_back(influences_[offsets_[vertex] + std::min(k, count(vertex) - 1)].bone);
            }
        }
        add_block(vertices, first_bone, influences, true);
    }

    void add_block(std::span<const std::uint32_t> vertices, std::uint32_t first_bone, std::size_t influences,
                   bool own_bones) {
        Lanes<std::int32_t> numbers;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            numbers.lane[lane] = static_cast<std::int32_t>(vertices[std::min(lane, vertices.size() - 1)]);
        }
        // Vertices ascend within a set, and within a number of influences.
        const bool consecutive =
            !own_bones && vertices.size() == kLanes && vertices.back() - vertices.front() == kLanes - 1;
        const std::size_t runs = consecutive ? 0 : add_runs(vertices);
        const auto output =
            consecutive ? vertices.front() : static_cast<std::uint32_t>(mesh_.runs.size() - runs);
        mesh_.blocks.push_back({weight_count_, first_bone, static_cast<std::uint32_t>(influences), output,
                                static_cast<std::uint8_t>(vertices.size()), static_cast<std::uint8_t>(runs),
                                own_bones, consecutive});
        mesh_.vertices.push_back(numbers);
        weight_count_ += static_cast<std::uint32_t>(own_bones ? influences : weights_kept(influences));
    }

    static std::size_t weights_kept(std::size_t influences) {
        return influences - std::min<std::size_t>(influences, 1);
    }

    /// Adds the runs of a block. Returns their number, or 0 if there are too many.
    std::size_t add_runs(std::span<const std::uint32_t> vertices) {
        const std::size_t before = mesh_.runs.size();
        for (std::size_t begin = 0, end = 0; begin < vertices.size(); begin = end) {
            end = begin + 1;
            while (end < vertices.size() && vertices[end] == vertices[begin] + (end - begin)) ++end;
            if (mesh_.runs.size() - before == kMaxRuns) {
                mesh_.runs.resize(before);
                return 0;
            }
            const std::uint64_t bits = (std::uint64_t{1} << 3 * end) - (std::uint64_t{1} << 3 * begin);
            mesh_.runs.push_back(
                {static_cast<std::int32_t>(vertices[begin]) - static_cast<std::int32_t>(begin),
                 {static_cast<std::uint16_t>(bits), static_cast<std::uint16_t>(bits >> 16),
                  static_cast<std::uint16_t>(bits >> 32)}});
        }
        return mesh_.runs.size() - before;
    }

    void fill(std::span<const Vec3<float>> rest_points) {
        mesh_.rest_points.resize(kPointRows * mesh_.blocks.size());
        mesh_.weights.resize(weight_count_ + 1);
        mesh_.first_weights.resize(mesh_.blocks.size());
        pack_points(mesh_, rest_points, mesh_.rest_points);
        for (std::size_t b = 0; b < mesh_.blocks.size(); ++b) {
            const Block& block = mesh_.blocks[b];
            Lanes<float>* const weights = &mesh_.weights[block.first_weight];
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const auto vertex = static_cast<std::uint32_t>(mesh_.vertices[b].lane[lane]);
                const std::size_t first = offsets_[vertex];
                const std::size_t end = offsets_[vertex + 1];
                if (first == end) continue;
                Lanes<float>* row = weights;
                (block.own_bones ? *row++ : mesh_.first_weights[b]).lane[lane] = influences_[first].weight;
                for (std::size_t i = first + 1; i < end; ++i) (row++)->lane[lane] = influences_[i].weight;
            }
        }
    }

    /// Collects the bones that are used, and replaces bone numbers by indices into them, so that a frame's memory
    /// does not grow with the highest number.
    void number_used_bones(std::span<const std::int32_t> more_bones) {
        std::int32_t highest = -1;
        for (const auto& bones : {std::span<const std::int32_t>(mesh_.bones), more_bones}) {
            for (const std::int32_t bone : bones) highest = std::max(highest, bone);
        }
        std::vector<std::int32_t> index_of_bone(static_cast<std::size_t>(highest + 1));
        for (const std::int32_t bone : mesh_.bones) index_of_bone[static_cast<std::size_t>(bone)] = 1;
        for (const std::int32_t bone : more_bones) index_of_bone[static_cast<std::size_t>(bone)] = 1;
        std::int32_t count = 0;
        for (std::int32_t bone = 0; bone <= highest; ++bone) {
            std::int32_t& index = index_of_bone[static_cast<std::size_t>(bone)];
            if (index == 0) continue;
            index = count++;
            mesh_.used_bones.push_back(bone);
        }
        for (std::int32_t& bone : mesh_.bones) bone = index_of_bone[static_cast<std::size_t>(bone)];
    }

    /// Fills PackedMesh::pairs. Takes linear time, as a mesh may have as many sets of bones as vertices.
    void list_bone_pairs() {
        std::unordered_set<std::uint64_t> pairs;
        const Block* before = nullptr;
        for (const Block& block : mesh_.blocks) {
            if (block.influences == 0) continue;
            const bool is_as_before = before != nullptr && block.first_bone == before->first_bone;
            before = &block;
            if (is_as_before) continue;
            const std::size_t sets = block.own_bones ? block.vertices : 1;
            for (std::size_t i = 0; i < sets; ++i) {
                const auto bones =
                    std::span(mesh_.bones).subspan(block.first_bone + i * block.influences, block.influences);
                for (const std::int32_t later : bones) {
                    if (later == bones[0]) continue;
                    pairs.insert(static_cast<std::uint64_t>(bones[0]) << 32 |
                                 static_cast<std::uint32_t>(later));
                }
            }
        }
        for (const std::uint64_t pair : pairs) {
            mesh_.pairs.first.push_back(static_cast<std::int32_t>(pair >> 32));
            mesh_.pairs.later.push_back(static_cast<std::int32_t>(pair));
        }
        while (mesh_.pairs.first.size() % kLanes != 0) {
            mesh_.pairs.first.push_back(0);
            mesh_.pairs.later.push_back(0);
        }
    }

    std::span<const std::uint32_t> offsets_;
    std::span<const Influence<float>> influences_;
    PackedMesh mesh_;
    std::uint32_t weight_count_ = 0;
};

}  // namespace

PackedMesh pack(std::span<const Vec3<float>> rest_points, std::span<const std::uint32_t> offsets,
                std::span<const Influence<float>> influences, std::span<const std::int32_t> more_bones) {
    return Packer(offsets, influences).run(rest_points, more_bones);
}

BoneSets find_bone_sets(const PackedMesh& mesh) {
    BoneSets sets;
    sets.entries.resize(mesh.bones.size());
    std::map<std::vector<std::int32_t>, std::size_t> known;
    // Adds the set of the `count` bones from `first` on, and its entries, which are `length` in all with padding.
    const auto add = [&](std::size_t first, std::size_t count, std::size_t length) {
        const auto bones = std::span(mesh.bones).subspan(first, count);
        const auto [set, is_new] = known.try_emplace({bones.begin(), bones.end()}, known.size());
        if (is_new) {
            sets.bones.insert(sets.bones.end(), bones.begin(), bones.end());
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

void pack_points(const PackedMesh& mesh, std::span<const Vec3<float>> rest_points,
                 std::span<Lanes<float>> packed) noexcept {
    for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
        Lanes<float>* const xyz = &packed[kPointRows * b];
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Vec3<float>& point = rest_points[static_cast<std::size_t>(mesh.vertices[b].lane[lane])];
            xyz[0].lane[lane] = point.x;
            xyz[1].lane[lane] = point.y;
            xyz[2].lane[lane] = point.z;
        }
    }
}

Status set_own_points(const PackedMesh& mesh, std::span<const Vec3<float>> rest_points,
                      std::vector<Lanes<float>>& packed) noexcept {
    try {
        packed.resize(kPointRows * mesh.blocks.size());
    } catch (const std::bad_alloc&) {
        return Status::memory;
    }
    pack_points(mesh, rest_points, packed);
    return Status::ok;
}

UnpackedMesh unpack(const PackedMesh& mesh, std::span<const Lanes<float>> rest_points, std::size_t vertices) {
    UnpackedMesh result;
    result.rest_points.resize(vertices);
    result.offsets.assign(vertices + 1, 0);
    // Calls call(vertex, influence) for each influence of each vertex.
    const auto for_each_influence = [&](const auto& call) {
        for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
            const Lanes<float>* const xyz = &rest_points[kPointRows * b];
            for (std::size_t lane = 0; lane < mesh.blocks[b].vertices; ++lane) {
                const auto vertex = static_cast<std::size_t>(mesh.vertices[b].lane[lane]);
                result.rest_points[vertex] = {xyz[0].lane[lane], xyz[1].lane[lane], xyz[2].lane[lane]};
                for (std::size_t k = 0; k < mesh.blocks[b].influences; ++k) {
                    const auto [bone, weight] = influence_at(mesh, b, lane, k);
                    if (weight == 0.0f) continue;
                    call(vertex, Influence<float>{mesh.used_bones[static_cast<std::size_t>(bone)], weight});
                }
            }
        }
    };
    for_each_influence([&](std::size_t vertex, const Influence<float>&) { ++result.offsets[vertex + 1]; });
    std::partial_sum(result.offsets.begin(), result.offsets.end(), result.offsets.begin());
    result.influences.resize(result.offsets.back());
    std::vector<std::uint32_t> next(result.offsets.begin(), result.offsets.end() - 1);
    for_each_influence([&](std::size_t vertex, const Influence<float>& influence) {
        result.influences[next[vertex]++] = influence;
    });
    return result;
}

std::vector<float> unpack_values(const PackedMesh& mesh, std::span<const Lanes<float>> packed,
                                 std::size_t vertices, std::size_t count) {
    std::vector<float> values(vertices * count);
    for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
        for (std::size_t lane = 0; lane < mesh.blocks[b].vertices; ++lane) {
            const auto vertex = static_cast<std::size_t>(mesh.vertices[b].lane[lane]);
            for (std::size_t i = 0; i < count; ++i) {
                values[vertex * count + i] = packed[b * count + i].lane[lane];
            }
        }
    }
    return values;
}

std::vector<Lanes<float>> pack_values(const PackedMesh& mesh, std::span<const float> values,
                                      std::size_t count) {
    std::vector<Lanes<float>> packed(mesh.blocks.size() * count);
    for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const auto vertex = static_cast<std::size_t>(mesh.vertices[b].lane[lane]);
            for (std::size_t i = 0; i < count; ++i)
                packed[count * b + i].lane[lane] = values[count * vertex + i];
        }
    }
    return packed;
}

std::vector<Lanes<float>> pack_weights(const PackedMesh& mesh, std::span<const float> weights) {
    if (weights.empty()) return {};
    std::vector<Lanes<float>> packed = pack_values(mesh, weights);
    for (Lanes<float>& block : packed) {
        for (float& weight : block.lane) weight = std::clamp(weight, 0.0f, 1.0f);
    }
    return packed;
}

}  // namespace sinew
