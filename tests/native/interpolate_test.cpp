// SPDX-License-Identifier: GPL-3.0-or-later
// Protects blends of degenerate weights and of the largest numbers; tests/python/exact_interpolation.py has
// the oracles.

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
    static bool is_finite(const Transform& a) { return sinew::is_finite(to_affine(a)); }
};

using Cases =
    testing::Types<Case<MatrixLinear, float>, Case<MatrixPolar, float>, Case<MatrixLog, float>,
                   Case<QvNlerp, float>, Case<QvSlerp, float>, Case<Dlb, float>, Case<Sclerp, float>,
                   Case<MatrixLinear, double>, Case<MatrixPolar, double>, Case<MatrixLog, double>,
                   Case<QvNlerp, double>, Case<QvSlerp, double>, Case<Dlb, double>, Case<Sclerp, double>>;
TYPED_TEST_SUITE(Interpolation, Cases);

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

}  // namespace
}  // namespace sinew
