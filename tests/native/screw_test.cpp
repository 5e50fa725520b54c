// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/transform/screw.h"

#include <vector>

#include "sinew/transform/make.h"
#include "sinew/transform/rigid_distance.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::Random;

template <class T>
class Rigid : public testing::Test {
protected:
    static constexpr double kTolerance = 64.0 * std::numeric_limits<T>::epsilon();

    // Angles for which quotients of small numbers, or of a sine near pi, fail first.
    static std::vector<QuatVec<T>> motions() {
        std::vector<QuatVec<T>> motions{{}, {Quat<T>(1, 0, 0, 0), Vec3<T>(1, 2, 3)}};
        for (const double degrees :
             {1e-30, 1e-12, 1e-7, 1e-4, 0.57, 0.58, 1.15, 90.0, 179.0, 179.9999, 180.0}) {
            for (const Vec3<double>& axis : {Vec3<double>(1, 0, 0), {0, 1, 0}, {0, 0, -1}, {1, 2, -3}}) {
                motions.push_back(
                    {Quat<T>(quat_from_axis_angle(axis, glm::radians(degrees))), Vec3<T>(1, 2, 3)});
            }
        }
        Random random(1);
        for (int i = 0; i < 50; ++i) motions.push_back(cast<T>(random.motion(3.0)));
        return motions;
    }
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Rigid, Scalars);

TYPED_TEST(Rigid, screw_and_back_is_the_same_motion) {
    for (const auto& motion : this->motions()) {
        const auto screw = to_screw(motion);
        EXPECT_LT(distance(to_affine(to_quat_vec(screw)), to_affine(motion)), this->kTolerance)
            << screw.angle;
        EXPECT_GE(screw.angle, 0);
        EXPECT_LE(screw.angle, std::numbers::pi + this->kTolerance);
        EXPECT_NEAR(glm::length(screw.axis), 1, this->kTolerance);
        EXPECT_FALSE(std::isnan(screw.pitch()));
    }
}

TYPED_TEST(Rigid, points_of_the_screw_line_only_slide_along_it) {
    using T = TypeParam;
    for (const T degrees : {T(30), T(90), T(179.9), T(180)}) {
        const Vec3<T> point(T(0.5), T(-1), T(2));
        const Screw<T> screw = screw_about(Vec3<T>(1, 2, -3), point, glm::radians(degrees), T(0.7));
        const Vec3<T> moved = transform_point(to_dual_quat(screw), point);
        EXPECT_LT(distance(moved, point + T(0.7) * screw.axis), this->kTolerance);
        const Screw<T> found = to_screw(to_dual_quat(screw));
        const T sign = glm::dot(found.axis, screw.axis) < T(0) ? T(-1) : T(1);
        EXPECT_LT(distance(sign * found.axis, screw.axis), this->kTolerance) << degrees;
        EXPECT_LT(distance(sign * found.moment, screw.moment), this->kTolerance) << degrees;
        EXPECT_NEAR(sign * found.translation, screw.translation, this->kTolerance) << degrees;
        EXPECT_NEAR(found.angle, screw.angle, this->kTolerance) << degrees;
    }
}

