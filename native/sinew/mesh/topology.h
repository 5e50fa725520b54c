// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sinew/mesh/mesh_topology.h"

namespace sinew {

/// `value`, which must not be negative, as an index.
[[nodiscard]] constexpr std::size_t index(std::int32_t value) noexcept {
    return static_cast<std::size_t>(value);
}

/// Throws std::invalid_argument that names the field, for: offsets that decrease or do not match; indices of
/// vertices that do not exist; more than `most_vertices` vertices or 2^30 - 1 edges.
///
/// argument  the name of the argument that determines the number of vertices
void check(const MeshTopology& topology, std::size_t vertex_count, const std::string& argument,
           std::size_t most_vertices);

/// A list of items for each vertex: vertex v has items [offsets[v], offsets[v + 1]), ascending.
struct ByVertex {
    std::vector<std::size_t> offsets;
    std::vector<std::int32_t> items;

    [[nodiscard]] std::span<const std::int32_t> of(std::size_t vertex) const {
        return std::span(items).subspan(offsets[vertex], offsets[vertex + 1] - offsets[vertex]);
    }
};

/// Groups the indices of `vertices` by the vertex that each names.
///
/// vertices  [any number] vertices below `count`
[[nodiscard]] ByVertex by_vertex(std::span<const std::int32_t> vertices, std::size_t count);

/// For each corner, the previous and the next corner in its face.
struct CornerNeighbours {
    std::vector<std::int32_t> previous;
    std::vector<std::int32_t> next;
};

[[nodiscard]] CornerNeighbours corners_around(const MeshTopology& topology);

/// [corners] the edge from each corner's vertex to that of the next corner. Throws if it is not among the edges.
///
/// edge_ends  by_vertex() of topology.edges
[[nodiscard]] std::vector<std::int32_t> edges_of_corners(const MeshTopology& topology,
                                                         const CornerNeighbours& around,
                                                         const ByVertex& edge_ends);

}  // namespace sinew
