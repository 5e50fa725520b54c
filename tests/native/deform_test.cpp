// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "scene.h"
#include "sinew/deform/deformer.h"

namespace sinew {
namespace {

using test::about;
using test::deformed;
using test::distance;
using test::in_double;
using test::kTolerance;
using test::random_scene;
using test::same_bits;
using test::scaling;
using test::Scene;

class Deform : public testing::TestWithParam<MethodInfo> {
protected:
    static const MethodInfo& method() { return GetParam(); }
};

INSTANTIATE_TEST_SUITE_P(every, Deform, testing::ValuesIn(kMethods),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_P(Deform, agrees_with_skinning_in_double) {
    double worst = 0.0;
    for (const double extent : {0.01, 1.0, 100.0}) {
        for (std::uint32_t seed = 0; seed < 5; ++seed) {
            const Scene scene = random_scene(seed, 500, extent);
            const auto expected = in_double(method(), scene);
            const auto points = deformed(Deformer(scene.data(), method()), scene);
            for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
                worst = std::max(worst, distance(Vec3<double>(points[vertex]), expected[vertex]) / extent);
            }
        }
    }
    RecordProperty("worst_error", std::to_string(worst * 1e9) + "e-9");
    EXPECT_LT(worst, kTolerance);
}

TEST_P(Deform, threads_change_no_bit) {
    for (const std::size_t vertices : {0, 1, 4095, 4096, 4097, 8191, 8192, 8193, 12289, 20000}) {
        const Scene scene = random_scene(7, vertices, 1.0);
        const Deformer deformer(scene.data(), method());
        const auto expected = deformed(deformer, scene, {{}, 1});
        for (std::size_t threads = 0; threads <= 8; ++threads) {
            const auto points = deformed(deformer, scene, {{}, threads});
            ASSERT_EQ(points.size(), vertices);
            for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
                ASSERT_TRUE(same_bits(points[vertex], expected[vertex])) << vertex << " on " << threads;
            }
        }
    }
}

TEST_P(Deform, vertices_without_weight_stay_to_the_bit) {
    Scene scene = random_scene(8, 3, 1.0);
    const Vec3<float> rest(0.1f, -2e-20f, 3e20f);
    scene.add_vertex(rest, {});
    scene.add_vertex(rest, {{0, 0.0f}, {11, 0.0f}});
    const Deformer deformer(scene.data(), method());
    DeformOptions options;
    for (int space = 0; space < 2; ++space) {
        const auto points = deformed(deformer, scene, options);
        EXPECT_TRUE(same_bits(points[3], rest));
        EXPECT_TRUE(same_bits(points[4], rest));
        options.bones_from_model = {to_mat3(about<float>({1, 2, 3}, 40.0f)), {1, 2, 3}};
    }
}

TEST_P(Deform, weights_are_normalised) {
    const Scene scene = random_scene(9, 200, 1.0);
    const auto expected = deformed(Deformer(scene.data(), method()), scene);
    // Powers of two scale without rounding, so the results must be equal.
    for (const float factor : {0x1p-80f, 0.25f, 0x1p80f}) {
        Scene scaled = scene;
        for (float& weight : scaled.weights) weight *= factor;
        const auto points = deformed(Deformer(scaled.data(), method()), scaled);
        for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
            ASSERT_TRUE(same_bits(points[vertex], expected[vertex])) << factor;
        }
    }
}

TEST_P(Deform, the_largest_weights_do_not_overflow) {
    Scene scene = random_scene(10, 0, 1.0);
    const float most = std::numeric_limits<float>::max();
    scene.add_vertex({1, 2, 3}, {{0, most}, {1, most}, {2, most}});
    Scene plain = random_scene(10, 0, 1.0);
    plain.add_vertex({1, 2, 3}, {{0, 1.0f}, {1, 1.0f}, {2, 1.0f}});
    EXPECT_TRUE(same_bits(deformed(Deformer(scene.data(), method()), scene)[0],
                          deformed(Deformer(plain.data(), method()), plain)[0]));
}