TYPED_TEST(Rigid, screw_of_translation_and_of_identity) {
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

TYPED_TEST(Rigid, axis_and_moment_may_have_any_length) {
    using T = TypeParam;
    const Screw<T> screw = screw_about(Vec3<T>(1, 2, -3), Vec3<T>(3, 1, 2), T(1), T(2));
    const Screw<T> longer{T(7) * screw.axis, T(7) * screw.moment + T(3) * screw.axis, T(1), T(2)};
    EXPECT_LT(distance(to_affine(longer), to_affine(screw)), this->kTolerance);
    EXPECT_EQ(distance(to_affine(Screw<T>{Vec3<T>(0), Vec3<T>(1, 2, 3), T(1), T(2)}), Affine<T>{}), 0.0);
}

TYPED_TEST(Rigid, twist_and_back_is_the_same_motion) {
    for (const auto& motion : this->motions()) {
        const auto twist = to_twist(motion);
        EXPECT_LT(distance(to_affine(to_quat_vec(twist)), to_affine(motion)), 2 * this->kTolerance)
            << glm::length(twist.angular);
    }
}

TYPED_TEST(Rigid, log_and_power_of_either_sign_are_one) {
    using T = TypeParam;
    for (const auto& motion : this->motions()) {
        const DualQuat<T> a = to_dual_quat(motion);
        const DualQuat<T> log_a = log(a);
        EXPECT_EQ(log_a.real.w, T(0));
        EXPECT_EQ(log_a.dual.w, T(0));
        EXPECT_LT(distance(to_affine(exp(log_a)), to_affine(a)), 2 * this->kTolerance);
        EXPECT_LT(distance(to_affine(power(a, T(1))), to_affine(a)), 2 * this->kTolerance);
        EXPECT_LT(distance(to_affine(power(a, T(-1))), to_affine(inverse(a))), 2 * this->kTolerance);
        EXPECT_EQ(distance(to_affine(power(a, T(0))), Affine<T>{}), 0.0);
        const DualQuat<T> root = power(-a, T(0.5));
        EXPECT_LT(distance(to_affine(root * root), to_affine(a)), 4 * this->kTolerance);
    }
}

TYPED_TEST(Rigid, exp_of_more_than_a_turn) {
    using T = TypeParam;
    const Vec3<T> axis = glm::normalize(Vec3<T>(1, 2, -3));
    const Twist<T> twist{T(2.5 * std::numbers::pi) * axis, T(4) * axis};
    const QuatVec<T> expected{about<T>(axis, T(90)), T(4) * axis};
    EXPECT_LT(distance(to_affine(twist), to_affine(expected)), this->kTolerance);
}

TYPED_TEST(Rigid, conjugates_of_a_product_are_products_of_conjugates) {
    using T = TypeParam;
    Random random(3);
    const DualQuat<T> a = cast<T>(to_dual_quat(random.motion(2.0)));
    const DualQuat<T> b = cast<T>(to_dual_quat(random.motion(2.0)));
    const auto apart = [](const DualQuat<T>& x, const DualQuat<T>& y) {
        return static_cast<double>(glm::length(x.real - y.real) + glm::length(x.dual - y.dual));
    };
    EXPECT_LT(apart(conjugate(a * b), conjugate(b) * conjugate(a)), this->kTolerance);
    EXPECT_LT(apart(dual_conjugate(a * b), dual_conjugate(a) * dual_conjugate(b)), this->kTolerance);
    EXPECT_LT(apart(combined_conjugate(a * b), combined_conjugate(b) * combined_conjugate(a)),
              this->kTolerance);
    EXPECT_EQ(apart(combined_conjugate(a), conjugate(dual_conjugate(a))), 0.0);
}

TYPED_TEST(Rigid, point_moves_between_a_and_its_combined_conjugate) {
    using T = TypeParam;
    const Vec3<T> point(T(0.3), T(-0.7), T(1.1));
    for (const auto& motion : this->motions()) {
        const DualQuat<T> a = to_dual_quat(motion);
        const DualQuat<T> moved = a * DualQuat<T>{Quat<T>(1, 0, 0, 0), pure(point)} * combined_conjugate(a);
        EXPECT_LT(distance(vector_part(moved.dual), transform_point(motion, point)), this->kTolerance);
    }
}

TYPED_TEST(Rigid, norm_is_a_dual_number_and_is_divided_out) {
    using T = TypeParam;
    const DualQuat<T> a{Quat<T>(1, 2, 3, 4), Quat<T>(5, -6, 7, -8)};
    const DualQuat<T> square = a * conjugate(a);
    const Dual<T> length = norm(a);
    const Dual<T> again = length * length;
    EXPECT_NEAR(again.real, square.real.w, 100 * this->kTolerance);
    EXPECT_NEAR(again.dual, square.dual.w, 100 * this->kTolerance);
    const Dual<T> one = norm(normalized(a));
    EXPECT_NEAR(one.real, T(1), this->kTolerance);
    EXPECT_NEAR(one.dual, T(0), this->kTolerance);
    const DualQuat<T> product = length * normalized(a);
    EXPECT_LT(glm::length(product.real - a.real) + glm::length(product.dual - a.dual), 10 * this->kTolerance);
}

TYPED_TEST(Rigid, normalized_of_nothing_is_the_identity) {
    using T = TypeParam;
    const Quat<T> zero(0, 0, 0, 0);
    EXPECT_EQ(distance(to_affine(normalized(DualQuat<T>{zero, zero})), Affine<T>{}), 0.0);
    EXPECT_EQ(norm(DualQuat<T>{zero, Quat<T>(1, 2, 3, 4)}), (Dual<T>{}));
    EXPECT_EQ(distance(to_affine(normalized(QuatVec<T>{zero, Vec3<T>(0)})), Affine<T>{}), 0.0);
    EXPECT_EQ(distance(normalized(Affine<T>{Mat3<T>(T(0)), Vec3<T>(0)}), Affine<T>{}), 0.0);
}

TYPED_TEST(Rigid, normals_stay_square_to_their_surface) {
    using T = TypeParam;
    Affine<T> a;
    a.linear = Mat3<T>(Vec3<T>(2, 1, 0), Vec3<T>(0, T(0.5), 1), Vec3<T>(1, 0, 3));
    const Vec3<T> u(1, 2, 3);
    const Vec3<T> v(-1, 1, 0);
    for (const T mirror : {T(1), T(-1)}) {
        a.linear[2] *= mirror;
        const Vec3<T> normal = transform_normal(a, glm::cross(u, v));
        EXPECT_NEAR(glm::length(normal), 1, this->kTolerance);
        EXPECT_NEAR(glm::dot(normal, transform_vector(a, u)), 0, 4 * this->kTolerance);
        EXPECT_NEAR(glm::dot(normal, transform_vector(a, v)), 0, 4 * this->kTolerance);
        // The normal keeps pointing outwards: to the side of the surface that a step along it reaches.
        EXPECT_GT(glm::dot(normal, transform_vector(a, glm::cross(u, v))), T(0));
    }
    a.linear = Mat3<T>(T(0));
    EXPECT_TRUE(test::same_bits(transform_normal(a, u), Vec3<T>(0)));
    EXPECT_TRUE(test::same_bits(transform_normal(QuatVec<T>{}, Vec3<T>(0)), Vec3<T>(0)));
}

TYPED_TEST(Rigid, distance_is_angle_and_shift) {
    using T = TypeParam;
    Random random(4);
    const DualQuat<T> x = cast<T>(to_dual_quat(random.motion(2.0)));
    for (const T degrees : {T(0), T(1e-3), T(90), T(179.99), T(180)}) {
        const QuatVec<T> step{about<T>(Vec3<T>(1, 2, -3), degrees), Vec3<T>(3, 4, 0)};
        const auto apart = rigid_distance(x, -(x * to_dual_quat(step)));
        EXPECT_NEAR(apart.angle, glm::radians(degrees), 2 * this->kTolerance);
        EXPECT_NEAR(apart.translation, 5, 2 * this->kTolerance);
    }
}

TYPED_TEST(Rigid, axis_of_no_length_is_no_turn) {
    using T = TypeParam;
    EXPECT_EQ(distance(from_axis_angle<Affine>(Vec3<T>(0), T(2)), Affine<T>{}), 0.0);
    // So short that its square underflows to 0 in this type.
    const Vec3<T> tiny(std::numeric_limits<T>::min(), 0, 0);
    EXPECT_LT(distance(from_axis_angle<Affine>(tiny, T(2)), from_axis_angle<Affine>(Vec3<T>(1, 0, 0), T(2))),
              this->kTolerance);
}

TYPED_TEST(Rigid, nearest_rotation_of_a_rotation_is_itself) {
    for (const auto& motion : this->motions()) {
        const auto matrix = to_affine(motion);
        EXPECT_LT(distance(normalized(matrix), matrix), this->kTolerance);
        EXPECT_NEAR(nearest_rotation(matrix.linear).gap, 4, this->kTolerance);
    }
}

TEST(Dual, obeys_the_rules_of_dual_numbers) {
    const Dual<double> a{2.0, 3.0};
    const Dual<double> b{0.5, -1.5};
    EXPECT_EQ(a * b, (Dual<double>{1.0, 2.0 * -1.5 + 3.0 * 0.5}));
    EXPECT_EQ((a * b) / b, a);
    EXPECT_EQ((Dual<double>{0.0, 1.0} * Dual<double>{0.0, 1.0}), (Dual<double>{}));
    EXPECT_EQ(conjugate(a), (Dual<double>{2.0, -3.0}));
    const Dual<double> one = sin(a) * sin(a) + cos(a) * cos(a);
    EXPECT_NEAR(one.real, 1.0, 1e-15);
    EXPECT_NEAR(one.dual, 0.0, 1e-15);
    const Dual<double> square = sqrt(a) * sqrt(a) - a;
    EXPECT_NEAR(square.real, 0.0, 1e-15);
    EXPECT_NEAR(square.dual, 0.0, 1e-15);
    const Dual<double> same = exp(log(a)) + (-a);
    EXPECT_NEAR(same.real, 0.0, 1e-15);
    EXPECT_NEAR(same.dual, 0.0, 1e-15);
    // The dual part of a function is its derivative.
    EXPECT_NEAR(sin(Dual<double>{0.7, 1.0}).dual, std::cos(0.7), 1e-15);
}

}  // namespace
}  // namespace sinew
