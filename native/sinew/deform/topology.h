// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sinew/deform/mesh_topology.h"

namespace sinew {

/// As an index; 0 or more.
[[nodiscard]] constexpr std::size_t index(std::int32_t value) noexcept {
    return static_cast<std::size_t>(value);
}

/// Throws std::invalid_argument that names the field: offsets that fall or do not fit, vertices that there are not, more
/// than `most_vertices` vertices or 2^30 - 1 edges.
///
/// argument  what the number of vertices comes from
void check(const MeshTopology& topology, std::size_t vertex_count, const std::string& argument,
           std::size_t most_vertices);

/// What belongs to each vertex: of vertex v, items [offsets[v], offsets[v + 1]), rising.
struct ByVertex {
    std::vector<std::size_t> offsets;
    std::vector<std::int32_t> items;

    [[nodiscard]] std::span<const std::int32_t> of(std::size_t vertex) const {
        return std::span(items).subspan(offsets[vertex], offsets[vertex + 1] - offsets[vertex]);
    }
};

/// The index of each of `vertices` by the vertex that it names.
[[nodiscard]] ByVertex by_vertex(std::span<const std::int32_t> vertices, std::size_t count);

/// For each corner the corner before and the one after it in its face.
struct CornerNeighbours {
    std::vector<std::int32_t> previous;
    std::vector<std::int32_t> next;
};

[[nodiscard]] CornerNeighbours corners_around(const MeshTopology& topology);

/// [corners] the edge from each corner's vertex to that of the corner after it. Throws where it is not among the edges.
///
/// edge_ends  by_vertex() of the edges
[[nodiscard]] std::vector<std::int32_t> edges_of_corners(const MeshTopology& topology,
                                                         const CornerNeighbours& around,
                                                         const ByVertex& edge_ends);

}  // namespace sinew
