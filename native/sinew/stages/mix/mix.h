// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/methods/method_info.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// The painted mix of two methods: a weight at each vertex blends from the first to the second. With linear
/// blending and dual quaternions it equals two Armature modifiers in Blender, the second with Preserve Volume,
/// Multi Modifier and the vertex group.
struct Mix {
    static constexpr Parameter kParameters[] = {
        {"method", "Second Method", "The method that the weights mix in", "", ParameterKind::method},
        {"group", "Vertex Group", "The share of the second method: 0 none of it, 1 all of it", "factor",
         ParameterKind::vertex_group},
    };
    static constexpr StageInfo info{
        "mix", "Mix",
        "A vertex group says where another method takes over, as at a twisted wrist or a bent elbow",
        "Kavan, Zara 2005 (as a mix of linear and spherical blending)", kParameters};

    /// a, b    the vertex deformed by the first and by the second method
    /// weight  0 to 1; 0 and 1 give exactly a and b
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(const Vec3<T>& a, const Vec3<T>& b, T weight) noexcept {
        // In this form the result equals a and b where they are equal, such as at rest.
        return weight < T(1) ? a + weight * (b - a) : b;
    }
};

}  // namespace sinew
