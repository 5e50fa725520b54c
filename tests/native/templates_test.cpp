// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the memory of averages, splines and inverse kinematics, for sanitizers; tests/python has the oracles.
#include <array>
#include <vector>

#include "sinew/fit/average.h"
#include "sinew/ik/solver.h"
#include "sinew/interpolate/methods.h"
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
        const QuatVec<double> key{about<double>({1, 2, 3}, degrees), {degrees, 0, 0}};
        if constexpr (std::is_same_v<Transform, Affine<double>>) keys.push_back(to_affine(key));
        if constexpr (std::is_same_v<Transform, QuatVec<double>>) keys.push_back(key);
        if constexpr (std::is_same_v<Transform, DualQuat<double>>) keys.push_back(to_dual_quat(key));
    }
    for (const double time : {-1.0, 0.0, 0.5, 1.0, 1.2, 2.0, 4.0, 5.0, 9.0}) {
        const auto value = catmull_rom<TypeParam, double>(std::span<const Transform>(keys), kTimes, time);
        EXPECT_TRUE(is_finite(to_affine(value.transform))) << time;
    }
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
