// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <string_view>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"

namespace sinew {

/// Spherical deform (SDEF) of MikuMikuDance: rotates a vertex of two bones by their blended rotation about C, a
/// point that the modeller gave the vertex. The bones move C, together with two more points, R0 and R1. Every
/// other vertex is blended linearly.
///
/// Scaled bones follow the rule of all rigid methods (ScaledRigid); MikuMikuDance has no scale.
struct Sdef : BlendsQuatVecs {
    static constexpr std::string_view kInterpolations[] = {"nlerp", "slerp"};
    static constexpr Parameter kParameters[] = {
        {.id = "interpolation",
         .label = "Interpolation",
         .description =
             "How two rotations are blended: by the normalised sum of quaternions, as mmd_tools does, or "
             "at even speed, as MikuMikuDance's other players do",
         .unit = "",
         .kind = ParameterKind::choice,
         .choices = kInterpolations}};
    static constexpr MethodInfo info{
        8,
        "sdef",
        "Spherical Deform",
        MethodGroup::mmd,
        "The shape that MikuMikuDance gives its models; vertices without such data "
        "are blended linearly",
        "MikuMikuDance; as mmd_tools computes it",
        Needs::rest_bones | Needs::vertex_data,
        kParameters,
        10};
    static const Kernel& kernel() noexcept;

    /// spheres     C, R0, R1 (x, y, z each), then a flag: 0 means the vertex is blended linearly; if empty, it is
    ///             as well. R0 belongs to the first influence of positive weight, R1 to the second; a vertex that
    ///             does not have exactly two is blended linearly
    /// parameters  empty, or the index in kInterpolations
    ///
    /// Two rotations that are 180 degrees apart are blended with the signs that their quaternions have, so the
    /// vertex may rotate either way.
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                               std::span<const T> spheres = {},
                                               std::span<const double> parameters = {}) noexcept {
        const auto bone_of = [&](const Influence<T>& influence) -> const Bone<T>& {
            return bones[static_cast<std::size_t>(influence.bone)];
        };
        // The influence's term: the displacement of `point` by the bone's rigid motion, and that of `rest` by its
        // scale.
        const auto moved_by = [&](const Influence<T>& influence, const Vec3<T>& point) {
            const Bone<T>& bone = bone_of(influence);
            const Quat<T>& q = bone.rigid.rotation;
            Vec3<T> moved = rotation_displacement(q, point) + bone.rigid.translation;
            if (bone.has_scale) moved += rotate(q, bone.scale_displacement(rest));
            return influence.weight * moved;
        };
        std::array<Influence<T>, 2> pair{};
        std::size_t count = 0;
        for (const Influence<T>& influence : influences) {
            if (influence.weight > T(0) && count++ < 2) pair[count - 1] = influence;
        }
        if (count != 2 || spheres.empty() || spheres[9] == T(0)) {
            Vec3<T> displacement{T(0)};
            for (const Influence<T>& influence : influences) displacement += moved_by(influence, rest);
            return rest + displacement;
        }
        const Vec3<T> centre(spheres[0], spheres[1], spheres[2]);
        const Vec3<T> ends[] = {{spheres[3], spheres[4], spheres[5]}, {spheres[6], spheres[7], spheres[8]}};
        const Vec3<T> mean = pair[0].weight * ends[0] + pair[1].weight * ends[1];
        const auto midpoint = [&](std::size_t k) { return centre + T(0.5) * (ends[k] - mean); };
        const Quat<T> rotation = blended(bone_of(pair[0]).rigid.rotation, bone_of(pair[1]).rigid.rotation,
                                         pair[1].weight, !parameters.empty() && parameters[0] == 1.0);
        return rest + rotation_displacement(rotation, rest - centre) + moved_by(pair[0], midpoint(0)) +
               moved_by(pair[1], midpoint(1));
    }

private:
    template <class T>
    static Quat<T> blended(const Quat<T>& a, Quat<T> b, T weight, bool by_slerp) noexcept {
        if (glm::dot(a, b) < T(0)) b = -b;
        return by_slerp ? glm::slerp(a, b, weight) : glm::normalize(a * (T(1) - weight) + b * weight);
    }
};

}  // namespace sinew
