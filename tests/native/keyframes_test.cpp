// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skeleton/keyframes.h"

#include "sinew/interpolate/hermite.h"
#include "sinew/interpolate/methods.h"
#include "sinew/skeleton/forward_kinematics.h"
#include "sinew/transform/make.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::Random;

constexpr std::array<double, 5> kTimes{0.0, 1.0, 1.5, 4.0, 5.0};

template <class T>
Vec3<double> sum_of_spline(std::span<const T> times, T time, const std::vector<Vec3<double>>& points) {
    const SplineSpan<T> span = spline_span(times, time);
    Vec3<double> sum(0.0);
    for (std::size_t i = 0; i < 4; ++i) sum += static_cast<double>(span.weights[i]) * points[span.keys[i]];
    return sum;
}

// Smith 2013, section 2.3.2, term by term.
Vec3<double> hermite(std::size_t key, double time, const std::vector<Vec3<double>>& p) {
    const auto tangent = [&](std::size_t k) {
        const std::size_t before = k > 0 ? k - 1 : 0;
        const std::size_t after = std::min(k + 1, p.size() - 1);
        return (p[after] - p[before]) / (kTimes[after] - kTimes[before]);
    };
    const double length = kTimes[key + 1] - kTimes[key];
    const double t = (time - kTimes[key]) / length;
    return (2 * t * t * t - 3 * t * t + 1) * p[key] + (t * t * t - 2 * t * t + t) * length * tangent(key) +
           (-2 * t * t * t + 3 * t * t) * p[key + 1] + (t * t * t - t * t) * length * tangent(key + 1);
}

std::vector<Vec3<double>> random_points(std::size_t count) {
    Random random(1);
    std::vector<Vec3<double>> points;
    for (std::size_t i = 0; i < count; ++i) points.push_back(random.vector(3.0));
    return points;
}

TEST(Spline, is_the_hermite_spline_of_the_report) {
    const auto points = random_points(5);
    for (std::size_t key = 0; key + 1 < kTimes.size(); ++key) {
        for (const double part : {0.0, 0.2, 0.5, 0.9}) {
            const double time = kTimes[key] + part * (kTimes[key + 1] - kTimes[key]);
            EXPECT_LT(distance(sum_of_spline<double>(kTimes, time, points), hermite(key, time, points)),
                      1e-14);
        }
    }
}

TEST(Spline, passes_through_keys_and_holds_at_the_ends) {
    const auto points = random_points(5);
    for (std::size_t key = 0; key < kTimes.size(); ++key) {
        EXPECT_LT(distance(sum_of_spline<double>(kTimes, kTimes[key], points), points[key]), 1e-15);
    }
    EXPECT_EQ(distance(sum_of_spline<double>(kTimes, -3.0, points), points.front()), 0.0);
    EXPECT_EQ(distance(sum_of_spline<double>(kTimes, 9.0, points), points.back()), 0.0);
}

TEST(Spline, has_one_slope_on_both_sides_of_a_key) {
    const auto points = random_points(5);
    for (const double time : {1.0, 1.5, 4.0}) {
        const double step = 1e-6;
        const auto at = [&](double when) { return sum_of_spline<double>(kTimes, when, points); };
        const Vec3<double> before = (at(time) - at(time - step)) / step;
        const Vec3<double> after = (at(time + step) - at(time)) / step;
        EXPECT_LT(distance(before, after), 1e-4) << time;
    }
}

TEST(Spline, of_points_on_a_line_in_time_is_that_line) {
    std::vector<Vec3<double>> points;
    for (const double time : kTimes) points.push_back(time * Vec3<double>(1, -2, 3));
    for (const double time : {0.3, 1.2, 2.0, 4.9}) {
        EXPECT_LT(distance(sum_of_spline<double>(kTimes, time, points), time * Vec3<double>(1, -2, 3)),
                  1e-14);
    }
}

TEST(Spline, keys_of_equal_time_are_a_cut) {
    const std::array<double, 6> times{0, 1, 1, 1, 2, 3};
    const auto points = random_points(6);
    const std::array<double, 2> first{0, 1};
    const std::array<double, 3> second{1, 2, 3};
    const std::vector<Vec3<double>> head(points.begin(), points.begin() + 2);
    const std::vector<Vec3<double>> tail(points.begin() + 3, points.end());
    for (const double time : {0.0, 0.3, 0.99}) {
        EXPECT_LT(
            distance(sum_of_spline<double>(times, time, points), sum_of_spline<double>(first, time, head)),
            1e-15);
    }
    for (const double time : {1.0, 1.3, 2.5, 3.0}) {
        EXPECT_LT(
            distance(sum_of_spline<double>(times, time, points), sum_of_spline<double>(second, time, tail)),
            1e-15);
    }
}

