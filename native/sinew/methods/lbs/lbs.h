// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// Linear blend skinning: the weighted mean of the vertex's images under each of its bones (Magnenat-Thalmann et
/// al. 1988; Smith 2013, section 2.3.1 with matrix linear blending).
struct Lbs {
    static constexpr MethodInfo info{
        1,
        "lbs",
        "Linear Blend",
        MethodGroup::blender,
        "Fast, smooth and what every engine plays; twisted and strongly bent joints lose volume",
        "Magnenat-Thalmann, Laperriere, Thalmann 1988",
        Needs::nothing};
    static const Kernel& kernel() noexcept;

    template <class T>
    using Bone = Affine<T>;

    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& /*rest_bone*/) noexcept {
        return posed_from_rest;
    }

    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences,
                                               const Vec3<T>& rest) noexcept {
        // Summing displacements instead of positions keeps the digits of a vertex far from the origin, and
        // returns the rest pose unchanged.
        Vec3<T> displacement{T(0)};
        for (const Influence<T>& influence : influences) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            displacement += influence.weight * (transform_point(bone, rest) - rest);
        }
        return rest + displacement;
    }
};

}  // namespace sinew
