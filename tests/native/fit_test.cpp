// SPDX-License-Identifier: GPL-3.0-or-later
#include <vector>

#include "sinew/fit/average.h"
#include "sinew/fit/hand_eye.h"
#include "sinew/fit/rigid.h"
#include "support.h"

namespace sinew {
namespace {

using test::distance;
using test::Random;

template <class T>
class Fit : public testing::Test {
protected:
    static constexpr double kTolerance = 256.0 * std::numeric_limits<T>::epsilon();
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Fit, Scalars);

TYPED_TEST(Fit, every_solver_finds_the_motion_of_points_and_directions) {
    using T = TypeParam;
    Random random(1);
    for (int i = 0; i < 50; ++i) {
        const QuatVec<double> motion = random.motion(3.0);
        std::vector<Vec3<T>> source, target;
        for (int point = 0; point < 5; ++point) {
            const Vec3<double> at = random.vector(2.0);
            source.emplace_back(at);
            target.emplace_back(transform_point(motion, at));
        }
        const std::vector<Vec3<T>> from{Vec3<T>(random.vector(1.0))};
        const std::vector<Vec3<T>> onto{Vec3<T>(rotate(motion.rotation, Vec3<double>(from[0])))};
        const Pairs<T> pairs{source, target, {}, from, onto, {}};
        std::apply(
            [&](auto... solver) {
                const auto check = [&](const auto& found) {
                    EXPECT_LT(distance(to_affine(found.transform), cast<T>(to_affine(motion))),
                              this->kTolerance);
                    EXPECT_LT(found.error, this->kTolerance);
                    EXPECT_TRUE(found.is_defined);
                    EXPECT_FALSE(found.is_mirrored);
                };
                (check(decltype(solver)::template fit<T>(pairs)), ...);
            },
            RigidFits{});
    }
}

TYPED_TEST(Fit, what_does_not_decide_a_rotation_is_finite_and_said) {
    using T = TypeParam;
    const std::vector<Vec3<T>> line{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}};
    const std::vector<T> nothing(3, T(0));
    std::apply(
        [&](auto... solver) {
            const auto check = [&]<class Solver>(Solver) {
                const auto empty = Solver::template fit<T>({});
                EXPECT_FALSE(empty.is_defined);
                EXPECT_FALSE(
                    Solver::template fit<T>({.source = line, .target = line, .weights = nothing}).is_defined);
                const auto along = Solver::template fit<T>({.source = line, .target = line});
                EXPECT_FALSE(along.is_defined);
                EXPECT_LT(along.error, this->kTolerance);
                EXPECT_TRUE(test::is_finite(to_affine(along.transform)));
            };
            (check(solver), ...);
        },
        RigidFits{});
}

TYPED_TEST(Fit, hand_eye_finds_where_the_eye_is) {
    using T = TypeParam;
    Random random(2);
    for (int i = 0; i < 50; ++i) {
        const DualQuat<double> x = to_dual_quat(random.motion(3.0));
        std::vector<DualQuat<T>> a, b;
        for (const Vec3<double>& angles : {Vec3<double>(1, 0.2, 0), {0, 0.8, 0.3}, {-0.4, 0.1, 1.5}}) {
            const DualQuat<double> hand =
                to_dual_quat(QuatVec<double>{quat_from_rotation_vector(angles), random.vector(2.0)});
            a.push_back(cast<T>(hand));
            b.push_back(cast<T>(-(inverse(x) * hand * x)));
        }
        const auto found = hand_eye<T>(a, b);
        EXPECT_TRUE(found.is_defined);
        EXPECT_LT(distance(to_affine(found.transform), cast<T>(to_affine(x))), this->kTolerance);
        EXPECT_FALSE(hand_eye<T>(std::span(a).first(1), std::span(b).first(1)).is_defined);
    }
}

TYPED_TEST(Fit, averages_leave_outliers_out_where_asked) {
    using T = TypeParam;
    Random random(3);
    const DualQuat<double> middle = to_dual_quat(random.motion(3.0));
    std::vector<DualQuat<T>> poses;
    for (const double side : {-1.0, 1.0}) {
        for (const Vec3<double>& axis : {Vec3<double>(0.01, 0, 0), {0, 0.01, 0}, {0, 0, 0.01}}) {
            const Twist<double> twist{side * axis, side * axis};
            poses.push_back(cast<T>(middle * to_dual_quat(twist)));
        }
    }
    const auto mean = average<T>(poses);
    EXPECT_TRUE(mean.is_defined);
    EXPECT_LT(distance(to_affine(mean.transform), cast<T>(to_affine(middle))), this->kTolerance);

    for (int i = 0; i < 4; ++i) poses.push_back(cast<T>(to_dual_quat(random.motion(30.0))));
    std::vector<T> kept(poses.size());
    const auto robust = robust_average<T>(poses, {}, kept);
    EXPECT_TRUE(robust.is_defined);
    EXPECT_LT(distance(to_affine(robust.transform), cast<T>(to_affine(middle))), this->kTolerance);
    EXPECT_EQ(kept.back(), T(0));
    EXPECT_GT(kept.front(), T(0.5));
    EXPECT_FALSE(average<T>({}).is_defined);
    EXPECT_FALSE(robust_average<T>({}, {}, {}).is_defined);
}

}  // namespace
}  // namespace sinew
