// SPDX-License-Identifier: GPL-3.0-or-later
// Calls everything that the installed library exports, and checks the results.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "sinew/base/simd.h"
#include "sinew/base/thread_pool.h"
#include "sinew/deformer.h"
#include "sinew/interpolate/methods.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#include "sinew/normals.h"
#include "sinew/skinned_normals.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "sinew/stages/twist_spread/twist_spread.h"
#include "sinew/transform/make.h"

namespace {

void expect(bool is_true, const char* what) {
    if (is_true) return;
    std::fprintf(stderr, "not so: %s\n", what);
    std::exit(1);
}

void deform() {
    const std::vector<sinew::Vec3<float>> rest{{1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
    const std::vector<std::int32_t> offsets{0, 1, 2, 3}, bones{0, 1, 1};
    const std::vector<float> weights{1.0f, 1.0f, 1.0f};
    std::vector<sinew::Affine<float>> pose(2);
    pose[0].translation = {10, 20, 30};
    pose[1].translation = {100, 200, 300};
    for (const sinew::MethodInfo& method : sinew::kMethods) {
        sinew::BindData data{rest, offsets, bones, weights};
        const sinew::VertexData linear{method, {}, true};
        if (method.vertex_floats > 0) data.vertex_data = std::span(&linear, 1);
        sinew::Deformer deformer(data, method);
        std::vector<sinew::Vec3<float>> points(rest.size());
        expect(deformer.deform({pose}, {}, points) == sinew::Status::ok, "sizes fit");
        expect(points[0] == sinew::Vec3<float>(11, 20, 30), "the first point is moved by its bone");
        expect(points[1] == sinew::Vec3<float>(100, 202, 300), "the second point is moved by its bone");
        expect(points[2] == sinew::Vec3<float>(100, 200, 303), "the third point is moved by its bone");
        expect(deformer.set_rest_points(points) == sinew::Status::ok, "the points are finite");
        expect(deformer.vertex_count() == 3 && deformer.influence_count() == 3 &&
                   deformer.bone_count() == 2 && deformer.method() == method,
               "a Deformer says what it was made of");
    }
    const sinew::Binding binding({rest, offsets, bones, weights});
    expect(binding.vertex_count() == 3 && binding.influence_count() == 3 && binding.bone_count() == 2,
           "a Binding says what it was made of");
    const std::vector<float> shares{0.0f, 0.5f, 1.0f};
    const sinew::Deformer mixed(binding, sinew::Lbs::info, sinew::MixData{sinew::Dq::info, shares});
    std::vector<sinew::Vec3<float>> points(rest.size());
    expect(mixed.deform({pose}, {}, points) == sinew::Status::ok, "sizes fit");
    expect(points[1] == sinew::Vec3<float>(100, 202, 300), "both methods move the second point alike");
    expect(mixed.mixed_method()->name == "dq", "a mix says what it adds");
}

void smooth() {
    const std::vector<sinew::Vec3<float>> rest{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::int32_t> face_offsets{0, 3}, corners{0, 1, 2}, edges{0, 1, 1, 2, 2, 0};
    const sinew::DeltaMush mush({face_offsets, corners, edges}, rest, {});
    std::vector<sinew::Vec3<float>> points = rest;
    expect(mush.apply(points) == sinew::Status::ok, "sizes fit");
    expect(mush.vertex_count() == 3 && mush.iterations() == 5, "a DeltaMush says what it was made of");
    for (std::size_t v = 0; v < rest.size(); ++v)
        expect(glm::length(points[v] - rest[v]) < 1e-6f, "delta mush gives the rest shape its details back");
}

void compute_normals() {
    const std::vector<sinew::Vec3<float>> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::int32_t> face_offsets{0, 3}, corners{0, 1, 2};
    const sinew::Normals normals({face_offsets, corners, {}}, points.size());
    std::vector<sinew::Vec3<float>> result(normals.count(sinew::NormalDomain::vertex));
    expect(normals.compute(normals.domain(), points, result) == sinew::Status::ok, "sizes fit");
    expect(normals.domain() == sinew::NormalDomain::vertex, "Normals say that nothing is sharp");
    for (const auto& normal : result) expect(normal == sinew::Vec3<float>(0, 0, 1), "a flat face's normal");
}

void move_normals() {
    const std::vector<sinew::Vec3<float>> rest{{1, 0, 0}}, normals{{0, 0, 1}};
    const std::vector<std::int32_t> offsets{0, 1}, bones{0};
    const std::vector<float> weights{1.0f};
    std::vector<sinew::Affine<float>> pose(1);
    pose[0].linear = sinew::Mat3<float>(0, 1, 0, 0, 0, 1, 1, 0, 0);
    const sinew::Binding binding({rest, offsets, bones, weights});
    const sinew::SkinnedNormals skinned(binding, sinew::Lbs::info, {normals});
    std::vector<sinew::Vec3<float>> points(1), moved(1);
    expect(skinned.deform({pose}, {}, points, moved) == sinew::Status::ok, "sizes fit");
    expect(skinned.frame_count() == 1 && !skinned.has_tangents() && skinned.deformer().vertex_count() == 1,
           "SkinnedNormals say what they were made of");
    expect(glm::length(moved[0] - sinew::Vec3<float>(1, 0, 0)) < 1e-5f, "a normal turns with its bone");
}

void limit_bulges() {
    const std::vector<sinew::Vec3<float>> rest{{0, 1, 0}};
    const std::vector<std::int32_t> offsets{0, 2}, bones{0, 1};
    const std::vector<float> weights{0.5f, 0.5f};
    const std::vector<sinew::BoneSegment<float>> segments{{{-1, 0, 0}, {0, 0, 0}}, {{0, 0, 0}, {1, 0, 0}}};
    const sinew::BulgeLimit limit(sinew::Binding({rest, offsets, bones, weights}), {segments});
    std::vector<sinew::Vec3<float>> points{{0, 3, 0}};
    const std::vector<sinew::Affine<float>> posed(2);
    expect(limit.apply(points, {posed}) == sinew::Status::ok, "sizes fit");
    expect(glm::length(points[0] - rest[0]) < 1e-5f, "a vertex is no further from its bones than at rest");
}

void spread_twists() {
    const std::vector<sinew::Vec3<float>> rest{{1, 1, 0}};
    const std::vector<std::int32_t> offsets{0, 1}, bones{0};
    const std::vector<float> weights{1.0f};
    const std::vector<sinew::TwistBone> twists{{0, 0, 1, false, {0, 0, 0}, {0, 2, 0}}};
    const std::vector<sinew::Affine<float>> rest_bones(2);
    const sinew::TwistSpread spread(sinew::Binding({rest, offsets, bones, weights}), {twists, rest_bones});
    std::vector<sinew::Vec3<float>> points{rest};
    const auto turn = sinew::from_axis_angle<sinew::QuatVec>(sinew::Vec3<float>(0, 1, 0), 1.0f);
    const std::vector<sinew::Affine<float>> posed{{}, sinew::to_affine(turn)};
    expect(spread.apply(points, {posed}) == sinew::Status::ok, "sizes fit");
    expect(glm::length(points[0] - sinew::Vec3<float>(std::cos(0.5f), 1, -std::sin(0.5f))) < 1e-5f,
           "half of the twist in the middle of the bone");
}

void find_centres() {
    const std::vector<sinew::Vec3<float>> rest{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::int32_t> offsets{0, 1, 2, 3}, bones{0, 0, 0}, triangles{0, 1, 2};
    const std::vector<float> weights{1.0f, 1.0f, 1.0f};
    std::vector<sinew::Vec3<float>> centres;
    const sinew::BackgroundJob background(0, false, [&](sinew::Job& job) {
        centres = sinew::centres_of_rotation({rest, offsets, bones, weights}, triangles, job);
    });
    while (!background.wait_for(std::chrono::seconds(1))) {
    }
    background.rethrow();
    expect(centres.size() == 3, "a centre for each vertex");
}

void interpolate() {
    const sinew::DualQuat<float> from{};
    const auto onto = sinew::from_translation<sinew::DualQuat>(sinew::Vec3<float>(2, 4, 6));
    const auto middle = sinew::Dlb::between(from, onto, 0.5f);
    expect(glm::length(sinew::translation(middle.transform) - sinew::Vec3<float>(1, 2, 3)) < 1e-6f,
           "half of a translation");
}

}  // namespace

int main() {
    deform();
    smooth();
    compute_normals();
    move_normals();
    limit_bulges();
    spread_twists();
    find_centres();
    interpolate();
    expect(sinew::simd_target() == sinew::simd_targets().front(), "the fastest kernels are in use");
    sinew::use_simd_target(sinew::simd_targets().back());
    deform();
    expect(sinew::hardware_threads() >= 1, "at least one thread");
    sinew::parallel_for(
        10, 2, [](std::size_t, std::size_t) {}, 1);
    sinew::end_threads();
}
