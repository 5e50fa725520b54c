// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the stage `delta_mush` on each instruction set against its definition in double, its radius,
// threads and degenerate meshes.
#include "sinew/stages/delta_mush/delta_mush.h"

#include <algorithm>
#include <limits>
#include <string>

#include "polygons.h"
#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew::test {
namespace {

std::vector<Vec3<float>> bent(const Mesh& mesh, std::uint32_t seed) {
    Random random(seed);
    std::vector<Vec3<float>> points;
    for (const Vec3<float>& p : mesh.rest_points) {
        const auto noise = Vec3<float>(random.vector(0.003));
        points.push_back(Vec3<float>(p.x, std::cos(2.0f * p.y) + p.z, std::sin(2.0f * p.y) + 0.2f * p.x) +
                         noise);
    }
    return points;
}

std::vector<float> weights_of(const Mesh& mesh, std::uint32_t seed) {
    Random random(seed);
    std::vector<float> weights;
    for (std::size_t i = 0; i < mesh.rest_points.size(); ++i) {
        weights.push_back(static_cast<float>(random.uniform(-0.3, 1.3)));
    }
    return weights;
}

/// The result by the definition, in double.
class Reference {
public:
    Reference(const Mesh& mesh, const DeltaMushSettings& settings) : mesh_(mesh), settings_(settings) {
        neighbours_.resize(mesh.rest_points.size());
        for (std::size_t i = 0; i < mesh.edges.size(); ++i) {
            neighbours_[static_cast<std::size_t>(mesh.edges[i])].push_back(
                static_cast<std::size_t>(mesh.edges[i ^ 1]));
        }
        factors_.assign(mesh.rest_points.size(), static_cast<double>(settings.factor));
        for (std::size_t i = 0; i < settings.weights.size(); ++i) {
            factors_[i] *= std::clamp(static_cast<double>(settings.weights[i]), 0.0, 1.0);
        }
        if (settings.pin_boundary) pin();
    }

    /// weights  receives the sum of the angles of each vertex's corners
    [[nodiscard]] std::vector<Vec3<double>> apply(std::span<const Vec3<float>> points, double scale,
                                                  std::vector<double>& weights) const {
        const auto rest = smoothed(mesh_.rest_points);
        auto result = smoothed(points);
        std::vector<Vec3<double>> details(result.size(), Vec3<double>(0.0));
        weights.assign(result.size(), 0.0);
        for_each_corner([&](std::size_t before, std::size_t at, std::size_t after) {
            const auto at_rest = DeltaMushDefinition::corner(rest[before], rest[at], rest[after]);
            const auto posed = DeltaMushDefinition::corner(result[before], result[at], result[after]);
            const Vec3<double> taken = Vec3<double>(mesh_.rest_points[at]) - rest[at];
            details[at] += posed.weight * (posed.axes * (glm::transpose(at_rest.axes) * taken));
            weights[at] += posed.weight;
        });
        for (std::size_t v = 0; v < result.size(); ++v) {
            if (weights[v] > 0.0) result[v] += scale / weights[v] * details[v];
        }
        return result;
    }

private:
    template <class Call>
    void for_each_corner(const Call& call) const {
        for (std::size_t face = 0; face + 1 < mesh_.offsets.size(); ++face) {
            const auto begin = static_cast<std::size_t>(mesh_.offsets[face]);
            const auto count = static_cast<std::size_t>(mesh_.offsets[face + 1]) - begin;
            const auto at = [&](std::size_t i) {
                return static_cast<std::size_t>(mesh_.corners[begin + i % count]);
            };
            for (std::size_t i = 0; i < count; ++i) call(at(i + count - 1), at(i), at(i + 1));
        }
    }

    void pin() {
        for (std::size_t edge = 0; edge < mesh_.edges.size(); edge += 2) {
            const auto a = static_cast<std::size_t>(mesh_.edges[edge]);
            const auto b = static_cast<std::size_t>(mesh_.edges[edge + 1]);
            int faces = 0;
            for_each_corner([&](std::size_t, std::size_t at, std::size_t after) {
                faces += std::minmax(at, after) == std::minmax(a, b);
            });
            if (faces == 1) factors_[a] = factors_[b] = 0.0;
        }
    }

