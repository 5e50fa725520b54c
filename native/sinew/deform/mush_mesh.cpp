// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/mush_mesh.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>

#include "sinew/deform/check_bind_data.h"

namespace sinew {
namespace {

constexpr std::size_t kMaxEdgeEnds = 0x7FFFFFFE;

std::size_t index(std::int32_t vertex) { return static_cast<std::size_t>(vertex); }

void check_vertices(const std::string& argument, std::span<const std::int32_t> vertices, std::size_t count) {
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (vertices[i] < 0 || index(vertices[i]) >= count) {
            fail(argument, "vertices from 0 to " + std::to_string(count) + " without the last",
                 std::to_string(vertices[i]) + " at index " + std::to_string(i));
        }
    }
}

void check(const MeshTopology& topology, std::size_t vertex_count) {
    if (vertex_count > kMaxMushVertices) {
        fail("rest_points", "at most " + std::to_string(kMaxMushVertices) + " vertices",
             std::to_string(vertex_count));
    }
    const auto& offsets = topology.face_offsets;
    if (offsets.empty() || offsets.front() != 0 || !std::ranges::is_sorted(offsets) ||
        index(offsets.back()) != topology.corner_vertices.size()) {
        fail("face_offsets",
             "to rise from 0 to the " + std::to_string(topology.corner_vertices.size()) + " corner_vertices",
             offsets.empty() ? "none"
                             : std::to_string(offsets.front()) + " to " + std::to_string(offsets.back()));
    }
    if (topology.edges.size() % 2 != 0 || topology.edges.size() > kMaxEdgeEnds) {
        fail("edges", "two vertices each, at most " + std::to_string(kMaxEdgeEnds) + " of all",
             std::to_string(topology.edges.size()) + " vertices");
    }
    check_vertices("corner_vertices", topology.corner_vertices, vertex_count);
    check_vertices("edges", topology.edges, vertex_count);
}

/// What belongs to each vertex: of vertex v, items [offsets[v], offsets[v + 1]).
struct ByVertex {
    std::vector<std::size_t> offsets;
    std::vector<std::int32_t> items;

    [[nodiscard]] std::span<const std::int32_t> of(std::size_t vertex) const {
        return std::span(items).subspan(offsets[vertex], offsets[vertex + 1] - offsets[vertex]);
    }
};

/// The index of each of `vertices` by the vertex that it names.
ByVertex by_vertex(std::span<const std::int32_t> vertices, std::size_t count) {
    ByVertex result{std::vector<std::size_t>(count + 1), std::vector<std::int32_t>(vertices.size())};
    for (const std::int32_t vertex : vertices) ++result.offsets[index(vertex) + 1];
    std::partial_sum(result.offsets.begin(), result.offsets.end(), result.offsets.begin());
    std::vector<std::size_t> next(result.offsets.begin(), result.offsets.end() - 1);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        result.items[next[index(vertices[i])]++] = static_cast<std::int32_t>(i);
    }
    return result;
}

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

/// For each corner the corner before and the one after it in its face.
struct CornerNeighbours {
    std::vector<std::int32_t> previous;
    std::vector<std::int32_t> next;
};

CornerNeighbours corners_around(const MeshTopology& topology) {
    const std::size_t count = topology.corner_vertices.size();
    CornerNeighbours around{std::vector<std::int32_t>(count), std::vector<std::int32_t>(count)};
    for (std::size_t face = 0; face + 1 < topology.face_offsets.size(); ++face) {
        const std::int32_t begin = topology.face_offsets[face];
        const std::int32_t end = topology.face_offsets[face + 1];
        for (std::int32_t corner = begin; corner < end; ++corner) {
            around.previous[index(corner)] = corner > begin ? corner - 1 : end - 1;
            around.next[index(corner)] = corner + 1 < end ? corner + 1 : begin;
        }
    }
    return around;
}

/// How many faces each edge has. Throws where an edge of a face is not among the edges.
std::vector<std::uint32_t> faces_of_edges(const MeshTopology& topology, const CornerNeighbours& around,
                                          const ByVertex& edge_ends) {
    std::vector<std::uint32_t> faces(topology.edges.size() / 2);
    for (std::size_t corner = 0; corner < topology.corner_vertices.size(); ++corner) {
        const std::int32_t from = topology.corner_vertices[corner];
        const std::int32_t to = topology.corner_vertices[index(around.next[corner])];
        const auto ends = edge_ends.of(index(from));
        const auto leads_there = [&](std::int32_t end) { return topology.edges[index(end) ^ 1] == to; };
        const auto found = std::ranges::find_if(ends, leads_there);
        if (found == ends.end()) {
            fail("edges", "every edge of each face",
                 "none from vertex " + std::to_string(from) + " to " + std::to_string(to));
        }
        ++faces[index(*found) / 2];
    }
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

    void add_runs(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (i == begin || valence(i) != mesh_.runs.back().valence) {
                mesh_.runs.push_back({static_cast<std::uint32_t>(i), 0,
                                      static_cast<std::uint32_t>(valence(i)), mesh_.neighbours.size()});
            }
            mesh_.runs.back().end = static_cast<std::uint32_t>(i + 1);
            for (const std::int32_t neighbour : neighbours_.of(mesh_.vertices[i])) {
                mesh_.neighbours.push_back(place_[index(neighbour)]);
            }
        }
    }

    void add_blocks(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end;) {
            std::size_t after = i + 1;
            while (after < end && after < i + kLanes && corners(after).size() == corners(i).size()) ++after;
            mesh_.blocks.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(after - i),
                                    static_cast<std::uint32_t>(corners(i).size()), mesh_.corners.size()});
            for (std::size_t k = 0; k < corners(i).size(); ++k) {
                MushCorners& made = mesh_.corners.emplace_back();
                for (std::size_t lane = 0; lane < kLanes; ++lane) {
                    // Lanes without a vertex repeat the last.
                    const std::size_t corner = index(corners(std::min(i + lane, after - 1))[k]);
                    made.previous.lane[lane] = first_number(around_.previous[corner]);
                    made.next.lane[lane] = first_number(around_.next[corner]);
                }
            }
            i = after;
        }
    }

    [[nodiscard]] std::int32_t first_number(std::int32_t corner) const {
        return 4 * place_[index(topology_.corner_vertices[index(corner)])];
    }

    const MeshTopology& topology_;
    CornerNeighbours around_;
    ByVertex edge_ends_;  // indices into the edges' vertices
    ByVertex neighbours_;
    ByVertex corners_;
    std::vector<std::int32_t> place_;  // of each vertex in the order of the mesh
    MushMesh mesh_;
};

}  // namespace

MushMesh make_mush_mesh(const MeshTopology& topology, std::size_t vertex_count) {
    check(topology, vertex_count);
    return Maker(topology, vertex_count).make();
}

}  // namespace sinew
