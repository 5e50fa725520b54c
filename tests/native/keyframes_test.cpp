// SPDX-License-Identifier: GPL-3.0-or-later
// Protects splines through half turns, and that they never jump; tests/python/exact_interpolation.py has the
// oracles.
#include "sinew/skeleton/keyframes.h"

#include <array>

#include "sinew/interpolate/methods.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;

constexpr std::array<double, 5> kTimes{0.0, 1.0, 1.5, 4.0, 5.0};

template <class Method>
class Keyframes : public testing::Test {
protected:
    using Transform = typename Method::template Transform<double>;
    static Transform in_layout(const QuatVec<double>& motion) {
        if constexpr (std::is_same_v<Transform, Affine<double>>) return to_affine(motion);
        if constexpr (std::is_same_v<Transform, QuatVec<double>>) return motion;
        if constexpr (std::is_same_v<Transform, DualQuat<double>>) return to_dual_quat(motion);
    }
    static double apart(const Transform& a, const Transform& b) {
        return distance(to_affine(a), to_affine(b));
    }
};

using Methods = testing::Types<MatrixLinear, MatrixPolar, MatrixLog, QvNlerp, QvSlerp, Dlb, Sclerp>;
TYPED_TEST_SUITE(Keyframes, Methods);

TYPED_TEST(Keyframes, half_turns_between_keys_are_finite) {
    using Transform = typename TypeParam::template Transform<double>;
    std::vector<Transform> keys;
    for (const double degrees : {0.0, 180.0, 360.0, 180.0, 0.0}) {
        keys.push_back(this->in_layout({about<double>({1, 2, 3}, degrees), {degrees, 0, 0}}));
    }
    for (const double time : {0.0, 0.5, 1.0, 1.2, 2.0, 4.0, 5.0}) {
        const auto value = catmull_rom<TypeParam, double>(std::span<const Transform>(keys), kTimes, time);
        EXPECT_TRUE(sinew::is_finite(to_affine(value.transform))) << time;
    }
}

TYPED_TEST(Keyframes, no_jump_within_the_spline) {
    using Transform = typename TypeParam::template Transform<double>;
    // Steps of 100 degrees: keys that are two steps apart differ by more than 180 degrees. If signs followed the
    // heaviest key, they would change in the middle of an interval.
    std::vector<Transform> keys;
    for (int i = 0; i < 5; ++i) {
        keys.push_back(this->in_layout({about<double>({1, 2, 3}, 100.0 * i), {1.0 * i, 0, 0}}));
    }
    if constexpr (std::is_same_v<TypeParam, QvNlerp> || std::is_same_v<TypeParam, Dlb>) {
        Transform before = keys[0];
        for (double time = 0.0; time < 5.0; time += 0.001) {
            const auto now = catmull_rom<TypeParam, double>(std::span<const Transform>(keys), kTimes, time);
            EXPECT_LT(this->apart(before, now.transform), 0.05) << time;
            before = now.transform;
        }
    }
}

}  // namespace
}  // namespace sinew
