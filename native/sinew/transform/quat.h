// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#ifdef GLM_FORCE_QUAT_DATA_WXYZ
#error "The library has quaternions with w last in memory: build without GLM_FORCE_QUAT_DATA_WXYZ"
#endif

namespace sinew {

// Packed whatever GLM's default is: a program compiled with GLM_FORCE_DEFAULT_ALIGNED_GENTYPES would otherwise
// have vectors of another size than the library.

template <class T>
using Vec3 = glm::vec<3, T, glm::packed_highp>;

/// Column-major, as everywhere in GLM: `matrix[column][row]`.
template <class T>
using Mat3 = glm::mat<3, 3, T, glm::packed_highp>;

/// Constructed of w and the vector (x, y, z): four numbers are w, x, y, z, but x, y, z, w in a program that defines
/// GLM_FORCE_QUAT_DATA_XYZW with GLM 1.0.1 and later (1.0.0: GLM_FORCE_QUAT_CTOR_XYZW). Components are accessed by name,
/// never by index.
template <class T>
using Quat = glm::qua<T, glm::packed_highp>;

static_assert(sizeof(Vec3<float>) == 3 * sizeof(float) && sizeof(Mat3<float>) == 9 * sizeof(float));

/// A blend shorter than this has cancelled: its direction is rounding noise. Methods then return the heaviest
/// influence.
inline constexpr double kDegenerateBlend = 1e-6;

/// The quaternion (0, v).
template <class T>
[[nodiscard]] Quat<T> pure(const Vec3<T>& v) noexcept {
    return Quat<T>(T(0), v);
}

/// The vector part of `q`.
template <class T>
[[nodiscard]] Vec3<T> vector_part(const Quat<T>& q) noexcept {
    return Vec3<T>(q.x, q.y, q.z);
}

/// The unit quaternion of a rotation matrix, with w >= 0. Requires orthonormal columns and determinant +1 to
/// within rounding.
template <class T>
[[nodiscard]] Quat<T> to_quat(const Mat3<T>& rotation) noexcept {
    const Quat<T> q = glm::normalize(glm::quat_cast(rotation));
    return q.w < T(0) ? -q : q;
}

/// The rotation matrix of the unit quaternion `q`.
template <class T>
[[nodiscard]] Mat3<T> to_mat3(const Quat<T>& q) noexcept {
    return glm::mat3_cast(q);
}

/// Rotates `v` by the unit quaternion `q`.
template <class T>
[[nodiscard]] Vec3<T> rotate(const Quat<T>& q, const Vec3<T>& v) noexcept {
    // v + 2 q_v x (q_v x v + w v): 15 multiplications and 3 doublings; q v q* takes 28 multiplications.
    const Vec3<T> axis = vector_part(q);
    return v + T(2) * glm::cross(axis, glm::cross(axis, v) + q.w * v);
}

}  // namespace sinew
