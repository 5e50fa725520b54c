// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/delta_mush/mush_mesh.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "sinew/mesh/topology.h"

namespace sinew {
namespace {

// Shorter sequences are not worth a run of their own, which costs about as much as several vertices.
constexpr std::size_t kMinConsecutive = 8;

/// The number of faces at each edge. Throws if an edge of a face is not among the edges.
std::vector<std::uint32_t> faces_of_edges(const MeshTopology& topology, const CornerNeighbours& around,
                                          const ByVertex& edge_ends) {
    std::vector<std::uint32_t> faces(topology.edges.size() / 2);
    for (const std::int32_t edge : edges_of_corners(topology, around, edge_ends)) ++faces[index(edge)];
    return faces;
}

/// The ends of each vertex's spokes, in the order described at MushBlock.
class Fans {
public:
    Fans(const MeshTopology& topology, const CornerNeighbours& around, const ByVertex& corners) {
        const auto vertex_at = [&](std::int32_t corner) { return topology.corner_vertices[index(corner)]; };
        for (std::size_t vertex = 0; vertex + 1 < corners.offsets.size(); ++vertex) {
            corners_.clear();
            for (const std::int32_t corner : corners.of(vertex)) {
                corners_.push_back(
                    {vertex_at(around.next[index(corner)]), vertex_at(around.previous[index(corner)])});
            }
            spokes_.offsets.push_back(spokes_.items.size());
            add_fan();
        }
        spokes_.offsets.push_back(spokes_.items.size());
    }

    [[nodiscard]] std::span<const std::int32_t> of(std::size_t vertex) const { return spokes_.of(vertex); }

private:
    /// A corner of a vertex, by the two other vertices. The next face around the vertex has `previous` as its
    /// `next`.
    struct Corner {
        std::int32_t next;
        std::int32_t previous;
    };

    void add_fan() {
        if (corners_.empty() || add_chain()) return;
        for (const Corner& corner : corners_) {
            spokes_.items.insert(spokes_.items.end(), {corner.next, corner.previous});
        }
    }

    /// If the faces of the corners are adjacent, in a row or all around, adds their spokes and returns true.
    bool add_chain() {
        std::ranges::sort(corners_, {}, &Corner::next);
        previous_.clear();
        for (const Corner& corner : corners_) previous_.push_back(corner.previous);
        std::ranges::sort(previous_);
        const auto is_first = [&](const Corner& corner) {
            return !std::ranges::binary_search(previous_, corner.next);
        };
        auto at = std::ranges::find_if(corners_, is_first);
        if (at == corners_.end()) at = corners_.begin();
        chain_.assign(1, at->next);
        for (std::size_t count = 1; count < corners_.size(); ++count) {
            chain_.push_back(at->previous);
            at = std::ranges::lower_bound(corners_, at->previous, {}, &Corner::next);
            if (at == corners_.end() || at->next != chain_.back()) return false;
        }
        const bool is_closed = at->previous == chain_.front();
        if (!is_closed) chain_.push_back(at->previous);
        previous_.assign(chain_.begin(), chain_.end());
        std::ranges::sort(previous_);
        if (std::ranges::adjacent_find(previous_) != previous_.end()) return false;
        spokes_.items.insert(spokes_.items.end(), chain_.begin(), chain_.end());
        return true;
    }

    ByVertex spokes_;
    // Scratch for one vertex.
    std::vector<Corner> corners_;
    std::vector<std::int32_t> previous_;
    std::vector<std::int32_t> chain_;
};

/// Orders vertices breadth-first, so that neighbours are close. The neighbours of a vertex are visited in the
/// order of its faces, starting where the vertex was reached from. A grid is thus visited row by row, whatever
/// the order of its vertices.
class BreadthFirst {
public:
    BreadthFirst(const ByVertex& neighbours, const Fans& fans, std::size_t count)
        : neighbours_(neighbours), fans_(fans), parents_(count, -1) {
        order_.reserve(count);
    }

