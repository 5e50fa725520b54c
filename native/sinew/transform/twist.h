// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/convert.h"

namespace sinew {

/// The logarithm of a rigid transform, in se(3): the constant velocity that reaches the transform in unit time.
/// It stands for the matrix [[angular]x, linear; 0, 0]. The default is the logarithm of the identity.
template <class T>
struct Twist {
    Vec3<T> angular{T(0)};
    Vec3<T> linear{T(0)};
};

template <class T>
[[nodiscard]] Twist<T> operator+(const Twist<T>& a, const Twist<T>& b) noexcept {
    return {a.angular + b.angular, a.linear + b.linear};
}

template <class T>
[[nodiscard]] Twist<T> operator*(T factor, const Twist<T>& a) noexcept {
    return {factor * a.angular, factor * a.linear};
}

/// The logarithm of the rotation by `angular`, of less than 360 degrees, with this translation.
template <class T>
[[nodiscard]] Twist<T> to_twist(const Vec3<T>& angular, const Vec3<T>& translation) noexcept {
    using std::cos;
    using std::sin;
    const T half = safe_length(angular) * T(0.5);
    // (1 - x cot x) / 4 x^2, which is finite up to 360 degrees; the series where the difference would cancel.
    const T x2 = half * half;
    const T factor = half < T(1e-2) ? T(1) / T(12) + x2 * (T(1) / T(180) + x2 / T(1890))
                                    : (T(1) - half * cos(half) / sin(half)) / (T(4) * x2);
    const Vec3<T> sideways = glm::cross(angular, translation);
    return {angular, translation - T(0.5) * sideways + factor * glm::cross(angular, sideways)};
}

/// The logarithm of `a`, with an angle of 0 to pi. At 180 degrees there are two, with opposite axes, and the
/// signs of a.rotation decide (Murray, Li, Sastry 1994, section 2.3.3).
template <class T>
[[nodiscard]] Twist<T> to_twist(const QuatVec<T>& a) noexcept {
    return to_twist(rotation_vector(a.rotation), a.translation);
}

template <template <class> class Transform, class T>
[[nodiscard]] Twist<T> to_twist(const Transform<T>& a) noexcept {
    return to_twist(to_quat_vec(a));
}

/// The exponential of `twist`, of any angle: the inverse of to_twist(). From angles of 1 / epsilon on the
/// rotation is arbitrary. Gives infinities and NaN where the length of `angular` or `linear` exceeds the type's
/// range.
template <class T>
[[nodiscard]] QuatVec<T> to_quat_vec(const Twist<T>& twist) noexcept {
    using std::sin;
    const T angle = safe_length(twist.angular);
    if (angle > T(1e4)) {
        // Powers of the angle, as used below, would overflow.
        const Vec3<T> axis = twist.angular / angle;
        const T half = sin(angle * T(0.5));
        const T along = glm::dot(axis, twist.linear);
        return {quat_from_rotation_vector(twist.angular),
                along * axis + (sin(angle) / angle) * (twist.linear - along * axis) +
                    (T(2) * half * half / angle) * glm::cross(axis, twist.linear)};
    }
    const T x2 = angle * angle;
    const T half_sinc = sinc(angle * T(0.5));
    // (x - sin x) / x^3.
    const T factor = angle < T(1e-2) ? T(1) / T(6) - x2 * (T(1) / T(120) - x2 / T(5040))
                                     : (angle - sin(angle)) / (angle * x2);
    const Vec3<T> sideways = glm::cross(twist.angular, twist.linear);
    return {quat_from_rotation_vector(twist.angular), twist.linear +
                                                          (T(0.5) * half_sinc * half_sinc) * sideways +
                                                          factor * glm::cross(twist.angular, sideways)};
}

template <class T>
[[nodiscard]] DualQuat<T> to_dual_quat(const Twist<T>& twist) noexcept {
    return to_dual_quat(to_quat_vec(twist));
}

/// The logarithm of the unit dual quaternion `a`: half its twist in the vector parts, and 0 in the scalar parts.
/// a and -a are one motion; the one with real.w >= 0 is used (Kavan et al. 2008, section 3.4).
template <class T>
[[nodiscard]] DualQuat<T> log(const DualQuat<T>& a) noexcept {
    const Twist<T> half = T(0.5) * to_twist(a);
    return {pure(half.angular), pure(half.linear)};
}

/// The unit dual quaternion whose logarithm is `a`. The scalar parts of `a` are ignored.
template <class T>
[[nodiscard]] DualQuat<T> exp(const DualQuat<T>& a) noexcept {
    return to_dual_quat(T(2) * Twist<T>{vector_part(a.real), vector_part(a.dual)});
}

/// The power of a unit `a`: the same screw with angle and translation multiplied by `exponent`, taken along the
/// shorter way (Kavan et al. 2008, section 3.4).
template <class T>
[[nodiscard]] DualQuat<T> power(const DualQuat<T>& a, T exponent) noexcept {
    return to_dual_quat(exponent * to_twist(a));
}

}  // namespace sinew
