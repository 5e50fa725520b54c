// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the kernels of the stage `bulge_limit` on each instruction set against the definition in double,
// its threads and options.
#include "sinew/stages/bulge_limit/bulge_limit.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "scene.h"
#include "sinew/base/simd.h"

namespace sinew::test {
namespace {

std::vector<BoneSegment<float>> segments_of(const Scene& scene) {
    Random random(99);
    std::vector<BoneSegment<float>> segments;
    for (const Affine<float>& bone : scene.rest_bones) {
        segments.push_back({bone.translation, bone.translation + Vec3<float>(random.vector(0.5))});
    }
    return segments;
}

std::vector<Vec3<float>> bulging(const Scene& scene) {
    std::vector<Vec3<float>> points = deformed(Deformer(scene.data(), Dq::info), scene);
    for (Vec3<float>& point : points) point *= 1.3f;
    return points;
}

/// The limited points by the definition, in double.
std::vector<Vec3<double>> by_definition(const Scene& scene, const std::vector<BoneSegment<float>>& segments,
                                        const std::vector<Vec3<float>>& points, BulgeForm form,
                                        double strength) {
    std::vector<BoneSegment<double>> rest_segments;
    std::vector<BulgeLimitDefinition::Bone<double>> bones;
    for (std::size_t bone = 0; bone < segments.size(); ++bone) {
        const BoneSegment<double> rest{Vec3<double>(segments[bone].head), Vec3<double>(segments[bone].tail)};
        const auto motion = cast<double>(scene.posed_from_rest[bone]);
        rest_segments.push_back(rest);
        bones.push_back({{transform_point(motion, rest.head), transform_point(motion, rest.tail)},
                         BulgeLimitDefinition::stretch(motion.linear, rest)});
    }
    std::vector<Vec3<double>> result;
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        const auto influences = normalised_influences_of<double>(scene, vertex);
        const double apart = BulgeLimitDefinition::rest_distance<double>(
            form, rest_segments, influences, Vec3<double>(scene.rest_points[vertex]));
        result.push_back(BulgeLimitDefinition::deform_vertex<double>(form, bones, influences, apart, strength,
                                                                     Vec3<double>(points[vertex])));
    }
    return result;
}

class LimitBulge : public OnEachTarget {};

INSTANTIATE_TEST_SUITE_P(every, LimitBulge, testing::ValuesIn(simd_targets()), name_of_target);

TEST_P(LimitBulge, kernel_agrees_with_the_definition) {
    for (const std::uint32_t seed : {1u, 2u, 3u}) {
        const Scene scene = scene_of_shared_bones(seed);
        const auto segments = segments_of(scene);
        const BulgeLimit limit(Binding(scene.data()), {segments});
        for (const BulgeForm form : {BulgeForm::continuous, BulgeForm::kim_han}) {
            const auto before = bulging(scene);
            auto points = before;
            EXPECT_EQ(limit.apply(points, {scene.posed_from_rest}, {form, 0.75f}), Status::ok);
            const auto expected = by_definition(scene, segments, before, form, 0.75);
            EXPECT_LT(largest_error(points, expected), 20.0 * kTolerance);
            EXPECT_GT(largest_error(before, expected), 0.1);
        }
    }
}

TEST_P(LimitBulge, threads_change_no_bit_and_the_rest_pose_stays) {
    const Scene scene = scene_of_shared_bones(4);
    const auto segments = segments_of(scene);
    const BulgeLimit limit(Binding(scene.data()), {segments});
    for (const BulgeForm form : {BulgeForm::continuous, BulgeForm::kim_han}) {
        auto one = bulging(scene);
        auto many = one;
        EXPECT_EQ(limit.apply(one, {scene.posed_from_rest}, {form, 1.0f, 1}), Status::ok);
        EXPECT_EQ(limit.apply(many, {scene.posed_from_rest}, {form, 1.0f, 5}), Status::ok);
        EXPECT_TRUE(same_bits(one, many));
        auto rest = scene.rest_points;
        // Without a pose, all bones are at rest.
        EXPECT_EQ(limit.apply(rest, {}, {form}), Status::ok);
        EXPECT_TRUE(same_bits(rest, scene.rest_points));
    }
}

// A sum with 0 makes 0 of -0. Vectors have vertices that bulge beside others, and lanes without a vertex.
TEST_P(LimitBulge, vertices_that_do_not_bulge_keep_their_bits) {
    Scene scene = scene_of_shared_bones(5);
    for (std::size_t i = 0; i < scene.rest_points.size(); ++i)
        scene.rest_points[i][static_cast<int>(i % 3)] = -0.0f;
    const auto segments = segments_of(scene);
    const std::vector<float> none(scene.rest_points.size(), 0.0f);
    const BulgeLimit limit(Binding(scene.data()), {segments});
    const BulgeLimit masked(Binding(scene.data()), {segments, {}, none});
    for (const BulgeForm form : {BulgeForm::continuous, BulgeForm::kim_han}) {
        auto points = scene.rest_points;
        for (std::size_t i = 0; i < points.size(); i += 7) points[i] *= 3.0f;
        const auto before = points;
        EXPECT_EQ(masked.apply(points, {}, {form}), Status::ok);
        EXPECT_TRUE(same_bits(points, before));
        EXPECT_EQ(limit.apply(points, {}, {form}), Status::ok);
        EXPECT_FALSE(same_bits(points, before));
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (i % 7 != 0) ASSERT_TRUE(same_bits(points[i], before[i])) << i;
        }
    }
}

TEST(BulgeLimit, options_become_valid_and_points_of_another_number_stay) {
    const Scene scene = scene_of_shared_bones(6);
    const auto segments = segments_of(scene);
    const BulgeLimit limit(Binding(scene.data()), {segments});
    const auto before = bulging(scene);
    const auto by = [&](float strength) {
        auto points = before;
        EXPECT_EQ(limit.apply(points, {scene.posed_from_rest}, {BulgeForm::continuous, strength}),
                  Status::ok);
        return points;
    };
    EXPECT_TRUE(by(-1.0f) == before);
    EXPECT_TRUE(by(5.0f) == by(1.0f));
    EXPECT_TRUE(by(std::numeric_limits<float>::quiet_NaN()) == by(1.0f));
    std::vector<Vec3<float>> few(3, Vec3<float>(9.0f));
    EXPECT_EQ(limit.apply(few, {scene.posed_from_rest}), Status::size);
    EXPECT_TRUE(few == std::vector<Vec3<float>>(3, Vec3<float>(9.0f)));
}

}  // namespace
}  // namespace sinew::test
