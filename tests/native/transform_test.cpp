// SPDX-License-Identifier: GPL-3.0-or-later
// Protects degenerate transforms, and the product in registers; tests/python/exact_transforms.py has the
// oracles.
#include <cmath>

#include "sinew/transform/make.h"
#include "sinew/transform/screw.h"
#include "support.h"

namespace sinew {
namespace {

using test::distance;
using test::Random;

template <class T>
class Transform : public testing::Test {
protected:
    static constexpr double kTolerance = 64.0 * std::numeric_limits<T>::epsilon();
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Transform, Scalars);

TYPED_TEST(Transform, default_is_the_identity) {
    using T = TypeParam;
    const Vec3<T> point(T(0.3), T(-0.7), T(1.1));
    EXPECT_TRUE(test::same_bits(transform_point(Affine<T>{}, point), point));
    EXPECT_TRUE(test::same_bits(transform_point(QuatVec<T>{}, point), point));
    EXPECT_TRUE(test::same_bits(transform_point(DualQuat<T>{}, point), point));
}

TYPED_TEST(Transform, pure_translation_comes_back_to_the_bit) {
    using T = TypeParam;
    const Vec3<T> far_away(T(0.1), T(-2e6), T(3e-6));
    const QuatVec<T> motion{Quat<T>(1, 0, 0, 0), far_away};
    EXPECT_TRUE(test::same_bits(translation(to_dual_quat(motion)), far_away));
    EXPECT_TRUE(test::same_bits(to_quat_vec(to_affine(motion)).translation, far_away));
}

TYPED_TEST(Transform, screw_of_translation_and_of_identity) {
    using T = TypeParam;
    const Screw<T> translation = to_screw(from_translation<DualQuat>(Vec3<T>(0, -2, 0)));
    EXPECT_TRUE(test::same_bits(translation.axis, Vec3<T>(0, -1, 0)));
    EXPECT_TRUE(test::same_bits(translation.moment, Vec3<T>(0)));
    EXPECT_EQ(translation.angle, T(0));
    EXPECT_EQ(translation.translation, T(2));
    EXPECT_EQ(translation.pitch(), std::numeric_limits<T>::infinity());
    const Screw<T> none = to_screw(DualQuat<T>{});
    EXPECT_TRUE(test::same_bits(none.axis, Vec3<T>(0, 0, 1)));
    EXPECT_EQ(none.angle, T(0));
    EXPECT_EQ(none.translation, T(0));
    EXPECT_EQ(none.pitch(), T(0));
}

TYPED_TEST(Transform, axis_and_moment_may_have_any_length) {
    using T = TypeParam;
    const Screw<T> screw = screw_about(Vec3<T>(1, 2, -3), Vec3<T>(3, 1, 2), T(1), T(2));
    const Screw<T> longer{T(7) * screw.axis, T(7) * screw.moment + T(3) * screw.axis, T(1), T(2)};
    EXPECT_LT(distance(to_affine(longer), to_affine(screw)), this->kTolerance);
    EXPECT_EQ(distance(to_affine(Screw<T>{Vec3<T>(0), Vec3<T>(1, 2, 3), T(1), T(2)}), Affine<T>{}), 0.0);
}

TYPED_TEST(Transform, normalized_of_nothing_is_the_identity) {
    using T = TypeParam;
    const Quat<T> zero(0, 0, 0, 0);
    EXPECT_EQ(distance(to_affine(normalized(DualQuat<T>{zero, zero})), Affine<T>{}), 0.0);
    EXPECT_EQ(norm(DualQuat<T>{zero, Quat<T>(1, 2, 3, 4)}), (Dual<T>{}));
    EXPECT_EQ(distance(to_affine(normalized(QuatVec<T>{zero, Vec3<T>(0)})), Affine<T>{}), 0.0);
    EXPECT_EQ(distance(normalized(Affine<T>{Mat3<T>(T(0)), Vec3<T>(0)}), Affine<T>{}), 0.0);
}

TYPED_TEST(Transform, axis_of_no_length_is_no_turn) {
    using T = TypeParam;
    EXPECT_EQ(distance(from_axis_angle<Affine>(Vec3<T>(0), T(2)), Affine<T>{}), 0.0);
    // So short that its square underflows to 0 in this type.
    const Vec3<T> tiny(std::numeric_limits<T>::min(), 0, 0);
    EXPECT_LT(distance(from_axis_angle<Affine>(tiny, T(2)), from_axis_angle<Affine>(Vec3<T>(1, 0, 0), T(2))),
              this->kTolerance);
}

TEST(Affine, product_in_registers_is_that_of_plain_loops) {
    // A compiler that contracts products and sums may round once less; others give the same bits.
#if defined(__FMA__) || defined(__aarch64__)
    constexpr float kJoined = 1e-6f;
#else
    constexpr float kJoined = 0.0f;
#endif
    Random random(7);
    for (int i = 0; i < 1000; ++i) {
        // Of any size, and with scale and shear.
        Affine<float> a = cast<float>(to_affine(random.motion(3.0)));
        const Affine<float> b = cast<float>(to_affine(random.motion(3.0)));
        a.linear[i % 3] *= std::ldexp(1.0f, i % 60 - 30);
        a.translation *= std::ldexp(1.0f, i % 40 - 20);
        const Affine<float> got = a * b;
        const Affine<float> want{a.linear * b.linear, a.linear * b.translation + a.translation};
        const float size = glm::length(a.linear[0]) + glm::length(a.linear[1]) + glm::length(a.linear[2]);
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                EXPECT_NEAR(got.linear[column][row], want.linear[column][row], kJoined * size);
            }
            EXPECT_NEAR(got.translation[row], want.translation[row],
                        kJoined * (size * glm::length(b.translation) + glm::length(a.translation)));
        }
    }
}

}  // namespace
}  // namespace sinew
