// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the kernels of each method on each instruction set: against the definition in double, in any order
// of vertices, to the bit where they must agree.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>

#include "scene.h"
#include "sinew/base/simd.h"
#include "sinew/base/x86_support.h"
#include "sinew/pose/continued_rotations.h"

namespace sinew::test {
namespace {

/// `sets` sets of 1 to `most` bones, each with `vertices` vertices that are not adjacent in the mesh.
Scene scene_of_sets(std::uint32_t seed, std::size_t sets, std::size_t vertices, std::size_t most, bool scaled,
                    double spread = 1.0) {
    Random random(seed);
    Scene scene = random_scene(seed, 0, 1.0);
    if (!scaled) {
        for (Affine<float>& motion : scene.posed_from_rest) {
            const Quat<double> rotation = glm::slerp(Quat<double>(1, 0, 0, 0), random.rotation(), spread);
            motion = cast<float>(to_affine(QuatVec<double>{rotation, random.vector(1.0)}));
        }
    }
    std::vector<std::vector<std::int32_t>> bones(sets);
    for (auto& set : bones) {
        const auto count = 1 + random.index(static_cast<std::int32_t>(most));
        const std::int32_t step = 1 + 2 * random.index(2);  // 1 or 3
        const std::int32_t first = random.index(12);
        for (std::int32_t k = 0; k < count; ++k) set.push_back((first + step * k) % 12);
    }
    for (std::size_t i = 0; i < sets * vertices; ++i) {
        const auto& set = bones[i % sets];
        auto influences = random.influences<float>(set.size(), 12);
        for (std::size_t k = 0; k < set.size(); ++k) influences[k].bone = set[k];
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
    }
    return scene;
}

/// The same vertices in another order.
Scene reordered(const Scene& scene, const std::vector<std::size_t>& order) {
    Scene other;
    other.rest_bones = scene.rest_bones;
    other.posed_from_rest = scene.posed_from_rest;
    for (const std::size_t vertex : order) {
        other.add_vertex(scene.rest_points[vertex], influences_of(scene, vertex));
    }
    return other;
}

/// The distance of each of `points` from the method's definition in double, ascending.
std::vector<double> errors_of(const std::vector<Vec3<float>>& points, const MethodInfo& method,
                              const Scene& scene, std::span<const double> parameters = {}) {
    const auto expected = in_double(method, scene, parameters);
    std::vector<double> result;
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        result.push_back(distance(Vec3<double>(points[vertex]), expected[vertex]));
    }
    std::ranges::sort(result);
    return result;
}

std::vector<double> errors(const MethodInfo& method, const Scene& scene, const DeformOptions& options = {}) {
    const auto points = deformed(Deformer(scene.data(), method), scene, options);
    return errors_of(points, method, scene, options.parameters);
}

/// `sets` sets of `vertices` vertices. Each has bones at distances of up to `farthest`, in any order, with
/// weights that decrease with the distance, so that each moves a vertex about equally far.
Scene scene_of_unlike_bones(std::uint32_t seed, std::size_t sets, std::size_t vertices, double farthest,
                            bool scaled, double spread) {
    Random random(seed);
    Scene scene;
    for (std::size_t set = 0; set < sets; ++set) {
        std::vector<Influence<float>> influences;
        const int count = 2 + random.index(5);
        for (int k = 0; k < count; ++k) {
            const double size = std::pow(farthest, random.uniform(0.0, 1.0));
            const Quat<double> rotation = glm::slerp(Quat<double>(1, 0, 0, 0), random.rotation(), spread);
            Affine<double> motion = to_affine(QuatVec<double>{rotation, size * random.vector(1.0)});
            if (scaled) motion = motion * scaling<double>({1.0, random.uniform(0.5, 2.0), 1.0});
            influences.push_back({static_cast<std::int32_t>(scene.posed_from_rest.size()),
                                  static_cast<float>(random.uniform(0.5, 1.5) / size)});
            scene.posed_from_rest.push_back(cast<float>(motion));
            scene.rest_bones.emplace_back();
        }
        for (std::size_t i = 0; i < vertices; ++i) {
            auto other = influences;
            for (auto& influence : other) {
                influence.weight *= static_cast<float>(random.uniform(0.5, 1.5));
            }
            scene.add_vertex(Vec3<float>(random.vector(1.0)), other);
        }
    }
    return scene;
}

class Kernels : public testing::TestWithParam<std::tuple<std::string_view, MethodInfo>> {
protected:
    void SetUp() override { use_simd_target(std::get<0>(GetParam())); }
    void TearDown() override { use_simd_target(simd_targets().front()); }
    static const MethodInfo& method() { return std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(every, Kernels,
                         testing::Combine(testing::ValuesIn(simd_targets()), testing::ValuesIn(kMethods)),
                         [](const auto& info) {
                             return std::string(std::get<0>(info.param)) + "_" +
                                    std::string(std::get<1>(info.param).name);
                         });

TEST_P(Kernels, agree_with_skinning_in_double) {
    for (const double extent : {0.01, 1.0, 100.0}) {
        for (std::uint32_t seed = 0; seed < 3; ++seed) {
            EXPECT_LT(errors(method(), random_scene(seed, 500, extent)).back(), kTolerance * extent);
        }
    }
}

TEST_P(Kernels, agree_for_sets_of_every_size) {
    for (const std::size_t vertices : {1, 2, 9, 10, 11, 15, 16, 17, 31, 33, 100}) {
        for (const bool scaled : {false, true}) {
            const Scene scene = scene_of_sets(static_cast<std::uint32_t>(vertices), 12, vertices, 8, scaled);
            EXPECT_LT(errors(method(), scene).back(), kTolerance) << vertices << (scaled ? " scaled" : "");
        }
    }
}

// Those of signs have their own test.
TEST_P(Kernels, agree_for_each_choice_of_a_parameter) {
    const bool has_choices = !method().parameters.empty() && method().parameters[0].id != "signs";
    if (!has_choices) GTEST_SKIP();
    for (std::size_t i = 0; i < method().parameters[0].choices.size(); ++i) {
        const double choice = static_cast<double>(i);
        for (const bool scaled : {false, true}) {
            // Most vertices have two bones, as sdef wants them.
            const Scene scene = scene_of_sets(10, 30, 20, 2, scaled);
            const double error = errors(method(), scene, {.parameters = std::span(&choice, 1)}).back();
            EXPECT_LT(error, 4.0 * kTolerance) << i << (scaled ? " scaled" : "");
        }
    }
}

// If all bones of a set are near to each other, their signs do not depend on the weights.
TEST_P(Kernels, agree_for_bones_turned_alike) {
    EXPECT_LT(errors(method(), scene_of_sets(1, 12, 100, 6, false, 0.2)).back(), kTolerance);
}

// Each component of the quaternion is the largest for one of them, and 180 degrees have w = 0.
TEST_P(Kernels, agree_for_bones_turned_far) {
    Scene scene;
    for (const double degrees : {0.0, 100.0, 179.0, 180.0, 181.0, 300.0}) {
        for (const Vec3<double> axis : {Vec3<double>(1, 0, 0), Vec3<double>(0, 1, 0), Vec3<double>(0, 0, 1),
                                        Vec3<double>(1, 1, 0), Vec3<double>(1, -1, 1)}) {
            const auto bone = static_cast<std::int32_t>(scene.posed_from_rest.size());
            scene.posed_from_rest.push_back(
                cast<float>(to_affine(QuatVec<double>{about(axis, degrees), {1, -2, 0.5}})));
            scene.rest_bones.emplace_back();
            for (int i = 0; i < 20; ++i)
                scene.add_vertex(Vec3<float>(1, 0.1f * static_cast<float>(i), -1), {{bone, 1.0f}});
        }
    }
    EXPECT_LT(errors(method(), scene).back(), 2 * kTolerance);
}

/// A chain of 12 bones that twist and coil by `degrees` each about axes that change, every third one scaled if
/// `scaled`. Vertices have up to four of them that are neighbours, in shared sets and in own ones.
Scene scene_of_chain(double degrees, bool scaled) {
    Random random(7);
    Scene scene;
    QuatVec<double> bone{Quat<double>(1, 0, 0, 0), Vec3<double>(0.0)};
    for (int i = 0; i < 12; ++i) {
        const Vec3<double> axis(0.2 * random.uniform(-1.0, 1.0), 1.0, 0.2 * random.uniform(-1.0, 1.0));
        bone = bone * QuatVec<double>{about(axis, degrees), 0.1 * random.vector(1.0)};
        const double stretch = scaled && i % 3 == 2 ? 1.5 : 1.0;
        scene.posed_from_rest.push_back(cast<float>(to_affine(bone) * scaling<double>({1.0, stretch, 1.0})));
        scene.rest_bones.emplace_back();
    }
    for (int i = 0; i < 1000; ++i) {
        const auto count = static_cast<std::size_t>(1 + i % 4);
        auto influences = random.influences<float>(count, 12);
        const std::int32_t first = i < 600 ? i % 8 : random.index(9);
        for (std::size_t k = 0; k < count; ++k) {
            influences[k].bone = first + static_cast<std::int32_t>(k);
        }
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
    }
    return scene;
}

TEST_P(Kernels, keep_the_signs_of_a_chain) {
    const bool has_signs = !method().parameters.empty() && method().parameters[0].id == "signs";
    if (!has_signs) GTEST_SKIP();
    std::vector<std::int32_t> parents(12);
    std::iota(parents.begin(), parents.end(), -1);
    const std::vector<double> blender{0.0}, kept{1.0};
    for (const double degrees : {20.0, 70.0, 110.0, 170.0}) {
        for (const bool scaled : {false, true}) {
            Scene scene = scene_of_chain(degrees, scaled);
            const Deformer deformer(scene.data(), method());
            const auto shorter = deformed(deformer, scene);
            scene.rotations = continued_rotations(parents, scene.posed_from_rest);
            const auto expected = in_double(method(), scene, kept);
            const auto points = deformed(deformer, scene, {.parameters = kept}, {}, scene.rotations);
            EXPECT_LT(largest_error(points, expected), 10 * kTolerance) << degrees << scaled;
            const double difference = largest_error(points, {shorter.begin(), shorter.end()});
            // Up to 60 degrees a bone, no two of four are more than half a turn apart.
            EXPECT_EQ(difference > 0.1, degrees > 60.0) << degrees << scaled;
            if (degrees < 60.0) EXPECT_EQ(difference, 0.0);
            const auto asked = deformed(deformer, scene, {.parameters = blender}, {}, scene.rotations);
            EXPECT_TRUE(same_bits(asked, shorter));
        }
    }
}

// Two bones a whole turn apart, where signs are kept.
TEST_P(Kernels, a_sum_that_cancels_gives_numbers) {
    Scene scene;
    for (int i = 0; i < 2; ++i) {
        scene.posed_from_rest.push_back(
            cast<float>(to_affine(QuatVec<double>{about({0, 1, 0}, 0.0), {1, 2, 3}})));
        scene.rest_bones.emplace_back();
    }
    scene.add_vertex({1, 2, 3}, {{0, 0.5f}, {1, 0.5f}});
    const std::vector<Quat<float>> rotations{{1, 0, 0, 0}, {-1, 0, 0, 0}};
    const std::vector<double> kept{1.0};
    const auto points =
        deformed(Deformer(scene.data(), method()), scene, {.parameters = kept}, {}, rotations);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(points[0][i]));
}

TEST_P(Kernels, agree_for_many_influences) {
    for (const std::size_t most : {12, 31, 32, 33, 40, 70}) {
        const Scene scene = scene_of_sets(2, 5, 40, most, false);
        EXPECT_LT(errors(method(), scene).back(), 2 * kTolerance) << most;
    }
}

// A bone that is far away and has little weight must not cost a vertex the digits of the others: in single
// precision and for any order of bones, the error is at most four times that of a plain sum.
TEST_P(Kernels, round_as_a_plain_sum_does_for_bones_of_unlike_size) {
    if (kRunsSlowly) GTEST_SKIP();
    std::uint32_t seed = 100;
    // First moments are stored as products that were rounded.
    const double times = method().rows_by_bone ? 8.0 : 4.0;
    for (const double farthest : {1.0, 1e3, 1e5, 1e7}) {
        for (const std::size_t vertices : {1, 7, 40}) {
            for (const bool scaled : {false, true}) {
                for (const double spread : {0.2, 1.0}) {
                    const Scene scene =
                        scene_of_unlike_bones(++seed, 800 / vertices, vertices, farthest, scaled, spread);
                    const auto ours = errors(method(), scene);
                    const auto plain = errors_of(by_skinning<float>(method(), scene), method(), scene);
                    // The highest errors may come from signs that are nearly a tie, where both choices are
                    // equally good.
                    for (const double part : {0.5, 0.9, 0.98}) {
                        const auto i = static_cast<std::size_t>(part * static_cast<double>(ours.size()));
                        EXPECT_LT(ours[i], times * plain[i] + 1e-7)
                            << farthest << " " << vertices << (scaled ? " scaled " : " ") << spread << " "
                            << part;
                    }
                }
            }
        }
    }
}

TEST_P(Kernels, a_far_bone_of_little_weight_costs_no_digits) {
    for (const double far : {1e3, 1e5}) {
        Scene scene;
        const auto rotation = about<double>({1, 2, 3}, 20.0);
        scene.posed_from_rest = {cast<float>(to_affine(QuatVec<double>{rotation, {far, -far, far}})),
                                 cast<float>(to_affine(QuatVec<double>{rotation, {0.1, 0.2, 0.3}}))};
        scene.rest_bones.resize(2);
        const auto little = static_cast<float>(1.0 / far);
        for (int i = 0; i < 40; ++i) {
            scene.add_vertex({0.01f * static_cast<float>(i), 0.5f, 0.25f}, {{0, little}, {1, 1.0f - little}});
        }
        EXPECT_LT(errors(method(), scene).back(), 1e-6) << far;
    }
}

TEST_P(Kernels, place_in_the_mesh_changes_no_bit) {
    // Its blocks contain all bones of their vertices, and the first of these is added whole.
    if (method().rows_by_bone) GTEST_SKIP() << "other vertices of a block change the rounding";
    for (const bool scaled : {false, true}) {
        Scene scene = scene_of_sets(3, 20, 37, 6, scaled);
        const Scene more = scene_of_sets(4, 400, 1, 6, scaled);
        for (std::size_t vertex = 0; vertex < more.rest_points.size(); ++vertex) {
            scene.add_vertex(more.rest_points[vertex], influences_of(more, vertex));
        }
        const auto expected = deformed(Deformer(scene.data(), method()), scene);
        std::vector<std::size_t> order(scene.rest_points.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        Random random(5);
        for (int round = 0; round < 3; ++round) {
            for (std::size_t i = order.size(); i > 1; --i) {
                std::swap(order[i - 1],
                          order[static_cast<std::size_t>(random.index(static_cast<std::int32_t>(i)))]);
            }
            // Fewer vertices in each round, so that sets also lose vertices and switch between kernels.
            order.resize(order.size() / 2);
            const Scene other = reordered(scene, order);
            const auto points = deformed(Deformer(other.data(), method()), other);
            for (std::size_t i = 0; i < order.size(); ++i) {
                ASSERT_TRUE(same_bits(points[i], expected[order[i]])) << i << (scaled ? " scaled" : "");
            }
        }
    }
}

TEST_P(Kernels, threads_change_no_bit) {
    const Scene scene = scene_of_sets(6, 700, 30, 4, true);
    const Deformer deformer(scene.data(), method());
    const auto expected = deformed(deformer, scene, {1});
    for (std::size_t threads = 2; threads <= 5; ++threads) {
        EXPECT_TRUE(same_bits(deformed(deformer, scene, {threads}), expected)) << threads;
    }
}

TEST_P(Kernels, rest_pose_is_unchanged_to_the_bit) {
    Scene scene = scene_of_sets(7, 30, 25, 6, false);
    scene.posed_from_rest.assign(scene.posed_from_rest.size(), {});
    for (Vec3<float>& point : scene.rest_points) point *= 1000.0f;
    EXPECT_TRUE(same_bits(deformed(Deformer(scene.data(), method()), scene), scene.rest_points));
}

TEST_P(Kernels, bones_from_model_goes_there_and_back) {
    const Scene scene = scene_of_sets(8, 20, 25, 6, true);
    const Affine<float> bones_from_model{to_mat3(about<float>({1, 2, 3}, 40.0f)), {1, -2, 3}};
    const auto points = deformed(Deformer(scene.data(), method()), scene, {}, bones_from_model);
    Scene other = scene;
    other.transform(bones_from_model);
    const auto moved = in_double(method(), other);
    const Affine<double> back = inverse(cast<double>(bones_from_model));
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        ASSERT_LT(distance(Vec3<double>(points[vertex]), transform_point(back, moved[vertex])), 1e-5);
    }
}

TEST_P(Kernels, write_no_other_point) {
    const Scene scene = scene_of_sets(9, 7, 23, 4, false);
    const Deformer deformer(scene.data(), method());
    const Vec3<float> mark(-1e9f);
    std::vector<Vec3<float>> points(scene.rest_points.size() + 2, mark);
    EXPECT_EQ(
        deformer.deform({scene.posed_from_rest}, {}, std::span(points).subspan(1, scene.rest_points.size())),
        Status::ok);
    EXPECT_TRUE(same_bits(points.front(), mark));
    EXPECT_TRUE(same_bits(points.back(), mark));
    for (std::size_t i = 1; i + 1 < points.size(); ++i) ASSERT_FALSE(same_bits(points[i], mark));
}

#if defined(__x86_64__) && defined(__linux__)
TEST(SimdTargets, x86_support_is_what_the_compiler_finds) {
    __builtin_cpu_init();
    // Every such processor has it.
    if (!__builtin_cpu_supports("sse2")) GTEST_SKIP() << "zig's runtime library finds nothing";
    const X86Support support = x86_support();
    EXPECT_EQ(support.sse4, __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("sse4.1") &&
                                __builtin_cpu_supports("sse4.2"));
    EXPECT_EQ(support.avx2, support.sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                                __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2"));
    EXPECT_EQ(support.avx3, support.avx2 && __builtin_cpu_supports("avx512f") &&
                                __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") &&
                                __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"));
}
#endif

TEST(SimdTargets, one_is_in_use) {
    const auto targets = simd_targets();
    ASSERT_FALSE(targets.empty());
    EXPECT_EQ(simd_target(), targets.front());
    for (const std::string_view target : targets) {
        use_simd_target(target);
        EXPECT_EQ(simd_target(), target);
    }
    use_simd_target(targets.front());
    EXPECT_THROW(use_simd_target("abacus"), std::invalid_argument);
    EXPECT_EQ(simd_target(), targets.front());
}

}  // namespace
}  // namespace sinew::test