TEST_P(Deform, rest_pose_is_unchanged_to_the_bit) {
    Scene scene = random_scene(11, 500, 1000.0);
    scene.posed_from_rest.assign(scene.posed_from_rest.size(), {});
    const auto points = deformed(Deformer(scene.data(), method()), scene);
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        ASSERT_TRUE(same_bits(points[vertex], scene.rest_points[vertex]));
    }
}

TEST_P(Deform, new_rest_points_equal_a_new_deformer) {
    Scene scene = random_scene(12, 300, 1.0);
    Deformer deformer(scene.data(), method());
    for (Vec3<float>& point : scene.rest_points) point = 0.5f * point + Vec3<float>(0, 1, 0);
    deformer.set_rest_points(scene.rest_points);
    const auto expected = deformed(Deformer(scene.data(), method()), scene);
    const auto points = deformed(deformer, scene);
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        ASSERT_TRUE(same_bits(points[vertex], expected[vertex]));
    }
}

TEST_P(Deform, bones_from_model_goes_there_and_back) {
    const Scene scene = random_scene(13, 300, 1.0);
    const Affine<double> rotation = to_affine(QuatVec<double>{about<double>({1, 2, 3}, 40.0), {1, -2, 3}});
    const Affine<float> bones_from_model = cast<float>(rotation * scaling<double>({2.0, 0.5, -1.5}));
    const auto points = deformed(Deformer(scene.data(), method()), scene, {bones_from_model, 0});
    Scene other = scene;
    other.transform(bones_from_model);
    const auto moved = deformed(Deformer(other.data(), method()), other);
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        const Vec3<float> expected = transform_point(inverse(bones_from_model), moved[vertex]);
        ASSERT_LT(distance(points[vertex], expected), 1e-5);
    }
}

TEST_P(Deform, bones_from_model_conjugates_one_bone) {
    Scene scene = random_scene(14, 0, 1.0);
    scene.add_vertex({0.1f, 0.2f, 0.3f}, {{0, 1.0f}});
    const Affine<double> bones_from_model =
        to_affine(QuatVec<double>{about<double>({1, 2, 3}, 40.0), {1, -2, 3}});
    const Affine<double> expected =
        inverse(bones_from_model) * cast<double>(scene.posed_from_rest[0]) * bones_from_model;
    const auto points = deformed(Deformer(scene.data(), method()), scene, {cast<float>(bones_from_model), 0});
    EXPECT_LT(distance(Vec3<double>(points[0]), transform_point(expected, {0.1, 0.2, 0.3})), 5e-6);
}

TEST_P(Deform, empty_rest_bones_mean_identity) {
    Scene scene = random_scene(15, 200, 1.0);
    scene.rest_bones.clear();
    const auto points = deformed(Deformer(scene.data(), method()), scene);
    scene.rest_bones.assign(scene.posed_from_rest.size(), {});
    const auto expected = deformed(Deformer(scene.data(), method()), scene);
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        ASSERT_TRUE(same_bits(points[vertex], expected[vertex]));
    }
}

TEST_P(Deform, bones_that_no_influence_names_are_not_needed) {
    Scene scene = random_scene(16, 0, 1.0);
    scene.add_vertex({1, 2, 3}, {{1, 1.0f}});
    const Deformer deformer(scene.data(), method());
    EXPECT_EQ(deformer.bone_count(), 2u);
    const auto expected = deformed(deformer, scene);
    scene.posed_from_rest.resize(2);
    EXPECT_TRUE(same_bits(deformed(deformer, scene)[0], expected[0]));
}

