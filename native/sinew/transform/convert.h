// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "sinew/transform/affine.h"
#include "sinew/transform/dual_quat.h"
#include "sinew/transform/quat_vec.h"

namespace sinew {

// Conversions between representations. The linear part of an Affine must be a rotation; see split_scale().

template <class T>
[[nodiscard]] Affine<T> to_affine(const Affine<T>& a) noexcept {
    return a;
}

template <class T>
[[nodiscard]] QuatVec<T> to_quat_vec(const QuatVec<T>& a) noexcept {
    return a;
}

template <class T>
[[nodiscard]] DualQuat<T> to_dual_quat(const DualQuat<T>& a) noexcept {
    return a;
}

template <class T>
[[nodiscard]] QuatVec<T> to_quat_vec(const Affine<T>& a) noexcept {
    return {to_quat(a.linear), a.translation};
}

template <class T>
[[nodiscard]] QuatVec<T> to_quat_vec(const DualQuat<T>& a) noexcept {
    return {a.real, translation(a)};
}

template <class T>
[[nodiscard]] DualQuat<T> to_dual_quat(const QuatVec<T>& a) noexcept {
    return {a.rotation, T(0.5) * (pure(a.translation) * a.rotation)};
}

template <class T>
[[nodiscard]] DualQuat<T> to_dual_quat(const Affine<T>& a) noexcept {
    return to_dual_quat(to_quat_vec(a));
}

template <class T>
[[nodiscard]] Affine<T> to_affine(const QuatVec<T>& a) noexcept {
    return {to_mat3(a.rotation), a.translation};
}

template <class T>
[[nodiscard]] Affine<T> to_affine(const DualQuat<T>& a) noexcept {
    return {to_mat3(a.real), translation(a)};
}

template <class T>
[[nodiscard]] bool is_finite(const Vec3<T>& v) noexcept {
    using std::isfinite;
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

template <class T>
[[nodiscard]] bool is_finite(const Mat3<T>& m) noexcept {
    return is_finite(m[0]) && is_finite(m[1]) && is_finite(m[2]);
}

template <class T>
[[nodiscard]] bool is_finite(const Quat<T>& q) noexcept {
    using std::isfinite;
    return isfinite(q.w) && is_finite(vector_part(q));
}

template <template <class> class Transform, class T>
[[nodiscard]] bool is_finite(const Transform<T>& a) noexcept {
    const auto& [first, second] = a;
    return is_finite(first) && is_finite(second);
}

/// The same transform with another scalar type.
template <class To, class From>
[[nodiscard]] Affine<To> cast(const Affine<From>& a) noexcept {
    return {Mat3<To>(a.linear), Vec3<To>(a.translation)};
}

template <class To, class From>
[[nodiscard]] QuatVec<To> cast(const QuatVec<From>& a) noexcept {
    return {Quat<To>(a.rotation), Vec3<To>(a.translation)};
}

template <class To, class From>
[[nodiscard]] DualQuat<To> cast(const DualQuat<From>& a) noexcept {
    return {Quat<To>(a.real), Quat<To>(a.dual)};
}

}  // namespace sinew
