// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/skinning/method_info.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// The painted mix of two methods: each vertex takes its own share of the second. With linear blending and dual
/// quaternions it is what riggers build in Blender from two Armature modifiers, the second with Preserve Volume,
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

    /// a, b    where the first and the second method put the vertex
    /// weight  0 to 1; at 0 and 1 exactly one of the two
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(const Vec3<T>& a, const Vec3<T>& b, T weight) noexcept {
        // Where both agree, as at rest, the result is that to the last bit.
        return weight < T(1) ? a + weight * (b - a) : b;
    }
};

}  // namespace sinew
