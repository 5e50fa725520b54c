// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/quat.h"

namespace sinew {

/// Dual quaternion real + e dual, e^2 = 0 (Smith 2013, section 2.2.3; Kavan et al. 2008).
/// A rigid transform is a unit one: |real| = 1 and dot(real, dual) = 0. The default is the identity.
template <class T>
struct DualQuat {
    Quat<T> real{T(1), T(0), T(0), T(0)};
    Quat<T> dual{T(0), T(0), T(0), T(0)};
};

/// First `b`, then `a`.
template <class T>
[[nodiscard]] DualQuat<T> operator*(const DualQuat<T>& a, const DualQuat<T>& b) noexcept {
    return {a.real * b.real, a.real * b.dual + a.dual * b.real};
}

/// The transform that undoes the unit dual quaternion `a`: both parts conjugated.
template <class T>
[[nodiscard]] DualQuat<T> inverse(const DualQuat<T>& a) noexcept {
    return {glm::conjugate(a.real), glm::conjugate(a.dual)};
}

/// The unit dual quaternion nearest to the direction of `a`: divided by |real|, and the part of `dual`
/// along `real` taken off. Requires |real| > 0.
template <class T>
[[nodiscard]] DualQuat<T> normalized(const DualQuat<T>& a) noexcept {
    const T scale = T(1) / glm::length(a.real);
    const Quat<T> real = a.real * scale;
    const Quat<T> dual = a.dual * scale;
    return {real, dual - real * glm::dot(real, dual)};
}

/// The translation of `a`: 2 dual real*, for a unit `a`.
template <class T>
[[nodiscard]] Vec3<T> translation(const DualQuat<T>& a) noexcept {
    return T(2) * vector_part(a.dual * glm::conjugate(a.real));
}

template <class T>
[[nodiscard]] Vec3<T> transform_point(const DualQuat<T>& a, const Vec3<T>& point) noexcept {
    return rotate(a.real, point) + translation(a);
}

template <class T>
[[nodiscard]] Vec3<T> transform_vector(const DualQuat<T>& a, const Vec3<T>& vector) noexcept {
    return rotate(a.real, vector);
}

}  // namespace sinew
