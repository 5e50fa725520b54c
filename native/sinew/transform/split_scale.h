// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

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
/// square to it. A mirror in `linear` is not in the rotation; a zero column gives some square axis.
template <class T>
[[nodiscard]] Mat3<T> rotation_keeping_y(const Mat3<T>& linear) noexcept {
    const auto unit = [](const Vec3<T>& v, const Vec3<T>& otherwise) {
        const T length = glm::length(v);
        return length > T(0) ? v / length : otherwise;
    };
    const Vec3<T> y = unit(linear[1], Vec3<T>(0, 1, 0));
    Vec3<T> x = linear[0];
    Vec3<T> z = linear[2];
    // The odd tests against 1 with x and z not normalised are Blender's: under extreme shear and scale
    // they pick another axis, and so must we.
    if (glm::dot(y, x) < T(1)) {
        z = unit(glm::cross(x, y), Vec3<T>(0, 0, 1));
        x = glm::cross(y, z);
    } else if (glm::dot(y, z) < T(1)) {
        x = unit(glm::cross(y, z), Vec3<T>(1, 0, 0));
        z = glm::cross(x, y);
    } else {
        x = unit(glm::cross(y, Vec3<T>(y.y, y.z, y.x)), Vec3<T>(1, 0, 0));
        z = glm::cross(x, y);
    }
    return Mat3<T>(x, y, z);
}

/// Splits a bone's motion into a rigid motion and a scale about the bone's head along its rest axes.
///
/// posed_from_rest  model or armature space
/// rest_bone        the bone's rest axes (Y along the bone) and head in the same space, orthonormal
///
/// A motion within 1e-5 of orthonormal, unmirrored and within 1e-4 of unit size counts as rigid.
/// A zero axis keeps the rest axis. Source: the rule that Blender's Armature modifier has for
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
