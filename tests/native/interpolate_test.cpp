// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <string>

#include "sinew/interpolate/methods.h"
#include "sinew/transform/make.h"
#include "sinew/transform/rigid_distance.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::Random;

template <class Method, class T>
struct Case {
    using M = Method;
    using Scalar = T;
};

template <class C>
class Interpolation : public testing::Test {
protected:
    using M = typename C::M;
    using T = typename C::Scalar;
    using Transform = typename M::template Transform<T>;
    static constexpr double kTolerance = 256.0 * std::numeric_limits<T>::epsilon();
    static constexpr bool kKeepsSigns = std::is_same_v<Transform, Affine<T>>;

    static Transform in_layout(const QuatVec<T>& motion) {
        if constexpr (std::is_same_v<Transform, Affine<T>>) return to_affine(motion);
        if constexpr (std::is_same_v<Transform, QuatVec<T>>) return motion;
        if constexpr (std::is_same_v<Transform, DualQuat<T>>) return to_dual_quat(motion);
    }
    static Transform random(Random& numbers) { return in_layout(cast<T>(numbers.motion(3.0))); }
    static Blended<Transform> blend(const std::vector<Transform>& transforms, const std::vector<T>& weights) {
        return M::template blend<Signs::kToHeaviest, T>(transforms, weights);
    }
    static double apart(const Transform& a, const Transform& b) {
        return distance(to_affine(a), to_affine(b));
    }
    static bool is_finite(const Transform& a) { return test::is_finite(to_affine(a)); }
};

using Cases =
    testing::Types<Case<MatrixLinear, float>, Case<MatrixPolar, float>, Case<MatrixLog, float>,
                   Case<QvNlerp, float>, Case<QvSlerp, float>, Case<Dlb, float>, Case<Sclerp, float>,
                   Case<MatrixLinear, double>, Case<MatrixPolar, double>, Case<MatrixLog, double>,
                   Case<QvNlerp, double>, Case<QvSlerp, double>, Case<Dlb, double>, Case<Sclerp, double>>;
TYPED_TEST_SUITE(Interpolation, Cases);

TYPED_TEST(Interpolation, ends_are_the_ends) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    Random random(1);
    for (int i = 0; i < 50; ++i) {
        const auto a = this->random(random);
        const auto b = this->random(random);
        EXPECT_LT(this->apart(M::between(a, b, T(0)).transform, a), this->kTolerance);
        EXPECT_LT(this->apart(M::between(a, b, T(1)).transform, b), this->kTolerance);
    }
}

TYPED_TEST(Interpolation, between_is_the_blend_of_two) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    Random random(2);
    for (int i = 0; i < 50; ++i) {
        const auto a = this->random(random);
        const auto b = this->random(random);
        const T t = static_cast<T>(random.uniform(0.0, 1.0));
        const auto two = M::between(a, b, t);
        const auto many = this->blend({a, b}, {T(1) - t, t});
        ASSERT_TRUE(two.is_defined && many.is_defined);
        EXPECT_LT(this->apart(two.transform, many.transform), 4 * this->kTolerance) << i;
    }
}

TYPED_TEST(Interpolation, blend_of_equals_is_that_transform) {
    using T = typename TypeParam::Scalar;
    Random random(3);
    const auto a = this->random(random);
    const auto mean = this->blend({a, a, a}, {T(0.2), T(0.5), T(0.3)});
    EXPECT_TRUE(mean.is_defined);
    EXPECT_LT(this->apart(mean.transform, a), this->kTolerance);
}

TYPED_TEST(Interpolation, factor_of_all_weights_and_order_change_nothing) {
    using T = typename TypeParam::Scalar;
    Random random(4);
    for (int i = 0; i < 20; ++i) {
        const auto a = this->random(random);
        const auto b = this->random(random);
        const auto c = this->random(random);
        const auto mean = this->blend({a, b, c}, {T(0.2), T(0.5), T(0.3)});
        const auto other = this->blend({b, c, a}, {T(5), T(3), T(2)});
        // An iterated blend may have several fixed points; it must reach the same one from the same start.
        EXPECT_LT(this->apart(mean.transform, other.transform), 16 * this->kTolerance) << i;
    }
}

