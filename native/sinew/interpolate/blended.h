// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "sinew/transform/convert.h"

namespace sinew {

/// The result of an interpolation. `is_defined` is false if the method has no unique result for this input, or if
/// rounding decides between several. The transform is then finite, and is the one that the method's header
/// specifies.
template <class Transform>
struct Blended {
    Transform transform;
    bool is_defined = true;
};

/// How a blend chooses the free signs of quaternions.
enum class BlendSigns {
    kToHeaviest,  ///< flips each to the hemisphere of the term with the largest weight: the shortest path
    /// flips each to the hemisphere of the sum of the terms before it: the rule of Blender and of Deformer
    kRunningSum,
    kAsGiven,  ///< leaves them unchanged
};

/// Weights normalised to sum 1, and the index of the largest weight (the first, if several are equal).
template <class T>
struct Shares {
    std::size_t heaviest = 0;
    T largest = T(1);
    T scale = T(1);  ///< for weights divided by the largest
    bool is_defined = true;

    /// Divides by the largest first: a sum of large numbers may overflow, and so may 1 over a sum of small ones.
    [[nodiscard]] T of(T weight) const noexcept { return weight / largest * scale; }
};

/// weights  [n] of any sign. Not defined if there are none, or if their sum is at most kDegenerateBlend times the
///          largest.
template <class T>
[[nodiscard]] Shares<T> shares(std::span<const T> weights) noexcept {
    if (weights.empty()) return {0, T(1), T(1), false};
    const auto largest = std::max_element(weights.begin(), weights.end());
    const auto heaviest = static_cast<std::size_t>(largest - weights.begin());
    if (!(*largest > T(0))) return {heaviest, T(1), T(1), false};
    T sum = T(0);
    for (const T weight : weights) sum += weight / *largest;
    if (!(sum > T(kDegenerateBlend))) return {heaviest, T(1), T(1), false};
    return {heaviest, *largest, T(1) / sum, true};
}

/// `result` if it is finite; `heaviest`, not defined, if it or an intermediate number overflowed.
template <class Transform>
[[nodiscard]] Blended<Transform> finite_or(const Blended<Transform>& result,
                                           const Transform& heaviest) noexcept {
    return is_finite(result.transform) ? result : Blended<Transform>{heaviest, false};
}

/// The quaternion whose sign is free: with the other sign it is the same transform.
template <class T>
[[nodiscard]] const Quat<T>& quaternion_of(const QuatVec<T>& a) noexcept {
    return a.rotation;
}

template <class T>
[[nodiscard]] const Quat<T>& quaternion_of(const DualQuat<T>& a) noexcept {
    return a.real;
}

/// Not matrices, and not points, which a spline treats as transforms without rotation.
template <class Transform>
concept HasQuaternion = requires(const Transform& a) {
    quaternion_of(a);
};

/// Whichever of `q` and -q is in the hemisphere of `pivot`.
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

template <class Transform>
[[nodiscard]] Transform aligned(const Transform& a, const Transform& /*pivot*/) noexcept {
    return a;
}

/// The tolerance for rotations: how far squared lengths may be from 1, and products of axes from 0.
inline constexpr double kUnitTolerance = 2e-3;

/// Whether the quaternion, if there is one, has unit length, up to the rounding of a few operations.
template <class Transform>
[[nodiscard]] bool has_unit_rotation(const Transform& a) noexcept {
    if constexpr (HasQuaternion<Transform>) {
        using std::abs;
        using T = decltype(glm::dot(quaternion_of(a), quaternion_of(a)));
        return abs(glm::dot(quaternion_of(a), quaternion_of(a)) - T(1)) <= T(kUnitTolerance);
    } else {
        return true;
    }
}

/// Whether the linear part of `a` is a rotation, without scale, shear or mirroring, up to the rounding of a few
/// operations.
template <class T>
[[nodiscard]] bool is_rigid(const Affine<T>& a) noexcept {
    using std::abs;
    bool is_orthonormal = true;
    for (int i = 0; i < 3; ++i) {
        is_orthonormal = is_orthonormal &&
                         abs(glm::dot(a.linear[i], a.linear[i]) - T(1)) <= T(kUnitTolerance) &&
                         abs(glm::dot(a.linear[i], a.linear[(i + 1) % 3])) <= T(kUnitTolerance);
    }
    return is_orthonormal && glm::determinant(a.linear) > T(0);
}

/// Whether another order of the terms would give other signs and thus another blend: several terms have the
/// largest weight, and the remaining terms are in different hemispheres relative to them.
template <HasQuaternion Transform, class T>
[[nodiscard]] bool order_decides(std::span<const Transform> transforms, std::span<const T> weights,
                                 const Shares<T>& share) noexcept {
    using std::abs;
    const auto rotation_dot = [](const Transform& a, const Transform& b) {
        return glm::dot(quaternion_of(a), quaternion_of(b));
    };
    const Transform& pivot = transforms[share.heaviest];
    // Rotations within 90 degrees of the pivot are within 180 degrees of each other, so all choose the same
    // signs.
    bool is_wide = false;
    for (std::size_t i = 0; i < transforms.size(); ++i) {
        is_wide = is_wide || (weights[i] != T(0) && abs(rotation_dot(transforms[i], pivot)) < T(0.7072));
    }
    if (!is_wide) return false;
    const T least = share.largest * (T(1) - T(8) * std::numeric_limits<T>::epsilon());
    for (std::size_t other = share.heaviest + 1; other < transforms.size(); ++other) {
        if (weights[other] < least) continue;
        const T between = rotation_dot(transforms[other], pivot);
        for (std::size_t i = 0; i < transforms.size(); ++i) {
            if (weights[i] == T(0)) continue;
            const T from_pivot = rotation_dot(transforms[i], pivot);
            const T from_other = rotation_dot(transforms[i], transforms[other]);
            if ((from_pivot < T(0)) != ((from_other < T(0)) != (between < T(0)))) return true;
        }
    }
    return false;
}

/// Whether rounding decides which way from `a` to `b` is the shorter one: they are 180 degrees apart.
template <class Transform>
[[nodiscard]] bool is_half_turn_apart(const Transform& a, const Transform& b) noexcept {
    if constexpr (HasQuaternion<Transform>) {
        return is_half_turn_apart(quaternion_of(a), quaternion_of(b));
    } else {
        return false;
    }
}

/// Whether `t` decides nothing, or there is one shorter way from `a` to `b`; with rotations of unit length.
template <class Transform, class T>
[[nodiscard]] bool has_shorter_way(const Transform& a, const Transform& b, T t) noexcept {
    return (t == T(0) || t == T(1) || !is_half_turn_apart(a, b)) && has_unit_rotation(a) &&
           has_unit_rotation(b);
}

/// The product of all components with `factor`.
template <template <class> class Transform, class T>
[[nodiscard]] Transform<T> scaled(T factor, const Transform<T>& a) noexcept {
    const auto& [first, second] = a;
    return {factor * first, factor * second};
}

template <class T>
[[nodiscard]] Vec3<T> scaled(T factor, const Vec3<T>& a) noexcept {
    return factor * a;
}

/// The sums of the components.
template <template <class> class Transform, class T>
[[nodiscard]] Transform<T> sum(const Transform<T>& a, const Transform<T>& b) noexcept {
    const auto& [a1, a2] = a;
    const auto& [b1, b2] = b;
    return {a1 + b1, a2 + b2};
}

template <class T>
[[nodiscard]] Vec3<T> sum(const Vec3<T>& a, const Vec3<T>& b) noexcept {
    return a + b;
}

/// The componentwise weighted sum (of 12, 7 or 8 components), with weights times `scale`; not a rigid transform
/// (Smith 2013, section 3.2.2). Not defined if a rotation of weight other than 0 does not have unit length; with
/// BlendSigns::kToHeaviest also if one is 180 degrees from the heaviest, or if order_decides(); with
/// BlendSigns::kRunningSum also if one is perpendicular to the sum before it.
template <BlendSigns signs, class Transform, class T>
[[nodiscard]] Blended<Transform> weighted_sum(std::span<const Transform> transforms,
                                              std::span<const T> weights, const Shares<T>& share) noexcept {
    const Transform& pivot = transforms[share.heaviest];
    Blended<Transform> total{scaled(T(0), pivot), true};
    [[maybe_unused]] bool has_terms = false;
    for (std::size_t i = 0; i < transforms.size(); ++i) {
        if (weights[i] == T(0)) continue;
        const T weight = share.of(weights[i]);
        if (!has_unit_rotation(transforms[i])) total.is_defined = false;
        if constexpr (signs == BlendSigns::kToHeaviest) {
            if (is_half_turn_apart(transforms[i], pivot)) total.is_defined = false;
            total.transform = sum(total.transform, scaled(weight, aligned(transforms[i], pivot)));
        } else if constexpr (signs == BlendSigns::kRunningSum) {
            if (has_terms && is_half_turn_apart(transforms[i], total.transform)) total.is_defined = false;
            has_terms = true;
            total.transform = sum(total.transform, scaled(weight, aligned(transforms[i], total.transform)));
        } else {
            total.transform = sum(total.transform, scaled(weight, transforms[i]));
        }
    }
    if constexpr (signs == BlendSigns::kToHeaviest && HasQuaternion<Transform>) {
        if (order_decides(transforms, weights, share)) total.is_defined = false;
    }
    return total;
}

}  // namespace sinew
