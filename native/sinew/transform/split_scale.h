// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

#include "sinew/transform/affine.h"

namespace sinew {

/// posed_from_rest = rigid * scale.
template <class T>
struct ScaleSplit {
    Affine<T> rigid;
    Affine<T> scale;
    bool has_scale = false;
};

/// The right-handed rotation that keeps the direction of the Y column of `linear` and makes the others
/// square to it. A mirror in `linear` is not in the rotation.
///
/// Columns below 1e-6 of the longest, or as near to parallel, give no direction: those left decide, and
/// after them the columns of the rotation `otherwise`.
template <class T>
[[nodiscard]] Mat3<T> rotation_keeping_y(const Mat3<T>& linear, const Mat3<T>& otherwise) noexcept {
    // Bones come as float32: what is shorter than this is their rounding.
    constexpr T kNoDirection = T(1e-6);
    const T size = std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
    if (!(size > T(0))) return otherwise;
    const Mat3<T> c = linear * (T(1) / size);

    Vec3<T> y = c[1];
    if (glm::length(y) <= kNoDirection) y = glm::cross(c[2], c[0]);
    if (glm::length(y) <= kNoDirection) y = otherwise[1];
    y = glm::normalize(y);

    // The odd tests against 1 with x and z not normalised are Blender's: under extreme shear and scale
    // they pick another axis, and so must we.
    Vec3<T> x;
    if (glm::dot(y, linear[0]) < T(1)) {
        x = c[0] - y * glm::dot(y, c[0]);
    } else if (glm::dot(y, linear[2]) < T(1)) {
        x = glm::cross(y, c[2]);
    } else {
        x = glm::cross(y, Vec3<T>(y.y, y.z, y.x));
    }
    for (const Vec3<T>& z : {c[2], otherwise[2], otherwise[1]}) {
        if (glm::length(x) <= kNoDirection) x = glm::cross(y, z);
    }
    // Twice, because a short difference of long vectors is not square to y.
    x = glm::normalize(x);
    x = glm::normalize(x - y * glm::dot(y, x));
    return Mat3<T>(x, y, glm::cross(x, y));
}

/// Splits a bone's motion into a rigid motion and a scale about the bone's head along its rest axes.
///
/// posed_from_rest  model or armature space
/// rest_bone        the bone's rest axes (Y along the bone) and head in the same space, orthonormal
///
/// A motion within 1e-5 of orthonormal, unmirrored and within 1e-4 of unit size counts as rigid.
/// Where axes vanish or are parallel those left decide, and after them the rest axes. Source: the rule that Blender's Armature modifier has for
/// Preserve Volume.
template <class T>
[[nodiscard]] ScaleSplit<T> split_scale(const Affine<T>& posed_from_rest,
                                        const Affine<T>& rest_bone) noexcept {
    const Mat3<T>& c = posed_from_rest.linear;
    bool orthonormal = true;
    for (int i = 0; i < 3; ++i) {
        orthonormal = orthonormal && std::abs(glm::dot(c[i], c[i]) - T(1)) < T(1e-5) &&
                      std::abs(glm::dot(c[i], c[(i + 1) % 3])) < T(1e-5);
    }
    if (orthonormal && glm::determinant(c) >= T(0)) {
        // Axes of unit length to 1e-5 stay so to 2.5e-5, below the size that counts as scale: most bones
        // of most frames, at a third of the cost of measuring it.
        bool unit_rest = true;
        for (int i = 0; i < 3; ++i) {
            const Vec3<T>& axis = rest_bone.linear[i];
            unit_rest = unit_rest && std::abs(glm::dot(axis, axis) - T(1)) < T(2e-5);
        }
        if (unit_rest) return {posed_from_rest, {}, false};
    }
    const Affine<T> posed_bone = posed_from_rest * rest_bone;
    const Vec3<T> stretch(glm::length(posed_bone.linear[0]) - T(1), glm::length(posed_bone.linear[1]) - T(1),
                          glm::length(posed_bone.linear[2]) - T(1));
    if (orthonormal && glm::determinant(c) >= T(0) && glm::dot(stretch, stretch) <= T(1e-8)) {
        return {posed_from_rest, {}, false};
    }
    const Affine<T> rigid_bone{rotation_keeping_y(posed_bone.linear, rest_bone.linear),
                               posed_bone.translation};
    const Affine<T> rest_from_model = inverse(rest_bone);
    return {rigid_bone * rest_from_model, rest_bone * (inverse(rigid_bone) * posed_bone) * rest_from_model,
            true};
}

}  // namespace sinew
