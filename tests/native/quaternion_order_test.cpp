// SPDX-License-Identifier: GPL-3.0-or-later
// Protects programs that have GLM construct quaternions as (x, y, z, w), as this one does (CMakeLists.txt).
#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "sinew/sinew.h"

namespace sinew {
namespace {

/// From x to y, from y to z, from z to x: a third of a turn.
const Mat3<float> kThird(0, 1, 0, 0, 0, 1, 1, 0, 0);
constexpr float kAngle = std::numbers::pi_v<float> * 2.0f / 3.0f;

float error_of(const Quat<float>& third) {
    return glm::length(rotate(third, Vec3<float>(1, 2, 3)) - Vec3<float>(3, 1, 2));
}

TEST(QuaternionOrder, of_a_program_changes_no_rotation) {
    const Vec3<float> axis(1.0f);
    const DualQuat<float> half = power(to_dual_quat(screw_about(axis, {}, kAngle, 0.0f)), 0.5f);
    for (const Quat<float>& third :
         {to_quat(kThird), quat_of_columns(kThird), nearest_rotation(kThird).rotation,
          quat_from_axis_angle(axis, kAngle), quat_from_rotation_vector(kAngle * glm::normalize(axis)),
          (half * half).real, exp(log(to_dual_quat(Affine<float>{kThird}))).real,
          QuatVec<float>{}.rotation * to_quat(kThird),
          Sclerp::between(DualQuat<float>{}, to_dual_quat(Affine<float>{kThird}), 1.0f).transform.real}) {
        EXPECT_LT(error_of(third), 1e-5f);
    }
    EXPECT_EQ(rotate(pure(Vec3<float>(1, 0, 0)), Vec3<float>(0, 1, 0)), Vec3<float>(0, -1, 0));
}

TEST(QuaternionOrder, of_a_program_changes_none_of_the_library) {
    const std::vector<std::int32_t> parents{-1, 0};
    const std::vector<Affine<float>> posed(2, Affine<float>{kThird});
    for (const Quat<float>& third : continued_rotations(parents, posed)) {
        EXPECT_LT(error_of(third), 1e-5f);
    }
}

}  // namespace
}  // namespace sinew
