// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes of polygons for tests of stages that need faces.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <set>
#include <utility>
#include <vector>

#include "sinew/mesh/mesh_topology.h"
#include "support.h"

namespace sinew::test {

/// A mesh of polygons that owns the data that MeshTopology refers to.
struct Mesh {
    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> corners;
    std::vector<std::int32_t> edges;

    void add_face(std::initializer_list<std::int32_t> vertices) {
        corners.insert(corners.end(), vertices);
        offsets.push_back(static_cast<std::int32_t>(corners.size()));
    }

    void add_edges_of_faces() {
        std::set<std::pair<std::int32_t, std::int32_t>> made;
        for (std::size_t face = 0; face + 1 < offsets.size(); ++face) {
            for (auto i = offsets[face]; i < offsets[face + 1]; ++i) {
                const auto after = i + 1 < offsets[face + 1] ? i + 1 : offsets[face];
                made.insert(std::minmax(corners[static_cast<std::size_t>(i)],
                                        corners[static_cast<std::size_t>(after)]));
            }
        }
        for (const auto& [a, b] : made) edges.insert(edges.end(), {a, b});
    }

    [[nodiscard]] MeshTopology topology() const { return {offsets, corners, edges}; }
};

/// A flat square of `size` by `size` vertices with side 1.
inline Mesh sheet(std::int32_t size) {
    Mesh mesh;
    for (std::int32_t x = 0; x < size; ++x) {
        for (std::int32_t y = 0; y < size; ++y) {
            mesh.rest_points.push_back(Vec3<float>(x, y, 0) / static_cast<float>(size - 1));
            const std::int32_t v = x * size + y;
            if (x > 0 && y > 0) mesh.add_face({v - size - 1, v - 1, v, v - size});
        }
    }
    mesh.add_edges_of_faces();
    return mesh;
}

/// A sheet of triangles, quads and hexagons, with holes, edges of three faces, and edges and vertices without
/// faces.
inline Mesh random_mesh(std::uint32_t seed, std::int32_t size) {
    Random random(seed);
    Mesh mesh;
    const auto vertex = [&](std::int32_t x, std::int32_t y) { return x * size + y; };
    for (std::int32_t x = 0; x < size; ++x) {
        for (std::int32_t y = 0; y < size; ++y) {
            mesh.rest_points.push_back(
                Vec3<float>((Vec3<double>(x, y, 0.0) + random.vector(0.25)) / static_cast<double>(size)));
        }
    }
    for (std::int32_t x = 0; x + 1 < size; ++x) {
        for (std::int32_t y = 0; y + 1 < size; ++y) {
            const auto a = vertex(x, y), b = vertex(x + 1, y), c = vertex(x + 1, y + 1), d = vertex(x, y + 1);
            switch (random.index(8)) {
                case 0: break;
                case 1:
                    mesh.add_face({a, b, c});
                    mesh.add_face({a, c, d});
                    break;
                case 2:
                    if (y + 2 < size) {
                        mesh.add_face({a, b, c, vertex(x + 1, y + 2), vertex(x, y + 2), d});
                        ++y;
                    }
                    break;
                case 3:
                    mesh.add_face({a, b, c, d});
                    mesh.rest_points.push_back(mesh.rest_points[static_cast<std::size_t>(a)] +
                                               Vec3<float>(0.01f, 0.0f, 0.05f));
                    mesh.add_face({a, b, static_cast<std::int32_t>(mesh.rest_points.size()) - 1});
                    break;
                default: mesh.add_face({a, b, c, d}); break;
            }
        }
    }
    mesh.add_edges_of_faces();
    for (std::int32_t i = 0; i < size; ++i) {
        mesh.rest_points.push_back(Vec3<float>(random.vector(1.0)));
        const auto last = static_cast<std::int32_t>(mesh.rest_points.size()) - 1;
        if (i % 3 > 0) mesh.edges.insert(mesh.edges.end(), {last, random.index(last)});
    }
    return mesh;
}

}  // namespace sinew::test