TYPED_TEST(Interpolation, weights_without_sum_give_the_heaviest) {
    using T = typename TypeParam::Scalar;
    Random random(5);
    const auto a = this->random(random);
    const auto b = this->random(random);
    for (const auto& weights : {std::vector<T>{0, 0}, {T(-1), T(1)}, {T(-2), T(-1)}}) {
        const auto mean = this->blend({a, b}, weights);
        EXPECT_FALSE(mean.is_defined);
        EXPECT_EQ(this->apart(mean.transform, weights[0] == T(0) ? a : b), 0.0);
    }
}

// Their sum overflows, or 1 over it does.
TYPED_TEST(Interpolation, weights_of_any_size_are_shares) {
    using T = typename TypeParam::Scalar;
    Random random(6);
    const auto a = this->random(random);
    const auto b = this->random(random);
    const auto expected = this->blend({a, b, a}, {T(1), T(0.5), T(1)});
    for (const T size : {std::numeric_limits<T>::max(), T(16) * std::numeric_limits<T>::denorm_min()}) {
        const auto mean = this->blend({a, b, a}, {size, size / T(2), size});
        EXPECT_EQ(mean.is_defined, expected.is_defined);
        EXPECT_LT(this->apart(mean.transform, expected.transform), 16 * this->kTolerance);
    }
}

// A result that is not finite must not be reported as defined, and a defined result must be right.
TYPED_TEST(Interpolation, translations_near_the_largest_number_are_finite) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    const T large = T(0.88) * std::numeric_limits<T>::max();
    Random random(7);
    for (int i = 0; i < 40; ++i) {
        const auto random_end = [&] {
            const Vec3<double> v = random.vector(1.0);
            const Quat<T> rotation(i % 4 == 0 ? Quat<double>(1, 0, 0, 0) : random.rotation());
            const Vec3<T> translation(v.x < 0 ? -large : large, v.y < 0 ? -large : large,
                                      v.z < 0 ? T(0) : large);
            return this->in_layout({rotation, translation});
        };
        const auto a = random_end();
        const auto b = random_end();
        // Some overflow as dual quaternions.
        if (!sinew::is_finite(a) || !sinew::is_finite(b)) continue;
        for (const T t : {T(0), T(0.25), T(0.5), T(1), T(-1), T(2), T(-1e30), T(3e38f)}) {
            EXPECT_TRUE(sinew::is_finite(M::between(a, b, t).transform)) << i << " " << t;
            EXPECT_TRUE(sinew::is_finite(this->blend({a, b, a}, {T(1) - t, t, t}).transform))
                << i << " " << t;
        }
    }
}

TYPED_TEST(Interpolation, half_turns_are_finite_and_said_not_to_be_defined) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    const auto a = this->in_layout({});
    for (const Vec3<T>& axis : {Vec3<T>(1, 0, 0), Vec3<T>(0, 1, 0), Vec3<T>(0, 0, 1), Vec3<T>(1, 2, -3)}) {
        const auto b = this->in_layout({about<T>(axis, T(180)), Vec3<T>(1, 2, 3)});
        const auto middle = M::between(a, b, T(0.5));
        EXPECT_TRUE(this->is_finite(middle.transform));
        EXPECT_EQ(middle.is_defined, (std::is_same_v<M, MatrixLinear>));
        EXPECT_TRUE(M::between(a, b, T(0)).is_defined);
        EXPECT_TRUE(M::between(a, b, T(1)).is_defined);
        const auto mean = this->blend({a, b}, {T(0.5), T(0.5)});
        EXPECT_TRUE(this->is_finite(mean.transform));
        EXPECT_EQ(mean.is_defined, (std::is_same_v<M, MatrixLinear>));
    }
}

