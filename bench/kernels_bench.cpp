// SPDX-License-Identifier: GPL-3.0-or-later
// Time of one deformation of a whole mesh, ours beside the plain loop on the same data.
#define GLM_ENABLE_EXPERIMENTAL
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "plain_loops.h"
#include "sinew/deform/deformer.h"
#include "sinew/deform/simd.h"
#include "sinew/deform/thread_pool.h"
#include "sinew/transform/convert.h"

namespace {

using namespace sinew;

constexpr std::size_t kBones = 100;

enum class Kind {
    chain,      // four influences, vertices along a cylinder
    shuffled,   // the same, in random order within windows of 4096
    character,  // 1 to 4 influences, 1.85 in the mean, in patches of some dozens of vertices
};
constexpr const char* kKindNames[] = {"chain", "shuffled", "character"};

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

    void add_vertex(const glm::vec3& rest, std::size_t count, const std::size_t* of, glm::vec4 share) {
        share /= share.x + share.y + share.z + share.w;
        glm::u16vec4 padded(of[0]);
        for (std::size_t k = 0; k < count; ++k) {
            const auto i = static_cast<glm::length_t>(k);
            padded[i] = static_cast<std::uint16_t>(of[k]);
            bones.push_back(static_cast<std::int32_t>(of[k]));
            weights.push_back(share[i]);
        }
        offsets.push_back(static_cast<std::int32_t>(bones.size()));
        plain.rest_points.push_back(rest);
        plain.bones.push_back(padded);
        plain.weights.push_back(share);
    }
};