    std::vector<std::uint32_t> order() {
        for (std::size_t vertex = 0; vertex < parents_.size(); ++vertex) {
            if (parents_[vertex] >= 0) continue;
            const std::size_t begin = order_.size();
            visit_from(vertex);
            // Visit this part of the mesh again, starting at the vertex reached last, which is at one of its
            // ends: neighbours are then closer in the order.
            const std::size_t last = order_.back();
            for (std::size_t i = begin; i < order_.size(); ++i) parents_[order_[i]] = -1;
            order_.resize(begin);
            visit_from(last);
        }
        return std::move(order_);
    }

private:
    void visit_from(std::size_t first) {
        std::size_t at = order_.size();
        reach(first, first);
        for (; at < order_.size(); ++at) {
            const std::size_t vertex = order_[at];
            const auto fan = fans_.of(vertex);
            const auto from = std::ranges::find(fan, parents_[vertex]);
            for (auto i = from; i != fan.end(); ++i) reach(index(*i), vertex);
            for (auto i = fan.begin(); i != from; ++i) reach(index(*i), vertex);
            for (const std::int32_t neighbour : neighbours_.of(vertex)) reach(index(neighbour), vertex);
        }
    }

    void reach(std::size_t vertex, std::size_t from) {
        if (parents_[vertex] >= 0) return;
        parents_[vertex] = static_cast<std::int32_t>(from);
        order_.push_back(static_cast<std::uint32_t>(vertex));
    }

