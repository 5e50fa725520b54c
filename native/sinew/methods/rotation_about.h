// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/signs.h"
#include "sinew/transform/scaled_rigid.h"

namespace sinew {

/// The bones of methods that blend quaternions, with the scale of each apart.
struct BlendsQuatVecs {
    template <class T>
    using Bone = ScaledRigid<QuatVec<T>, T>;

    /// rest_bone  orthonormal; only read where the motion has scale
    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& rest_bone) noexcept {
        return scaled_rigid(posed_from_rest, rest_bone);
    }
};

/// The displacement of `v` under the rotation by the unit quaternion `q`.
template <class T>
[[nodiscard]] Vec3<T> rotation_displacement(const Quat<T>& q, const Vec3<T>& v) noexcept {
    const Vec3<T> axis = vector_part(q);
    return T(2) * glm::cross(axis, glm::cross(axis, v) + q.w * v);
}

/// Rotates `rest` by the blended quaternion about `centre`, which is moved by linear blending of the rigid
/// motions. The displacements by the bones' scales are rotated by each bone and added.
///
/// parameters  empty, or the index in Signs::kChoices
///
/// Other arguments and degenerate results as described in methods.h.
template <class T, class Bone>
[[nodiscard]] Vec3<T> rotated_about(const Vec3<T>& centre, std::span<const Bone> bones,
                                    std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                    std::span<const double> parameters) noexcept {
    const bool are_kept = Signs::are_kept(parameters);
    Quat<T> rotation(T(0), Vec3<T>(T(0)));
    // Summing displacements returns the rest pose unchanged.
    Vec3<T> displacement{T(0)};
    for (const Influence<T>& influence : influences) {
        const Bone& bone = bones[static_cast<std::size_t>(influence.bone)];
        const Quat<T>& q = bone.rigid.rotation;
        const T sign = !are_kept && glm::dot(q, rotation) < T(0) ? T(-1) : T(1);
        rotation = rotation + (sign * influence.weight) * q;
        Vec3<T> moved = rotation_displacement(q, centre) + bone.rigid.translation;
        if (bone.has_scale) moved += rotate(q, bone.scale_displacement(rest));
        displacement += influence.weight * moved;
    }
    const T length = glm::length(rotation);
    if (length < T(kDegenerateBlend)) {
        const Bone& bone = bones[static_cast<std::size_t>(heaviest(influences).bone)];
        return transform_point(bone.rigid, bone.has_scale ? rest + bone.scale_displacement(rest) : rest);
    }
    return rest + rotation_displacement(rotation * (T(1) / length), rest - centre) + displacement;
}

}  // namespace sinew