TEST(Spline, of_keys_all_at_one_time_is_the_last_from_then_on) {
    const std::array<float, 3> times{1, 1, 1};
    const auto points = random_points(3);
    EXPECT_EQ(distance(sum_of_spline<float>(times, 0.5f, points), points[0]), 0.0);
    EXPECT_EQ(distance(sum_of_spline<float>(times, 1.0f, points), points[2]), 0.0);
}

template <class Method>
class Keyframes : public testing::Test {
protected:
    using Transform = typename Method::template Transform<double>;
    static Transform in_layout(const QuatVec<double>& motion) {
        if constexpr (std::is_same_v<Transform, Affine<double>>) return to_affine(motion);
        if constexpr (std::is_same_v<Transform, QuatVec<double>>) return motion;
        if constexpr (std::is_same_v<Transform, DualQuat<double>>) return to_dual_quat(motion);
    }
    static std::vector<Transform> random(Random& numbers, std::size_t count) {
        std::vector<Transform> bones;
        for (std::size_t i = 0; i < count; ++i) bones.push_back(in_layout(numbers.motion(2.0)));
        return bones;
    }
    static double apart(const Transform& a, const Transform& b) {
        return distance(to_affine(a), to_affine(b));
    }
};

using Methods = testing::Types<MatrixLinear, MatrixPolar, MatrixLog, QvNlerp, QvSlerp, Dlb, Sclerp>;
TYPED_TEST_SUITE(Keyframes, Methods);

TYPED_TEST(Keyframes, each_bone_is_interpolated_by_itself) {
    const std::vector<std::int32_t> parents{-1, 0, 1};
    const Skeleton skeleton(parents);
    Random random(2);
    const auto from = this->random(random, 3);
    const auto onto = this->random(random, 3);
    auto bones = from;
    EXPECT_TRUE((interpolate_keyframes<TypeParam, double>(skeleton, bones, onto, 0.3, bones)));
    for (std::size_t bone = 0; bone < 3; ++bone) {
        EXPECT_EQ(this->apart(bones[bone], TypeParam::between(from[bone], onto[bone], 0.3).transform), 0.0);
    }
}

TYPED_TEST(Keyframes, spline_goes_through_every_keyframe) {
    const std::vector<std::int32_t> parents{-1, 0};
    const Skeleton skeleton(parents);
    Random random(3);
    const auto keyframes = this->random(random, 10);
    using Transform = typename TypeParam::template Transform<double>;
    std::vector<Transform> bones(2);
    const std::span<const double> times(kTimes);
    for (std::size_t key = 0; key < kTimes.size(); ++key) {
        (void)spline_keyframes<TypeParam, double>(skeleton, keyframes, times, kTimes[key], bones);
        for (std::size_t bone = 0; bone < 2; ++bone) {
            EXPECT_LT(this->apart(bones[bone], keyframes[2 * key + bone]), 1e-13);
        }
        (void)spline_keyframes_vector<Transform, double>(skeleton, keyframes, times, kTimes[key], bones);
        for (std::size_t bone = 0; bone < 2; ++bone) {
            EXPECT_LT(this->apart(bones[bone], keyframes[2 * key + bone]), 1e-13);
        }
    }
}

TYPED_TEST(Keyframes, vector_form_made_rigid_is_the_blend_form_of_a_sum) {
    using Transform = typename TypeParam::template Transform<double>;
    if constexpr (std::is_same_v<TypeParam, MatrixPolar> || std::is_same_v<TypeParam, QvNlerp> ||
                  std::is_same_v<TypeParam, Dlb>) {
        Random random(4);
        const auto keys = this->random(random, 5);
        const std::span<const Transform> span(keys);
        for (const double time : {0.5, 1.2, 2.0, 4.5}) {
            const auto vector = catmull_rom_vector<Transform, double>(span, kTimes, time);
            const auto blend = catmull_rom<TypeParam, double>(span, kTimes, time);
            EXPECT_LT(this->apart(normalized(vector.transform), blend.transform), 1e-13);
        }
    }
}

