// SPDX-License-Identifier: GPL-3.0-or-later
// Time of one deformation of a whole mesh, ours beside the plain loop on the same data.
#define GLM_ENABLE_EXPERIMENTAL
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <string>

#include "plain_loops.h"
#include "sinew/deform/deformer.h"
#include "sinew/deform/simd.h"
#include "sinew/deform/thread_pool.h"
#include "sinew/transform/convert.h"

namespace {

using namespace sinew;

enum class Kind {
    chain,      // vertices along a cylinder
    shuffled,   // the same, in random order within windows of 4096
    character,  // 1 to 4 influences, 1.85 in the mean, in patches of some dozens of vertices
};
constexpr const char* kKindNames[] = {"chain", "shuffled", "character"};

struct Shape {
    Kind kind = Kind::chain;
    std::size_t vertices = 100'000;
    std::size_t bones = 100;
    std::size_t influences = 4;  // of chain and shuffled
    auto operator<=>(const Shape&) const = default;
};

constexpr std::size_t kMostInfluences = 8;

struct Scene {
    plain::Mesh plain;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
    std::vector<Affine<float>> pose;
    std::vector<glm::mat4> matrices;
    std::vector<glm::dualquat> dual_quats;
    std::vector<glm::quat> rotations;
    std::vector<glm::vec3> translations;
    std::vector<Vec3<float>> points;

    BindData data() const { return {plain.rest_points, offsets, bones, weights, {}}; }

