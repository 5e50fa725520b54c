// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <string>

#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::Random;

// Motions for which conversions fail first: no rotation, 180 degrees about each axis and between axes, rotations
// that differ minimally from these, and pure translation.
template <class T>
std::vector<QuatVec<T>> named_motions() {
    const Vec3<T> x(1, 0, 0);
    const Vec3<T> y(0, 1, 0);
    const Vec3<T> z(0, 0, 1);
    const Vec3<T> translation(T(0.5), T(-2), T(3));
    std::vector<QuatVec<T>> motions{{}, {Quat<T>(1, 0, 0, 0), translation}};
    for (const Vec3<T>& axis : {x, y, z, x + y, y + z, x - z, x + y + z}) {
        for (const T degrees : {T(1e-3), T(90), T(179.99), T(180), T(180.01), T(270)}) {
            motions.push_back({about<T>(axis, degrees), translation});
        }
    }
    return motions;
}

template <class T>
class Transform : public testing::Test {
protected:
    static constexpr double kTolerance = 64.0 * std::numeric_limits<T>::epsilon();

    static std::vector<QuatVec<T>> motions() {
        std::vector<QuatVec<T>> motions = named_motions<T>();
        Random random(1);
        for (int i = 0; i < 20; ++i) motions.push_back(cast<T>(random.motion(3.0)));
        return motions;
    }
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Transform, Scalars);

TYPED_TEST(Transform, points_move_alike_in_every_representation) {
    using T = TypeParam;
    const Vec3<T> point(T(0.3), T(-0.7), T(1.1));
    for (const QuatVec<T>& motion : this->motions()) {
        const Vec3<T> expected = transform_point(motion, point);
        EXPECT_LT(distance(transform_point(to_affine(motion), point), expected), this->kTolerance);
        EXPECT_LT(distance(transform_point(to_dual_quat(motion), point), expected), this->kTolerance);
    }
}

TYPED_TEST(Transform, vectors_turn_and_do_not_shift) {
    using T = TypeParam;
    const Vec3<T> vector(T(0.3), T(-0.7), T(1.1));
    for (const QuatVec<T>& motion : this->motions()) {
        const Vec3<T> expected = to_affine(motion).linear * vector;
        EXPECT_LT(distance(transform_vector(motion, vector), expected), this->kTolerance);
        EXPECT_LT(distance(transform_vector(to_affine(motion), vector), expected), this->kTolerance);
        EXPECT_LT(distance(transform_vector(to_dual_quat(motion), vector), expected), this->kTolerance);
    }
}

TYPED_TEST(Transform, composition_agrees) {
    using T = TypeParam;
    const std::vector<QuatVec<T>> motions = this->motions();
    for (std::size_t i = 0; i + 1 < motions.size(); ++i) {
        const QuatVec<T>& a = motions[i];
        const QuatVec<T>& b = motions[i + 1];
        const Affine<T> expected = to_affine(a) * to_affine(b);
        EXPECT_LT(distance(to_affine(a * b), expected), this->kTolerance);
        EXPECT_LT(distance(to_affine(to_dual_quat(a) * to_dual_quat(b)), expected), this->kTolerance);
    }
}

TYPED_TEST(Transform, product_applies_the_right_factor_first) {
    using T = TypeParam;
    const QuatVec<T> rotation{about<T>(Vec3<T>(0, 0, 1), T(90)), Vec3<T>(T(0))};
    const QuatVec<T> translation{Quat<T>(1, 0, 0, 0), Vec3<T>(1, 0, 0)};
    const Vec3<T> origin(T(0));
    EXPECT_LT(distance(transform_point(rotation * translation, origin), Vec3<T>(0, 1, 0)), this->kTolerance);
    EXPECT_LT(
        distance(transform_point(to_affine(rotation) * to_affine(translation), origin), Vec3<T>(0, 1, 0)),
        this->kTolerance);
    EXPECT_LT(distance(transform_point(to_dual_quat(rotation) * to_dual_quat(translation), origin),
                       Vec3<T>(0, 1, 0)),
              this->kTolerance);
}

TYPED_TEST(Transform, inverse_agrees) {
    using T = TypeParam;
    for (const QuatVec<T>& motion : this->motions()) {
        const Affine<T> expected = inverse(to_affine(motion));
        EXPECT_LT(distance(to_affine(inverse(motion)), expected), this->kTolerance);
        EXPECT_LT(distance(to_affine(inverse(to_dual_quat(motion))), expected), this->kTolerance);
    }
}

TYPED_TEST(Transform, inverse_composes_to_identity) {
    using T = TypeParam;
    for (const QuatVec<T>& motion : this->motions()) {
        const DualQuat<T> dual = to_dual_quat(motion);
        EXPECT_LT(distance(to_affine(motion * inverse(motion)), Affine<T>{}), this->kTolerance);
        EXPECT_LT(distance(to_affine(inverse(motion) * motion), Affine<T>{}), this->kTolerance);
        EXPECT_LT(distance(to_affine(dual * inverse(dual)), Affine<T>{}), this->kTolerance);
        EXPECT_LT(distance(to_affine(inverse(dual) * dual), Affine<T>{}), this->kTolerance);
    }
}