TYPED_TEST(Interpolation, turns_near_half_a_turn_are_finite) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    const auto a = this->in_layout({});
    for (const T degrees : {T(0), T(1e-30), T(1e-6), T(179.9999), T(180.0001), T(359.9999), T(360)}) {
        const auto b = this->in_layout({about<T>(Vec3<T>(1, 2, -3), degrees), Vec3<T>(1, 2, 3)});
        for (const T t : {T(0), T(0.5), T(1), T(-1), T(2)}) {
            EXPECT_TRUE(this->is_finite(M::between(a, b, t).transform)) << degrees << " " << t;
        }
        EXPECT_TRUE(this->is_finite(this->blend({a, b}, {T(0.5), T(0.5)}).transform)) << degrees;
    }
}

// Four rotations 90 degrees apart: their matrices sum to 0.
TYPED_TEST(Interpolation, sum_that_cancels_gives_the_heaviest_turn) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    const Vec3<T> translation(1, 2, 3);
    const auto none = this->in_layout({Quat<T>(1, 0, 0, 0), translation});
    const auto x = this->in_layout({Quat<T>(0, 1, 0, 0), translation});
    const auto y = this->in_layout({Quat<T>(0, 0, 1, 0), translation});
    const auto z = this->in_layout({Quat<T>(0, 0, 0, 1), translation});
    const auto mean = this->blend({none, x, y, z}, {T(0.25), T(0.25), T(0.25), T(0.25)});
    EXPECT_TRUE(this->is_finite(mean.transform));
    EXPECT_EQ(mean.is_defined, (std::is_same_v<M, MatrixLinear>));
    if (std::is_same_v<M, MatrixPolar>) {
        EXPECT_LT(this->apart(mean.transform, none), this->kTolerance);
    }
}

TYPED_TEST(Interpolation, signs_of_quaternions_change_nothing) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    if constexpr (!std::is_same_v<typename M::template Transform<T>, Affine<T>>) {
        Random random(6);
        for (int i = 0; i < 20; ++i) {
            const QuatVec<T> first = cast<T>(random.motion(3.0));
            const QuatVec<T> second = cast<T>(random.motion(3.0));
            const auto a = this->in_layout(first);
            const auto b = this->in_layout(second);
            const auto minus_b = this->in_layout({-second.rotation, second.translation});
            const auto plain = M::between(a, b, T(0.3));
            EXPECT_LT(this->apart(plain.transform, M::between(a, minus_b, T(0.3)).transform),
                      this->kTolerance);
            const auto mean = this->blend({a, b, a}, {T(0.3), T(0.5), T(0.2)});
            const auto other_sign = this->blend({a, minus_b, a}, {T(0.3), T(0.5), T(0.2)});
            EXPECT_LT(this->apart(mean.transform, other_sign.transform), this->kTolerance);
        }
    }
}

TEST(MatrixLinear, halfway_to_half_a_turn_is_flat) {
    // The example of Smith 2013, section 3.5.2.
    const Affine<double> half_turn = to_affine(QuatVec<double>{about<double>({0, 0, 1}, 180.0), {0, 0, 0}});
    const Affine<double> middle = MatrixLinear::between(Affine<double>{}, half_turn, 0.5).transform;
    Affine<double> expected;
    expected.linear[0][0] = expected.linear[1][1] = 0.0;
    EXPECT_LT(distance(middle, expected), 1e-15);
}

TEST(MatrixPolar, is_the_nearest_rotation_even_to_a_mirror) {
    // The mean of the three rotations by 180 degrees about the axes is -1/3, a mirror: all rotations are equally
    // near.
    const Vec3<double> none(0.0);
    std::vector<Affine<double>> rotations;
    for (const Vec3<double>& axis : {Vec3<double>(1, 0, 0), {0, 1, 0}, {0, 0, 1}}) {
        rotations.push_back(to_affine(QuatVec<double>{about<double>(axis, 180.0), none}));
    }
    const std::vector<double> even{1, 1, 1};
    const auto tie = MatrixPolar::blend<Signs::kToHeaviest, double>(rotations, even);
    EXPECT_FALSE(tie.is_defined);
    EXPECT_LT(test::rotation_error(tie.transform.linear), 1e-14);
    // A slightly larger weight breaks the tie.
    const std::vector<double> uneven{1, 1, 1.5};
    const auto mean = MatrixPolar::blend<Signs::kToHeaviest, double>(rotations, uneven);
    EXPECT_TRUE(mean.is_defined);
    EXPECT_LT(distance(mean.transform, rotations[2]), 1e-12);
}

