// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the kernels of the stage `twist_spread` on each instruction set against the definition in double,
// its threads and options.
#include "sinew/stages/twist_spread/twist_spread.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "scene.h"
#include "sinew/base/simd.h"
#include "sinew/transform/convert.h"
#include "sinew/transform/split_scale.h"

namespace sinew::test {
namespace {

/// Bones 0, 2, 4 ... share the twist of the next, or their own.
std::vector<TwistBone> twists_of(const Scene& scene) {
    Random random(99);
    std::vector<TwistBone> twists;
    for (std::int32_t bone = 0; bone + 1 < kBones; bone += 2) {
        const Affine<float>& rest = scene.rest_bones[static_cast<std::size_t>(bone)];
        const bool is_from_parent = bone % 4 == 0;
        const std::int32_t next = bone + 1;
        twists.push_back({bone, is_from_parent ? next : bone, is_from_parent ? bone : next, is_from_parent,
                          rest.translation, rest.translation + Vec3<float>(random.vector(1.0))});
    }
    return twists;
}

std::vector<std::int32_t> chain() {
    std::vector<std::int32_t> parents;
    for (std::int32_t bone = 0; bone < kBones; ++bone) parents.push_back(bone - 1);
    return parents;
}

/// Channels of turns that the poses do not tell, where they are to be trusted.
std::vector<TwistChannels<float>> channels_of(const Scene& scene, const std::vector<TwistBone>& twists) {
    std::vector<TwistChannels<float>> channels;
    for (const TwistBone& twist : twists) {
        const auto tip = static_cast<std::size_t>(twist.tip);
        const auto rest = cast<double>(scene.rest_bones[tip]);
        const auto base = cast<double>(scene.posed_from_rest[static_cast<std::size_t>(twist.base)]);
        const auto relative =
            split_scale(inverse(base) * cast<double>(scene.posed_from_rest[tip]), rest).rigid.linear;
        const Quat<double> axes = to_quat(rotation_keeping_y(rest.linear));
        const auto own = Quat<float>(glm::conjugate(axes) * to_quat(relative) * axes);
        channels.push_back({own, Vec3<float>(0.3f, twist.bone % 3 == 0 ? 9.0f : -6.5f, -0.2f)});
    }
    return channels;
}

std::vector<float> mixed(const Scene& scene) {
    std::vector<float> mix;
    for (std::size_t i = 0; i < scene.rest_points.size(); ++i)
        mix.push_back(0.25f * static_cast<float>(i % 5));
    return mix;
}

/// The twisted points by the definition, in double.
std::vector<Vec3<double>> by_definition(const Scene& scene, const TwistSpreadData& data,
                                        const std::vector<Vec3<float>>& points,
                                        const TwistSpreadOptions& options) {
    const TwistSpread spread(Binding(scene.data()), data);
    std::vector<Vec3<double>> result;
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        const auto influences = normalised_influences_of<double>(scene, vertex);
        const Vec3<double> rest(scene.rest_points[vertex]);
        Vec3<double> point(points[vertex]);
        for (std::size_t i = data.twists.size(); i-- > 0;) {
            const TwistBone& twist = data.twists[i];
            const auto tip_rest = cast<double>(scene.rest_bones[static_cast<std::size_t>(twist.tip)]);
            const auto motion_of = [&](std::int32_t bone) {
                return cast<double>(scene.posed_from_rest[static_cast<std::size_t>(bone)]);
            };
            const auto relative =
                split_scale(inverse(motion_of(twist.base)) * motion_of(twist.tip), tip_rest).rigid.linear;
            const Quat<double> rotation = glm::normalize(to_quat(relative));
            const auto bone_rest = cast<double>(scene.rest_bones[static_cast<std::size_t>(twist.bone)]);
            const Vec3<double> head(twist.head);
            const Vec3<double> axis = glm::normalize(Vec3<double>(twist.tail) - head);
            double expected = 0.0;
            if (!options.channels.empty()) {
                const TwistChannels<double> told{glm::normalize(Quat<double>(options.channels[i].rotation)),
                                                 Vec3<double>(options.channels[i].angles)};
                expected = TwistSpreadDefinition::expected(
                    told, rotation, to_quat(rotation_keeping_y(tip_rest.linear)), axis);
            }
            const auto [angle, around, part] = TwistSpreadDefinition::read(rotation, axis, expected);
            const double factor =
                static_cast<double>(options.amount) * static_cast<double>(options.amounts[i]);
            const TwistSpreadDefinition::Bone<double> bone{
                motion_of(twist.bone),
                head,
                axis,
                head,
                Vec3<double>(twist.tail),
                static_cast<double>(options.curves[i]),
                factor * angle,
                around,
                factor * part,
                twist.is_from_parent,
                split_scale(motion_of(twist.bone), bone_rest).has_scale};
            double weight = 0.0;
            double below = 0.0;
            for (const auto& influence : influences) {
                if (influence.bone == twist.bone) weight += influence.weight;
                if (influence.bone >= twist.tip) below += influence.weight;
            }
            if (weight == 0.0 && !(below > 0.0)) continue;
            const double mix = data.mix.empty() ? 0.0 : static_cast<double>(data.mix[vertex]);
            point = TwistSpreadDefinition::deform_vertex(bone, options.blend, options.mix_blend, mix, weight,
                                                         below, static_cast<double>(data.weights[vertex]),
                                                         rest, point);
        }
        result.push_back(point);
    }
    return result;
}

class SpreadTwists : public OnEachTarget {};

INSTANTIATE_TEST_SUITE_P(every, SpreadTwists, testing::ValuesIn(simd_targets()), name_of_target);

TEST_P(SpreadTwists, kernel_agrees_with_the_definition) {
    for (const std::uint32_t seed : {1u, 2u, 3u}) {
        const Scene scene = scene_of_shared_bones(seed);
        const auto twists = twists_of(scene);
        const auto parents = chain();
        const auto mix = mixed(scene);
        std::vector<float> weights(scene.rest_points.size(), 1.0f);
        for (std::size_t i = 0; i < weights.size(); i += 3) weights[i] = 0.5f;
        const auto channels = channels_of(scene, twists);
        const std::vector<float> amounts{1.0f, 0.8f, 0.6f, 1.0f, 0.0f, 1.0f};
        const std::vector<float> curves{0.0f, 1.0f, -1.0f, 0.5f, 0.0f, -0.25f};
        const auto before = deformed(Deformer(scene.data(), Lbs::info), scene);
        constexpr auto kBlendCount = static_cast<int>(std::size(TwistSpreadDefinition::kBlends));
        for (int pair = 0; pair < kBlendCount * kBlendCount; ++pair) {
            const auto first = static_cast<TwistBlend>(pair / kBlendCount);
            const auto second = static_cast<TwistBlend>(pair % kBlendCount);
            SCOPED_TRACE(pair);
            for (const bool are_known : {false, true}) {
                TwistSpreadData data{twists, scene.rest_bones, parents, {}, weights, mix};
                TwistSpreadOptions options{0.9f, amounts, curves, {}, first, second};
                if (are_known) options.channels = channels;
                auto points = before;
                EXPECT_EQ(
                    TwistSpread(Binding(scene.data()), data).apply(points, {scene.posed_from_rest}, options),
                    Status::ok);
                const auto expected = by_definition(scene, data, before, options);
                EXPECT_LT(largest_error(points, expected), 40.0 * kTolerance);
                EXPECT_GT(largest_error(before, expected), 0.1);
            }
        }
    }
}

TEST_P(SpreadTwists, threads_change_no_bit_and_the_rest_pose_stays) {
    Scene scene = scene_of_shared_bones(4);
    for (Vec3<float>& point : scene.rest_points) point.x = -0.0f;
    const auto twists = twists_of(scene);
    const TwistSpread spread(Binding(scene.data()), {twists, scene.rest_bones});
    for (const TwistBlend blend : {TwistBlend::linear, TwistBlend::rotations}) {
        TwistSpreadOptions options;
        options.blend = blend;
        auto one = deformed(Deformer(scene.data(), Dq::info), scene);
        auto many = one;
        options.threads = 1;
        EXPECT_EQ(spread.apply(one, {scene.posed_from_rest}, options), Status::ok);
        options.threads = 5;
        EXPECT_EQ(spread.apply(many, {scene.posed_from_rest}, options), Status::ok);
        EXPECT_TRUE(same_bits(one, many));
        auto rest = scene.rest_points;
        // Without a pose, all bones are at rest.
        EXPECT_EQ(spread.apply(rest, {}, options), Status::ok);
        EXPECT_TRUE(same_bits(rest, scene.rest_points));
    }
}

TEST(TwistSpread, options_become_valid_and_wrong_sizes_change_nothing) {
    const Scene scene = scene_of_shared_bones(6);
    const auto twists = twists_of(scene);
    const TwistSpread spread(Binding(scene.data()), {twists, scene.rest_bones});
    const auto before = deformed(Deformer(scene.data(), Lbs::info), scene);
    const auto by = [&](float amount) {
        auto points = before;
        TwistSpreadOptions options;
        options.amount = amount;
        EXPECT_EQ(spread.apply(points, {scene.posed_from_rest}, options), Status::ok);
        return points;
    };
    EXPECT_TRUE(by(-1.0f) == before);
    EXPECT_TRUE(by(5.0f) == by(1.0f));
    EXPECT_TRUE(by(std::numeric_limits<float>::quiet_NaN()) == by(1.0f));
    std::vector<Vec3<float>> few(3, Vec3<float>(9.0f));
    EXPECT_EQ(spread.apply(few, {scene.posed_from_rest}), Status::size);
    EXPECT_TRUE(few == std::vector<Vec3<float>>(3, Vec3<float>(9.0f)));
    auto points = before;
    const std::vector<float> two(2, 1.0f);
    TwistSpreadOptions options;
    options.amounts = two;
    EXPECT_EQ(spread.apply(points, {scene.posed_from_rest}, options), Status::size);
    EXPECT_TRUE(points == before);
}

}  // namespace
}  // namespace sinew::test
