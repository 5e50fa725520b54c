// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"

namespace sinew {

/// Skinning with optimised centres of rotation (Le, Hodgins 2016): the blended quaternion rotates each vertex
/// about the vertex's own centre, which linear blending moves. methods/cor/centres_of_rotation.h computes the centres.
struct Cor : BlendsQuatVecs {
    static constexpr MethodInfo info{
        5,
        "cor",
        "Centres of Rotation",
        MethodGroup::volume,
        "Keeps the volume of twisted joints and bulges half as much as dual "
        "quaternions where they bend; large meshes are bound a second longer",
        "Le, Hodgins 2016",
        Needs::rest_bones | Needs::vertex_data | Needs::topology | Needs::precomputation,
        Signs::kParameters,
        3};
    static const Kernel& kernel() noexcept;

    /// centre      of rotation, x, y, z; if empty, the vertex itself, which gives linear blending of the rigid
    ///             motions
    /// parameters  empty, or the index in Signs::kChoices
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                               std::span<const T> centre = {},
                                               std::span<const double> parameters = {}) noexcept {
        const Vec3<T> about = centre.empty() ? rest : Vec3<T>(centre[0], centre[1], centre[2]);
        return rotated_about(about, bones, influences, rest, parameters);
    }
};

}  // namespace sinew