    const ByVertex& neighbours_;
    const Fans& fans_;
    std::vector<std::int32_t> parents_;  // the vertex that each vertex was reached from; -1: not reached yet
    std::vector<std::uint32_t> order_;
};

class Maker {
public:
    Maker(const MeshTopology& topology, std::size_t vertex_count)
        : topology_(topology),
          around_(corners_around(topology)),
          edge_ends_(by_vertex(topology.edges, vertex_count)),
          neighbours_{edge_ends_.offsets, {}},
          corners_(by_vertex(topology.corner_vertices, vertex_count)),
          fans_(topology, around_, corners_) {
        for (const std::int32_t end : edge_ends_.items) {
            neighbours_.items.push_back(topology.edges[index(end) ^ 1]);
        }
        mesh_.vertices = BreadthFirst(neighbours_, fans_, vertex_count).order();
        for (std::size_t begin = 0; begin < vertex_count; begin += MushMesh::kChunk) {
            const auto first = mesh_.vertices.begin() + static_cast<std::ptrdiff_t>(begin);
            const auto kind = [this](std::uint32_t v) {
                return std::tuple(neighbours_.of(v).size(), corners_.of(v).size(), fans_.of(v).size());
            };
            std::ranges::stable_sort(
                first, first + static_cast<std::ptrdiff_t>(std::min(MushMesh::kChunk, vertex_count - begin)),
                {}, kind);
        }
        number_in_order_.resize(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) {
            number_in_order_[mesh_.vertices[i]] = static_cast<std::int32_t>(i);
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
    /// The numbers of corners and spokes.
    [[nodiscard]] std::pair<std::size_t, std::size_t> fan_size(std::size_t i) const {
        const std::size_t vertex = mesh_.vertices[i];
        return {corners_.of(vertex).size(), fans_.of(vertex).size()};
    }

    void mark_boundary() {
        mesh_.on_boundary.resize(mesh_.vertices.size());
        const auto faces = faces_of_edges(topology_, around_, edge_ends_);
        for (std::size_t end = 0; end < topology_.edges.size(); ++end) {
            if (faces[end / 2] == 1)
                mesh_.on_boundary[index(number_in_order_[index(topology_.edges[end])])] = 1;
        }
    }

    /// The neighbours of a vertex, in the order of the mesh.
    [[nodiscard]] std::span<const std::int32_t> neighbours(std::size_t i) const {
        return std::span(sorted_).subspan(first_sorted_[i], valence(i));
    }

    void sort_neighbours() {
        for (const std::uint32_t vertex : mesh_.vertices) {
            const std::size_t chunk = first_sorted_.size() / MushMesh::kChunk;
            first_sorted_.push_back(sorted_.size());
            for (const std::int32_t neighbour : neighbours_.of(vertex)) {
                sorted_.push_back(number_in_order_[index(neighbour)]);
                const std::size_t of_neighbour = index(sorted_.back()) / MushMesh::kChunk;
                mesh_.reach =
                    std::max(mesh_.reach, std::max(chunk, of_neighbour) - std::min(chunk, of_neighbour));
            }
            std::sort(sorted_.begin() + static_cast<std::ptrdiff_t>(first_sorted_.back()), sorted_.end());
        }
    }

    /// How many vertices from `i` on have neighbours that follow those of the vertex before by one index.
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
            const bool is_consecutive = count >= kMinConsecutive;
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

    /// The ends of a vertex's spokes. Adjacent vertices start with corresponding ones.
    std::span<const std::int32_t> spokes(std::size_t i) {
        const auto [corners, count] = fan_size(i);
        spokes_.clear();
        for (const std::int32_t vertex : fans_.of(mesh_.vertices[i])) {
            spokes_.push_back(number_in_order_[index(vertex)]);
        }
        if (count == corners) {
            std::rotate(spokes_.begin(), std::ranges::min_element(spokes_), spokes_.end());
        }
        return spokes_;
    }

    void add_blocks(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end;) {
            std::size_t after = i + 1;
            while (after < end && after < i + kLanes && fan_size(after) == fan_size(i)) ++after;
            add_block(i, after);
            i = after;
        }
    }

    void add_block(std::size_t begin, std::size_t end) {
        const auto [corner_count, spoke_count] = fan_size(begin);
        const std::size_t first = mesh_.spokes.size();
        mesh_.spokes.resize(first + spoke_count);
        const std::span<Lanes<std::int32_t>> added(mesh_.spokes.begin() + static_cast<std::ptrdiff_t>(first),
                                                   mesh_.spokes.end());
        bool is_consecutive = true;
        for (std::size_t v = begin; v < end; ++v) {
            const std::size_t lane = v - begin;
            const auto of_vertex = spokes(v);
            for (std::size_t k = 0; k < spoke_count; ++k) {
                // Lanes without a vertex repeat the last one.
                std::fill(added[k].lane.begin() + static_cast<std::ptrdiff_t>(lane), added[k].lane.end(),
                          of_vertex[k]);
                is_consecutive &= added[k].lane[0] + static_cast<std::int32_t>(lane) == of_vertex[k];
            }
        }
        mesh_.blocks.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end - begin),
                                static_cast<std::uint32_t>(corner_count),
                                static_cast<std::uint32_t>(spoke_count), is_consecutive,
                                is_consecutive ? mesh_.first_spokes.size() : first, mesh_.detail_count});
        mesh_.detail_count += corner_count;
        if (!is_consecutive) return;
        for (const Lanes<std::int32_t>& spoke : added) mesh_.first_spokes.push_back(spoke.lane[0]);
        mesh_.spokes.resize(first);
    }

    const MeshTopology& topology_;
    CornerNeighbours around_;
    ByVertex edge_ends_;  // indices into the edges' vertices
    ByVertex neighbours_;
    ByVertex corners_;
    Fans fans_;
    std::vector<std::int32_t> spokes_;           // scratch for one vertex
    std::vector<std::int32_t> number_in_order_;  // the number of each vertex in the order of the mesh
    // the numbers of each vertex's neighbours in the order of the mesh, ascending
    std::vector<std::int32_t> sorted_;
    std::vector<std::size_t> first_sorted_;
    MushMesh mesh_;
};

}  // namespace

MushMesh make_mush_mesh(const MeshTopology& topology, std::size_t vertex_count) {
    check(topology, vertex_count, "rest_points", kMaxMushVertices);
    return Maker(topology, vertex_count).make();
}

}  // namespace sinew
