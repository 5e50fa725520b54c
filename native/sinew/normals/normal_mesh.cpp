// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/normals/normal_mesh.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "sinew/mesh/topology.h"

namespace sinew {
namespace {

// Faces are grouped by their number of corners within batches of this size: many enough to fill blocks, few
// enough to stay close in memory.
constexpr std::size_t kFacesTogether = 2048;

/// The index in Float4 of the normal in the slot that has the angle `source`.
std::int32_t normal_of(std::uint32_t source) { return static_cast<std::int32_t>(source / 8 * 2); }

class FaceBlocks {
public:
    FaceBlocks(const MeshTopology& topology, std::size_t vertex_count, NormalMesh& mesh)
        : topology_(topology), last_vertex_(static_cast<std::int32_t>(vertex_count) - 1), mesh_(mesh) {}

    /// Makes the blocks. Returns the index of each corner's angle.
    std::vector<std::uint32_t> make() {
        const std::size_t face_count = topology_.face_offsets.size() - 1;
        mesh_.face_sources.resize(face_count);
        sources_.resize(topology_.corner_vertices.size());
        std::vector<std::uint32_t> faces(face_count);
        std::iota(faces.begin(), faces.end(), 0u);
        for (std::size_t begin = 0; begin < face_count; begin += kFacesTogether) {
            const auto together =
                std::span(faces).subspan(begin, std::min(kFacesTogether, face_count - begin));
            std::ranges::stable_sort(together, {}, [this](std::uint32_t face) { return corners(face); });
            for (std::size_t i = 0; i < together.size();) {
                const std::size_t most = corners(together[i]) > NormalMesh::kMaxBlockCorners ? 1 : kLanes;
                std::size_t end = i + 1;
                while (end < together.size() && end < i + most &&
                       corners(together[end]) == corners(together[i]))
                    ++end;
                add(together.subspan(i, end - i), most);
                i = end;
            }
        }
        return std::move(sources_);
    }

private:
    [[nodiscard]] std::size_t corners(std::uint32_t face) const {
        return index(topology_.face_offsets[face + 1]) - index(topology_.face_offsets[face]);
    }

    void add(std::span<const std::uint32_t> faces, std::size_t lanes) {
        const std::size_t count = corners(faces.front());
        FaceBlock block{mesh_.corner_vertices.size(), static_cast<std::uint32_t>(mesh_.slot_count),
                        static_cast<std::uint32_t>(count), static_cast<std::uint8_t>(lanes), false};
        for (std::size_t k = 0; k < count; ++k) {
            for (std::size_t lane = 0; lane < lanes; ++lane) {
                const std::uint32_t face = faces[std::min(lane, faces.size() - 1)];
                const std::size_t corner = index(topology_.face_offsets[face]) + k;
                mesh_.corner_vertices.push_back(topology_.corner_vertices[corner]);
                block.reads_last_point |= topology_.corner_vertices[corner] == last_vertex_;
                if (lane >= faces.size()) continue;
                const std::size_t slot = mesh_.slot_count + k / 4 * lanes + lane;
                sources_[corner] = static_cast<std::uint32_t>(8 * slot + 4 + k % 4);
            }
        }
        for (std::size_t lane = 0; lane < faces.size(); ++lane) {
            mesh_.face_sources[faces[lane]] = static_cast<std::int32_t>(2 * (mesh_.slot_count + lane));
        }
        mesh_.slot_count += std::max<std::size_t>(1, (count + 3) / 4) * lanes;
        mesh_.blocks.push_back(block);
    }

