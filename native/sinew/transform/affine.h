// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cmath>

#include "sinew/transform/nearest_rotation.h"
#include "sinew/transform/rotation.h"

namespace sinew {

/// A 3x4 matrix: x -> linear * x + translation. The default is the identity.
template <class T>
struct Affine {
    Mat3<T> linear{T(1)};
    Vec3<T> translation{T(0)};
};

/// Applies `b` first, then `a`: model_from_bone * bone_from_rest = model_from_rest.
template <class T>
[[nodiscard]] Affine<T> operator*(const Affine<T>& a, const Affine<T>& b) noexcept {
    return {a.linear * b.linear, a.linear * b.translation + a.translation};
}

#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
/// The product in vectors of four floats: the twelve numbers, column after column, fill three of them.
/// Equal to the generic product to the last bit, unless the compiler contracts products and sums
/// (-ffp-contract=fast with FMA), which it may do differently here.
[[nodiscard]] inline Affine<float> operator*(const Affine<float>& a, const Affine<float>& b) noexcept {
    using Lanes = float __attribute__((vector_size(16)));
    struct Registers {
        Lanes first, second, third;
    };
    static_assert(sizeof(Registers) == sizeof(Affine<float>));
    const auto [a0, a1, a2] = std::bit_cast<Registers>(a);
    const auto [b0, b1, b2] = std::bit_cast<Registers>(b);
    // The fourth lane of each column is unused.
    const Lanes x = a0;
    const Lanes y = __builtin_shufflevector(a0, a1, 3, 4, 5, 5);
    const Lanes z = __builtin_shufflevector(a1, a2, 2, 3, 4, 4);
    const Lanes moved = __builtin_shufflevector(a2, a2, 1, 2, 3, 3);
    const Lanes c0 = x * b0[0] + y * b0[1] + z * b0[2];
    const Lanes c1 = x * b0[3] + y * b1[0] + z * b1[1];
    const Lanes c2 = x * b1[2] + y * b1[3] + z * b2[0];
    const Lanes c3 = (x * b2[1] + y * b2[2] + z * b2[3]) + moved;
    return std::bit_cast<Affine<float>>(Registers{__builtin_shufflevector(c0, c1, 0, 1, 2, 4),
                                                  __builtin_shufflevector(c1, c2, 1, 2, 4, 5),
                                                  __builtin_shufflevector(c2, c3, 2, 4, 5, 6)});
}
#endif
#endif

/// The inverse of `a`. Requires an invertible linear part; a singular one gives infinities.
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

/// The unit normal, after `a`, of a surface with normal `normal`: along the inverse transpose of the linear part
/// (Turkowski 1990). A linear part that flattens the surface to a line gives (0, 0, 0).
template <class T>
[[nodiscard]] Vec3<T> transform_normal(const Affine<T>& a, const Vec3<T>& normal) noexcept {
    const Vec3<T> yz = glm::cross(a.linear[1], a.linear[2]);
    // The cofactors are the inverse transpose times the determinant; they exist for determinant 0, too.
    const Mat3<T> cofactors(yz, glm::cross(a.linear[2], a.linear[0]), glm::cross(a.linear[0], a.linear[1]));
    const Vec3<T> rotated = unit(cofactors * normal, Vec3<T>(T(0)));
    return glm::dot(a.linear[0], yz) < T(0) ? -rotated : rotated;
}

/// The rigid transform nearest to `a`: the linear part becomes nearest_rotation(). If that is not unique, as for
/// rank 0 or 1, it is one of the nearest.
template <class T>
[[nodiscard]] Affine<T> normalized(const Affine<T>& a) noexcept {
    return {to_mat3(nearest_rotation(a.linear).rotation), a.translation};
}

}  // namespace sinew
