// SPDX-License-Identifier: GPL-3.0-or-later
// Protects fits of nothing and of what does not decide them, in float and double; tests/python has the
// oracles.
#include <vector>

#include "sinew/fit/average.h"
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

TYPED_TEST(Fit, what_does_not_decide_a_rotation_is_finite_and_said) {
    using T = TypeParam;
    const std::vector<Vec3<T>> line{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}};
    const std::vector<T> nothing(3, T(0));
    EXPECT_FALSE(fit_rigid<T>({}).is_defined);
    EXPECT_FALSE(fit_rigid<T>({.source = line, .target = line, .weights = nothing}).is_defined);
    const auto along = fit_rigid<T>({.source = line, .target = line});
    EXPECT_FALSE(along.is_defined);
    EXPECT_LT(along.error, this->kTolerance);
    EXPECT_TRUE(sinew::is_finite(to_affine(along.transform)));
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
