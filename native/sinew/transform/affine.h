// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/quat.h"

namespace sinew {

/// A 3x4 matrix: x -> linear * x + translation. The default is the identity.
template <class T>
struct Affine {
    Mat3<T> linear{T(1)};
    Vec3<T> translation{T(0)};
};

/// First `b`, then `a`: model_from_bone * bone_from_rest = model_from_rest.
template <class T>
[[nodiscard]] Affine<T> operator*(const Affine<T>& a, const Affine<T>& b) noexcept {
    return {a.linear * b.linear, a.linear * b.translation + a.translation};
}

/// The transform that undoes `a`. Requires an invertible linear part; a singular one gives infinities.
template <class T>
[[nodiscard]] Affine<T> inverse(const Affine<T>& a) noexcept {
    const Mat3<T> linear = glm::inverse(a.linear);
    return {linear, -(linear * a.translation)};
}

template <class T>
[[nodiscard]] Vec3<T> transform_point(const Affine<T>& a, const Vec3<T>& point) noexcept {
    return a.linear * point + a.translation;
}

template <class T>
[[nodiscard]] Vec3<T> transform_vector(const Affine<T>& a, const Vec3<T>& vector) noexcept {
    return a.linear * vector;
}

}  // namespace sinew
