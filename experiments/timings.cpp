// SPDX-License-Identifier: GPL-3.0-or-later
// The loops of Smith 2013, Tables 3.4, 3.5, 3.9 and 3.10, for each candidate: "TABLE/NAME". One iteration is one
// whole loop. --shorten=N makes the loops N times shorter.
#define GLM_ENABLE_EXPERIMENTAL
#include <benchmark/benchmark.h>

#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/candidates.h"
#include "sinew/deformer.h"

namespace {

using namespace experiments;

// Repetitions in the report. Table 3.10 does not state them; its text mentions a point.
constexpr int kChains = 100'000;
constexpr int kPoints = 1'000'000;
constexpr int kInterpolations = 1'000'000;
constexpr int kBlends = 1'000'000;
constexpr int kChainLength = 6;

// Few enough to stay in the first-level cache, so that arithmetic is measured.
constexpr int kDistinct = 64;
constexpr std::size_t kMesh = 10'000;

int shorten = 1;

std::mt19937& dice() {
    static std::mt19937 engine(2013);
    return engine;
}

/// Motions along a smooth path, as adjacent bones have: up to about 40 degrees apart.
const std::vector<Rigid>& motions() {
    static const std::vector<Rigid> list = [] {
        std::uniform_real_distribution<double> number(-1.0, 1.0);
        std::vector<Rigid> result;
        Rigid motion;
        for (int i = 0; i < kDistinct + kChainLength; ++i) {
            const sinew::Vec3<double> axis(number(dice()), number(dice()), number(dice()));
            Rigid step = sinew::from_axis_angle<sinew::QuatVec>(axis, 0.7 * number(dice()));
            step.translation = {number(dice()), number(dice()), number(dice())};
            motion = normalized(motion * step);
            result.push_back(motion);
        }
        return result;
    }();
    return list;
}

const std::vector<float>& parameters() {
    static const std::vector<float> list = [] {
        std::uniform_real_distribution<float> number(0.05f, 0.95f);
        std::vector<float> result(kDistinct);
        for (float& t : result) t = number(dice());
        return result;
    }();
    return list;
}

template <class Candidate>
std::vector<typename Candidate::Transform> transforms() {
    std::vector<typename Candidate::Transform> list;
    for (const Rigid& rigid : motions()) list.push_back(Candidate::make(rigid));
    return list;
}

template <class Point>
std::vector<Point> points() {
    std::vector<Point> list;
    for (int i = 0; i < kDistinct; ++i) {
        const float x = parameters()[static_cast<std::size_t>(i)];
        list.push_back(Point(x, 1.0f - 2.0f * x, 0.5f * x));
    }
    return list;
}

std::vector<Weights> weights() {
    std::vector<Weights> list;
    for (const float t : parameters()) list.push_back({0.5f, 0.5f * t, 0.5f - 0.5f * t});
    return list;
}

/// Runs task(i) for i in 0 .. kDistinct - 1, `count` times in all.
template <class Task>
void loop(benchmark::State& state, int count, Task task) {
    for (std::size_t i = 0; i < kDistinct; ++i) task(i);
    for (auto _ : state) {
        for (int i = 0; i < count / shorten; ++i) task(static_cast<std::size_t>(i % kDistinct));
    }
}

template <class Task>
void add(std::string_view table, std::string_view name, int count, Task task) {
    const std::string full = std::string(table) + "/" + std::string(name);
    benchmark::RegisterBenchmark(full.c_str(),
                                 [count, task](benchmark::State& state) { loop(state, count, task); })
        ->Iterations(1)
        ->Unit(benchmark::kNanosecond);
}

template <class Candidate>
void add_chain(std::string_view name) {
    add("3.4", name, kChains, [all = transforms<Candidate>()](std::size_t i) {
        auto product = all[i];
        for (std::size_t k = 1; k < kChainLength; ++k) product = Candidate::compose(product, all[i + k]);
        benchmark::DoNotOptimize(product);
    });
}

template <class Candidate>
void add_point(std::string_view name) {
    using Point = typename Candidate::Point;
    add("3.5", name, kPoints, [all = transforms<Candidate>(), points = points<Point>()](std::size_t i) {
        auto moved = Candidate::apply(all[i], points[i]);
        benchmark::DoNotOptimize(moved);
    });
}

template <class Candidate, class Between>
void add_between(std::string_view name, Between between) {
    add("3.9", name, kInterpolations, [all = transforms<Candidate>(), between](std::size_t i) {
        auto result = between(all[i], all[i + 1], parameters()[i]);
        benchmark::DoNotOptimize(result);
    });
}

template <class Method>
void add_method() {
    using Transform = typename Method::template Transform<float>;
    const auto between = [](const Transform& a, const Transform& b, float t) {
        return Method::between(a, b, t);
    };
    const std::string name = "sinew_" + std::string(Method::name);
    if constexpr (std::is_same_v<Transform, sinew::Affine<float>>) {
        add_between<Ours<sinew::Affine>>(name, between);
    } else if constexpr (std::is_same_v<Transform, sinew::QuatVec<float>>) {
        add_between<Ours<sinew::QuatVec>>(name, between);
    } else {
        add_between<Ours<sinew::DualQuat>>(name, between);
    }
}

template <class Candidate>
void add_blend(std::string_view name) {
    using Point = typename Candidate::Point;
    add("3.10", name, kBlends,
        [all = transforms<Candidate>(), points = points<Point>(), weights = weights()](std::size_t i) {
            auto moved = Candidate::apply(Candidate::blend(&all[i], weights[i]), points[i]);
            benchmark::DoNotOptimize(moved);
        });
}

template <class Method>
void add_skinning(std::string_view name) {
    using Bone = typename Method::template Bone<float>;
    std::vector<Bone> bones;
    for (const Rigid& rigid : motions()) {
        const auto affine = sinew::cast<float>(sinew::to_affine(rigid));
        bones.push_back(Method::template prepare<float>(affine, {}));
    }
    std::vector<std::array<sinew::Influence<float>, 3>> influences;
    for (const Weights& w : weights()) influences.push_back({{{0, w[0]}, {1, w[1]}, {2, w[2]}}});
    add("3.10", name, kBlends, [bones, influences, points = points<glm::vec3>()](std::size_t i) {
        auto moved =
            Method::template deform_vertex<float>(std::span(bones).subspan(i, 3), influences[i], points[i]);
        benchmark::DoNotOptimize(moved);
    });
}

/// Sinew's kernels: deform a mesh of kMesh vertices on one thread until kBlends vertices are done. Three bones
/// for each vertex, in runs of vertices with the same three, as in a mesh.
void add_kernels(const sinew::MethodInfo& method, std::string_view name) {
    struct Scene {
        sinew::Deformer deformer;
        std::vector<sinew::Affine<float>> pose;
        std::vector<glm::vec3> points;
    };
    const std::size_t count = std::min<std::size_t>(kMesh, static_cast<std::size_t>(kBlends / shorten));
    const std::size_t times = static_cast<std::size_t>(kBlends / shorten) / count;
    std::vector<glm::vec3> rest;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> bones;
    std::vector<float> shares;
    const std::vector<glm::vec3> some = points<glm::vec3>();
    const std::vector<Weights> some_weights = weights();
    for (std::size_t i = 0; i < count; ++i) {
        rest.push_back(some[i % kDistinct]);
        for (std::size_t k = 0; k < 3; ++k) {
            bones.push_back(static_cast<std::int32_t>(i * kDistinct / count + k));
            shares.push_back(some_weights[i % kDistinct][k]);
        }
        offsets.push_back(static_cast<std::int32_t>(bones.size()));
    }
    const auto scene =
        std::make_shared<Scene>(Scene{sinew::Deformer({rest, offsets, bones, shares, {}}, method),
                                      transforms<Ours<sinew::Affine>>(), std::vector<glm::vec3>(count)});
    const auto run = [scene, times](benchmark::State& state) {
        const sinew::DeformOptions options{.threads = 1};
        (void)scene->deformer.deform({scene->pose}, options, scene->points);
        for (auto _ : state) {
            for (std::size_t i = 0; i < times; ++i) {
                (void)scene->deformer.deform({scene->pose}, options, scene->points);
            }
        }
    };
    const std::string full = "3.10/" + std::string(name);
    benchmark::RegisterBenchmark(full.c_str(), run)->Iterations(1)->Unit(benchmark::kNanosecond);
}

template <class... Methods>
void add_methods(std::tuple<Methods...>*) {
    (add_method<Methods>(), ...);
}

template <class Candidate>
void add_linear(std::string_view name) {
    add_between<Candidate>(name,
                           [](const auto& a, const auto& b, float t) { return Candidate::linear(a, b, t); });
}

template <class Candidate>
void add_pair(const std::string& name) {
    add_between<Candidate>(name + "_nlerp",
                           [](const auto& a, const auto& b, float t) { return Candidate::nlerp(a, b, t); });
    add_between<Candidate>(name + "_slerp",
                           [](const auto& a, const auto& b, float t) { return Candidate::slerp(a, b, t); });
}

template <class Candidate>
void add_chain_and_point(std::string_view name) {
    add_chain<Candidate>(name);
    add_point<Candidate>(name);
}

void add_all() {
    using sinew::Affine;
    using sinew::DualQuat;
    using sinew::QuatVec;
    add_chain_and_point<Plain4x4>("plain_4x4");
    add_chain_and_point<Lanes4x4>("lanes_4x4");
    add_chain_and_point<Lanes3x4>("lanes_3x4");
    add_chain_and_point<Ours<Affine>>("sinew_affine");
    add_chain_and_point<Ours<QuatVec>>("sinew_quat_vec");
    add_chain_and_point<Ours<DualQuat>>("sinew_dual_quat");
    add_chain_and_point<Glm4x4>("glm_4x4");
    add_chain_and_point<GlmPair>("glm_quat_vec");
    add_chain_and_point<GlmDualQuat>("glm_dual_quat");
    add_chain_and_point<Eigen4x4>("eigen_4x4");
    add_chain_and_point<Eigen3x4>("eigen_3x4");
    add_chain_and_point<EigenPair>("eigen_quat_vec");

    add_linear<Plain4x4>("plain_4x4");
    add_linear<Lanes4x4>("lanes_4x4");
    add_linear<Lanes3x4>("lanes_3x4");
    add_methods(static_cast<sinew::Interpolations*>(nullptr));
    add_linear<Glm4x4>("glm_4x4");
    add_pair<GlmPair>("glm_quat_vec");
    add_between<GlmDualQuat>("glm_dual_quat", &GlmDualQuat::dlb);
    add_between<GlmDualQuat>("glm_dual_quat_sclerp", &GlmDualQuat::sclerp);
    add_linear<Eigen4x4>("eigen_4x4");
    add_linear<Eigen3x4>("eigen_3x4");
    add_pair<EigenPair>("eigen_quat_vec");

    add_blend<Plain4x4>("plain_4x4");
    add_blend<Lanes4x4>("lanes_4x4");
    add_blend<Lanes3x4>("lanes_3x4");
    add_skinning<sinew::Lbs>("sinew_lbs");
    add_skinning<sinew::Qv>("sinew_qv");
    add_skinning<sinew::Dq>("sinew_dq");
    add_kernels(sinew::Lbs::info, "kernel_lbs");
    add_kernels(sinew::Qv::info, "kernel_qv");
    add_kernels(sinew::Dq::info, "kernel_dq");
    add_kernels(sinew::Log::info, "kernel_log");
    add_kernels(sinew::Sbs::info, "kernel_sbs");
    add_blend<Glm4x4>("glm_4x4");
    add_blend<GlmPair>("glm_quat_vec");
    add_blend<GlmDualQuat>("glm_dual_quat");
    add_blend<Eigen4x4>("eigen_4x4");
    add_blend<Eigen3x4>("eigen_3x4");
    add_blend<EigenPair>("eigen_quat_vec");
}

}  // namespace

int main(int argc, char** argv) {
    constexpr std::string_view kShorten = "--shorten=";
    std::vector<char*> rest;
    for (int i = 0; i < argc; ++i) {
        const std::string_view argument = argv[i];
        if (argument.starts_with(kShorten)) {
            shorten = std::stoi(std::string(argument.substr(kShorten.size())));
        } else {
            rest.push_back(argv[i]);
        }
    }
    int count = static_cast<int>(rest.size());
    benchmark::AddCustomContext("compiler", SINEW_COMPILER);
    benchmark::AddCustomContext("flags", SINEW_FLAGS);
    benchmark::Initialize(&count, rest.data());
    if (benchmark::ReportUnrecognizedArguments(count, rest.data())) return 2;
    add_all();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
}