    /// The plain loops see the first four influences.
    void add_vertex(const glm::vec3& rest, std::size_t count, const std::size_t* of, const float* share) {
        const float sum = std::accumulate(share, share + count, 0.0f);
        glm::u16vec4 padded(of[0]);
        glm::vec4 padded_share(0.0f);
        for (std::size_t k = 0; k < count; ++k) {
            bones.push_back(static_cast<std::int32_t>(of[k]));
            weights.push_back(share[k] / sum);
            if (k < 4) {
                const auto i = static_cast<glm::length_t>(k);
                padded[i] = static_cast<std::uint16_t>(of[k]);
                padded_share[i] = share[k] / sum;
            }
        }
        offsets.push_back(static_cast<std::int32_t>(bones.size()));
        plain.rest_points.push_back(rest);
        plain.bones.push_back(padded);
        plain.weights.push_back(padded_share);
    }
};

void add_pose(Scene& scene, std::size_t bones) {
    QuatVec<double> bone;
    const Quat<double> bend = glm::angleAxis(0.05, glm::normalize(Vec3<double>(1, 2, 0.5)));
    for (std::size_t b = 0; b < bones; ++b) {
        const Vec3<double> head(0, 0, static_cast<double>(b));
        bone = bone * QuatVec<double>{bend, head - rotate(bend, head)};
        const QuatVec<float> motion = cast<float>(bone);
        const Affine<float> affine = to_affine(motion);
        scene.pose.push_back(affine);
        glm::mat4 matrix(affine.linear);
        matrix[3] = glm::vec4(affine.translation, 1.0f);
        scene.matrices.push_back(matrix);
        scene.dual_quats.emplace_back(motion.rotation, motion.translation);
        scene.rotations.push_back(motion.rotation);
        scene.translations.push_back(motion.translation);
    }
}

Scene make_scene(const Shape& shape) {
    Scene scene;
    std::mt19937 engine(1);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    add_pose(scene, shape.bones);
    std::vector<std::size_t> order(shape.vertices);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (shape.kind == Kind::shuffled) {
        for (std::size_t i = 0; i < shape.vertices; i += 4096) {
            const auto begin = order.begin() + static_cast<std::ptrdiff_t>(i);
            const std::size_t count = std::min<std::size_t>(4096, shape.vertices - i);
            std::shuffle(begin, begin + static_cast<std::ptrdiff_t>(count), engine);
        }
    }
    std::size_t patch_left = 0;
    std::size_t count = shape.influences;
    std::size_t of[kMostInfluences] = {};
    float share[kMostInfluences] = {};
    const auto last_first = static_cast<float>(shape.bones - std::min(shape.bones, count));
    for (const std::size_t i : order) {
        const float along =
            static_cast<float>(i) / static_cast<float>(shape.vertices) * static_cast<float>(shape.bones);
        const float turn = unit(engine) * 6.2831853f;
        if (shape.kind == Kind::character) {
            if (patch_left == 0) {
                // Means of 1.85 influences and of 24 vertices a patch, as in human.blend.
                const float chance = unit(engine);
                count = chance < 0.45f ? 1 : chance < 0.80f ? 2 : chance < 0.95f ? 3 : 4;
                patch_left = 1 + static_cast<std::size_t>(unit(engine) * 46.0f);
                for (std::size_t k = 0; k < 4; ++k) {
                    of[k] = std::min(shape.bones - 1, static_cast<std::size_t>(along) / 4 * 4 + k);
                }
                std::shuffle(of, of + 4, engine);
            }
            --patch_left;
        } else {
            const float before = static_cast<float>((count - 1) / 2);
            const auto first =
                static_cast<std::size_t>(std::clamp(std::floor(along) - before, 0.0f, last_first));
            for (std::size_t k = 0; k < count; ++k) of[k] = first + k;
        }
        for (std::size_t k = 0; k < count; ++k) {
            const float away = static_cast<float>(of[k]) + 0.5f - along;
            share[k] = std::exp(-away * away) + 0.02f + 0.05f * unit(engine);
        }
        scene.add_vertex({std::cos(turn), std::sin(turn), along}, count, of, share);
    }
    scene.points.resize(shape.vertices);
    return scene;
}

Scene& scene_of(const Shape& shape) {
    // One at a time: those of 8 million vertices are a gigabyte each.
    static std::map<Shape, std::unique_ptr<Scene>> scenes;
    auto& scene = scenes[shape];
    if (!scene) {
        scenes.clear();
        return *(scenes[shape] = std::make_unique<Scene>(make_scene(shape)));
    }
    return *scene;
}

void ours(benchmark::State& state, MethodId method, const Shape& shape, std::size_t threads) {
    Scene& scene = scene_of(shape);
    const Deformer deformer(method, scene.data());
    for (auto _ : state) {
        deformer.deform(scene.pose, {{}, threads}, scene.points);
        benchmark::ClobberMemory();
    }
}

void glm_loop(benchmark::State& state, MethodId method, const Shape& shape) {
    Scene& scene = scene_of(shape);
    glm::vec3* const points = scene.points.data();
    for (auto _ : state) {
        switch (method) {
            case MethodId::lbs: plain::lbs(scene.plain, scene.matrices, points); break;
            case MethodId::dq: plain::dq(scene.plain, scene.dual_quats, points); break;
            case MethodId::qv: plain::qv(scene.plain, scene.rotations, scene.translations, points); break;
        }
        benchmark::ClobberMemory();
    }
}

void eigen_loop(benchmark::State& state, MethodId method, const Shape& shape) {
    Scene& scene = scene_of(shape);
    glm::vec3* const points = scene.points.data();
    for (auto _ : state) {
        switch (method) {
            case MethodId::lbs: plain::eigen::lbs(scene.plain, scene.matrices, points); break;
            case MethodId::dq: plain::eigen::dq(scene.plain, scene.dual_quats, points); break;
            case MethodId::qv:
                plain::eigen::qv(scene.plain, scene.rotations, scene.translations, points);
                break;
        }
        benchmark::ClobberMemory();
    }
}

void bind(benchmark::State& state, const Shape& shape) {
    const Scene& scene = scene_of(shape);
    for (auto _ : state) {
        const Deformer deformer(MethodId::dq, scene.data());
        benchmark::DoNotOptimize(&deformer);
    }
}

void new_rest_points(benchmark::State& state, const Shape& shape) {
    const Scene& scene = scene_of(shape);
    Deformer deformer(MethodId::dq, scene.data());
    for (auto _ : state) deformer.set_rest_points(scene.plain.rest_points);
}

// Two pieces of no work: what the pool itself costs.
void pool_call(benchmark::State& state) {
    for (auto _ : state)
        parallel_for(
            2, 2, [](std::size_t, std::size_t) {}, 1);
}

template <class Call>
void add(const std::string& name, const Call& call) {
    benchmark::RegisterBenchmark(name.c_str(), call)->UseRealTime();
}

void register_all() {
    for (const Kind kind : {Kind::chain, Kind::shuffled, Kind::character}) {
        for (const std::size_t vertices : {1'000, 10'000, 100'000, 1'000'000, 8'000'000}) {
            const Shape shape{kind, vertices};
            const std::string scene =
                std::string("/") + kKindNames[static_cast<int>(kind)] + "/" + std::to_string(vertices);
            for (const Method& row : kMethods) {
                const MethodId method = row.id;
                const std::string of = "/" + std::string(row.name) + scene;
                for (const std::size_t threads : {1, 2}) {
                    add("sinew" + std::to_string(threads) + of,
                        [=](benchmark::State& s) { ours(s, method, shape, threads); });
                }
                add("glm" + of, [=](benchmark::State& s) { glm_loop(s, method, shape); });
                add("eigen" + of, [=](benchmark::State& s) { eigen_loop(s, method, shape); });
            }
            add("bind/dq" + scene, [=](benchmark::State& s) { bind(s, shape); });
            add("rest/dq" + scene, [=](benchmark::State& s) { new_rest_points(s, shape); });
        }
    }
    const auto add_cost = [](const std::string& influences, const Shape& shape) {
        for (const Method& row : kMethods) {
            const MethodId method = row.id;
            add("cost/" + std::string(row.name) + "/" + influences + "/" + std::to_string(shape.bones),
                [=](benchmark::State& s) { ours(s, method, shape, 1); });
        }
    };
    for (const std::size_t bones : {10, 30, 100, 300, 1000}) {
        for (const std::size_t influences : {1, 2, 3, 4, 6, 8}) {
            add_cost(std::to_string(influences), {Kind::chain, 100'000, bones, influences});
        }
        add_cost("mixed", {Kind::character, 100'000, bones, 4});
    }
    add("pool", pool_call);
}

}  // namespace

// Beside Google Benchmark's own options: --simd=NAME for another instruction set than the best.
int main(int argc, char** argv) {
    std::vector<char*> rest;
    for (int i = 0; i < argc; ++i) {
        const std::string_view argument = argv[i];
        if (argument.starts_with("--simd=")) {
            use_simd_target(argument.substr(7));
        } else {
            rest.push_back(argv[i]);
        }
    }
    int count = static_cast<int>(rest.size());
    register_all();
    benchmark::Initialize(&count, rest.data());
    if (benchmark::ReportUnrecognizedArguments(count, rest.data())) return 2;
    benchmark::AddCustomContext("simd", std::string(simd_target()));
    benchmark::AddCustomContext("compiler", SINEW_COMPILER);
    benchmark::AddCustomContext("flags", SINEW_FLAGS);
    benchmark::AddCustomContext("plain_flags", SINEW_PLAIN_FLAGS);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
