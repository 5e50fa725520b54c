// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of whole meshes, compared with their definition in double.
#include "sinew/deform/normals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>

#include "polygons.h"
#include "scene.h"
#include "sinew/deform/simd.h"
#include "sinew/skinning/delta_mush.h"

namespace sinew {
namespace {

using test::distance;
using test::Mesh;
using test::Random;
using test::random_mesh;
using test::same_bits;

using Point = Vec3<double>;

constexpr NormalDomain kDomains[] = {NormalDomain::vertex, NormalDomain::corner, NormalDomain::face};

Point unit(const Point& v) {
    const double length = glm::length(v);
    return length > 0.0 ? v / length : Point(0.0);
}

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

/// The normals by the definition, in double, one face and corner after the other.
class Reference {
public:
    Reference(const Mesh& mesh, const Flags& flags) : mesh_(mesh), fans_(mesh.corners.size()) {
        std::iota(fans_.begin(), fans_.end(), std::size_t{0});
        std::map<std::pair<std::int32_t, std::int32_t>, std::vector<std::size_t>> users;
        std::set<std::pair<std::int32_t, std::int32_t>> sharp;
        for (std::size_t edge = 0; edge < flags.edges.size(); ++edge) {
            if (flags.edges[edge] != 0)
                sharp.insert(std::minmax(mesh.edges[2 * edge], mesh.edges[2 * edge + 1]));
        }
        for_each_corner([&](std::size_t face, std::size_t, std::size_t corner, std::size_t after) {
            const auto edge = std::minmax(mesh.corners[corner], mesh.corners[after]);
            users[edge].push_back(corner);
            if (!flags.faces.empty() && flags.faces[face] != 0) sharp.insert(edge);
            next_.push_back(after);
        });
        for (const auto& [edge, corners] : users) {
            if (corners.size() != 2 || sharp.contains(edge)) continue;
            if (mesh.corners[corners[0]] == mesh.corners[corners[1]]) continue;
            join(corners[0], next_[corners[1]]);
            join(next_[corners[0]], corners[1]);
        }
    }

    [[nodiscard]] std::vector<Point> compute(NormalDomain domain, std::span<const Vec3<float>> points) const {
        std::vector<Point> faces(mesh_.offsets.size() - 1, Point(0.0));
        const auto at = [&](std::size_t corner) {
            return Point(points[static_cast<std::size_t>(mesh_.corners[corner])]);
        };
        // This sum of cross products equals Newell's; relative to a corner of the face it loses fewer digits.
        for_each_corner([&](std::size_t face, std::size_t, std::size_t corner, std::size_t after) {
            const Point origin = at(static_cast<std::size_t>(mesh_.offsets[face]));
            faces[face] += glm::cross(at(corner) - origin, at(after) - origin);
        });
        for (Point& normal : faces) normal = normal == Point(0.0) ? Point(0.0, 0.0, 1.0) : unit(normal);
        if (domain == NormalDomain::face) return faces;
        std::vector<Point> sums(domain == NormalDomain::vertex ? points.size() : fans_.size(), Point(0.0));
        std::vector<int> counts(sums.size());
        const auto group = [&](std::size_t corner) {
            return domain == NormalDomain::vertex ? static_cast<std::size_t>(mesh_.corners[corner])
                                                  : fans_[corner];
        };
        for_each_corner([&](std::size_t face, std::size_t before, std::size_t corner, std::size_t after) {
            const double cosine = glm::dot(unit(at(before) - at(corner)), unit(at(after) - at(corner)));
            sums[group(corner)] += DeltaMushStage::angle(cosine) * faces[face];
            ++counts[group(corner)];
        });
        for (std::size_t i = 0; i < points.size() && domain == NormalDomain::vertex; ++i) {
            if (counts[i] == 0) sums[i] = Point(points[i]);
        }
        std::vector<Point> normals(domain == NormalDomain::vertex ? points.size() : mesh_.corners.size());
        for (std::size_t i = 0; i < points.size() && domain == NormalDomain::vertex; ++i)
            normals[i] = unit(sums[i]);
        if (domain == NormalDomain::vertex) return normals;
        for_each_corner([&](std::size_t face, std::size_t, std::size_t corner, std::size_t) {
            normals[corner] = counts[fans_[corner]] == 1 ? faces[face] : unit(sums[fans_[corner]]);
        });
        return normals;
    }

private:
    /// Calls call(face, the corner before, the corner, the one after it).
    template <class Call>
    void for_each_corner(const Call& call) const {
        for (std::size_t face = 0; face + 1 < mesh_.offsets.size(); ++face) {
            const auto begin = static_cast<std::size_t>(mesh_.offsets[face]);
            const auto count = static_cast<std::size_t>(mesh_.offsets[face + 1]) - begin;
            for (std::size_t i = 0; i < count; ++i) {
                call(face, begin + (i + count - 1) % count, begin + i, begin + (i + 1) % count);
            }
        }
    }