    const MeshTopology& topology_;
    std::int32_t last_vertex_;
    NormalMesh& mesh_;
    std::vector<std::uint32_t> sources_;
};

CornerGroups groups_of_vertices(const ByVertex& corners, const std::vector<std::uint32_t>& sources) {
    CornerGroups groups;
    groups.offsets.assign(corners.offsets.begin(), corners.offsets.end());
    for (const std::int32_t corner : corners.items) groups.sources.push_back(sources[index(corner)]);
    return groups;
}

/// The first two corners whose edge this is, and how many there are.
struct EdgeUse {
    std::int32_t first = -1;
    std::int32_t second = -1;
    std::int32_t count = 0;
    bool is_flat = false;
};

/// The walk around a vertex from corner to corner, across smooth edges.
struct Walks {
    // [corners] the corner across the preceding edge; -1 if that edge is not smooth
    std::vector<std::int32_t> next;
    // [corners] whether some corner leads to it, which means that its following edge is smooth
    std::vector<std::uint8_t> is_reached;
};

Walks walks_of(const MeshTopology& topology, const Sharpness& sharpness, const CornerNeighbours& around,
               const ByVertex& edge_ends) {
    const std::size_t corner_count = topology.corner_vertices.size();
    const std::vector<std::int32_t> edges = edges_of_corners(topology, around, edge_ends);
    std::vector<EdgeUse> uses(topology.edges.size() / 2);
    for (std::size_t face = 0; face + 1 < topology.face_offsets.size(); ++face) {
        for (auto corner = topology.face_offsets[face]; corner < topology.face_offsets[face + 1]; ++corner) {
            EdgeUse& use = uses[index(edges[index(corner)])];
            (use.count++ == 0 ? use.first : use.second) = corner;
            use.is_flat |= !sharpness.faces.empty() && sharpness.faces[face] != 0;
        }
    }
    Walks walks{std::vector<std::int32_t>(corner_count, -1), std::vector<std::uint8_t>(corner_count)};
    for (std::size_t edge = 0; edge < uses.size(); ++edge) {
        const auto [a, b, count, is_flat] = uses[edge];
        const bool is_sharp = is_flat || (!sharpness.edges.empty() && sharpness.edges[edge] != 0);
        if (is_sharp || count != 2) continue;
        // Both traverse the edge from the same end: one of the faces is flipped.
        if (topology.corner_vertices[index(a)] == topology.corner_vertices[index(b)]) continue;
        walks.next[index(around.next[index(a)])] = b;
        walks.next[index(around.next[index(b)])] = a;
        walks.is_reached[index(a)] = walks.is_reached[index(b)] = 1;
    }
    return walks;
}

/// Makes fans, grouped by their vertices.
class FanMaker {
public:
    FanMaker(const MeshTopology& topology, std::size_t vertex_count, const Sharpness& sharpness,
             const ByVertex& corners, const std::vector<std::uint32_t>& sources, NormalMesh& mesh)
        : topology_(topology),
          sharpness_(sharpness),
          corners_(corners),
          sources_(sources),
          around_(corners_around(topology)),
          last_vertex_(static_cast<std::int32_t>(vertex_count) - 1),
          walks_(walks_of(topology, sharpness, around_, by_vertex(topology.edges, vertex_count))),
          mesh_(mesh) {}

    void make() {
        std::vector<std::uint8_t> is_seen(sources_.size());
        mesh_.corner_sources.resize(sources_.size());
        const auto add_from = [&](std::int32_t corner) {
            fan_.clear();
            for (; corner >= 0 && is_seen[index(corner)] == 0; corner = walks_.next[index(corner)]) {
                is_seen[index(corner)] = 1;
                fan_.push_back(corner);
            }
            if (!fan_.empty()) add();
        };
        for (std::size_t vertex = 0; vertex + 1 < corners_.offsets.size(); ++vertex) {
            for (const std::int32_t corner : corners_.of(vertex)) {
                if (walks_.is_reached[index(corner)] == 0) add_from(corner);
            }
            for (const std::int32_t corner : corners_.of(vertex)) add_from(corner);
        }
        if (!sharpness_.custom.empty()) customise();
    }

private:
    static constexpr std::uint32_t kNoBlock = std::numeric_limits<std::uint32_t>::max();

    /// What customise() needs to know about a fan.
    struct Custom {
        std::size_t first_corner;  // into walked_
        std::uint32_t corners;
        std::uint32_t edges;
    };

