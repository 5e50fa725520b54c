// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/dual.h"
#include "sinew/transform/rotation.h"

namespace sinew {

/// Dual quaternion real + e dual, e^2 = 0 (Smith 2013, section 2.2.3; Kavan et al. 2008). A rigid transform is a
/// unit dual quaternion: |real| = 1 and dot(real, dual) = 0. The default is the identity.
template <class T>
struct DualQuat {
    Quat<T> real{T(1), Vec3<T>(T(0))};
    Quat<T> dual{T(0), Vec3<T>(T(0))};
};

/// Applies `b` first, then `a`.
template <class T>
[[nodiscard]] DualQuat<T> operator*(const DualQuat<T>& a, const DualQuat<T>& b) noexcept {
    return {a.real * b.real, a.real * b.dual + a.dual * b.real};
}

template <class T>
[[nodiscard]] DualQuat<T> operator+(const DualQuat<T>& a, const DualQuat<T>& b) noexcept {
    return {a.real + b.real, a.dual + b.dual};
}

/// -a. For a unit `a` this is the same motion.
template <class T>
[[nodiscard]] DualQuat<T> operator-(const DualQuat<T>& a) noexcept {
    return {-a.real, -a.dual};
}

/// The product with a dual number. It is commutative.
template <class T>
[[nodiscard]] DualQuat<T> operator*(const Dual<T>& factor, const DualQuat<T>& a) noexcept {
    return {factor.real * a.real, factor.real * a.dual + factor.dual * a.real};
}

/// The quaternion conjugate, real* + e dual*. It reverses products, and is the inverse of a unit `a`.
template <class T>
[[nodiscard]] DualQuat<T> conjugate(const DualQuat<T>& a) noexcept {
    return {glm::conjugate(a.real), glm::conjugate(a.dual)};
}

/// The dual conjugate: real - e dual.
template <class T>
[[nodiscard]] DualQuat<T> dual_conjugate(const DualQuat<T>& a) noexcept {
    return {a.real, -a.dual};
}

/// Both conjugates: real* - e dual*. The image of a point 1 + e p is a (1 + e p) times this (Smith 2013, section
/// 2.2.3).
template <class T>
[[nodiscard]] DualQuat<T> combined_conjugate(const DualQuat<T>& a) noexcept {
    return {glm::conjugate(a.real), -glm::conjugate(a.dual)};
}

/// sqrt(a a*), a dual number: |real| + e dot(real, dual) / |real|. If the real part is 0, the result is 0.
template <class T>
[[nodiscard]] Dual<T> norm(const DualQuat<T>& a) noexcept {
    const T length = glm::length(a.real);
    const T before = prescale(a.real, length);
    if (!(before > T(0))) return {};
    if (before != T(1)) {
        const Quat<T> real = a.real / before;
        const T rest = glm::length(real);
        return {before * rest, glm::dot(real / rest, a.dual)};
    }
    return {length, glm::dot(a.real, a.dual) / length};
}

/// The inverse of the unit dual quaternion `a`: its quaternion conjugate.
template <class T>
[[nodiscard]] DualQuat<T> inverse(const DualQuat<T>& a) noexcept {
    return conjugate(a);
}

/// The unit dual quaternion `a` / norm(a): `a` divided by |real|, without the component of `dual` along `real`.
/// If the real part is 0, the result is the identity.
template <class T>
[[nodiscard]] DualQuat<T> normalized(const DualQuat<T>& a) noexcept {
    const T length = glm::length(a.real);
    const T before = prescale(a.real, length);
    if (!(before > T(0))) return {};
    if (before != T(1)) return normalized(DualQuat<T>{a.real / before, a.dual / before});
    const T scale = T(1) / length;
    const Quat<T> real = a.real * scale;
    const Quat<T> dual = a.dual * scale;
    return {real, dual - real * glm::dot(real, dual)};
}

/// The translation of a unit `a`: 2 dual real*.
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

/// The rotated `normal`, normalised; (0, 0, 0) gives (0, 0, 0).
template <class T>
[[nodiscard]] Vec3<T> transform_normal(const DualQuat<T>& a, const Vec3<T>& normal) noexcept {
    return rotate(a.real, unit(normal, Vec3<T>(T(0))));
}

}  // namespace sinew