    void join(std::size_t a, std::size_t b) {
        const std::size_t from = fans_[a], to = fans_[b];
        std::ranges::replace(fans_, from, to);
    }

    const Mesh& mesh_;
    std::vector<std::size_t> fans_;  // for each corner, one of its fan's corners
    std::vector<std::size_t> next_;
};

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

TEST_P(NormalKernels, agree_with_the_definition_in_double) {
    for (const Mesh& mesh : {random_mesh(1, 20), mesh_with_large_faces()}) {
        for (const Flags& flags : {Flags{}, random_flags(mesh, 0.1, 0.05), random_flags(mesh, 0.5, 0.3),
                                   random_flags(mesh, 0.0, 1.0)}) {
            const Reference reference(mesh, flags);
            const Normals normals = normals_of(mesh, flags);
            for (const NormalDomain domain : kDomains) {
                // If nothing is sharp, corners have the normals of their vertices, which may have several fans.
                if (domain == NormalDomain::corner && normals.domain() == NormalDomain::vertex) continue;
                const auto expected = reference.compute(domain, mesh.rest_points);
                const auto result = computed(normals, domain, mesh.rest_points);
                ASSERT_EQ(result.size(), expected.size());
                for (std::size_t i = 0; i < result.size(); ++i) {
                    ASSERT_LT(distance(Point(result[i]), expected[i]), 2e-5) << i;
                }
            }
        }
    }
}

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

TEST_P(NormalKernels, corners_of_a_smooth_mesh_have_the_normals_of_their_vertices) {
    const Mesh mesh = random_mesh(6, 30);
    const Normals normals = normals_of(mesh);
    const auto vertices = computed(normals, NormalDomain::vertex, mesh.rest_points);
    const auto corners = computed(normals, NormalDomain::corner, mesh.rest_points);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        ASSERT_TRUE(same_bits(corners[i], vertices[static_cast<std::size_t>(mesh.corners[i])])) << i;
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

TEST(Normals, say_what_they_were_made_of) {
    const Mesh mesh = random_mesh(8, 20);
    const Normals normals = normals_of(mesh, with_custom(random_flags(mesh, 0.1, 0.1), mesh));
    const Normals::Parts parts = normals.parts();
    const Normals copy(parts.topology, parts.vertex_count, parts.sharpness);
    for (const NormalDomain domain : kDomains) {
        EXPECT_TRUE(
            same(computed(copy, domain, mesh.rest_points), computed(normals, domain, mesh.rest_points)));
    }
}

TEST(Normals, refuse_what_does_not_fit) {
    const Mesh mesh = random_mesh(8, 6);
    const std::vector<std::uint8_t> one{1};
    const std::size_t count = mesh.rest_points.size();
    const std::vector<std::uint8_t> faces(mesh.offsets.size() - 1, 0);
    auto one_flat = faces;
    one_flat[0] = 1;
    EXPECT_THROW(Normals(mesh.topology(), count - 30), std::invalid_argument);
    EXPECT_THROW(Normals(mesh.topology(), count, {one, {}}), std::invalid_argument);
    EXPECT_THROW(Normals(mesh.topology(), count, {{}, one}), std::invalid_argument);
    const std::vector<std::int16_t> numbers(mesh.corners.size());
    EXPECT_THROW(Normals(mesh.topology(), count, {{}, {}, numbers}), std::invalid_argument);
    EXPECT_NO_THROW(Normals({mesh.offsets, mesh.corners, {}}, count, {{}, faces}));
    // Fans need the edges.
    EXPECT_THROW(Normals({mesh.offsets, mesh.corners, {}}, count, {{}, one_flat}), std::invalid_argument);
}

}  // namespace
}  // namespace sinew
