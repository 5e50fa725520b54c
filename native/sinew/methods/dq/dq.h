// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/signs.h"
#include "sinew/transform/scaled_rigid.h"

namespace sinew {

/// Dual quaternion skinning by DLB (Kavan, Collins, Zara, O'Sullivan 2008, algorithm 1; Smith 2013,
/// section 3.6), with the choice of signs and the scale rule of Blender's Preserve Volume.
struct Dq {
    static constexpr MethodInfo info{
        3,
        "dq",
        "Dual Quaternion",
        MethodGroup::blender,
        "Keeps the volume of twisted joints anywhere on the body; strong bends bulge outwards",
        "Kavan, Collins, Zara, O'Sullivan 2008",
        Needs::rest_bones,
        Signs::kParameters};
    static const Kernel& kernel() noexcept;

    template <class T>
    using Bone = ScaledRigid<DualQuat<T>, T>;

    /// rest_bone  orthonormal; only read where the motion has scale
    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& rest_bone) noexcept {
        const auto bone = scaled_rigid_of_blender(posed_from_rest, rest_bone);
        return {to_dual_quat(bone.rigid), bone.scale, bone.has_scale};
    }

    /// The order of influences decides the sign of a term that is perpendicular to the sum of the terms before it.
    ///
    /// parameters  empty, or the index in Signs::kChoices
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                               std::span<const double> parameters = {}) noexcept {
        const bool are_kept = Signs::are_kept(parameters);
        DualQuat<T> sum{Quat<T>(T(0), Vec3<T>(T(0))), Quat<T>(T(0), Vec3<T>(T(0)))};
        for (const Influence<T>& influence : influences) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            const T sign = !are_kept && glm::dot(bone.rigid.real, sum.real) < T(0) ? T(-1) : T(1);
            const T weight = sign * influence.weight;
            sum.real = sum.real + weight * bone.rigid.real;
            sum.dual = sum.dual + weight * dual_at(bone, rest);
        }
        T squared_norm = glm::dot(sum.real, sum.real);
        if (squared_norm < T(kDegenerateBlend * kDegenerateBlend)) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(heaviest(influences).bone)];
            sum = {bone.rigid.real, dual_at(bone, rest)};
            squared_norm = T(1);
        }
        // Both products below have two factors of the sum, so dividing once by the squared norm normalises them
        // without a square root. dot(real, dual) != 0 is harmless: the image of a point does not depend on it.
        const Vec3<T> axis = vector_part(sum.real);
        const Vec3<T> rotated = glm::cross(axis, glm::cross(axis, rest) + sum.real.w * rest);
        const Vec3<T> translation = vector_part(sum.dual * glm::conjugate(sum.real));
        return rest + (T(2) / squared_norm) * (rotated + translation);
    }

private:
    /// The dual part of the rigid motion that maps `rest` to where the bone, with its scale, maps it.
    template <class T>
    [[nodiscard]] static Quat<T> dual_at(const Bone<T>& bone, const Vec3<T>& rest) noexcept {
        if (!bone.has_scale) return bone.rigid.dual;
        return bone.rigid.dual + T(0.5) * (bone.rigid.real * pure(bone.scale_displacement(rest)));
    }
};

}  // namespace sinew
