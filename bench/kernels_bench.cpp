// SPDX-License-Identifier: GPL-3.0-or-later
// Times one deformation of a whole mesh, with Sinew and with the plain loops on the same data.
#define GLM_ENABLE_EXPERIMENTAL
#include <benchmark/benchmark.h>

#include <map>
#include <string>

#include "scenes.h"
#include "sinew/base/simd.h"
#include "sinew/base/thread_pool.h"
#include "sinew/methods/methods.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace {

using namespace sinew;
using namespace sinew::bench;

struct Bound {
    Scene scene;
    std::map<int, Deformer> deformers;  // keyed by the method's number

    const Deformer& deformer(const MethodInfo& method) {
        return deformers.try_emplace(method.number, scene.data_for(method), method).first->second;
    }
};

/// Kept for the next measurement, one at a time: meshes of 8 million vertices take a gigabyte each.
Bound& bound(const Shape& shape) {
    static std::map<Shape, Bound> kept;
    if (!kept.contains(shape)) {
        kept.clear();
        kept[shape].scene = make_scene(shape);
    }
    return kept[shape];
}

Scene& scene_of(const Shape& shape) { return bound(shape).scene; }

void ours(benchmark::State& state, const MethodInfo& method, const Shape& shape,
          const DeformOptions& options) {
    Scene& scene = scene_of(shape);
    const Deformer& deformer = bound(shape).deformer(method);
    for (auto _ : state) {
        (void)deformer.deform({scene.pose}, options, scene.points);
        benchmark::ClobberMemory();
    }
}

/// The stage bulge_limit after dq. It is so weak that it hardly changes the points, but it writes them.
void bulge_limit(benchmark::State& state, const Shape& shape) {
    Scene& scene = scene_of(shape);
    std::vector<BoneSegment<float>> segments;
    for (std::size_t bone = 0; bone < shape.bones; ++bone) {
        const auto z = static_cast<float>(bone);
        segments.push_back({{0, 0, z}, {0, 0, z + 1}});
    }
    const BulgeLimit limit(Binding(scene.data()), {segments});
    (void)bound(shape).deformer(Dq::info).deform({scene.pose}, {1}, scene.points);
    for (Vec3<float>& point : scene.points) point *= 1.01f;
    for (auto _ : state) {
        (void)limit.apply(scene.points, {scene.pose}, {BulgeForm::continuous, 1e-12f, 1});
        benchmark::ClobberMemory();
    }
}

/// The stage twist_spread after a method, along every bone. So weak that the points stay.
void twist_spread(benchmark::State& state, const Shape& shape, TwistBlend blend) {
    Scene& scene = scene_of(shape);
    std::vector<TwistBone> twists;
    std::vector<Affine<float>> rest_bones;
    for (std::size_t i = 0; i < shape.bones; ++i) {
        const auto bone = static_cast<std::int32_t>(i);
        const auto z = static_cast<float>(i);
        const auto next = static_cast<std::int32_t>((i + 1) % shape.bones);
        twists.push_back({bone, bone, next, false, {0, 0, z}, {0, 0, z + 1}});
        rest_bones.push_back(
            {Mat3<float>(Vec3<float>(1, 0, 0), Vec3<float>(0, 0, 1), Vec3<float>(0, -1, 0)), {0, 0, z}});
    }
    const TwistSpread spread(Binding(scene.data()), {twists, rest_bones});
    (void)bound(shape).deformer(Dq::info).deform({scene.pose}, {1}, scene.points);
    TwistSpreadOptions options;
    options.amount = 1e-3f;
    options.blend = blend;
    options.threads = 1;
    for (auto _ : state) {
        (void)spread.apply(scene.points, {scene.pose}, options);
        benchmark::ClobberMemory();
    }
}

// The loops that one writes first, for methods that have one.
void glm_loop(Lbs, Scene& s) { plain::lbs(s.plain, s.matrices, s.points.data()); }
void glm_loop(Dq, Scene& s) { plain::dq(s.plain, s.dual_quats, s.points.data()); }
void glm_loop(Qv, Scene& s) { plain::qv(s.plain, s.rotations, s.translations, s.points.data()); }
void eigen_loop(Lbs, Scene& s) { plain::eigen::lbs(s.plain, s.matrices, s.points.data()); }
void eigen_loop(Dq, Scene& s) { plain::eigen::dq(s.plain, s.dual_quats, s.points.data()); }
void eigen_loop(Qv, Scene& s) { plain::eigen::qv(s.plain, s.rotations, s.translations, s.points.data()); }

template <class Method>
concept HasPlainLoops = requires(Scene& scene) {
    glm_loop(Method{}, scene);
    eigen_loop(Method{}, scene);
};

template <class Loop>
void plain_loop(benchmark::State& state, const Loop& loop, const Shape& shape) {
    Scene& scene = scene_of(shape);
    for (auto _ : state) {
        loop(scene);
        benchmark::ClobberMemory();
    }
}

void bind(benchmark::State& state, const Shape& shape) {
    const Scene& scene = scene_of(shape);
    for (auto _ : state) {
        const Deformer deformer(scene.data(), Dq::info);
        benchmark::DoNotOptimize(&deformer);
    }
}

void new_rest_points(benchmark::State& state, const Shape& shape) {
    const Scene& scene = scene_of(shape);
    Deformer deformer(scene.data(), Dq::info);
    for (auto _ : state) benchmark::DoNotOptimize(deformer.set_rest_points(scene.plain.rest_points));
}

// Two chunks without work: the cost of the pool itself.
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
            for_each_method([&]<class Method>(Method) {
                const std::string of = "/" + std::string(Method::info.name) + scene;
                for (const std::size_t threads : {1, 2}) {
                    add("sinew" + std::to_string(threads) + of,
                        [=](benchmark::State& s) { ours(s, Method::info, shape, {threads}); });
                }
                for (const Variant& variant : variants_of(Method::info)) {
                    add("sinew1/" + variant.name + scene,
                        [=](benchmark::State& s) { ours(s, Method::info, shape, variant.options()); });
                }
                if constexpr (HasPlainLoops<Method>) {
                    add("glm" + of, [=](benchmark::State& s) {
                        plain_loop(
                            s, [](Scene& data) { glm_loop(Method{}, data); }, shape);
                    });
                    add("eigen" + of, [=](benchmark::State& s) {
                        plain_loop(
                            s, [](Scene& data) { eigen_loop(Method{}, data); }, shape);
                    });
                }
            });
            if (vertices != 100'000) continue;
            add("bind/dq" + scene, [=](benchmark::State& s) { bind(s, shape); });
            add("stage/bulge_limit" + scene, [=](benchmark::State& s) { bulge_limit(s, shape); });
            add("stage/twist_spread/lbs" + scene,
                [=](benchmark::State& s) { twist_spread(s, shape, TwistBlend::linear); });
            add("stage/twist_spread/dq" + scene,
                [=](benchmark::State& s) { twist_spread(s, shape, TwistBlend::rotations); });
            add("rest/dq" + scene, [=](benchmark::State& s) { new_rest_points(s, shape); });
        }
    }
    const auto add_cost = [](const std::string& influences, const Shape& shape) {
        for (const MethodInfo& method : kMethods) {
            add("cost/" + std::string(method.name) + "/" + influences + "/" + std::to_string(shape.bones),
                [=](benchmark::State& s) { ours(s, method, shape, {1}); });
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

// Options in addition to Google Benchmark's: --simd=NAME for another instruction set than the best.
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
