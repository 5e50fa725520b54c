// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

#include "sinew/transform/affine.h"

namespace sinew {

/// The tolerance for rotations: squared lengths of columns differ from 1, and dot products from 0, by less than
/// this.
inline constexpr double kOrthonormal = 1e-5;

/// Whether the rest axes of a bone have unit length, within twice kOrthonormal. This leaves a margin below the
/// size that counts as scale.
template <class T>
[[nodiscard]] bool has_unit_axes(const Affine<T>& rest_bone) noexcept {
    bool unit = true;
    for (int i = 0; i < 3; ++i) {
        const Vec3<T>& axis = rest_bone.linear[i];
        unit = unit && std::abs(glm::dot(axis, axis) - T(1)) < T(2 * kOrthonormal);
    }
    return unit;
}

/// The parts of a motion: posed_from_rest = rigid * scale.
template <class T>
struct ScaleSplit {
    Affine<T> rigid;
    Affine<T> scale;
    bool has_scale = false;
};

/// The unit quaternion that Blender extracts from `axes`, whose columns have unit length or are zero.
///
/// For a rotation it is the rotation's quaternion. With zero columns it is arbitrary, but Blender's vertices
/// depend on it where they share a bone of width 0 with another bone.
template <class T>
[[nodiscard]] Quat<T> quat_of_columns(const Mat3<T>& axes) noexcept {
    // If the columns are no rotation, the result depends on which of the four components is computed first.
    int first = 3;
    if (axes[2][2] < T(0)) {
        first = axes[0][0] > axes[1][1] ? 0 : 1;
    } else if (axes[0][0] < -axes[1][1]) {
        first = 2;
    }
    const Vec3<T> difference(axes[1][2] - axes[2][1], axes[2][0] - axes[0][2], axes[0][1] - axes[1][0]);
    if (first == 3) {
        const T s = T(2) * std::sqrt(T(1) + axes[0][0] + axes[1][1] + axes[2][2]);
        return glm::normalize(Quat<T>(s / T(4), difference / s));
    }
    const int second = (first + 1) % 3;
    const int third = (first + 2) % 3;
    T s = T(2) * std::sqrt(T(1) + axes[first][first] - axes[second][second] - axes[third][third]);
    if (difference[first] < T(0)) s = -s;
    Vec3<T> v{};
    v[first] = s / T(4);
    v[second] = (axes[first][second] + axes[second][first]) / s;
    v[third] = (axes[first][third] + axes[third][first]) / s;
    return glm::normalize(Quat<T>(difference[first] / s, v));
}

/// The right-handed rotation that keeps the direction of the Y column of `linear` and makes the other columns
/// perpendicular to it. If `linear` mirrors, the rotation does not.
///
/// Columns shorter than 1e-6 of the longest count as zero. If Y is zero, the result is the identity. If X or Z is
/// zero, or X is along Y, it is quat_of_columns() of the remaining columns.
template <class T>
[[nodiscard]] Mat3<T> rotation_keeping_y(const Mat3<T>& linear) noexcept {
    // Bones are given as float32; anything shorter than this is rounding.
    constexpr T kNoDirection = T(1e-6);
    const T size = std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
    if (!(size > T(0))) return Mat3<T>(T(1));
    const Mat3<T> c = linear * (T(1) / size);
    const auto is_zero = [](const Vec3<T>& v) { return glm::length(v) <= kNoDirection; };
    if (is_zero(c[1])) return Mat3<T>(T(1));
    const Vec3<T> y = glm::normalize(c[1]);

    // The odd tests against 1, with x and z not normalised and the second one of x against z, are Blender's:
    // under extreme shear and scale they select another axis, and so must these.
    Vec3<T> x;
    if (glm::dot(y, linear[0]) < T(1)) {
        x = c[0] - y * glm::dot(y, c[0]);
    } else if (glm::dot(linear[0], linear[2]) < T(1)) {
        x = glm::cross(y, c[2]);
    } else {
        x = glm::cross(y, Vec3<T>(y.y, y.z, y.x));
    }
    if (is_zero(x)) return to_mat3(quat_of_columns(Mat3<T>(Vec3<T>(T(0)), y, Vec3<T>(T(0)))));
    // Twice, since a short difference of long vectors is not perpendicular to y.
    x = glm::normalize(x);
    x = glm::normalize(x - y * glm::dot(y, x));
    Mat3<T> axes(x, y, glm::cross(x, y));
    if (!is_zero(c[0]) && !is_zero(c[2])) return axes;
    if (is_zero(c[0])) axes[0] = Vec3<T>(T(0));
    if (is_zero(c[2])) axes[2] = Vec3<T>(T(0));
    return to_mat3(quat_of_columns(axes));
}

/// Splits a bone's motion into a rigid motion and a scale about the bone's head along its rest axes.
///
/// posed_from_rest  model or armature space
/// rest_bone        the bone's rest axes (Y along the bone) and head in the same space, orthonormal
///
/// A motion counts as rigid if it is within 1e-5 of orthonormal, does not mirror, and is within 1e-4 of unit
/// scale. The rigid part is always a rotation, even if axes vanish. Source: the rule of Blender's Armature
/// modifier for Preserve Volume.
template <class T>
[[nodiscard]] ScaleSplit<T> split_scale(const Affine<T>& posed_from_rest,
                                        const Affine<T>& rest_bone) noexcept {
    const Mat3<T>& c = posed_from_rest.linear;
    bool orthonormal = true;
    for (int i = 0; i < 3; ++i) {
        orthonormal = orthonormal && std::abs(glm::dot(c[i], c[i]) - T(1)) < T(kOrthonormal) &&
                      std::abs(glm::dot(c[i], c[(i + 1) % 3])) < T(kOrthonormal);
    }
    // Most bones in most frames; costs a third of measuring the scale.
    if (orthonormal && glm::determinant(c) >= T(0) && has_unit_axes(rest_bone)) {
        return {posed_from_rest, {}, false};
    }
    const Affine<T> posed_bone = posed_from_rest * rest_bone;
    const Vec3<T> stretch(glm::length(posed_bone.linear[0]) - T(1), glm::length(posed_bone.linear[1]) - T(1),
                          glm::length(posed_bone.linear[2]) - T(1));
    if (orthonormal && glm::determinant(c) >= T(0) && glm::dot(stretch, stretch) <= T(1e-8)) {
        return {posed_from_rest, {}, false};
    }
    const Affine<T> rigid_bone{rotation_keeping_y(posed_bone.linear), posed_bone.translation};
    const Affine<T> rest_from_model = inverse(rest_bone);
    return {rigid_bone * rest_from_model, rest_bone * (inverse(rigid_bone) * posed_bone) * rest_from_model,
            true};
}

}  // namespace sinew
