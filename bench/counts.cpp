// SPDX-License-Identifier: GPL-3.0-or-later
// Runs each kernel and stage once, for callgrind to count its instructions: one dump for each case, with its name.
#define GLM_ENABLE_EXPERIMENTAL
#include <valgrind/callgrind.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "scenes.h"
#include "sinew/base/simd.h"
#include "sinew/methods/methods.h"
#include "sinew/skinned_normals.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace {

using namespace sinew;
using namespace sinew::bench;

template <class Call>
void count(const std::string& name, const Call& call) {
    // The first call allocates memory and starts threads.
    call();
    CALLGRIND_ZERO_STATS;
    CALLGRIND_TOGGLE_COLLECT;
    call();
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS_AT(name.c_str());
}

/// The stages that have a bound mesh, and normals that move with the skin.
void count_stages(Scene& scene, const std::string& kind) {
    const Binding binding(scene.data());
    std::vector<BoneSegment<float>> segments;
    std::vector<TwistBone> twists;
    for (std::size_t bone = 0; bone < scene.pose.size(); ++bone) {
        const auto z = static_cast<float>(bone);
        const auto number = static_cast<std::int32_t>(bone);
        segments.push_back({{0, 0, z}, {0, 0, z + 1}});
        if (bone + 1 < scene.pose.size()) {
            twists.push_back({number, number, number + 1, false, {0, 0, z}, {0, 0, z + 1}});
        }
    }
    const std::vector<Affine<float>> rest_bones(scene.pose.size());
    const Deformer deformer(binding, Dq::info);
    (void)deformer.deform({scene.pose}, {1}, scene.points);
    const BulgeLimit limit(binding, {segments});
    count("bulge_limit" + kind, [&] {
        (void)limit.apply(scene.points, {scene.pose}, {BulgeForm::continuous, 1.0f, 1});
    });
    const TwistSpread spread(binding, {twists, rest_bones});
    TwistSpreadOptions options;
    options.threads = 1;
    for (const TwistBlend blend : {TwistBlend::linear, TwistBlend::rotations}) {
        options.blend = options.mix_blend = blend;
        count((blend == TwistBlend::linear ? "twist_linear" : "twist_rotations") + kind,
              [&] { (void)spread.apply(scene.points, {scene.pose}, options); });
    }
    std::vector<Vec3<float>> normals(scene.points.size(), Vec3<float>(0, 0, 1));
    const SkinnedNormals skinned(binding, Dq::info, {normals});
    count("normals" + kind, [&] { (void)skinned.deform({scene.pose}, {1}, scene.points, normals); });
}

void count_delta_mush() {
    constexpr std::int32_t kSize = 100;
    std::vector<Vec3<float>> points;
    std::vector<std::int32_t> offsets{0}, corners, edges;
    for (std::int32_t i = 0; i < kSize * kSize; ++i) {
        const std::int32_t x = i % kSize, y = i / kSize;
        points.emplace_back(x, y, std::sin(0.3f * static_cast<float>(x * y % 17)));
        if (x + 1 < kSize) edges.insert(edges.end(), {i, i + 1});
        if (y + 1 < kSize) edges.insert(edges.end(), {i, i + kSize});
        if (x + 1 == kSize || y + 1 == kSize) continue;
        corners.insert(corners.end(), {i, i + 1, i + kSize + 1, i + kSize});
        offsets.push_back(static_cast<std::int32_t>(corners.size()));
    }
    const DeltaMush mush({offsets, corners, edges}, points, {});
    count("delta_mush/grid", [&] { (void)mush.apply(points, 1.0f, 1); });
}

}  // namespace

int main() {
    if (RUNNING_ON_VALGRIND == 0) {
        std::fputs("run this under valgrind --tool=callgrind --collect-atstart=no\n", stderr);
        return 2;
    }
    use_simd_target("AVX2");
    for (const Kind kind : {Kind::chain, Kind::shuffled, Kind::character}) {
        Scene scene = make_scene({kind, 10'000});
        const std::string of = std::string("/") + kKindNames[static_cast<int>(kind)];
        for (const MethodInfo& method : kMethods) {
            const Deformer deformer(scene.data_for(method), method);
            count(std::string(method.name) + of,
                  [&] { (void)deformer.deform({scene.pose}, {1}, scene.points); });
            for (const Variant& variant : variants_of(method)) {
                count(variant.name + of,
                      [&] { (void)deformer.deform({scene.pose}, variant.options(), scene.points); });
            }
        }
        count("bind" + of, [&] { const Deformer deformer(scene.data(), Dq::info); });
        count_stages(scene, of);
    }
    count_delta_mush();
    Scene bones = make_scene({Kind::chain, 1000, 1000, 1});
    for (const MethodInfo& method : kMethods) {
        const Deformer deformer(bones.data_for(method), method);
        count(std::string(method.name) + "/bones",
              [&] { (void)deformer.deform({bones.pose}, {1}, bones.points); });
    }
    return 0;
}