void add_pose(Scene& scene) {
    QuatVec<double> bone;
    const Quat<double> bend = glm::angleAxis(0.05, glm::normalize(Vec3<double>(1, 2, 0.5)));
    for (std::size_t b = 0; b < kBones; ++b) {
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

Scene make_scene(Kind kind, std::size_t vertices) {
    Scene scene;
    std::mt19937 engine(1);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    add_pose(scene);
    std::vector<std::size_t> order(vertices);
    for (std::size_t i = 0; i < vertices; ++i) order[i] = i;
    if (kind == Kind::shuffled) {
        for (std::size_t i = 0; i < vertices; i += 4096) {
            const auto begin = order.begin() + static_cast<std::ptrdiff_t>(i);
            std::shuffle(begin,
                         begin + static_cast<std::ptrdiff_t>(std::min<std::size_t>(4096, vertices - i)),
                         engine);
        }
    }
    std::size_t patch_left = 0;
    std::size_t count = 4;
    std::size_t of[4] = {};
    for (const std::size_t i : order) {
        const float along = static_cast<float>(i) / static_cast<float>(vertices) * kBones;
        const float turn = unit(engine) * 6.2831853f;
        glm::vec4 share(0.0f);
        if (kind == Kind::character) {
            if (patch_left == 0) {
                // Means of 1.85 influences and of 24 vertices a patch, as in human.blend.
                const float chance = unit(engine);
                count = chance < 0.45f ? 1 : chance < 0.80f ? 2 : chance < 0.95f ? 3 : 4;
                patch_left = 1 + static_cast<std::size_t>(unit(engine) * 46.0f);
                for (std::size_t k = 0; k < 4; ++k) {
                    of[k] = std::min(kBones - 1, static_cast<std::size_t>(along) / 4 * 4 + k);
                }
                std::shuffle(of, of + 4, engine);
            }
            --patch_left;
        } else {
            const auto first = static_cast<std::size_t>(
                std::clamp(std::floor(along) - 1.0f, 0.0f, static_cast<float>(kBones - 4)));
            for (std::size_t k = 0; k < 4; ++k) of[k] = first + k;
        }
        for (std::size_t k = 0; k < count; ++k) {
            const float away = static_cast<float>(of[k]) + 0.5f - along;
            share[static_cast<glm::length_t>(k)] = std::exp(-away * away) + 0.02f + 0.05f * unit(engine);
        }
        scene.add_vertex({std::cos(turn), std::sin(turn), along}, count, of, share);
    }
    scene.points.resize(vertices);
    return scene;
}

Scene& scene_of(Kind kind, std::size_t vertices) {
    // One at a time: those of 8 million vertices are a gigabyte each.
    static std::map<std::pair<Kind, std::size_t>, std::unique_ptr<Scene>> scenes;
    auto& scene = scenes[{kind, vertices}];
    if (!scene) {
        scenes.clear();
        return *(scenes[{kind, vertices}] = std::make_unique<Scene>(make_scene(kind, vertices)));
    }
    return *scene;
}

void count_vertices(benchmark::State& state, std::size_t vertices) {
    state.counters["vertex"] =
        benchmark::Counter(static_cast<double>(vertices),
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void ours(benchmark::State& state, MethodId method, Kind kind, std::size_t vertices, std::size_t threads) {
    Scene& scene = scene_of(kind, vertices);
    const Deformer deformer(method, scene.data());
    for (auto _ : state) {
        deformer.deform(scene.pose, {{}, threads}, scene.points);
        benchmark::ClobberMemory();
    }
    count_vertices(state, vertices);
}

void plain_loop(benchmark::State& state, MethodId method, Kind kind, std::size_t vertices) {
    Scene& scene = scene_of(kind, vertices);
    for (auto _ : state) {
        switch (method) {
            case MethodId::lbs: plain::lbs(scene.plain, scene.matrices, scene.points.data()); break;
            case MethodId::dq: plain::dq(scene.plain, scene.dual_quats, scene.points.data()); break;
            case MethodId::qv:
                plain::qv(scene.plain, scene.rotations, scene.translations, scene.points.data());
                break;
        }
        benchmark::ClobberMemory();
    }
    count_vertices(state, vertices);
}

void bind(benchmark::State& state, Kind kind, std::size_t vertices) {
    const Scene& scene = scene_of(kind, vertices);
    for (auto _ : state) {
        const Deformer deformer(MethodId::dq, scene.data());
        benchmark::DoNotOptimize(&deformer);
    }
    count_vertices(state, vertices);
}

void new_rest_points(benchmark::State& state, std::size_t vertices) {
    const Scene& scene = scene_of(Kind::chain, vertices);
    Deformer deformer(MethodId::dq, scene.data());
    for (auto _ : state) deformer.set_rest_points(scene.plain.rest_points);
    count_vertices(state, vertices);
}

// Two pieces of no work: what the pool itself costs.
void pool_call(benchmark::State& state) {
    for (auto _ : state)
        parallel_for(
            2, 2, [](std::size_t, std::size_t) {}, 1);
}

void register_all(bool with_millions) {
    std::vector<std::size_t> sizes{1'000, 10'000, 100'000, 1'000'000};
    if (with_millions) sizes.push_back(8'000'000);
    const auto name = [](const std::string& who, std::string_view method, Kind kind, std::size_t vertices) {
        return who + "/" + std::string(method) + "/" + kKindNames[static_cast<int>(kind)] + "/" +
               std::to_string(vertices);
    };
    for (const Kind kind : {Kind::chain, Kind::shuffled, Kind::character}) {
        for (const std::size_t vertices : sizes) {
            for (const Method& row : kMethods) {
                const MethodId method = row.id;
                for (const std::size_t threads : {1, 2}) {
                    benchmark::RegisterBenchmark(
                        name("sinew" + std::to_string(threads), row.name, kind, vertices).c_str(),
                        [=](benchmark::State& s) { ours(s, method, kind, vertices, threads); });
                }
                benchmark::RegisterBenchmark(
                    name("plain", row.name, kind, vertices).c_str(),
                    [=](benchmark::State& s) { plain_loop(s, method, kind, vertices); });
            }
        }
        benchmark::RegisterBenchmark(name("bind", "dq", kind, 100'000).c_str(),
                                     [=](benchmark::State& s) { bind(s, kind, 100'000); });
    }
    benchmark::RegisterBenchmark("rest/dq/chain/100000",
                                 [](benchmark::State& s) { new_rest_points(s, 100'000); });
    benchmark::RegisterBenchmark("pool", pool_call)->UseRealTime();
}

}  // namespace

// Beside Google Benchmark's own options: --simd=NAME for another instruction set than the best, --millions
// for meshes of 8 million vertices, too.
int main(int argc, char** argv) {
    bool with_millions = false;
    std::vector<char*> rest;
    for (int i = 0; i < argc; ++i) {
        const std::string_view argument = argv[i];
        if (argument == "--millions") {
            with_millions = true;
        } else if (argument.starts_with("--simd=")) {
            use_simd_target(argument.substr(7));
        } else {
            rest.push_back(argv[i]);
        }
    }
    int count = static_cast<int>(rest.size());
    register_all(with_millions);
    benchmark::Initialize(&count, rest.data());
    if (benchmark::ReportUnrecognizedArguments(count, rest.data())) return 2;
    benchmark::AddCustomContext("simd", std::string(simd_target()));
    benchmark::AddCustomContext("compiler", SINEW_COMPILER);
    benchmark::AddCustomContext("flags", SINEW_FLAGS);
    benchmark::AddCustomContext("plain_flags", SINEW_PLAIN_FLAGS);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