TYPED_TEST(Transform, conversions_round_trip) {
    using T = TypeParam;
    for (const QuatVec<T>& motion : this->motions()) {
        const Affine<T> expected = to_affine(motion);
        EXPECT_LT(distance(to_affine(to_quat_vec(expected)), expected), this->kTolerance);
        EXPECT_LT(distance(to_affine(to_dual_quat(expected)), expected), this->kTolerance);
        EXPECT_LT(distance(to_affine(to_quat_vec(to_dual_quat(motion))), expected), this->kTolerance);
    }
}

TYPED_TEST(Transform, quaternion_of_a_matrix_is_unit_with_w_not_negative) {
    using T = TypeParam;
    for (const QuatVec<T>& motion : this->motions()) {
        const Quat<T> q = to_quat(to_affine(motion).linear);
        EXPECT_GE(q.w, T(0));
        EXPECT_NEAR(static_cast<double>(glm::length(q)), 1.0, this->kTolerance);
    }
}

TYPED_TEST(Transform, default_is_the_identity) {
    using T = TypeParam;
    const Vec3<T> point(T(0.3), T(-0.7), T(1.1));
    EXPECT_TRUE(test::same_bits(transform_point(Affine<T>{}, point), point));
    EXPECT_TRUE(test::same_bits(transform_point(QuatVec<T>{}, point), point));
    EXPECT_TRUE(test::same_bits(transform_point(DualQuat<T>{}, point), point));
}

TYPED_TEST(Transform, dual_quat_of_a_motion_is_unit) {
    using T = TypeParam;
    for (const QuatVec<T>& motion : this->motions()) {
        const DualQuat<T> a = to_dual_quat(motion);
        EXPECT_NEAR(static_cast<double>(glm::length(a.real)), 1.0, this->kTolerance);
        EXPECT_NEAR(static_cast<double>(glm::dot(a.real, a.dual)), 0.0, this->kTolerance);
    }
}

TYPED_TEST(Transform, pure_translation_comes_back_to_the_bit) {
    using T = TypeParam;
    const Vec3<T> far_away(T(0.1), T(-2e6), T(3e-6));
    const QuatVec<T> motion{Quat<T>(1, 0, 0, 0), far_away};
    EXPECT_TRUE(test::same_bits(translation(to_dual_quat(motion)), far_away));
    EXPECT_TRUE(test::same_bits(to_quat_vec(to_affine(motion)).translation, far_away));
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

TEST(DualQuat, normalized_keeps_a_unit_one) {
    Random random(2);
    for (int i = 0; i < 20; ++i) {
        const DualQuat<double> a = to_dual_quat(random.motion(3.0));
        EXPECT_LT(distance(to_affine(normalized(a)), to_affine(a)), 1e-14);
    }
}

TEST(DualQuat, normalized_undoes_a_factor) {
    Random random(3);
    for (const double factor : {-4.0, 1e-9, 0.5, 1e9}) {
        const DualQuat<double> a = to_dual_quat(random.motion(3.0));
        const DualQuat<double> scaled{a.real * factor, a.dual * factor};
        EXPECT_LT(distance(to_affine(normalized(scaled)), to_affine(a)), 1e-13) << factor;
    }
}

TEST(DualQuat, normalized_of_any_sum_is_unit) {
    Random random(4);
    for (int i = 0; i < 20; ++i) {
        const DualQuat<double> a = to_dual_quat(random.motion(3.0));
        const DualQuat<double> b = to_dual_quat(random.motion(3.0));
        const DualQuat<double> sum = normalized(DualQuat<double>{a.real + b.real, a.dual + b.dual});
        EXPECT_NEAR(glm::length(sum.real), 1.0, 1e-14);
        EXPECT_NEAR(glm::dot(sum.real, sum.dual), 0.0, 1e-14);
    }
}

TEST(DualQuat, normalized_takes_off_no_translation) {
    const DualQuat<double> a = to_dual_quat(QuatVec<double>{about<double>({1, 2, 3}, 70.0), {4, 5, 6}});
    const DualQuat<double> tilted{a.real, a.dual + 0.25 * a.real};
    EXPECT_LT(distance(translation(normalized(tilted)), translation(a)), 1e-14);
}

TEST(DualQuat, both_signs_are_one_motion) {
    const DualQuat<double> a = to_dual_quat(QuatVec<double>{about<double>({1, 2, 3}, 170.0), {4, 5, 6}});
    EXPECT_LT(distance(to_affine(DualQuat<double>{-a.real, -a.dual}), to_affine(a)), 1e-15);
}

TEST(Cast, there_and_back_keeps_a_float) {
    Random random(5);
    const QuatVec<float> a = cast<float>(random.motion(3.0));
    EXPECT_EQ(distance(cast<float>(cast<double>(to_affine(a))), to_affine(a)), 0.0);
    EXPECT_EQ(distance(to_affine(cast<float>(cast<double>(a))), to_affine(a)), 0.0);
    const DualQuat<float> dual = to_dual_quat(a);
    EXPECT_EQ(distance(to_affine(cast<float>(cast<double>(dual))), to_affine(dual)), 0.0);
}

}  // namespace
}  // namespace sinew
