// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/mush_mesh.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "sinew/deform/topology.h"

namespace sinew {
namespace {

// A run costs about as much as some vertices.
constexpr std::size_t kFewestConsecutive = 8;

/// Vertices breadth-first, each part of the mesh from its first vertex on, so that neighbours are near each other.
std::vector<std::uint32_t> breadth_first(const ByVertex& neighbours, std::size_t count) {
    std::vector<std::uint32_t> order;
    order.reserve(count);
    std::vector<std::uint8_t> seen(count);
    for (std::size_t first = 0; first < count; ++first) {
        if (seen[first] != 0) continue;
        seen[first] = 1;
        order.push_back(static_cast<std::uint32_t>(first));
        for (std::size_t at = order.size() - 1; at < order.size(); ++at) {
            for (const std::int32_t neighbour : neighbours.of(order[at])) {
                if (seen[index(neighbour)] != 0) continue;
                seen[index(neighbour)] = 1;
                order.push_back(static_cast<std::uint32_t>(neighbour));
            }
        }
    }
    return order;
}

/// How many faces each edge has. Throws where an edge of a face is not among the edges.
std::vector<std::uint32_t> faces_of_edges(const MeshTopology& topology, const CornerNeighbours& around,
                                          const ByVertex& edge_ends) {
    std::vector<std::uint32_t> faces(topology.edges.size() / 2);
    for (const std::int32_t edge : edges_of_corners(topology, around, edge_ends)) ++faces[index(edge)];
    return faces;
}

class Maker {
public:
    Maker(const MeshTopology& topology, std::size_t vertex_count)
        : topology_(topology),
          around_(corners_around(topology)),
          edge_ends_(by_vertex(topology.edges, vertex_count)),
          neighbours_{edge_ends_.offsets, {}},
          corners_(by_vertex(topology.corner_vertices, vertex_count)) {
        for (const std::int32_t end : edge_ends_.items) {
            neighbours_.items.push_back(topology.edges[index(end) ^ 1]);
        }
        mesh_.vertices = breadth_first(neighbours_, vertex_count);
        for (std::size_t begin = 0; begin < vertex_count; begin += MushMesh::kChunk) {
            const auto first = mesh_.vertices.begin() + static_cast<std::ptrdiff_t>(begin);
            const auto kind = [this](std::uint32_t v) {
                return std::tuple(neighbours_.of(v).size(), corners_.of(v).size());
            };
            std::ranges::stable_sort(
                first, first + static_cast<std::ptrdiff_t>(std::min(MushMesh::kChunk, vertex_count - begin)),
                {}, kind);
        }
        place_.resize(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) {
            place_[mesh_.vertices[i]] = static_cast<std::int32_t>(i);
        }
    }

    MushMesh make() {
        mark_boundary();
        sort_neighbours();
        mesh_.first_runs.push_back(0);
        mesh_.first_blocks.push_back(0);
        for (std::size_t begin = 0; begin < mesh_.vertices.size(); begin += MushMesh::kChunk) {
            const std::size_t end = std::min(begin + MushMesh::kChunk, mesh_.vertices.size());
            add_runs(begin, end);
            add_blocks(begin, end);
            mesh_.first_runs.push_back(static_cast<std::uint32_t>(mesh_.runs.size()));
            mesh_.first_blocks.push_back(static_cast<std::uint32_t>(mesh_.blocks.size()));
        }
        return std::move(mesh_);
    }

private:
    [[nodiscard]] std::size_t valence(std::size_t i) const {
        return neighbours_.of(mesh_.vertices[i]).size();
    }
    [[nodiscard]] std::span<const std::int32_t> corners(std::size_t i) const {
        return corners_.of(mesh_.vertices[i]);
    }

    void mark_boundary() {
        mesh_.on_boundary.resize(mesh_.vertices.size());
        const auto faces = faces_of_edges(topology_, around_, edge_ends_);
        for (std::size_t end = 0; end < topology_.edges.size(); ++end) {
            if (faces[end / 2] == 1) mesh_.on_boundary[index(place_[index(topology_.edges[end])])] = 1;
        }
    }

    /// Those of a vertex, in the order of the mesh.
    [[nodiscard]] std::span<const std::int32_t> neighbours(std::size_t i) const {
        return std::span(sorted_).subspan(first_sorted_[i], valence(i));
    }

    void sort_neighbours() {
        for (const std::uint32_t vertex : mesh_.vertices) {
            first_sorted_.push_back(sorted_.size());
            for (const std::int32_t neighbour : neighbours_.of(vertex)) {
                sorted_.push_back(place_[index(neighbour)]);
            }
            std::sort(sorted_.begin() + static_cast<std::ptrdiff_t>(first_sorted_.back()), sorted_.end());
        }
    }

