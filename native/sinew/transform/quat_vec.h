// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/rotation.h"

namespace sinew {

/// Quaternion-vector pair (QV): x -> rotation x rotation* + translation (Smith 2013, section 2.2.1). The rotation
/// has unit length. The default is the identity.
template <class T>
struct QuatVec {
    Quat<T> rotation{T(1), Vec3<T>(T(0))};
    Vec3<T> translation{T(0)};
};

/// Applies `b` first, then `a`.
template <class T>
[[nodiscard]] QuatVec<T> operator*(const QuatVec<T>& a, const QuatVec<T>& b) noexcept {
    return {a.rotation * b.rotation, rotate(a.rotation, b.translation) + a.translation};
}

/// The inverse of `a`.
template <class T>
[[nodiscard]] QuatVec<T> inverse(const QuatVec<T>& a) noexcept {
    const Quat<T> rotation = glm::conjugate(a.rotation);
    return {rotation, -rotate(rotation, a.translation)};
}

template <class T>
[[nodiscard]] Vec3<T> transform_point(const QuatVec<T>& a, const Vec3<T>& point) noexcept {
    return rotate(a.rotation, point) + a.translation;
}

template <class T>
[[nodiscard]] Vec3<T> transform_vector(const QuatVec<T>& a, const Vec3<T>& vector) noexcept {
    return rotate(a.rotation, vector);
}

/// The rotated `normal`, normalised; (0, 0, 0) gives (0, 0, 0).
template <class T>
[[nodiscard]] Vec3<T> transform_normal(const QuatVec<T>& a, const Vec3<T>& normal) noexcept {
    return rotate(a.rotation, unit(normal, Vec3<T>(T(0))));
}

/// `a` with a rotation of unit length. If the rotation is 0, the result has the identity as its rotation.
template <class T>
[[nodiscard]] QuatVec<T> normalized(const QuatVec<T>& a) noexcept {
    const T length = glm::length(a.rotation);
    const T before = prescale(a.rotation, length);
    if (!(before > T(0))) return {Quat<T>(T(1), Vec3<T>(T(0))), a.translation};
    if (before != T(1)) return {glm::normalize(a.rotation / before), a.translation};
    return {a.rotation / length, a.translation};
}

}  // namespace sinew