    void add() {
        std::int32_t source = normal_of(sources_[index(fan_.front())]);
        if (fan_.size() > 1) {
            source = static_cast<std::int32_t>(mesh_.first_of_groups() + mesh_.fans.size());
            for (const std::int32_t corner : fan_) mesh_.fans.sources.push_back(sources_[index(corner)]);
            mesh_.fans.offsets.push_back(static_cast<std::uint32_t>(mesh_.fans.sources.size()));
        }
        for (const std::int32_t corner : fan_) mesh_.corner_sources[index(corner)] = source;
        if (sharpness_.custom.empty()) return;
        const auto count = static_cast<std::uint32_t>(fan_.size());
        const bool is_round = following(fan_.front()) == preceding(fan_.back());
        customs_.push_back({walked_.size(), count, count + (is_round ? 0 : 1)});
        walked_.insert(walked_.end(), fan_.begin(), fan_.end());
    }

    /// The vertex at the other end of a corner's following edge.
    [[nodiscard]] std::int32_t following(std::int32_t corner) const {
        return topology_.corner_vertices[index(around_.next[index(corner)])];
    }
    [[nodiscard]] std::int32_t preceding(std::int32_t corner) const {
        return topology_.corner_vertices[index(around_.previous[index(corner)])];
    }

    /// Removes from customs_ those fans that are computed along with faces.
    void add_lone_fans() {
        std::vector<std::uint32_t> block_of_slot(mesh_.slot_count, kNoBlock);
        for (std::size_t b = 0; b < mesh_.blocks.size(); ++b) {
            const FaceBlock& block = mesh_.blocks[b];
            // Other blocks are computed for any number of corners, with one lane or one point at a time.
            if (block.lanes != kLanes || block.reads_last_point || block.corners < 3 || block.corners > 4)
                continue;
            std::fill_n(block_of_slot.begin() + block.first_slot, kLanes, static_cast<std::uint32_t>(b));
        }
        const auto source_of = [this](const Custom& fan) {
            return sources_[index(walked_[fan.first_corner])];
        };
        const auto block_of = [&](const Custom& fan) {
            return fan.corners == 1 && fan.edges == 2 ? block_of_slot[source_of(fan) / 8] : kNoBlock;
        };
        std::vector<std::uint32_t> counts(mesh_.blocks.size());
        for (const Custom& fan : customs_) {
            if (const std::uint32_t block = block_of(fan); block != kNoBlock) ++counts[block];
        }
        for (std::size_t b = 0; b < mesh_.blocks.size(); ++b) {
            FaceBlock& block = mesh_.blocks[b];
            // Lanes without a fan take as much time as lanes with one.
            if (2 * counts[b] < block.corners * kLanes) continue;
            block.first_lone = static_cast<std::uint32_t>(mesh_.lone_fans.size());
            mesh_.lone_fans.resize(mesh_.lone_fans.size() + block.corners);
        }
        std::erase_if(customs_, [&](const Custom& fan) {
            const std::uint32_t b = block_of(fan);
            if (b == kNoBlock || mesh_.blocks[b].first_lone == FaceBlock::kNoLoneFans) return false;
            const std::size_t corner = index(walked_[fan.first_corner]);
            const std::size_t lane = source_of(fan) / 8 - mesh_.blocks[b].first_slot;
            const std::size_t row = mesh_.blocks[b].first_lone + source_of(fan) % 4;
            mesh_.lone_fans[row].tilt.lane[lane] = part(sharpness_.custom[2 * corner]);
            mesh_.lone_fans[row].spin.lane[lane] = part(sharpness_.custom[2 * corner + 1]);
            mesh_.corner_sources[corner] =
                static_cast<std::int32_t>(mesh_.first_of_lone_fans() + kLanes * row + lane);
            return true;
        });
    }

