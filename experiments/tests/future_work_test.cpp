// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the memory of curves, fits and inverse kinematics, and whatever sizes are given; the tests in Python have the
// oracles.
#include <array>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#include "future_work/curves/hermite.h"
#include "future_work/fit/average.h"
#include "future_work/fit/hand_eye.h"
#include "future_work/ik/solver.h"
#include "tests/native/support.h"

namespace {
int allocations = 0;
}

void* operator new(std::size_t size) {
    ++allocations;
    if (void* const memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

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

// Includes limits, a bend and a second try.
TEST(IkSolver, allocates_nothing) {
    const std::vector<std::int32_t> parents{-1, 0, 1};
    std::vector<BoneLimits> limits(3);
    limits[1][1].is_locked = true;
    limits[1][0] = {.is_limited = true, .min = 0.0, .max = 2.0};
    const std::vector<IkEffector> effectors{{.bone = 2, .rotation_weight = 0.5}};
    IkSolver solver(Skeleton(parents), limits, effectors);
    const DualQuat<double> next = to_dual_quat(QuatVec<double>{{1, 0, 0, 0}, {0, 1, 0}});
    const std::vector<DualQuat<double>> rest{{}, next, next};
    const std::vector<Vec3<double>> tips{{0, 1, 0}};
    std::vector<Quat<double>> rotations(3, Quat<double>(1, 0, 0, 0));
    const int before = allocations;
    for (int i = 0; i < 20; ++i) {
        const std::array goals{to_dual_quat(QuatVec<double>{{1, 0, 0, 0}, {0.1 * i, 2.0 - 0.2 * i, 0.0}})};
        EXPECT_TRUE(solver.solve({{}, rest, tips, goals, {}}, rotations));
    }
    EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace sinew::test
