// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the memory of fits, splines, skeletons and inverse kinematics, for sanitizers, and whatever sizes are given; tests/python has the oracles.
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "sinew/fit/average.h"
#include "sinew/fit/hand_eye.h"
#include "sinew/ik/solver.h"
#include "sinew/interpolate/hermite.h"
#include "sinew/interpolate/methods.h"
#include "sinew/skeleton/forward_kinematics.h"
#include "sinew/skeleton/keyframes.h"
#include "support.h"

namespace sinew::test {
namespace {

template <class T>
class Average : public testing::Test {};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Average, Scalars);

TYPED_TEST(Average, leaves_outliers_out) {
    using T = TypeParam;
    Random random(3);
    const DualQuat<double> middle = to_dual_quat(random.motion(3.0));
    std::vector<DualQuat<T>> poses;
    for (const double side : {-1.0, 1.0}) {
        for (const Vec3<double>& axis : {Vec3<double>(0.01, 0, 0), {0, 0.01, 0}, {0, 0, 0.01}}) {
            poses.push_back(cast<T>(middle * to_dual_quat(Twist<double>{side * axis, side * axis})));
        }
    }
    for (int i = 0; i < 4; ++i) poses.push_back(cast<T>(to_dual_quat(random.motion(30.0))));
    std::vector<T> kept(poses.size());
    const auto robust = robust_average<T>(poses, {}, kept);
    EXPECT_TRUE(robust.is_defined);
    EXPECT_LT(distance(to_affine(robust.transform), cast<T>(to_affine(middle))),
              256.0 * std::numeric_limits<T>::epsilon());
    EXPECT_EQ(kept.back(), T(0));
    EXPECT_GT(kept.front(), T(0.5));
    EXPECT_FALSE(average<T>({}).is_defined);
    EXPECT_FALSE(robust_average<T>({}, {}, {}).is_defined);
}

template <class Transform>
Transform as(const QuatVec<double>& motion) {
    if constexpr (std::is_same_v<Transform, Affine<double>>) return to_affine(motion);
    if constexpr (std::is_same_v<Transform, QuatVec<double>>) return motion;
    if constexpr (std::is_same_v<Transform, DualQuat<double>>) return to_dual_quat(motion);
}

template <class Method>
class Spline : public testing::Test {};

using InterpolationMethods =
    testing::Types<MatrixLinear, MatrixPolar, MatrixLog, QvNlerp, QvSlerp, Dlb, Sclerp>;
TYPED_TEST_SUITE(Spline, InterpolationMethods);

TYPED_TEST(Spline, half_turns_between_keys_are_finite) {
    using Transform = typename TypeParam::template Transform<double>;
    constexpr std::array kTimes{0.0, 1.0, 1.5, 4.0, 5.0};
    std::vector<Transform> keys;
    for (const double degrees : {0.0, 180.0, 360.0, 180.0, 0.0}) {
        keys.push_back(as<Transform>({about<double>({1, 2, 3}, degrees), {degrees, 0, 0}}));
    }
    for (const double time : {-1.0, 0.0, 0.5, 1.0, 1.2, 2.0, 4.0, 5.0, 9.0}) {
        const auto value = catmull_rom<TypeParam, double>(std::span<const Transform>(keys), kTimes, time);
        EXPECT_TRUE(is_finite(to_affine(value.transform))) << time;
    }
}

TYPED_TEST(Spline, sizes_that_do_not_fit_read_and_write_nothing) {
    using Transform = typename TypeParam::template Transform<double>;
    const std::vector<Transform> keys(4);
    const std::vector<double> times{0.0, 1.0, 2.0, 3.0};
    const auto few = [](const auto& all) { return std::span(all).first(2); };
    for (const auto& value :
         {catmull_rom<TypeParam, double>(keys, few(times), 0.5),
          catmull_rom<TypeParam, double>(few(keys), times, 2.5), catmull_rom<TypeParam, double>({}, {}, 0.5),
          catmull_rom_vector<Transform, double>(few(keys), times, 2.5),
          TypeParam::template blend<BlendSigns::kToHeaviest, double>(keys, few(times)),
          TypeParam::template blend<BlendSigns::kToHeaviest, double>(few(keys), times),
          TypeParam::template blend<BlendSigns::kToHeaviest, double>({}, {})}) {
        EXPECT_FALSE(value.is_defined);
        EXPECT_EQ(distance(to_affine(value.transform), Affine<double>{}), 0.0);
    }
    const Skeleton skeleton(std::vector<std::int32_t>{-1, 0, 1, 2});
    const Transform mark = as<Transform>({about<double>({1, 2, 3}, 50.0), {9, 8, 7}});
    std::vector<Transform> bones(4, mark), three(3, mark);
    const std::span<const Transform> all(keys), some = all.first(3);
    std::vector<bool> are_done;
    for (const auto& [from, onto] : {std::pair(some, std::span(bones)), std::pair(all, std::span(three))}) {
        are_done.push_back(root_relative<Transform>(skeleton, mark, from, onto));
        are_done.push_back(update_branch<Transform>(skeleton, mark, from, 1, onto));
        are_done.push_back(interpolate_keyframes<TypeParam, double>(skeleton, from, all, 0.5, onto));
        are_done.push_back(
            spline_keyframes<TypeParam, double>(skeleton, from, few(times).first(1), 0.5, onto));
        are_done.push_back(
            spline_keyframes_vector<Transform, double>(skeleton, from, few(times).first(1), 0.5, onto));
    }
    are_done.push_back(update_branch<Transform>(skeleton, mark, all, 4, bones));
    are_done.push_back(interpolate_keyframes<TypeParam, double>(skeleton, all, some, 0.5, bones));
    are_done.push_back(spline_keyframes<TypeParam, double>(skeleton, {}, {}, 0.5, bones));
    EXPECT_EQ(std::ranges::count(are_done, true), 0);
    for (const Transform& bone : bones) EXPECT_EQ(distance(to_affine(bone), to_affine(mark)), 0.0);
    EXPECT_TRUE(root_relative<Transform>(skeleton, mark, all, bones));
}

TEST(Hermite, sizes_that_do_not_fit_read_nothing) {
    const std::vector<Vec3<double>> points(4, Vec3<double>(1.0));
    const std::vector<DualQuat<double>> keys(4);
    const std::vector<Twist<double>> velocities(4);
    const std::vector<double> times{0.0, 1.0, 2.0, 3.0};
    const auto few = [](const auto& all) { return std::span(all).first(2); };
    EXPECT_EQ(hermite<double>(few(points), points, times, 2.5), Vec3<double>(0.0));
    EXPECT_EQ(hermite<double>(points, few(points), times, 2.5), Vec3<double>(0.0));
    EXPECT_EQ(hermite<double>(std::span<const Vec3<double>>(), {}, {}, 2.5), Vec3<double>(0.0));
    EXPECT_FALSE(hermite<double>(few(keys), velocities, times, 2.5).is_defined);
    EXPECT_FALSE(hermite<double>(keys, few(velocities), times, 2.5).is_defined);
    EXPECT_FALSE(hermite<double>(std::span<const DualQuat<double>>(), {}, {}, 2.5).is_defined);
    EXPECT_TRUE(hermite<double>(keys, velocities, times, 2.5).is_defined);
}

TEST(Fits, of_numbers_that_differ_are_not_defined) {
    const std::vector<Vec3<double>> three(3, Vec3<double>(1.0));
    const std::vector<DualQuat<double>> poses(3);
    const std::vector<double> two(2, 1.0);
    std::vector<double> kept(2);
    const auto few = [](const auto& all) { return std::span(all).first(2); };
    EXPECT_FALSE(fit_rigid(Pairs<double>{three, few(three)}).is_defined);
    EXPECT_FALSE(fit_rigid(Pairs<double>{three, three, two}).is_defined);
    EXPECT_FALSE(fit_rigid(Pairs<double>{{}, {}, {}, three, few(three)}).is_defined);
    EXPECT_FALSE(fit_rigid(Pairs<double>{{}, {}, {}, three, three, two}).is_defined);
    EXPECT_FALSE(hand_eye<double>(poses, few(poses)).is_defined);
    EXPECT_FALSE(hand_eye<double>(poses, poses, two).is_defined);
    EXPECT_FALSE(average<double>(poses, two).is_defined);
    EXPECT_FALSE(robust_average<double>(poses, {}, kept).is_defined);
}

// Beside one that is 1e600 times as heavy.
TEST(RobustAverage, a_weight_that_vanishes_counts_as_0) {
    const std::vector poses{DualQuat<double>{},
                            to_dual_quat(QuatVec<double>{about<double>({1, 2, 3}, 180.0), {}}),
                            DualQuat<double>{}};
    const std::vector weights{1e300, 1e-300, 1e300};
    std::vector<double> kept(3, 5.0);
    EXPECT_TRUE(average<double>(poses, weights).is_defined);
    EXPECT_TRUE(robust_average<double>(poses, weights, kept).is_defined);
    EXPECT_EQ(kept, (std::vector{1.0, 0.0, 1.0}));
}

TEST(IkSolver, takes_limits_poles_and_trees_and_solves_nothing_where_sizes_do_not_fit) {
    Random random(5);
    const std::vector<std::int32_t> parents{-1, 0, 1, 2, 1, 4};
    for (std::size_t i = 0; i < 50; ++i) {
        std::vector<BoneLimits> limits(parents.size());
        std::vector<DualQuat<double>> rest;
        std::vector<Quat<double>> rotations;
        for (BoneLimits& of_bone : limits) {
            for (AxisLimit& limit : of_bone) {
                limit = {.is_locked = random.index(3) == 0,
                         .is_limited = random.index(2) == 0,
                         .min = -random.uniform(0.1, 2.5),
                         .max = random.uniform(0.1, 2.5)};
            }
            rest.push_back(to_dual_quat(random.motion(1.0)));
            rotations.push_back(random.rotation());
        }
        const std::vector<IkEffector> all{{.bone = 3, .rotation_weight = 0.5, .has_pole = true}, {.bone = 5}};
        const std::span effectors = std::span(all).first(1 + i % 2);
        const std::vector<Vec3<double>> tips(effectors.size(), {0, 1, 0}), poles(effectors.size(), {0, 0, 5});
        const std::vector goals(effectors.size(), to_dual_quat(random.motion(2.0)));
        const IkSolver solver(Skeleton(parents), limits, effectors);
        EXPECT_TRUE(solver.solve({{}, rest, tips, goals, poles}, rotations));
        for (const Quat<double>& q : rotations) EXPECT_NEAR(glm::length(q), 1.0, 1e-9);
        const auto solved = rotations;
        const auto fewer = std::span(rest).first(1);
        EXPECT_FALSE(solver.solve({{}, fewer, tips, goals, poles}, rotations));
        EXPECT_FALSE(solver.solve({{}, rest, {}, goals, poles}, rotations));
        EXPECT_FALSE(solver.solve({{}, rest, tips, {}, poles}, rotations));
        EXPECT_FALSE(solver.solve({{}, rest, tips, goals, poles}, std::span(rotations).first(1)));
        EXPECT_EQ(rotations, solved);
    }
}

}  // namespace
}  // namespace sinew::test