TEST_P(Deform, bones_that_the_pose_lacks_stay_at_rest) {
    for (const bool scaled : {false, true}) {
        Scene scene = random_scene(18, 300, 1.0);
        if (!scaled) {
            for (std::size_t bone = 2; bone < 12; bone += 3)
                scene.posed_from_rest[bone] = scene.posed_from_rest[0];
        } else {
            // Not of unit length, so it is prepared one by one in any pose.
            scene.rest_bones[11] = cast<float>(scaling<double>({2.0, 2.0, 2.0}));
        }
        const Deformer deformer(scene.data(), method());
        for (const std::size_t bones : {0, 1, 5, 11}) {
            Scene whole = scene;
            for (std::size_t bone = bones; bone < 12; ++bone) whole.posed_from_rest[bone] = {};
            // Allocated with exactly this size, so that the address sanitizer detects a read past its end.
            const std::vector<Affine<float>> shorter(
                scene.posed_from_rest.begin(), scene.posed_from_rest.begin() + static_cast<long>(bones));
            std::vector<Vec3<float>> points(deformer.vertex_count());
            for (const Affine<float>& space :
                 {Affine<float>{}, cast<float>(scaling<double>({1.0, 2.0, 1.0}))}) {
                EXPECT_TRUE(deformer.deform(shorter, {space, 0}, points));
                const auto expected = deformed(deformer, whole, {space, 0});
                for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
                    // A stretched rest bone has scale even if it does not move.
                    ASSERT_LT(distance(points[vertex], expected[vertex]), scaled ? 20.0 : 1e-5) << bones;
                }
            }
        }
    }
}

TEST_P(Deform, writes_nothing_to_points_of_another_number) {
    const Scene scene = random_scene(19, 30, 1.0);
    const Deformer deformer(scene.data(), method());
    for (const std::size_t size : {0, 29, 31}) {
        const Vec3<float> mark(-1e9f);
        std::vector<Vec3<float>> points(size, mark);
        EXPECT_FALSE(deformer.deform(scene.posed_from_rest, {}, points));
        for (const auto& point : points) ASSERT_TRUE(same_bits(point, mark));
    }
}

TEST_P(Deform, results_have_the_old_rest_points_or_the_new) {
    Scene scene = random_scene(20, 10000, 1.0);
    Deformer deformer(scene.data(), method());
    const std::vector<Vec3<float>> old_rest(scene.rest_points.size(), Vec3<float>(0.25f));
    const std::vector<Vec3<float>> new_rest(scene.rest_points.size(), Vec3<float>(-0.5f));
    const auto results = [&](const std::vector<Vec3<float>>& rest) {
        deformer.set_rest_points(rest);
        return deformed(deformer, scene);
    };
    const auto with_new = results(new_rest);
    const auto with_old = results(old_rest);
    std::atomic<bool> done{false};
    std::atomic<int> torn{0};
    std::vector<std::thread> readers;
    // More threads than palettes.
    for (int reader = 0; reader < 20; ++reader) {
        readers.emplace_back([&, reader] {
            std::vector<Vec3<float>> points(scene.rest_points.size());
            while (!done) {
                EXPECT_TRUE(deformer.deform(scene.posed_from_rest,
                                            {{}, static_cast<std::size_t>(1 + reader % 2)}, points));
                const auto& expected = same_bits(points[0], with_old[0]) ? with_old : with_new;
                if (!std::ranges::equal(points, expected, same_bits<float>)) ++torn;
            }
        });
    }
    for (int round = 0; round < 20; ++round) deformer.set_rest_points(round % 2 == 0 ? new_rest : old_rest);
    done = true;
    for (std::thread& reader : readers) reader.join();
    EXPECT_EQ(torn, 0);
}

TEST_P(Deform, moved_deformers_go_on) {
    const Scene scene = random_scene(21, 30, 1.0);
    Deformer first(scene.data(), method());
    const auto expected = deformed(first, scene);
    Deformer second(std::move(first));
    EXPECT_TRUE(same_bits(deformed(second, scene)[7], expected[7]));
    first = std::move(second);
    EXPECT_TRUE(same_bits(deformed(first, scene)[7], expected[7]));
}

