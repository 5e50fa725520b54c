// SPDX-License-Identifier: GPL-3.0-or-later
// Spherical deform, and parameters of methods, since it has one.
#include "sinew/skinning/sdef.h"

#include <cmath>
#include <limits>
#include <vector>

#include "scene.h"
#include "sinew/deform/simd.h"

namespace sinew {
namespace {

using test::about;
using test::deformed;
using test::distance;
using test::in_double;
using test::is_finite;
using test::kTolerance;
using test::Random;
using test::random_scene;
using test::Scene;

constexpr double kNlerp[] = {0.0};
constexpr double kSlerp[] = {1.0};

/// Pairs from a few bones, so that many vertices have the same pair, then vertices of one to four bones.
Scene scene_of_pairs(std::uint32_t seed, bool scaled) {
    Random random(seed);
    Scene scene = random_scene(seed, 0, 1.0);
    if (!scaled) {
        for (Affine<float>& motion : scene.posed_from_rest)
            motion = cast<float>(to_affine(random.motion(1.0)));
    }
    for (int i = 0; i < 400; ++i) {
        auto influences = random.influences<float>(2, 12);
        influences[0].bone = i % 3;
        influences[1].bone = 3 + i % 2;
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
    }
    for (int i = 0; i < 100; ++i) {
        const auto count = static_cast<std::size_t>(1 + random.index(4));
        scene.add_vertex(Vec3<float>(random.vector(1.0)), random.influences<float>(count, 12));
    }
    return scene;
}

double largest_error(const std::vector<Vec3<float>>& points, const std::vector<Vec3<double>>& expected) {
    double error = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        error = std::max(error, distance(Vec3<double>(points[i]), expected[i]));
    }
    return error;
}

class EveryTarget : public testing::TestWithParam<std::string_view> {
protected:
    EveryTarget() { use_simd_target(GetParam()); }
    ~EveryTarget() override { use_simd_target(simd_targets().front()); }
};

INSTANTIATE_TEST_SUITE_P(Sdef, EveryTarget, testing::ValuesIn(simd_targets()),
                         [](const auto& info) { return std::string(info.param); });

TEST_P(EveryTarget, kernel_agrees_with_the_definition) {
    for (const bool scaled : {false, true}) {
        for (std::uint32_t seed = 0; seed < 5; ++seed) {
            const Scene scene = scene_of_pairs(seed, scaled);
            const Deformer deformer(scene.data(), Sdef::info);
            for (const std::span<const double> by : {std::span(kNlerp), std::span(kSlerp)}) {
                const auto points = deformed(deformer, scene, {{}, 0, by});
                EXPECT_LT(largest_error(points, in_double(Sdef::info, scene, by)), 4.0 * kTolerance)
                    << scaled;
            }
        }
    }
}

TEST_P(EveryTarget, bones_may_have_another_space) {
    const Scene scene = scene_of_pairs(7, true);
    Random random(8);
    const Affine<double> bones_from_model = to_affine(random.motion(1.0)) * test::scaling<double>({2, 2, 2});
    Scene moved = scene;
    moved.transform(cast<float>(inverse(bones_from_model)));
    const auto points =
        deformed(Deformer(moved.data(), Sdef::info), moved, {cast<float>(bones_from_model), 0, kSlerp});
    auto expected = in_double(Sdef::info, scene, kSlerp);
    for (Vec3<double>& point : expected) point = transform_point(inverse(bones_from_model), point);
    EXPECT_LT(largest_error(points, expected), 4.0 * kTolerance);
}

TEST_P(EveryTarget, opposite_quaternions_and_half_turns_are_finite) {
    Scene scene;
    scene.posed_from_rest = {Affine<float>{}};
    for (const double degrees : {179.999, 180.0, 180.001, 359.999, 360.0}) {
        scene.posed_from_rest.push_back(
            cast<float>(to_affine(QuatVec<double>{about<double>({1, 2, 3}, degrees), {1, 2, 3}})));
    }
    scene.rest_bones.resize(scene.posed_from_rest.size());
    Random random(9);
    for (std::int32_t bone = 1; bone < 6; ++bone) {
        for (int i = 0; i <= 20; ++i) {
            const float weight = 0.05f * static_cast<float>(i);
            scene.add_vertex(Vec3<float>(random.vector(1.0)), {{0, 1.0f - weight}, {bone, weight}});
        }
    }
    const Deformer deformer(scene.data(), Sdef::info);
    for (const std::span<const double> by : {std::span(kNlerp), std::span(kSlerp)}) {
        for (const Vec3<float>& point : deformed(deformer, scene, {{}, 0, by})) {
            ASSERT_TRUE(is_finite(point));
            // The bound for rotations about points within 1 of the origin, which move by at most (1, 2, 3).
            EXPECT_LT(glm::length(point), 10.0f);
        }
    }
}

// mmd_tools: R(v - C) + w0 M0 cr0 + w1 M1 cr1 with matrices of whole motions.
TEST(Sdef, definition_is_that_of_mmd_tools) {
    Random random(10);
    for (int i = 0; i < 50; ++i) {
        const QuatVec<double> motions[] = {random.motion(2.0), random.motion(2.0)};
        const std::vector<Sdef::Bone<double>> bones{{motions[0], {}, false}, {motions[1], {}, false}};
        const Vec3<double> rest = random.vector(1.0);
        const Vec3<double> c = random.vector(1.0);
        const Vec3<double> r[] = {random.vector(1.0), random.vector(1.0)};
        const double weight = random.uniform(0.0, 1.0);
        const std::vector<Influence<double>> influences{{0, 1.0 - weight}, {1, weight}};
        const double spheres[] = {c.x, c.y, c.z, r[0].x, r[0].y, r[0].z, r[1].x, r[1].y, r[1].z, 1.0};
        Quat<double> other = motions[1].rotation;
        if (glm::dot(motions[0].rotation, other) < 0.0) other = -other;
        const Quat<double> q = glm::normalize(motions[0].rotation * (1.0 - weight) + other * weight);
        const Vec3<double> mean = (1.0 - weight) * r[0] + weight * r[1];
        Vec3<double> expected = to_mat3(q) * (rest - c);
        for (std::size_t k = 0; k < 2; ++k) {
            const Vec3<double> moved_end = c + r[k] - mean;
            expected += influences[k].weight * transform_point(to_affine(motions[k]), 0.5 * (c + moved_end));
        }
        const auto points = Sdef::deform_vertex<double>(bones, influences, rest, spheres);
        EXPECT_LT(distance(points, expected), 1e-13);
    }
}

TEST(Sdef, slerp_is_at_even_speed) {
    const Quat<double> turn = about<double>({0, 0, 1}, 160.0);
    const std::vector<Sdef::Bone<double>> bones{{{}, {}, false}, {{turn, Vec3<double>(0.0)}, {}, false}};
    const double spheres[] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1.0};
    for (const double weight : {0.1, 0.25, 0.7}) {
        const std::vector<Influence<double>> influences{{0, 1.0 - weight}, {1, weight}};
        const auto point = Sdef::deform_vertex<double>(bones, influences, {1, 0, 0}, spheres, kSlerp);
        EXPECT_NEAR(glm::degrees(std::atan2(point.y, point.x)), 160.0 * weight, 1e-9);
        const auto by_nlerp = Sdef::deform_vertex<double>(bones, influences, {1, 0, 0}, spheres, kNlerp);
        EXPECT_GT(distance(point, by_nlerp), 0.02);
    }
}

