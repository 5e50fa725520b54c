// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"

namespace sinew {

/// Quaternion-vector blending: rotations by normalised sum, translations by weighted mean (Smith 2013, section
/// 3.6, "direct quaternion blending"; Hejl 2004). The blend rotates about the origin of the space in which it is
/// computed, so the result depends on where that origin is.
struct Qv : BlendsQuatVecs {
    static constexpr MethodInfo info{
        2,
        "qv",
        "Quaternion-Vector",
        MethodGroup::report,
        "Keeps twisted limbs round near the armature's origin; joints far from it drift off their bones",
        "Hejl 2004",
        Needs::rest_bones};
    static const Kernel& kernel() noexcept;

    /// If the rotations cancel, the heaviest influence's is used.
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences,
                                               const Vec3<T>& rest) noexcept {
        Quat<T> rotation(T(0), Vec3<T>(T(0)));
        Vec3<T> translation{T(0)};
        for (const Influence<T>& influence : influences) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            // q and -q are the same rotation but blend differently: keep each term in the hemisphere of the sum
            // so far.
            const T sign = glm::dot(bone.rigid.rotation, rotation) < T(0) ? T(-1) : T(1);
            rotation = rotation + (sign * influence.weight) * bone.rigid.rotation;
            Vec3<T> offset = bone.rigid.translation;
            if (bone.has_scale) {
                offset += rotate(bone.rigid.rotation, bone.scale_displacement(rest));
            }
            translation += influence.weight * offset;
        }
        const T length = glm::length(rotation);
        if (length < T(kDegenerateBlend)) {
            rotation = bones[static_cast<std::size_t>(heaviest(influences).bone)].rigid.rotation;
        } else {
            rotation = rotation * (T(1) / length);
        }
        return rotate(rotation, rest) + translation;
    }
};

}  // namespace sinew
