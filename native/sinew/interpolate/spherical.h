// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>

#include "sinew/interpolate/linear.h"
#include "sinew/transform/rotation.h"

namespace sinew {

/// Number of iterations after which a blend counts as not defined. Rotations within 90 degrees take 5 to 15.
inline constexpr int kBlendSteps = 100;

/// Whether t times an angle has an error below a thousandth of a radian.
template <class T>
[[nodiscard]] bool is_near(T t) noexcept {
    using std::abs;
    return abs(t) * std::numeric_limits<T>::epsilon() < T(1e-3);
}

/// Interpolates unit quaternions `a` to `b` on the great circle through both, the way that their signs determine
/// (Shoemake 1985; Smith 2013, section 2.1.1). Opposite ones (a = -b) have no unique great circle: the result is
/// then the nearer end.
template <class T>
[[nodiscard]] Quat<T> slerp(const Quat<T>& a, const Quat<T>& b, T t) noexcept {
    using std::atan2;
    const Quat<T> sum = a + b;
    if (glm::length(sum) < T(kDegenerateBlend)) return t < T(0.5) ? a : b;
    // From chords instead of acos: exact for equal and for opposite ends.
    const T angle = T(2) * atan2(glm::length(b - a), glm::length(sum));
    const T whole = sinc(angle);
    const T from = (T(1) - t) * sinc((T(1) - t) * angle) / whole;
    const T onto = t * sinc(t * angle) / whole;
    return glm::normalize(from * a + onto * b);
}

/// Rotations by slerp, translations by mean (Smith 2013, section 2.2.1). Between two transforms it takes the
/// shorter way at constant speed. Blend of n: the weighted mean on the sphere (Buss and Fillmore 2001, algorithm
/// A1), which does not depend on the order. Depends on the origin.
///
/// Not defined where QvNlerp is not, if |t| exceeds 0.001 / epsilon, if the iteration does not converge, or if a
/// rotation is 180 degrees from the result.
struct QvSlerp {
    static constexpr std::string_view name = "qv_slerp";
    template <class T>
    using Transform = QuatVec<T>;

    template <class T>
    [[nodiscard]] static Blended<QuatVec<T>> between(const QuatVec<T>& a, const QuatVec<T>& b, T t) noexcept {
        return finite_or<QuatVec<T>>({{slerp(a.rotation, aligned(b.rotation, a.rotation), t),
                                       (T(1) - t) * a.translation + t * b.translation},
                                      has_shorter_way(a, b, t) && is_near(t)},
                                     T(1) - t < t ? b : a);
    }

    template <BlendSigns signs = BlendSigns::kToHeaviest, class T>
    [[nodiscard]] static Blended<QuatVec<T>> blend(std::span<const QuatVec<T>> transforms,
                                                   std::span<const T> weights) noexcept {
        const Shares<T> share = shares(weights);
        Blended<QuatVec<T>> mean = QvNlerp::blend<signs, T>(transforms, weights);
        if (!mean.is_defined) return mean;
        Quat<T>& rotation = mean.transform.rotation;
        for (int step = 0; step < kBlendSteps; ++step) {
            Vec3<T> correction{T(0)};
            bool is_half_turn = false;
            for (std::size_t i = 0; i < transforms.size(); ++i) {
                if (weights[i] == T(0)) continue;
                is_half_turn = is_half_turn || is_half_turn_apart(rotation, transforms[i].rotation);
                const Quat<T> difference = glm::conjugate(rotation) * transforms[i].rotation;
                correction += share.of(weights[i]) * rotation_vector(difference);
            }
            rotation = glm::normalize(rotation * quat_from_rotation_vector(correction));
            if (safe_length(correction) <= T(8) * std::numeric_limits<T>::epsilon()) {
                mean.is_defined = !is_half_turn;
                return mean;
            }
        }
        mean.is_defined = false;
        return mean;
    }
};

}  // namespace sinew
