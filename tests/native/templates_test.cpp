// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the memory of splines, for sanitizers, and whatever sizes are given; tests/python has the oracles.
#include <algorithm>
#include <array>
#include <vector>

#include "sinew/interpolate/methods.h"
#include "sinew/interpolate/spline.h"
#include "support.h"

namespace sinew::test {
namespace {

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

TYPED_TEST(Spline, sizes_that_do_not_fit_read_nothing) {
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
}

}  // namespace
}  // namespace sinew::test