TEST_P(Deform, says_what_it_was_made_of) {
    Scene scene = random_scene(17, 0, 1.0);
    scene.add_vertex({1, 2, 3}, {{1, 1.0f}, {4, 0.0f}});
    scene.add_vertex({1, 2, 3}, {});
    const Deformer deformer(scene.data(), method());
    EXPECT_EQ(deformer.method(), method());
    EXPECT_EQ(deformer.vertex_count(), 2u);
    EXPECT_EQ(deformer.influence_count(), 1u);
    EXPECT_EQ(deformer.bone_count(), 5u);
}

std::string message_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "nothing thrown";
}

std::string refusal(const std::function<void(Scene&)>& spoil) {
    Scene scene;
    scene.add_vertex({0, 0, 0}, {{0, 1.0f}});
    scene.add_vertex({1, 1, 1}, {{0, 0.5f}, {1, 0.5f}});
    spoil(scene);
    return message_of([&] { const Deformer deformer(scene.data(), Lbs::info); });
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Deformer, accepts_the_scene_that_the_refusals_spoil) {
    EXPECT_EQ(refusal([](Scene&) {}), "nothing thrown");
}

TEST(Deformer, refuses_rest_points_that_are_not_finite) {
    EXPECT_EQ(refusal([](Scene& s) { s.rest_points[1].y = kNan; }),
              "rest_points: expected finite values, got NaN or infinity at vertex 1");
    EXPECT_EQ(refusal([](Scene& s) { s.rest_points[0].z = -kInfinity; }),
              "rest_points: expected finite values, got NaN or infinity at vertex 0");
}

TEST(Deformer, refuses_another_number_of_weights) {
    EXPECT_EQ(refusal([](Scene& s) { s.weights.pop_back(); }),
              "influence_weights: expected one for each of the 3 influence_bones, got 2");
}

TEST(Deformer, refuses_another_number_of_offsets) {
    EXPECT_EQ(refusal([](Scene& s) { s.offsets.pop_back(); }),
              "influence_offsets: expected 3 values (vertices + 1), got 2");
    EXPECT_EQ(refusal([](Scene& s) { s.offsets.clear(); }),
              "influence_offsets: expected 3 values (vertices + 1), got 0");
}

TEST(Deformer, refuses_offsets_that_do_not_rise_from_0_to_the_end) {
    EXPECT_EQ(refusal([](Scene& s) {
                  s.offsets = {1, 1, 3};
              }),
              "influence_offsets: expected 0 at the start, got 1");
    EXPECT_EQ(refusal([](Scene& s) {
                  s.offsets = {0, -1, 3};
              }),
              "influence_offsets: expected values that never fall, got -1 after 0 at vertex 0");
    EXPECT_EQ(refusal([](Scene& s) {
                  s.offsets = {0, 4, 3};
              }),
              "influence_offsets: expected values that never fall, got 3 after 4 at vertex 1");
    EXPECT_EQ(refusal([](Scene& s) {
                  s.offsets = {0, 1, 2};
              }),
              "influence_offsets: expected 3 at the end (the number of influences), got 2");
    EXPECT_EQ(refusal([](Scene& s) {
                  s.offsets = {0, 1, 4};
              }),
              "influence_offsets: expected 3 at the end (the number of influences), got 4");
}

TEST(Deformer, refuses_a_negative_bone) {
    EXPECT_EQ(refusal([](Scene& s) { s.bones[2] = -1; }),
              "influence_bones: expected indices of bones, 0 or more, got -1 at influence 2");
}

TEST(Deformer, refuses_bones_beyond_the_limit) {
    EXPECT_EQ(refusal([](Scene& s) { s.bones[1] = (1 << 20) - 1; }), "nothing thrown");
    EXPECT_EQ(refusal([](Scene& s) { s.bones[1] = 1 << 20; }),
              "influence_bones: expected indices of bones below 1048576, got 1048576 at influence 1");
    EXPECT_EQ(refusal([](Scene& s) { s.bones[2] = std::numeric_limits<std::int32_t>::max(); }),
              "influence_bones: expected indices of bones below 1048576, got 2147483647 at influence 2");
}

