// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <span>

#include "sinew/transform/convert.h"

namespace sinew {

/// What interpolating gives. `is_defined` is false where the method has no one answer for this input, or
/// where rounding would decide which: the transform is then the one that the method's header names, finite.
template <class Transform>
struct Blended {
    Transform transform;
    bool is_defined = true;
};

/// What a blend does with the free signs of quaternions.
enum class Signs {
    kToHeaviest,  ///< flips each to the hemisphere of the term of largest weight: the shortest path
    kAsGiven,     ///< leaves them
};

/// Weights brought to sum 1, and the index of the largest, the first of equals.
template <class T>
struct Shares {
    std::size_t heaviest = 0;
    T largest = T(1);
    T scale = T(1);  ///< of weights that are divided by the largest
    bool is_defined = true;

    /// By the largest first: the sum of the largest numbers is infinite, and so is 1 by that of the smallest.
    [[nodiscard]] T of(T weight) const noexcept { return weight / largest * scale; }
};

/// weights  [n], n >= 1, of any sign. A sum not above kDegenerateBlend times the largest is not defined.
template <class T>
[[nodiscard]] Shares<T> shares(std::span<const T> weights) noexcept {
    assert(!weights.empty());
    const auto largest = std::max_element(weights.begin(), weights.end());
    const auto heaviest = static_cast<std::size_t>(largest - weights.begin());
    if (!(*largest > T(0))) return {heaviest, T(1), T(1), false};
    T sum = T(0);
    for (const T weight : weights) sum += weight / *largest;
    if (!(sum > T(kDegenerateBlend))) return {heaviest, T(1), T(1), false};
    return {heaviest, *largest, T(1) / sum, true};
}

template <class T>
[[nodiscard]] bool is_finite(const Vec3<T>& v) noexcept {
    using std::isfinite;
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

template <class T>
[[nodiscard]] bool is_finite(const Quat<T>& q) noexcept {
    using std::isfinite;
    return isfinite(q.w) && is_finite(vector_part(q));
}

template <class T>
[[nodiscard]] bool is_finite(const Affine<T>& a) noexcept {
    return is_finite(a.linear[0]) && is_finite(a.linear[1]) && is_finite(a.linear[2]) &&
           is_finite(a.translation);
}

template <class T>
[[nodiscard]] bool is_finite(const QuatVec<T>& a) noexcept {
    return is_finite(a.rotation) && is_finite(a.translation);
}

template <class T>
[[nodiscard]] bool is_finite(const DualQuat<T>& a) noexcept {
    return is_finite(a.real) && is_finite(a.dual);
}

/// `result`; where it, or a number on the way to it, is too large for its type, `heaviest`, which is then not
/// defined.
template <class Transform>
[[nodiscard]] Blended<Transform> finite_or(const Blended<Transform>& result,
                                           const Transform& heaviest) noexcept {
    return is_finite(result.transform) ? result : Blended<Transform>{heaviest, false};
}

/// `q` or -q, whichever is in the hemisphere of `pivot`.
template <class T>
[[nodiscard]] Quat<T> aligned(const Quat<T>& q, const Quat<T>& pivot) noexcept {
    return glm::dot(q, pivot) < T(0) ? -q : q;
}

template <class T>
[[nodiscard]] QuatVec<T> aligned(const QuatVec<T>& a, const QuatVec<T>& pivot) noexcept {
    return {aligned(a.rotation, pivot.rotation), a.translation};
}

template <class T>
[[nodiscard]] DualQuat<T> aligned(const DualQuat<T>& a, const DualQuat<T>& pivot) noexcept {
    return glm::dot(a.real, pivot.real) < T(0) ? -a : a;
}

/// A matrix has no free sign.
template <class T>
[[nodiscard]] Affine<T> aligned(const Affine<T>& a, const Affine<T>& /*pivot*/) noexcept {
    return a;
}

/// Whether the shorter way from `a` to `b` is decided by rounding: they are 180 degrees apart.
template <class T>
[[nodiscard]] bool is_half_turn_apart(const QuatVec<T>& a, const QuatVec<T>& b) noexcept {
    return is_half_turn_apart(a.rotation, b.rotation);
}

template <class T>
[[nodiscard]] bool is_half_turn_apart(const DualQuat<T>& a, const DualQuat<T>& b) noexcept {
    return is_half_turn_apart(a.real, b.real);
}

/// Matrices are not brought to one side, so nothing is decided.
template <class T>
[[nodiscard]] bool is_half_turn_apart(const Affine<T>& /*a*/, const Affine<T>& /*b*/) noexcept {
    return false;
}

template <class T>
[[nodiscard]] Affine<T> scaled(T factor, const Affine<T>& a) noexcept {
    return {factor * a.linear, factor * a.translation};
}

template <class T>
[[nodiscard]] QuatVec<T> scaled(T factor, const QuatVec<T>& a) noexcept {
    return {factor * a.rotation, factor * a.translation};
}

template <class T>
[[nodiscard]] DualQuat<T> scaled(T factor, const DualQuat<T>& a) noexcept {
    return {factor * a.real, factor * a.dual};
}

template <class T>
[[nodiscard]] Affine<T> sum(const Affine<T>& a, const Affine<T>& b) noexcept {
    return {a.linear + b.linear, a.translation + b.translation};
}

template <class T>
[[nodiscard]] QuatVec<T> sum(const QuatVec<T>& a, const QuatVec<T>& b) noexcept {
    return {a.rotation + b.rotation, a.translation + b.translation};
}

template <class T>
[[nodiscard]] DualQuat<T> sum(const DualQuat<T>& a, const DualQuat<T>& b) noexcept {
    return a + b;
}

/// The sum of the components, 12, 7 or 8 of them, each times its weight times `scale`: no rigid transform
/// (Smith 2013, section 3.2.2). Signs::kToHeaviest is not defined where a transform of weight other than 0
/// is 180 degrees from the heaviest.
template <Signs signs, class Transform, class T>
[[nodiscard]] Blended<Transform> weighted_sum(std::span<const Transform> transforms,
                                              std::span<const T> weights, const Shares<T>& share) noexcept {
    const Transform& pivot = transforms[share.heaviest];
    Blended<Transform> total{scaled(T(0), pivot), true};
    for (std::size_t i = 0; i < transforms.size(); ++i) {
        if (weights[i] == T(0)) continue;
        const T weight = share.of(weights[i]);
        if constexpr (signs == Signs::kToHeaviest) {
            if (is_half_turn_apart(transforms[i], pivot)) total.is_defined = false;
            total.transform = sum(total.transform, scaled(weight, aligned(transforms[i], pivot)));
        } else {
            total.transform = sum(total.transform, scaled(weight, transforms[i]));
        }
    }
    return total;
}

}  // namespace sinew
