// SPDX-License-Identifier: GPL-3.0-or-later
// Time of one deformation of a whole mesh, ours beside the plain loops on the same data.
#define GLM_ENABLE_EXPERIMENTAL
#include <benchmark/benchmark.h>

#include <map>
#include <string>

#include "scenes.h"
#include "sinew/deform/simd.h"
#include "sinew/deform/thread_pool.h"
#include "sinew/skinning/methods.h"

namespace {

using namespace sinew;
using namespace sinew::bench;

struct Bound {
    Scene scene;
    std::map<MethodId, Deformer> deformers;

    const Deformer& deformer(MethodId method) {
        return deformers.try_emplace(method, method, scene.data()).first->second;
    }
};

/// Kept for the next measurement, one at a time: those of 8 million vertices are a gigabyte each.
Bound& bound(const Shape& shape) {
    static std::map<Shape, Bound> kept;
    if (!kept.contains(shape)) {
        kept.clear();
        kept[shape].scene = make_scene(shape);
    }
    return kept[shape];
}

Scene& scene_of(const Shape& shape) { return bound(shape).scene; }

void ours(benchmark::State& state, MethodId method, const Shape& shape, std::size_t threads) {
    Scene& scene = scene_of(shape);
    const Deformer& deformer = bound(shape).deformer(method);
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
            if (vertices != 100'000) continue;
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
