// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the stage `mix` of each two methods on each instruction set.
#include "sinew/stages/mix/mix.h"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <tuple>

#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew::test {
namespace {

/// Long runs of 0 and of 1, as painted weights have them, and values in between.
std::vector<float> painted(std::uint32_t seed, std::size_t vertices) {
    Random random(seed);
    std::vector<float> weights(vertices);
    for (std::size_t begin = 0; begin < vertices;) {
        const std::size_t end = std::min(vertices, begin + 1 + static_cast<std::size_t>(random.index(90)));
        const int kind = random.index(3);
        for (; begin < end; ++begin) {
            weights[begin] =
                kind < 2 ? static_cast<float>(kind) : static_cast<float>(random.uniform(0.0, 1.0));
        }
    }
    return weights;
}

/// A scene with few sets of bones in order, so that whole blocks have weights of 0 and of 1.
Scene scene_in_order(std::uint32_t seed, std::size_t vertices) {
    Random random(seed);
    Scene scene = random_scene(seed, 0, 1.0);
    for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
        auto influences = random.influences<float>(1 + vertex / 200 % 5, 12);
        for (std::size_t k = 0; k < influences.size(); ++k) {
            influences[k].bone = static_cast<std::int32_t>((vertex / 200 + 2 * k) % 12);
        }
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
    }
    return scene;
}

class Mixes : public testing::TestWithParam<std::tuple<std::string_view, MethodInfo, MethodInfo>> {
protected:
    void SetUp() override { use_simd_target(std::get<0>(GetParam())); }
    void TearDown() override { use_simd_target(simd_targets().front()); }
    static const MethodInfo& first() { return std::get<1>(GetParam()); }
    static const MethodInfo& second() { return std::get<2>(GetParam()); }
};

std::span<const MethodInfo> second_methods() {
    return std::span(kMethods).first(kRunsSlowly ? 1 : kMethodCount);
}

INSTANTIATE_TEST_SUITE_P(every, Mixes,
                         testing::Combine(testing::ValuesIn(simd_targets()), testing::ValuesIn(kMethods),
                                          testing::ValuesIn(second_methods())),
                         [](const auto& info) {
                             return std::string(std::get<0>(info.param)) + "_" +
                                    std::string(std::get<1>(info.param).name) + "_" +
                                    std::string(std::get<2>(info.param).name);
                         });

TEST_P(Mixes, agree_with_skinning_in_double) {
    for (const bool ordered : {false, true}) {
        const Scene scene = ordered ? scene_in_order(1, 1500) : random_scene(1, 700, 1.0);
        const auto weights = painted(2, scene.rest_points.size());
        const auto a = in_double(first(), scene);
        const auto b = in_double(second(), scene);
        const auto points =
            deformed(Deformer(Binding(scene.data()), first(), MixData{second(), weights}), scene);
        for (std::size_t v = 0; v < points.size(); ++v) {
            const Vec3<double> expected = Mix::deform_vertex(a[v], b[v], static_cast<double>(weights[v]));
            ASSERT_LT(distance(Vec3<double>(points[v]), expected), kTolerance) << v;
        }
    }
}

TEST_P(Mixes, where_weights_are_0_or_1_have_the_bits_of_one_method) {
    const Scene scene = scene_in_order(3, 3000);
    const Binding binding(scene.data());
    const auto weights = painted(4, scene.rest_points.size());
    ASSERT_GT(std::ranges::count(weights, 0.0f), 500);
    ASSERT_GT(std::ranges::count(weights, 1.0f), 500);
    const Affine<float> another_space{to_mat3(about<float>({1, 2, 3}, 40.0f)), {1, -2, 3}};
    for (const Affine<float>& space : {Affine<float>{}, another_space}) {
        const auto a = deformed(Deformer(binding, first()), scene, {}, space);
        const auto b = deformed(Deformer(binding, second()), scene, {}, space);
        const auto points =
            deformed(Deformer(binding, first(), MixData{second(), weights}), scene, {}, space);
        for (std::size_t v = 0; v < points.size(); ++v) {
            if (weights[v] == 0.0f) {
                ASSERT_TRUE(same_bits(points[v], a[v])) << v;
            } else if (weights[v] == 1.0f) {
                ASSERT_TRUE(same_bits(points[v], b[v])) << v;
            }
        }
    }
}

TEST_P(Mixes, keep_the_rest_pose_to_the_bit) {
    Scene scene = random_scene(5, 500, 1000.0);
    scene.posed_from_rest.assign(scene.posed_from_rest.size(), {});
    const auto weights = painted(6, scene.rest_points.size());
    const auto points = deformed(Deformer(Binding(scene.data()), first(), MixData{second(), weights}), scene);
    EXPECT_TRUE(same_bits(points, scene.rest_points));
}

TEST_P(Mixes, threads_change_no_bit) {
    const Scene scene = scene_in_order(7, 20000);
    const auto weights = painted(8, scene.rest_points.size());
    const Deformer deformer(Binding(scene.data()), first(), MixData{second(), weights});
    const auto expected = deformed(deformer, scene, {1});
    for (std::size_t threads = 2; threads <= 5; ++threads) {
        const auto points = deformed(deformer, scene, {threads});
        ASSERT_TRUE(same_bits(points, expected)) << threads;
    }
}

TEST(Mix, weights_beyond_0_to_1_are_clamped) {
    const Scene scene = random_scene(9, 200, 1.0);
    const Binding binding(scene.data());
    std::vector<float> weights(200, -3.0f);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::fill_n(weights.begin(), 100, kInfinity);
    const auto lbs = deformed(Deformer(binding, Lbs::info), scene);
    const auto dq = deformed(Deformer(binding, Dq::info), scene);
    const auto points = deformed(Deformer(binding, Lbs::info, MixData{Dq::info, weights}), scene);
    for (std::size_t v = 0; v < points.size(); ++v) {
        ASSERT_TRUE(same_bits(points[v], v < 100 ? dq[v] : lbs[v])) << v;
    }
}

}  // namespace
}  // namespace sinew::test