    [[nodiscard]] std::vector<Vec3<double>> smoothed(std::span<const Vec3<float>> from) const {
        std::vector<Vec3<double>> points(from.begin(), from.end());
        for (std::size_t i = 0; i < settings_.iterations; ++i) {
            const auto before = points;
            for (std::size_t v = 0; v < points.size(); ++v) {
                std::vector<Vec3<double>> around;
                for (const std::size_t neighbour : neighbours_[v]) around.push_back(before[neighbour]);
                const std::span<const Vec3<double>> neighbours(around);
                points[v] = settings_.type == SmoothType::simple
                                ? DeltaMushDefinition::smoothed(before[v], neighbours, factors_[v])
                                : DeltaMushDefinition::smoothed_by_length(before[v], neighbours, factors_[v]);
            }
        }
        return points;
    }

    const Mesh& mesh_;
    const DeltaMushSettings& settings_;
    std::vector<std::vector<std::size_t>> neighbours_;
    std::vector<double> factors_;
};

std::vector<Vec3<float>> mushed(const DeltaMush& mush, std::vector<Vec3<float>> points, float scale = 1.0f,
                                std::size_t threads = 0) {
    EXPECT_EQ(mush.apply(points, scale, threads), Status::ok);
    return points;
}

class Mushes : public OnEachTarget {};

INSTANTIATE_TEST_SUITE_P(every, Mushes, testing::ValuesIn(simd_targets()), name_of_target);

TEST_P(Mushes, agree_with_the_definition_in_double) {
    const Mesh mesh = random_mesh(1, 20);
    const auto points = bent(mesh, 2);
    const auto weights = weights_of(mesh, 3);
    for (const auto type : {SmoothType::simple, SmoothType::length_weighted}) {
        for (const std::size_t iterations : {0, 1, 5, 30}) {
            for (const bool masked : {false, true}) {
                DeltaMushSettings settings{iterations, 0.0f, masked ? 0.9f : 0.5f, type, masked, {}};
                if (masked) settings.weights = weights;
                const float scale = masked ? 0.7f : 1.0f;
                std::vector<double> angles;
                const auto expected =
                    Reference(mesh, settings).apply(points, static_cast<double>(scale), angles);
                const auto result =
                    mushed(DeltaMush(mesh.topology(), mesh.rest_points, settings), points, scale);
                std::size_t compared = 0;
                for (std::size_t v = 0; v < result.size(); ++v) {
                    // For corners that are almost straight, half of the angle's digits are rounding.
                    if (angles[v] > 0.0 && angles[v] < 0.3) continue;
                    ++compared;
                    ASSERT_LT(distance(Vec3<double>(result[v]), expected[v]), 1e-5) << v << " " << iterations;
                }
                EXPECT_GT(compared, result.size() * 9 / 10);
            }
        }
    }
}

TEST_P(Mushes, agree_where_an_edge_of_the_smoothed_points_has_no_length) {
    Mesh mesh;
    mesh.rest_points = {{0.1f, 0.2f, 0.3f}, {1, 0, 0.1f}, {0.1f, 1, 0}, {-1, 0.2f, 0}, {0, -1, 0.2f}};
    for (std::int32_t i = 1; i <= 4; ++i) mesh.add_face({0, i, i % 4 + 1});
    mesh.add_edges_of_faces();
    // Only the first vertex is smoothed, and moves to the second, because the others sum to 0.
    const std::vector<float> weights{1, 0, 0, 0, 0};
    const std::vector<Vec3<float>> points{{0, 0, 0}, {0, 0, 0}, {1, 0, 0.5f}, {-1, 1, 0}, {0, -1, -0.5f}};
    DeltaMushSettings settings{.iterations = 1, .factor = 1.0f};
    settings.weights = weights;
    std::vector<double> angles;
    const auto expected = Reference(mesh, settings).apply(points, 1.0, angles);
    const auto result = mushed(DeltaMush(mesh.topology(), mesh.rest_points, settings), points);
    EXPECT_LT(distance(Vec3<double>(result[0]), expected[0]), 1e-6);
    EXPECT_GT(glm::length(expected[0]), 0.1);
}

TEST_P(Mushes, threads_change_no_bit) {
    const Mesh mesh = random_mesh(5, 150);
    const auto points = bent(mesh, 6);
    for (const auto type : {SmoothType::simple, SmoothType::length_weighted}) {
        const DeltaMush mush(mesh.topology(), mesh.rest_points, {.iterations = 7, .type = type});
        const auto expected = mushed(mush, points, 1.0f, 1);
        for (const std::size_t threads : {2, 3, 8}) {
            EXPECT_TRUE(same_bits(mushed(mush, points, 1.0f, threads), expected)) << threads;
        }
    }
}

// A step across a sheet becomes the integral of a Gaussian: at the distance of its width, erf(1 / sqrt(2)) =
// 0.683.
TEST(Radius, is_the_width_of_a_Gaussian_however_dense_the_mesh_is) {
    for (const auto type : {SmoothType::simple, SmoothType::length_weighted}) {
        for (const std::int32_t size : {41, 101}) {
            const Mesh mesh = sheet(size);
            const DeltaMush mush(mesh.topology(), mesh.rest_points, {.radius = 0.1f, .type = type});
            // The step is small, so that lengths of edges hardly change. A flat sheet has no details.
            auto points = mesh.rest_points;
            for (Vec3<float>& point : points) point.z = point.x < 0.501f ? -1e-3f : 1e-3f;
            EXPECT_EQ(mush.apply(points, 0.0f), Status::ok);
            const auto at = [&](float x) {
                const auto column = static_cast<std::size_t>(std::lround(x * static_cast<float>(size - 1)));
                return 1e3f *
                       points[column * static_cast<std::size_t>(size) + static_cast<std::size_t>(size / 2)].z;
            };
            // The step is half an edge away from the vertices on both sides.
            EXPECT_NEAR(at(0.6f) - at(0.4f), 2.0f * 0.683f, 0.03f) << size;
            EXPECT_NEAR(at(0.7f) - at(0.3f), 2.0f * 0.954f, 0.03f) << size;
        }
    }
}

TEST(DeltaMush, takes_meshes_without_faces_and_without_vertices) {
    std::vector<Vec3<float>> none;
    EXPECT_EQ(DeltaMush({std::vector<std::int32_t>{0}, {}, {}}, none, {}).apply(none), Status::ok);
    std::vector<Vec3<float>> points{{0, 0, 0}, {1, 0, 0}, {5, 5, 5}};
    const std::vector<std::int32_t> offsets{0}, edges{0, 1};
    const DeltaMush mush({offsets, {}, edges}, points, {.iterations = 1});
    // Smoothed, without details.
    const std::vector<Vec3<float>> expected{{0.5f, 0, 0}, {0.5f, 0, 0}, {5, 5, 5}};
    EXPECT_EQ(mushed(mush, points), expected);
    std::vector<Vec3<float>> fewer(2, Vec3<float>(7.0f));
    EXPECT_EQ(mush.apply(fewer), Status::size);
    EXPECT_EQ(fewer, std::vector<Vec3<float>>(2, Vec3<float>(7.0f)));
    for (const float scale :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        EXPECT_EQ(mush.apply(points, scale), Status::not_finite);
        EXPECT_EQ(points, (std::vector<Vec3<float>>{{0, 0, 0}, {1, 0, 0}, {5, 5, 5}}));
    }
}

// Faces without size, and spikes.
TEST(DeltaMush, has_no_NaN_where_faces_are_degenerate) {
    const std::vector<std::int32_t> offsets{0, 3, 6, 10}, corners{0, 1, 2, 2, 1, 0, 0, 1, 0, 2},
        edges{0, 1, 1, 2, 2, 0};
    for (const Vec3<float>& third : {Vec3<float>(0, 0, 0), Vec3<float>(2, 0, 0), Vec3<float>(1e-30f, 0, 0)}) {
        const std::vector<Vec3<float>> points{{0, 0, 0}, {1, 0, 0}, third};
        for (const auto type : {SmoothType::simple, SmoothType::length_weighted}) {
            const DeltaMush mush({offsets, corners, edges}, points, {.type = type});
            for (const Vec3<float>& point : mushed(mush, points)) {
                EXPECT_TRUE(std::isfinite(point.x + point.y + point.z));
            }
        }
    }
}

}  // namespace
}  // namespace sinew::test
