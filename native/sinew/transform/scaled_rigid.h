// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/convert.h"
#include "sinew/transform/split_scale.h"

namespace sinew {

/// A bone's motion as the rigid methods need it: a scale about the bone's head, then `rigid`.
///
/// Scale rule of all rigid methods: each bone's term of the blend is the rigid motion that maps this vertex
/// exactly to where that bone alone, scale included, would map it (Blender's rule since 4.0).
template <class Rigid, class T>
struct ScaledRigid {
    Rigid rigid;
    Affine<T> scale;
    bool has_scale = false;

    /// The displacement of `rest` by the scale, before the rigid motion.
    [[nodiscard]] Vec3<T> scale_displacement(const Vec3<T>& rest) const noexcept {
        return transform_point(scale, rest) - rest;
    }
};

/// A bone's motion, split exactly as Blender's Preserve Volume splits it.
///
/// rest_bone  orthonormal; only read where the motion has scale
///
/// The rest axes of Blender's bones near -Y deviate from orthonormal by up to 4e-5, and so does the rigid part of
/// split_scale(). Blender extracts a quaternion from it, but measures the scale against the part itself. So the
/// two together miss the motion by as much.
template <class T>
[[nodiscard]] ScaledRigid<QuatVec<T>, T> scaled_rigid_of_blender(const Affine<T>& posed_from_rest,
                                                                 const Affine<T>& rest_bone) noexcept {
    const ScaleSplit<T> split = split_scale(posed_from_rest, rest_bone);
    QuatVec<T> rigid = to_quat_vec(split.rigid);
    if (split.has_scale) {
        const Mat3<T>& axes = split.rigid.linear;
        rigid.rotation = quat_of_columns(
            Mat3<T>(glm::normalize(axes[0]), glm::normalize(axes[1]), glm::normalize(axes[2])));
    }
    return {rigid, split.scale, split.has_scale};
}

/// scaled_rigid_of_blender() with the scale measured against the quaternion: the two together are the motion.
template <class T>
[[nodiscard]] ScaledRigid<QuatVec<T>, T> scaled_rigid(const Affine<T>& posed_from_rest,
                                                      const Affine<T>& rest_bone) noexcept {
    ScaledRigid<QuatVec<T>, T> bone = scaled_rigid_of_blender(posed_from_rest, rest_bone);
    if (bone.has_scale) bone.scale = to_affine(inverse(bone.rigid)) * posed_from_rest;
    return bone;
}

/// The same motion in another scalar type.
template <class To, template <class> class Rigid, class From>
[[nodiscard]] ScaledRigid<Rigid<To>, To> cast(const ScaledRigid<Rigid<From>, From>& bone) noexcept {
    return {cast<To>(bone.rigid), cast<To>(bone.scale), bone.has_scale};
}

}  // namespace sinew
