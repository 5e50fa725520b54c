// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/topology.h"

#include <algorithm>
#include <numeric>

#include "sinew/base/fail.h"

namespace sinew {
namespace {

constexpr std::size_t kMaxEdgeEnds = 0x7FFFFFFE;

void check_vertices(const std::string& argument, std::span<const std::int32_t> vertices, std::size_t count) {
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (vertices[i] < 0 || index(vertices[i]) >= count) {
            fail(argument, count == 0 ? "none" : "vertices from 0 to " + std::to_string(count - 1),
                 std::to_string(vertices[i]) + " at index " + std::to_string(i));
        }
    }
}

}  // namespace

void check(const MeshTopology& topology, std::size_t vertex_count, const std::string& argument,
           std::size_t most_vertices) {
    if (vertex_count > most_vertices) {
        fail(argument, "at most " + std::to_string(most_vertices) + " vertices",
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
    if (topology.edges.size() % 2 != 0) {
        fail("edges", "two vertices each", std::to_string(topology.edges.size()) + " vertices");
    }
    if (topology.edges.size() > kMaxEdgeEnds) {
        fail("edges", "at most " + std::to_string(kMaxEdgeEnds / 2),
             std::to_string(topology.edges.size() / 2));
    }
    check_vertices("corner_vertices", topology.corner_vertices, vertex_count);
    check_vertices("edges", topology.edges, vertex_count);
}

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

std::vector<std::int32_t> edges_of_corners(const MeshTopology& topology, const CornerNeighbours& around,
                                           const ByVertex& edge_ends) {
    std::vector<std::int32_t> edges(topology.corner_vertices.size());
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
        edges[corner] = *found / 2;
    }
    return edges;
}

}  // namespace sinew