TYPED_TEST(Keyframes, half_turns_between_keys_are_finite) {
    using Transform = typename TypeParam::template Transform<double>;
    std::vector<Transform> keys;
    for (const double degrees : {0.0, 180.0, 360.0, 180.0, 0.0}) {
        keys.push_back(this->in_layout({about<double>({1, 2, 3}, degrees), {degrees, 0, 0}}));
    }
    for (const double time : {0.0, 0.5, 1.0, 1.2, 2.0, 4.0, 5.0}) {
        const auto value = catmull_rom<TypeParam, double>(std::span<const Transform>(keys), kTimes, time);
        EXPECT_TRUE(test::is_finite(to_affine(value.transform))) << time;
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

// Smith 2013, figure 3.3: an arm of two bones of length 1, both rotated by 90 degrees between the keyframes.
template <class Method>
double elbow_gap(bool combine_first) {
    using Transform = typename Method::template Transform<double>;
    const std::vector<std::int32_t> parents{-1, 0};
    const Skeleton skeleton(parents);
    const auto layout = [](const QuatVec<double>& motion) {
        if constexpr (std::is_same_v<Transform, Affine<double>>)
            return to_affine(motion);
        else if constexpr (std::is_same_v<Transform, QuatVec<double>>)
            return motion;
        else
            return to_dual_quat(motion);
    };
    const Vec3<double> z(0, 0, 1);
    const auto pose = [&](double degrees) {
        return std::vector<Transform>{layout({about<double>(z, degrees), {0, 0, 0}}),
                                      layout({about<double>(z, degrees), {1, 0, 0}})};
    };
    std::vector<Transform> from = pose(0.0);
    std::vector<Transform> onto = pose(90.0);
    std::vector<Transform> bones(2);
    if (combine_first) {
        root_relative<Transform>(skeleton, {}, from, from);
        root_relative<Transform>(skeleton, {}, onto, onto);
        (void)interpolate_keyframes<Method, double>(skeleton, from, onto, 0.5, bones);
    } else {
        (void)interpolate_keyframes<Method, double>(skeleton, from, onto, 0.5, bones);
        root_relative<Transform>(skeleton, {}, bones, bones);
    }
    // On a real arm the end of the upper arm and the head of the lower arm are the same point.
    return distance(transform_point(bones[0], {1, 0, 0}), transform_point(bones[1], {0, 0, 0}));
}

TEST(Hermite, passes_through_points_with_the_tangents_given) {
    const std::vector<Vec3<double>> points{{0, 0, 0}, {1, 2, 0}, {3, 1, 1}};
    const std::vector<Vec3<double>> tangents{{1, 0, 0}, {0, 1, 2}, {-1, 0, 3}};
    const std::vector<double> times{0, 2, 3};
    const auto at = [&](double time) {
        return sinew::hermite<double>(std::span<const Vec3<double>>(points),
                                      std::span<const Vec3<double>>(tangents), std::span<const double>(times),
                                      time);
    };
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(distance(at(times[i]), points[i]), 1e-15);
    for (const double side : {1e-6, -1e-6}) {
        EXPECT_LT(distance((at(2 + side) - points[1]) / side, tangents[1]), 1e-5);
    }
    EXPECT_EQ(at(-1), points[0]);
    EXPECT_EQ(at(9), points[2]);
}

TEST(FigureThreeThree, interpolating_after_combining_tears_the_elbow) {
    EXPECT_LT(elbow_gap<QvNlerp>(false), 1e-15);
    EXPECT_LT(elbow_gap<QvSlerp>(false), 1e-15);
    EXPECT_LT(elbow_gap<Dlb>(false), 1e-15);
    EXPECT_LT(elbow_gap<Sclerp>(false), 1e-15);
    // The lower arm's head moves straight from (1, 0) to (0, 1); the upper arm's end moves on the circle.
    EXPECT_NEAR(elbow_gap<QvNlerp>(true), 1.0 - std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(elbow_gap<QvSlerp>(true), 1.0 - std::sqrt(0.5), 1e-12);
    // The lower arm's own screw rotates by 180 degrees about the midpoint of its path.
    EXPECT_GT(elbow_gap<Dlb>(true), 0.1);
    EXPECT_GT(elbow_gap<Sclerp>(true), 0.1);
}

}  // namespace
}  // namespace sinew
