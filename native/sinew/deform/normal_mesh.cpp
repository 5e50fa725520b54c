// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/normal_mesh.h"

#include <algorithm>
#include <numeric>

#include "sinew/deform/topology.h"

namespace sinew {
namespace {

// Faces that are grouped by their corners: so many that blocks are full, so few that they are near each other.
constexpr std::size_t kFacesTogether = 2048;

class FaceBlocks {
public:
    FaceBlocks(const MeshTopology& topology, std::size_t vertex_count, NormalMesh& mesh)
        : topology_(topology), last_vertex_(static_cast<std::int32_t>(vertex_count) - 1), mesh_(mesh) {}

    /// Returns the index of each corner's angle.
    std::vector<std::uint32_t> make() {
        const std::size_t face_count = topology_.face_offsets.size() - 1;
        mesh_.face_slots.resize(face_count);
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
                sources_[corner] = static_cast<std::uint32_t>(4 * slot + k % 4);
            }
        }
        for (std::size_t lane = 0; lane < faces.size(); ++lane) {
            mesh_.face_slots[faces[lane]] = static_cast<std::int32_t>(mesh_.slot_count + lane);
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

/// Fans of corners, joined two by two.
class Fans {
public:
    explicit Fans(std::size_t corners) : parents_(corners) {
        std::iota(parents_.begin(), parents_.end(), std::int32_t{0});
    }

    /// The first corner of the fan that `corner` is in.
    std::int32_t first(std::int32_t corner) {
        while (parents_[index(corner)] != corner) {
            std::int32_t& parent = parents_[index(corner)];
            corner = parent = parents_[index(parent)];
        }
        return corner;
    }

    void join(std::int32_t a, std::int32_t b) {
        a = first(a);
        b = first(b);
        parents_[index(std::max(a, b))] = std::min(a, b);
    }

private:
    std::vector<std::int32_t> parents_;
};

/// The two corners that go along an edge, and how many do.
struct EdgeUse {
    std::int32_t first = -1;
    std::int32_t second = -1;
    std::int32_t count = 0;
    bool is_flat = false;
};

Fans fans_of(const MeshTopology& topology, const Sharpness& sharpness, const ByVertex& edge_ends) {
    const CornerNeighbours around = corners_around(topology);
    const std::vector<std::int32_t> edges = edges_of_corners(topology, around, edge_ends);
    std::vector<EdgeUse> uses(topology.edges.size() / 2);
    for (std::size_t face = 0; face + 1 < topology.face_offsets.size(); ++face) {
        for (auto corner = topology.face_offsets[face]; corner < topology.face_offsets[face + 1]; ++corner) {
            EdgeUse& use = uses[index(edges[index(corner)])];
            (use.count++ == 0 ? use.first : use.second) = corner;
            use.is_flat |= !sharpness.faces.empty() && sharpness.faces[face] != 0;
        }
    }
    Fans fans(topology.corner_vertices.size());
    for (std::size_t edge = 0; edge < uses.size(); ++edge) {
        const EdgeUse& use = uses[edge];
        const bool is_sharp = use.is_flat || (!sharpness.edges.empty() && sharpness.edges[edge] != 0);
        if (is_sharp || use.count != 2) continue;
        // Both from the same end: one of the faces is the wrong way round.
        if (topology.corner_vertices[index(use.first)] == topology.corner_vertices[index(use.second)])
            continue;
        fans.join(use.first, around.next[index(use.second)]);
        fans.join(around.next[index(use.first)], use.second);
    }
    return fans;
}

void add_fans(Fans fans, const ByVertex& corners, const std::vector<std::uint32_t>& sources,
              NormalMesh& mesh) {
    const std::size_t corner_count = sources.size();
    std::vector<std::uint32_t> sizes(corner_count);
    for (std::size_t corner = 0; corner < corner_count; ++corner) {
        ++sizes[index(fans.first(static_cast<std::int32_t>(corner)))];
    }
    // Numbered by vertex, so that what is added up together is near each other.
    std::vector<std::uint32_t> numbers(corner_count);
    for (const std::int32_t corner : corners.items) {
        if (fans.first(corner) != corner || sizes[index(corner)] < 2) continue;
        numbers[index(corner)] = static_cast<std::uint32_t>(mesh.fans.size());
        mesh.fans.offsets.push_back(mesh.fans.offsets.back() + sizes[index(corner)]);
    }
    mesh.fans.sources.resize(mesh.fans.offsets.back());
    mesh.corner_sources.resize(corner_count);
    std::vector<std::uint32_t> next(mesh.fans.offsets);
    for (std::size_t corner = 0; corner < corner_count; ++corner) {
        const std::size_t first = index(fans.first(static_cast<std::int32_t>(corner)));
        if (sizes[first] < 2) {
            mesh.corner_sources[corner] = static_cast<std::int32_t>(sources[corner] / 4);
            continue;
        }
        mesh.corner_sources[corner] = static_cast<std::int32_t>(mesh.slot_count + numbers[first]);
        mesh.fans.sources[next[numbers[first]]++] = sources[corner];
    }
}

}  // namespace

NormalMesh make_normal_mesh(const MeshTopology& topology, std::size_t vertex_count,
                            const Sharpness& sharpness, NormalDomain domain) {
    NormalMesh mesh;
    const std::vector<std::uint32_t> sources = FaceBlocks(topology, vertex_count, mesh).make();
    const ByVertex corners = by_vertex(topology.corner_vertices, vertex_count);
    mesh.vertices = groups_of_vertices(corners, sources);
    if (domain == NormalDomain::corner) {
        add_fans(fans_of(topology, sharpness, by_vertex(topology.edges, vertex_count)), corners, sources,
                 mesh);
    } else if (domain == NormalDomain::face) {
        for (const std::uint32_t source : sources) {
            mesh.corner_sources.push_back(static_cast<std::int32_t>(source / 4));
        }
    }
    return mesh;
}

}  // namespace sinew
