// SPDX-License-Identifier: GPL-3.0-or-later
// Protects normals of whole meshes on each instruction set and on threads: all have the same bits, which
// tests/blender/skinning/test_normals.py compares with Blender's.
#include "sinew/normals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "polygons.h"
#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew::test {
namespace {

using Point = Vec3<double>;

constexpr NormalDomain kDomains[] = {NormalDomain::vertex, NormalDomain::corner, NormalDomain::face};

struct Flags {
    std::vector<std::uint8_t> edges;
    std::vector<std::uint8_t> faces;
    std::vector<std::int16_t> custom;

    [[nodiscard]] Sharpness sharpness() const { return {edges, faces, custom}; }
};

Flags random_flags(const Mesh& mesh, double share_of_edges, double share_of_faces) {
    Random random(9);
    Flags flags;
    for (std::size_t i = 0; i < mesh.edges.size() / 2; ++i) {
        flags.edges.push_back(random.uniform(0.0, 1.0) < share_of_edges ? 1 : 0);
    }
    for (std::size_t i = 0; i + 1 < mesh.offsets.size(); ++i) {
        flags.faces.push_back(random.uniform(0.0, 1.0) < share_of_faces ? 200 : 0);
    }
    return flags;
}

/// With custom normals for all corners, different within a fan.
Flags with_custom(Flags flags, const Mesh& mesh) {
    Random random(10);
    for (std::size_t i = 0; i < 2 * mesh.corners.size(); ++i) {
        flags.custom.push_back(static_cast<std::int16_t>(random.index(65536) - 32768));
    }
    return flags;
}

std::vector<Vec3<float>> computed(const Normals& normals, NormalDomain domain,
                                  std::span<const Vec3<float>> points, std::size_t threads = 0) {
    std::vector<Vec3<float>> result(normals.count(domain), Vec3<float>(7.0f));
    EXPECT_EQ(normals.compute(domain, points, result, threads), Status::ok);
    return result;
}

Normals normals_of(const Mesh& mesh, const Flags& flags = {}) {
    return {mesh.topology(), mesh.rest_points.size(), flags.sharpness()};
}

/// Includes polygons of up to 70 corners.
Mesh mesh_with_large_faces() {
    Mesh mesh = random_mesh(3, 24);
    for (const int count : {5, 7, 8, 9, 32, 33, 70}) {
        const auto first = static_cast<std::int32_t>(mesh.rest_points.size());
        for (int i = 0; i < count; ++i) {
            const double turn = 6.283185307179586 * i / count;
            mesh.rest_points.push_back(
                Vec3<float>(Point(std::cos(turn), std::sin(turn), 0.1 * std::cos(3.0 * turn))));
            mesh.corners.push_back(first + i);
        }
        mesh.offsets.push_back(static_cast<std::int32_t>(mesh.corners.size()));
    }
    mesh.edges.clear();
    mesh.add_edges_of_faces();
    return mesh;
}

class NormalKernels : public OnEachTarget {};

INSTANTIATE_TEST_SUITE_P(every, NormalKernels, testing::ValuesIn(simd_targets()), name_of_target);

TEST_P(NormalKernels, have_the_bits_of_any_other) {
    const Mesh mesh = mesh_with_large_faces();
    // With nearly all edges sharp, most corners are fans by themselves.
    for (const double sharp : {0.2, 0.95}) {
        const Normals normals = normals_of(mesh, with_custom(random_flags(mesh, sharp, 0.1), mesh));
        for (const NormalDomain domain : kDomains) {
            use_simd_target(simd_targets().back());
            const auto expected = computed(normals, domain, mesh.rest_points);
            use_simd_target(GetParam());
            EXPECT_TRUE(same_bits(computed(normals, domain, mesh.rest_points), expected));
        }
    }
}

TEST_P(NormalKernels, threads_change_no_bit) {
    const Mesh mesh = random_mesh(5, 150);
    const Normals normals = normals_of(mesh, with_custom(random_flags(mesh, 0.1, 0.1), mesh));
    for (const NormalDomain domain : kDomains) {
        const auto expected = computed(normals, domain, mesh.rest_points, 1);
        for (const std::size_t threads : {0, 2, 3, 8}) {
            EXPECT_TRUE(same_bits(computed(normals, domain, mesh.rest_points, threads), expected)) << threads;
        }
    }
}

TEST_P(NormalKernels, any_points_give_finite_normals) {
    const Mesh mesh = mesh_with_large_faces();
    const Flags flags = random_flags(mesh, 0.2, 0.1);
    const Normals normals = normals_of(mesh, flags);
    const Normals custom = normals_of(mesh, with_custom(flags, mesh));
    Random random(4);
    const float values[] = {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(),
                            1e38f,
                            -1e25f,
                            1e-30f,
                            1e-45f};
    for (int round = 0; round < 20; ++round) {
        auto points = mesh.rest_points;
        for (Vec3<float>& point : points) {
            if (random.index(4) == 0) point[random.index(3)] = values[random.index(6)];
            if (random.index(6) == 0) point = points[static_cast<std::size_t>(random.index(100))];
        }
        for (const NormalDomain domain : kDomains) {
            for (const auto& normal : computed(normals, domain, points)) {
                const float length = glm::length(normal);
                ASSERT_TRUE(length == 0.0f || std::abs(length - 1.0f) < 1e-5f) << length;
            }
        }
        // Without a first edge there is no direction to tilt to.
        for (const auto& normal : computed(custom, NormalDomain::corner, points)) {
            ASSERT_LT(glm::length(normal), 1.00001f);
        }
    }
}

TEST(Normals, take_meshes_without_faces_and_without_vertices) {
    Mesh mesh;
    EXPECT_TRUE(computed(normals_of(mesh), NormalDomain::vertex, mesh.rest_points).empty());
    EXPECT_TRUE(computed(normals_of(mesh), NormalDomain::corner, mesh.rest_points).empty());
    mesh.rest_points = {{0, 3, 4}};
    EXPECT_EQ(computed(normals_of(mesh), NormalDomain::vertex, mesh.rest_points)[0],
              Vec3<float>(0, 0.6f, 0.8f));
}

TEST(Normals, write_nothing_where_sizes_do_not_fit) {
    const Mesh mesh = random_mesh(8, 6);
    const Normals normals = normals_of(mesh);
    std::vector<Vec3<float>> result(mesh.rest_points.size(), Vec3<float>(7.0f));
    EXPECT_EQ(normals.compute(NormalDomain::vertex, std::span(mesh.rest_points).first(3), result),
              Status::size);
    EXPECT_EQ(normals.compute(NormalDomain::corner, mesh.rest_points, result), Status::size);
    for (const auto& normal : result) ASSERT_EQ(normal, Vec3<float>(7.0f));
}

}  // namespace
}  // namespace sinew::test