    void customise() {
        add_lone_fans();
        for (std::size_t begin = 0; begin < customs_.size(); begin += kFacesTogether) {
            const auto together =
                std::span(customs_).subspan(begin, std::min(kFacesTogether, customs_.size() - begin));
            std::ranges::stable_sort(together, {}, &Custom::edges);
            for (std::size_t i = 0; i < together.size();) {
                std::size_t end = i + 1;
                while (end < together.size() && end < i + kLanes && together[end].edges == together[i].edges)
                    ++end;
                add_block(together.subspan(i, end - i));
                i = end;
            }
        }
    }

    void add_block(std::span<const Custom> fans) {
        const std::size_t first_vertex = mesh_.fan_vertices.size();
        const std::size_t first_normal = mesh_.first_of_blocks() + kLanes * mesh_.fan_blocks.size();
        FanBlock& block =
            mesh_.fan_blocks.emplace_back(FanBlock{first_vertex, fans.front().edges, false, {}, {}, {}});
        mesh_.fan_vertices.resize(first_vertex + (2 + block.edges) * kLanes);
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Custom& fan = fans[std::min(lane, fans.size() - 1)];
            const auto corners =
                std::span<const std::int32_t>(walked_).subspan(fan.first_corner, fan.corners);
            std::int32_t* const vertices = mesh_.fan_vertices.data() + first_vertex + lane;
            vertices[0] = topology_.corner_vertices[index(corners.front())];
            vertices[kLanes] = preceding(corners.back());
            // In a fan that is not closed, the last edge is not the following edge of any corner.
            vertices[(1 + block.edges) * kLanes] = vertices[kLanes];
            std::int64_t tilt = 0, spin = 0;
            for (std::size_t k = 0; k < corners.size(); ++k) {
                vertices[(2 + k) * kLanes] = following(corners[k]);
                tilt += sharpness_.custom[2 * index(corners[k])];
                spin += sharpness_.custom[2 * index(corners[k]) + 1];
            }
            block.normals.lane[lane] = mesh_.corner_sources[index(corners.front())];
            block.tilt.lane[lane] = part(tilt / static_cast<std::int64_t>(corners.size()));
            block.spin.lane[lane] = part(spin / static_cast<std::int64_t>(corners.size()));
        }
        const auto vertices = std::span<const std::int32_t>(mesh_.fan_vertices).subspan(first_vertex);
        block.reads_last_point = std::ranges::find(vertices, last_vertex_) != vertices.end();
        for (std::size_t lane = 0; lane < fans.size(); ++lane) {
            for (std::size_t k = 0; k < fans[lane].corners; ++k) {
                mesh_.corner_sources[index(walked_[fans[lane].first_corner + k])] =
                    static_cast<std::int32_t>(first_normal + lane);
            }
        }
    }

    static float part(std::int64_t value) { return std::max(static_cast<float>(value) / 32767.0f, -1.0f); }

    const MeshTopology& topology_;
    const Sharpness& sharpness_;
    const ByVertex& corners_;
    const std::vector<std::uint32_t>& sources_;
    CornerNeighbours around_;
    std::int32_t last_vertex_;
    Walks walks_;
    NormalMesh& mesh_;
    std::vector<std::int32_t> fan_;     // in the order of the walk
    std::vector<std::int32_t> walked_;  // the corners of all fans
    std::vector<Custom> customs_;
};

}  // namespace

NormalMesh make_normal_mesh(const MeshTopology& topology, std::size_t vertex_count,
                            const Sharpness& sharpness, NormalDomain domain) {
    NormalMesh mesh;
    const std::vector<std::uint32_t> sources = FaceBlocks(topology, vertex_count, mesh).make();
    const ByVertex corners = by_vertex(topology.corner_vertices, vertex_count);
    mesh.vertices = groups_of_vertices(corners, sources);
    if (domain == NormalDomain::corner) {
        FanMaker(topology, vertex_count, sharpness, corners, sources, mesh).make();
    } else if (domain == NormalDomain::face) {
        for (const std::uint32_t source : sources) {
            mesh.corner_sources.push_back(normal_of(source));
        }
    }
    return mesh;
}

}  // namespace sinew
