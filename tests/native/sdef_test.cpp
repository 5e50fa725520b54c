// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the kernels of sdef on each instruction set, and parameters of methods. tests/python/test_sdef.py
// compares with the formula of mmd_tools.
#include "sinew/methods/sdef/sdef.h"

#include <cmath>
#include <vector>

#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew::test {
namespace {

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

using EveryTarget = OnEachTarget;

INSTANTIATE_TEST_SUITE_P(Sdef, EveryTarget, testing::ValuesIn(simd_targets()), name_of_target);

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

}  // namespace
}  // namespace sinew::test