    /// How many vertices from `i` on have their neighbours one place behind those of the one before.
    [[nodiscard]] std::size_t count_consecutive(std::size_t i, std::size_t end) const {
        std::size_t after = i + 1;
        while (after < end && std::ranges::equal(neighbours(after - 1), neighbours(after),
                                                 [](std::int32_t a, std::int32_t b) { return a + 1 == b; })) {
            ++after;
        }
        return after - i;
    }

    void add_runs(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end;) {
            const std::size_t count = count_consecutive(i, end);
            const bool is_consecutive = count >= kFewestConsecutive;
            if (i == begin || is_consecutive || mesh_.runs.back().is_consecutive ||
                valence(i) != mesh_.runs.back().valence) {
                mesh_.runs.push_back({static_cast<std::uint32_t>(i), 0,
                                      static_cast<std::uint32_t>(valence(i)), is_consecutive,
                                      mesh_.neighbours.size()});
            }
            for (std::size_t v = i; v < (is_consecutive ? i + 1 : i + count); ++v) {
                const auto of_vertex = neighbours(v);
                mesh_.neighbours.insert(mesh_.neighbours.end(), of_vertex.begin(), of_vertex.end());
            }
            i += count;
            mesh_.runs.back().end = static_cast<std::uint32_t>(i);
        }
    }

    /// The two other vertices of each of a vertex's corners, in an order that is alike for vertices side by side.
    [[nodiscard]] std::vector<std::pair<std::int32_t, std::int32_t>> corner_ends(std::size_t i) const {
        std::vector<std::pair<std::int32_t, std::int32_t>> ends;
        for (const std::int32_t corner : corners(i)) {
            ends.emplace_back(place_of(around_.previous[index(corner)]),
                              place_of(around_.next[index(corner)]));
        }
        std::ranges::sort(ends);
        return ends;
    }

    void add_blocks(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end;) {
            std::size_t after = i + 1;
            while (after < end && after < i + kLanes && corners(after).size() == corners(i).size()) ++after;
            add_block(i, after);
            i = after;
        }
    }

    void add_block(std::size_t begin, std::size_t end) {
        const std::size_t corner_count = corners(begin).size();
        std::vector<MushEnds> made(corner_count);
        bool is_consecutive = true;
        for (std::size_t v = begin; v < end; ++v) {
            const auto ends = corner_ends(v);
            for (std::size_t k = 0; k < corner_count; ++k) {
                MushEnds& corner = made[k];
                // Lanes without a vertex repeat the last.
                for (std::size_t lane = v - begin; lane < (v + 1 < end ? v - begin + 1 : kLanes); ++lane) {
                    corner.previous.lane[lane] = ends[k].first;
                    corner.next.lane[lane] = ends[k].second;
                }
                const auto step = static_cast<std::int32_t>(v - begin);
                is_consecutive &= corner.previous.lane[0] + step == ends[k].first &&
                                  corner.next.lane[0] + step == ends[k].second;
            }
        }
        mesh_.blocks.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end - begin),
                                static_cast<std::uint32_t>(corner_count), is_consecutive,
                                is_consecutive ? mesh_.first_ends.size() : mesh_.ends.size(),
                                mesh_.detail_count});
        mesh_.detail_count += corner_count;
        if (!is_consecutive) {
            mesh_.ends.insert(mesh_.ends.end(), made.begin(), made.end());
            return;
        }
        for (const MushEnds& corner : made) {
            mesh_.first_ends.push_back({corner.previous.lane[0], corner.next.lane[0]});
        }
    }

    [[nodiscard]] std::int32_t place_of(std::int32_t corner) const {
        return place_[index(topology_.corner_vertices[index(corner)])];
    }

    const MeshTopology& topology_;
    CornerNeighbours around_;
    ByVertex edge_ends_;  // indices into the edges' vertices
    ByVertex neighbours_;
    ByVertex corners_;
    std::vector<std::int32_t> place_;   // of each vertex in the order of the mesh
    std::vector<std::int32_t> sorted_;  // the places of each vertex's neighbours, rising
    std::vector<std::size_t> first_sorted_;
    MushMesh mesh_;
};

}  // namespace

MushMesh make_mush_mesh(const MeshTopology& topology, std::size_t vertex_count) {
    check(topology, vertex_count, "rest_points", kMaxMushVertices);
    return Maker(topology, vertex_count).make();
}

}  // namespace sinew
