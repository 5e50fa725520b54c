// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "sinew/transform/quat.h"

namespace sinew {

/// sin(x) / x; 1 for x = 0.
template <class T>
[[nodiscard]] T sinc(T x) noexcept {
    using std::abs;
    using std::sin;
    return abs(x) < T(1e-4) ? T(1) - x * x / T(6) : sin(x) / x;
}

/// `v` normalised; `otherwise` if its length is 0.
template <class T>
[[nodiscard]] Vec3<T> unit(const Vec3<T>& v, const Vec3<T>& otherwise) noexcept {
    using std::abs;
    using std::max;
    // Divide by the largest component first: the square of a short vector underflows to 0 long before the vector
    // does.
    const T largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    return largest > T(0) ? glm::normalize(v / largest) : otherwise;
}

/// The length of `v`, also where the squares of its components would underflow or overflow.
template <class T>
[[nodiscard]] T safe_length(const Vec3<T>& v) noexcept {
    using std::hypot;
    return hypot(v.x, v.y, v.z);
}

/// The divisor of `q`, of length `length`, that gives the squares of its components full precision: 1 if
/// they do already, else its largest absolute component, which is 0 only if all are.
template <class T>
[[nodiscard]] T prescale(const Quat<T>& q, T length) noexcept {
    using std::abs;
    using std::max;
    if (length > T(1e-12) && length < T(1e12)) return T(1);
    return max(max(abs(q.w), abs(q.x)), max(abs(q.y), abs(q.z)));
}

/// The unit quaternion of the rotation by `angle` radians about `axis`. The axis may have any length; length 0
/// gives the identity.
template <class T>
[[nodiscard]] Quat<T> quat_from_axis_angle(const Vec3<T>& axis, T angle) noexcept {
    using std::cos;
    using std::sin;
    const Vec3<T> direction = unit(axis, Vec3<T>(T(0)));
    if (direction == Vec3<T>(T(0))) return Quat<T>(T(1), Vec3<T>(T(0)));
    const T half = angle * T(0.5);
    const Vec3<T> v = sin(half) * direction;
    return Quat<T>(cos(half), v);
}

/// Axis times angle of the unit quaternion `q`, in radians, with a length of 0 to pi: of the two ways that q and
/// -q stand for, the shorter one. If both are 180 degrees (w = 0), the signs of `q` decide.
template <class T>
[[nodiscard]] Vec3<T> rotation_vector(const Quat<T>& q) noexcept {
    using std::atan2;
    const Quat<T> near = q.w < T(0) ? -q : q;
    const Vec3<T> v = vector_part(near);
    const T length = safe_length(v);
    // Below this the factor is 2 to the last digit. Above, atan2 is exact at both ends, while acos(w) is exact at
    // neither.
    const T factor = length < T(1e-9) ? T(2) : T(2) * atan2(length, near.w) / length;
    return factor * v;
}

/// The unit quaternion of a rotation vector of any length. The inverse of rotation_vector(), up to sign.
template <class T>
[[nodiscard]] Quat<T> quat_from_rotation_vector(const Vec3<T>& rotation) noexcept {
    using std::cos;
    const T half = safe_length(rotation) * T(0.5);
    const Vec3<T> v = (T(0.5) * sinc(half)) * rotation;
    return Quat<T>(cos(half), v);
}

/// x, y and z of the unit quaternion `q` or of -q, whichever has w >= 0: three numbers that represent a rotation
/// (Smith 2013, section 3.3).
template <class T>
[[nodiscard]] Vec3<T> three_numbers(const Quat<T>& q) noexcept {
    return q.w < T(0) ? -vector_part(q) : vector_part(q);
}

/// The unit quaternion whose three_numbers() are `v`. w is the square root of 1 - |v|^2, or 0 if rounding made
/// |v| > 1.
///
/// Near 180 degrees w is small and imprecise: its error is up to the square root of the type's rounding error.
template <class T>
[[nodiscard]] Quat<T> from_three_numbers(const Vec3<T>& v) noexcept {
    using std::max;
    using std::sqrt;
    return glm::normalize(Quat<T>(sqrt(max(T(1) - glm::dot(v, v), T(0))), v));
}

/// The angle of the rotation from `a` to `b`, 0 to pi. Both have unit length; their signs do not matter.
template <class T>
[[nodiscard]] T angle_between(const Quat<T>& a, const Quat<T>& b) noexcept {
    using std::abs;
    using std::atan2;
    const Quat<T> difference = glm::conjugate(a) * b;
    return T(2) * atan2(safe_length(vector_part(difference)), abs(difference.w));
}

/// Whether two unit quaternions are 180 degrees apart to within rounding, so that neither way between them is the
/// shorter one.
template <class T>
[[nodiscard]] bool is_half_turn_apart(const Quat<T>& a, const Quat<T>& b) noexcept {
    using std::abs;
    return abs(glm::dot(a, b)) < T(kDegenerateBlend);
}

}  // namespace sinew
