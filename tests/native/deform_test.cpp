// SPDX-License-Identifier: GPL-3.0-or-later
// Protects what only C++ can ask of a Deformer: poses of too few bones, sizes and parameters that do not fit,
// moves, and new rest points beside a frame. tests/python/library/test_deformer.py has the rest.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "scene.h"
#include "sinew/deformer.h"

namespace sinew::test {
namespace {

class Deform : public testing::TestWithParam<MethodInfo> {
protected:
    static const MethodInfo& method() { return GetParam(); }
};

INSTANTIATE_TEST_SUITE_P(every, Deform, testing::ValuesIn(kMethods),
                         [](const auto& info) { return std::string(info.param.name); });

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
                EXPECT_EQ(deformer.deform({shorter, space}, {}, points), Status::ok);
                const auto expected = deformed(deformer, whole, {}, space);
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
        EXPECT_EQ(deformer.deform({scene.posed_from_rest}, {}, points), Status::size);
        for (const auto& point : points) ASSERT_TRUE(same_bits(point, mark));
    }
}

TEST_P(Deform, refuses_rest_points_that_do_not_fit_or_are_not_finite) {
    const Scene scene = random_scene(19, 30, 1.0);
    Deformer deformer(scene.data(), method());
    const auto expected = deformed(deformer, scene);
    for (const std::size_t size : {0, 29, 31}) {
        EXPECT_EQ(deformer.set_rest_points(std::vector<Vec3<float>>(size)), Status::size);
    }
    auto points = scene.rest_points;
    points.back().y = std::numeric_limits<float>::infinity();
    EXPECT_EQ(deformer.set_rest_points(points), Status::not_finite);
    EXPECT_TRUE(same_bits(deformed(deformer, scene), expected));
}

// Not a bone of the vertex before it is stored and none afterwards.
TEST_P(Deform, weights_that_vanish_beside_the_others_count_as_0) {
    Scene scene = random_scene(23, 30, 1.0);
    scene.add_vertex({1, 2, 3}, {{0, 1e30f}, {1, 1e30f}, {2, 1e-20f}});
    scene.add_vertex({1, 2, 3}, {{3, 0.0f}, {4, 1e-20f}, {5, 1e-38f}});
    const Deformer deformer(scene.data(), method());
    const BoundMesh bound = deformer.unpack();
    EXPECT_EQ(bound.influence_offsets[31] - bound.influence_offsets[30], 2);
    EXPECT_EQ(deformer.influence_count(), bound.influence_bones.size());
    BindData stored = bound.data();
    stored.vertex_data = scene.data().vertex_data;
    EXPECT_TRUE(same_bits(deformed(Deformer(stored, method()), scene), deformed(deformer, scene)));
}

TEST_P(Deform, results_have_the_old_rest_points_or_the_new) {
    Scene scene = random_scene(20, 10000, 1.0);
    Deformer deformer(scene.data(), method());
    const std::vector<Vec3<float>> old_rest(scene.rest_points.size(), Vec3<float>(0.25f));
    const std::vector<Vec3<float>> new_rest(scene.rest_points.size(), Vec3<float>(-0.5f));
    const auto results = [&](const std::vector<Vec3<float>>& rest) {
        EXPECT_EQ(deformer.set_rest_points(rest), Status::ok);
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
                EXPECT_EQ(deformer.deform({scene.posed_from_rest}, {static_cast<std::size_t>(1 + reader % 2)},
                                          points),
                          Status::ok);
                const auto& expected = same_bits(points[0], with_old[0]) ? with_old : with_new;
                if (!same_bits(points, expected)) ++torn;
            }
        });
    }
    for (int round = 0; round < 20; ++round) {
        EXPECT_EQ(deformer.set_rest_points(round % 2 == 0 ? new_rest : old_rest), Status::ok);
    }
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

TEST(Parameters, those_not_given_or_out_of_range_have_valid_values) {
    const Scene scene = random_scene(22, 200, 1.0);
    const Deformer deformer(scene.data(), Sdef::info);
    const auto by = [&](std::initializer_list<double> values) {
        return deformed(deformer, scene, {0, std::span(values.begin(), values.size())});
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

TEST(Deformer, refuses_more_influences_of_a_vertex_than_the_limit) {
    if (kRunsSlowly) GTEST_SKIP();
    const auto with_influences = [](std::size_t count) {
        Scene scene;
        scene.add_vertex({0, 0, 0}, std::vector<Influence<float>>(count, {0, 1.0f}));
        const Deformer deformer(scene.data(), Dq::info);
    };
    EXPECT_NO_THROW(with_influences(65536));
    EXPECT_THROW(with_influences(65537), std::invalid_argument);
}

}  // namespace
}  // namespace sinew::test
