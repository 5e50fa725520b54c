// SPDX-License-Identifier: GPL-3.0-or-later
// Protects normals of whole meshes on each instruction set and on threads: all have the same bits, which
// tests/python/test_normals.py compares with the definition.
#include "sinew/normals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "polygons.h"
#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew {
namespace {

using test::distance;
using test::Mesh;
using test::Random;
using test::random_mesh;
using test::same_bits;

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
    EXPECT_TRUE(normals.compute(domain, points, result, threads));
    return result;
}

bool same(const std::vector<Vec3<float>>& a, const std::vector<Vec3<float>>& b) {
    return std::ranges::equal(a, b, same_bits<float>);
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

class NormalKernels : public testing::TestWithParam<std::string_view> {
protected:
    void SetUp() override { use_simd_target(GetParam()); }
    void TearDown() override { use_simd_target(simd_targets().front()); }
};

INSTANTIATE_TEST_SUITE_P(every, NormalKernels, testing::ValuesIn(simd_targets()),
                         [](const auto& info) { return std::string(info.param); });

TEST_P(NormalKernels, have_the_bits_of_any_other) {
    const Mesh mesh = mesh_with_large_faces();
    // With nearly all edges sharp, most corners are fans by themselves.
    for (const double sharp : {0.2, 0.95}) {
        const Normals normals = normals_of(mesh, with_custom(random_flags(mesh, sharp, 0.1), mesh));
        for (const NormalDomain domain : kDomains) {
            use_simd_target(simd_targets().back());
            const auto expected = computed(normals, domain, mesh.rest_points);
            use_simd_target(GetParam());
            EXPECT_TRUE(same(computed(normals, domain, mesh.rest_points), expected));
        }
    }
}

TEST_P(NormalKernels, threads_change_no_bit) {
    const Mesh mesh = random_mesh(5, 150);
    const Normals normals = normals_of(mesh, with_custom(random_flags(mesh, 0.1, 0.1), mesh));
    for (const NormalDomain domain : kDomains) {
        const auto expected = computed(normals, domain, mesh.rest_points, 1);
        for (const std::size_t threads : {0, 2, 3, 8}) {
            EXPECT_TRUE(same(computed(normals, domain, mesh.rest_points, threads), expected)) << threads;
        }
    }
}

TEST_P(NormalKernels, tilt_and_turn_custom_normals) {
    Mesh mesh;
    // A pyramid without a base; its edges are at 45 degrees to the normal of its top.
    mesh.rest_points = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    for (std::int32_t i = 1; i < 5; ++i) mesh.add_face({0, i, i % 4 + 1});
    mesh.add_edges_of_faces();
    Flags flags;
    flags.custom.assign(2 * mesh.corners.size(), 0);
    // The walk starts at the edge to vertex 1, which is the first corner's following edge.
    const auto at_top = [&](std::int16_t tilt, std::int16_t turn) {
        for (std::size_t corner = 0; corner < mesh.corners.size(); corner += 3) {
            flags.custom[2 * corner] = tilt;
            flags.custom[2 * corner + 1] = turn;
        }
        return Point(computed(normals_of(mesh, flags), NormalDomain::corner, mesh.rest_points)[0]);
    };
    const double whole = 3.0 * 0.7853981633974483;  // from +z to the edges, which go down
    EXPECT_LT(distance(at_top(0, 20000), Point(0, 0, 1)), 1e-6);
    EXPECT_LT(distance(at_top(32767, 0), Point(std::sin(whole), 0, std::cos(whole))), 1e-4);
    EXPECT_LT(distance(at_top(16384, 8192), Point(0, std::sin(whole / 2), std::cos(whole / 2))), 1e-3);
    EXPECT_LT(distance(at_top(16384, 24575), Point(0, -std::sin(whole / 2), std::cos(whole / 2))), 1e-3);
    // Backwards: 360 degrees minus the angle.
    EXPECT_LT(distance(at_top(-32767, 0), Point(std::sin(whole), 0, std::cos(whole))), 1e-4);
    // For corners with different numbers, the mean, rounded towards 0.
    at_top(16384, 8192);
    flags.custom[0] = 16384 - 3;
    const auto result = computed(normals_of(mesh, flags), NormalDomain::corner, mesh.rest_points);
    EXPECT_LT(distance(Point(result[0]), Point(0, std::sin(whole / 2), std::cos(whole / 2))), 1e-3);
    EXPECT_TRUE(same_bits(result[0], result[3]));
}

TEST_P(NormalKernels, degenerate_faces_have_defined_normals) {
    Mesh mesh;
    mesh.rest_points = {{3, 4, 0}, {3, 4, 0}, {3, 4, 0}, {4, 4, 0}, {5, 4, 0}, {0, 0, 0}};
    mesh.add_face({0, 1, 2});  // one point
    mesh.add_face({0, 3, 4});  // a line
    mesh.add_face({1});
    mesh.add_face({});
    mesh.add_face({2, 3});
    const Normals normals = normals_of(mesh);
    for (const auto& normal : computed(normals, NormalDomain::face, mesh.rest_points)) {
        EXPECT_EQ(normal, Vec3<float>(0, 0, 1));
    }
    const auto vertices = computed(normals, NormalDomain::vertex, mesh.rest_points);
    // 3 is in the middle of the line, with an angle of pi; the others' angles are 0, except pi / 2 where an edge
    // has length 0.
    EXPECT_EQ(vertices[3], Vec3<float>(0, 0, 1));
    EXPECT_EQ(vertices[0], Vec3<float>(0, 0, 1));
    EXPECT_EQ(vertices[4], Vec3<float>(0, 0, 0));
    // A vertex without faces, at the origin.
    EXPECT_EQ(vertices[5], Vec3<float>(0, 0, 0));
}

TEST_P(NormalKernels, faces_back_to_back_cancel) {
    Mesh mesh;
    mesh.rest_points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.add_face({0, 1, 2});
    mesh.add_face({0, 2, 1});
    for (const auto& normal : computed(normals_of(mesh), NormalDomain::vertex, mesh.rest_points)) {
        EXPECT_EQ(normal, Vec3<float>(0, 0, 0));
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

TEST(Normals, say_their_domain) {
    Mesh mesh = random_mesh(7, 6);
    const auto domain = [&](double edges, double faces) {
        return normals_of(mesh, random_flags(mesh, edges, faces)).domain();
    };
    EXPECT_EQ(normals_of(mesh).domain(), NormalDomain::vertex);
    EXPECT_EQ(domain(0.0, 0.0), NormalDomain::vertex);
    EXPECT_EQ(domain(0.3, 0.0), NormalDomain::corner);
    EXPECT_EQ(domain(0.0, 0.3), NormalDomain::corner);
    EXPECT_EQ(domain(1.0, 0.0), NormalDomain::face);
    EXPECT_EQ(domain(0.3, 1.0), NormalDomain::face);
    EXPECT_EQ(normals_of(mesh, with_custom({}, mesh)).domain(), NormalDomain::corner);
    EXPECT_EQ(normals_of(mesh, with_custom(random_flags(mesh, 0.0, 1.0), mesh)).domain(),
              NormalDomain::corner);
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
    EXPECT_FALSE(normals.compute(NormalDomain::vertex, std::span(mesh.rest_points).first(3), result));
    EXPECT_FALSE(normals.compute(NormalDomain::corner, mesh.rest_points, result));
    for (const auto& normal : result) ASSERT_EQ(normal, Vec3<float>(7.0f));
}

}  // namespace
}  // namespace sinew