TEST(QvSlerp, has_constant_pace_where_nlerp_has_not) {
    const QuatVec<double> a{};
    const QuatVec<double> b{about<double>({1, 2, 3}, 170.0), {0, 0, 0}};
    const auto at = [&](auto method, double t) {
        return rigid_distance(a, decltype(method)::between(a, b, t).transform).angle;
    };
    const double whole = rigid_distance(a, b).angle;
    EXPECT_NEAR(at(QvSlerp{}, 0.2), 0.2 * whole, 1e-14);
    EXPECT_LT(at(QvNlerp{}, 0.2), 0.19 * whole);
}

TEST(Sclerp, is_the_screw_at_constant_pace) {
    Random random(7);
    const DualQuat<double> a = to_dual_quat(random.motion(3.0));
    const Screw<double> screw = screw_about<double>({1, 2, 3}, {4, -1, 2}, 2.0, 1.5);
    const DualQuat<double> b = a * to_dual_quat(screw);
    Screw<double> part = screw;
    part.angle *= 0.3;
    part.translation *= 0.3;
    EXPECT_LT(distance(to_affine(Sclerp::between(a, b, 0.3).transform), to_affine(a * to_dual_quat(part))),
              1e-13);
}

TEST(MatrixLog, is_not_the_shortest_path) {
    // 170 degrees and -170 degrees are 20 degrees apart, but the mean of their logarithms is 0.
    const auto rotation = [](double degrees) {
        return to_affine(QuatVec<double>{about<double>({0, 0, 1}, degrees), {0, 0, 0}});
    };
    const Affine<double> middle = MatrixLog::between(rotation(170), rotation(-170), 0.5).transform;
    EXPECT_LT(distance(middle, Affine<double>{}), 1e-14);
    const Affine<double> nearest = MatrixPolar::between(rotation(170), rotation(-170), 0.5).transform;
    EXPECT_LT(distance(nearest, rotation(180)), 1e-14);
}

TEST(Slerp, of_opposite_quaternions_is_finite) {
    const Quat<double> q = about<double>({1, 2, 3}, 50.0);
    for (const double t : {0.0, 0.3, 0.5, 1.0}) {
        EXPECT_NEAR(std::abs(glm::dot(slerp(q, -q, t), q)), 1.0, 1e-15);
    }
}

TYPED_TEST(Interpolation, a_tie_that_the_order_decides_is_not_defined) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    const auto rotated = [&](T degrees) {
        return this->in_layout({about<T>(Vec3<T>(0, 0, 1), degrees), Vec3<T>(1, 2, 3)});
    };
    const auto tie = this->blend({rotated(0), rotated(120), rotated(240)}, {T(1), T(1), T(1)});
    // Matrices have no signs. The sum for matrix_polar is flat, and any rotation about z is equally near.
    EXPECT_EQ(tie.is_defined, (std::is_same_v<M, MatrixLinear> || std::is_same_v<M, MatrixLog>));
    EXPECT_TRUE(this->is_finite(tie.transform));
    EXPECT_TRUE(this->blend({rotated(0), rotated(40), rotated(80)}, {T(1), T(1), T(1)}).is_defined);
}

TYPED_TEST(Interpolation, what_is_no_rotation_is_not_defined) {
    using T = typename TypeParam::Scalar;
    using M = typename TypeParam::M;
    auto a = this->in_layout({about<T>(Vec3<T>(1, 2, 3), T(50)), Vec3<T>(1, 2, 3)});
    const auto b = this->in_layout({});
    EXPECT_TRUE(M::between(a, b, T(0.5)).is_defined);
    a = scaled(T(1.1), a);
    const bool takes_any = std::is_same_v<M, MatrixLinear> || std::is_same_v<M, MatrixPolar>;
    EXPECT_EQ(M::between(a, b, T(0.5)).is_defined, takes_any);
    EXPECT_EQ(this->blend({a, b}, {T(0.3), T(0.7)}).is_defined, takes_any);
}

}  // namespace
}  // namespace sinew