// Checks only sizes: no array of such a size exists.
TEST(Deformer, refuses_more_than_it_can_number) {
    const Vec3<float> point(0.0f);
    const std::size_t many = std::size_t{1} << 31;
    BindData data{{&point, many}, {}, {}, {}, {}};
    EXPECT_EQ(message_of([&] { const Deformer deformer(data, Lbs::info); }),
              "rest_points: expected at most 2147483647 vertices, got 2147483648");
    const std::int32_t bone = 0;
    data = {{&point, 1}, {}, {&bone, many}, {}, {}};
    EXPECT_EQ(message_of([&] { const Deformer deformer(data, Lbs::info); }),
              "influence_bones: expected at most 2147483647 influences, got 2147483648");
}

TEST(Deformer, refuses_more_influences_of_a_vertex_than_the_limit) {
    if (test::kRunsSlowly) GTEST_SKIP();
    const auto with_influences = [](std::size_t count) {
        Scene scene;
        scene.add_vertex({0, 0, 0}, {{0, 1.0f}});
        scene.add_vertex({0, 0, 0}, std::vector<Influence<float>>(count, {0, 1.0f}));
        return message_of([&] { const Deformer deformer(scene.data(), Dq::info); });
    };
    EXPECT_EQ(with_influences(65536), "nothing thrown");
    EXPECT_EQ(with_influences(65537),
              "influence_offsets: expected at most 65536 influences a vertex, got 65537 at vertex 1");
}

TEST(Deformer, refuses_rest_bones_that_are_not_finite) {
    EXPECT_EQ(refusal([](Scene& s) {
                  s.rest_bones.resize(2);
                  s.rest_bones[1].linear[2].y = kNan;
              }),
              "rest_bones: expected finite values, got NaN or infinity at bone 1");
    EXPECT_EQ(refusal([](Scene& s) {
                  s.rest_bones.resize(3);
                  s.rest_bones[0].translation.x = -kInfinity;
              }),
              "rest_bones: expected finite values, got NaN or infinity at bone 0");
}

TEST(Deformer, refuses_weights_that_are_negative_or_not_finite) {
    EXPECT_EQ(refusal([](Scene& s) { s.weights[1] = -0.5f; }),
              "influence_weights: expected finite values, 0 or more, got -0.500000 at influence 1");
    EXPECT_EQ(refusal([](Scene& s) { s.weights[0] = kInfinity; }),
              "influence_weights: expected finite values, 0 or more, got inf at influence 0");
    EXPECT_NE(refusal([](Scene& s) { s.weights[0] = kNan; }).find("nan at influence 0"), std::string::npos);
}

TEST(Deformer, refuses_too_few_rest_bones) {
    EXPECT_EQ(refusal([](Scene& s) { s.rest_bones.resize(1); }),
              "rest_bones: expected at least 2 bones, got 1");
}

TEST(Deformer, refuses_other_new_rest_points) {
    Scene scene;
    scene.add_vertex({0, 0, 0}, {{0, 1.0f}});
    Deformer deformer(scene.data(), Lbs::info);
    const std::vector<Vec3<float>> two(2);
    const std::vector<Vec3<float>> spoilt{{0, kNan, 0}};
    EXPECT_EQ(message_of([&] { deformer.set_rest_points(two); }), "rest_points: expected 1 points, got 2");
    EXPECT_EQ(message_of([&] { deformer.set_rest_points(spoilt); }),
              "rest_points: expected finite values, got NaN or infinity at vertex 0");
    scene.posed_from_rest.resize(1);
    EXPECT_TRUE(same_bits(deformed(deformer, scene)[0], {0, 0, 0}));
}

TEST(Deformer, empty_mesh_works) {
    const Scene scene;
    const Deformer deformer(scene.data(), Dq::info);
    EXPECT_EQ(deformer.bone_count(), 0u);
    EXPECT_TRUE(deformed(deformer, scene).empty());
}

}  // namespace
}  // namespace sinew