TEST(Sdef, vertices_without_data_or_of_other_numbers_of_bones_are_blended_linearly) {
    Scene scene = scene_of_pairs(11, true);
    const auto linear = in_double(Lbs::info, scene);
    const auto points = deformed(Deformer(scene.data(), Sdef::info), scene);
    std::size_t spherical = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool has_two = scene.offsets[i + 1] - scene.offsets[i] == 2;
        const bool is_used = scene.vertex_numbers[Scene::kVertexNumbers * i + 9] != 0.0f;
        const double difference = distance(Vec3<double>(points[i]), linear[i]);
        if (has_two && is_used) {
            spherical += difference > 0.01 ? 1 : 0;
        } else {
            EXPECT_LT(difference, 4.0 * kTolerance);
        }
    }
    EXPECT_GT(spherical, 300u);
    BindData without = scene.data();
    without.vertex_data = {};
    EXPECT_LT(largest_error(deformed(Deformer(without, Sdef::info), scene), linear), 4.0 * kTolerance);
}

TEST(Parameters, those_not_given_or_out_of_range_have_valid_values) {
    const Scene scene = scene_of_pairs(12, false);
    const Deformer deformer(scene.data(), Sdef::info);
    const auto by = [&](std::initializer_list<double> values) {
        return deformed(deformer, scene, {{}, 0, std::span(values.begin(), values.size())});
    };
    const auto nlerp = by({0.0});
    const auto slerp = by({1.0});
    EXPECT_TRUE(nlerp != slerp);
    EXPECT_TRUE(deformed(deformer, scene) == nlerp);
    EXPECT_TRUE(by({}) == nlerp);
    EXPECT_TRUE(by({-5.0}) == nlerp);
    EXPECT_TRUE(by({std::nan("")}) == nlerp);
    EXPECT_TRUE(by({99.0, 3.0}) == slerp);
}

TEST(Parameters, the_method_of_the_mix_has_its_own) {
    const Scene scene = scene_of_pairs(13, false);
    const std::vector<float> all(scene.rest_points.size(), 1.0f);
    const std::vector<float> half(scene.rest_points.size(), 0.5f);
    const Binding binding(scene.data());
    const Deformer alone(binding, Sdef::info);
    const auto slerp = deformed(alone, scene, {{}, 0, kSlerp});
    const Deformer taken_over(binding, Dq::info, MixData{Sdef::info, all});
    EXPECT_TRUE(deformed(taken_over, scene, {{}, 0, {}, kSlerp}) == slerp);
    EXPECT_TRUE(deformed(taken_over, scene, {{}, 0, kSlerp}) != slerp);
    const Deformer both(binding, Sdef::info, MixData{Sdef::info, half});
    const auto nlerp = deformed(alone, scene);
    const auto between = deformed(both, scene, {{}, 0, kNlerp, kSlerp});
    for (std::size_t i = 0; i < between.size(); ++i) {
        ASSERT_LT(distance(between[i], 0.5f * (nlerp[i] + slerp[i])), 1e-6f);
    }
}

}  // namespace
}  // namespace sinew
