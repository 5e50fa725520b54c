// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"
#include "sinew/transform/twist.h"

namespace sinew {

/// Log-matrix skinning: the exponential of the weighted sum of the logarithms of the bones' motions (Alexa 2002;
/// Cordier, Magnenat-Thalmann 2005).
///
/// Each logarithm takes the shorter way from the rest pose, at most 180 degrees. Where a bone passes 180 degrees
/// from rest, the axis of its logarithm changes sign, and vertices that it shares with other bones jump. Vertices
/// of one bone never jump. Rotations are measured from the rest pose, so rotating the whole character by its
/// bones changes the shape where bones meet.
struct Log : BlendsQuatVecs {
    static constexpr MethodInfo info{4,
                                     "log",
                                     "Log-Matrix",
                                     MethodGroup::report,
                                     "Spreads a twist evenly along limbs near their rest pose; flips where a "
                                     "bone passes 180 degrees from rest",
                                     "Alexa 2002; Cordier, Magnenat-Thalmann 2005",
                                     Needs::rest_bones};
    static const Kernel& kernel() noexcept;

    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences,
                                               const Vec3<T>& rest) noexcept {
        Twist<T> sum;
        for (const Influence<T>& influence : influences) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            QuatVec<T> motion = bone.rigid;
            if (bone.has_scale) {
                motion.translation += rotate(motion.rotation, bone.scale_displacement(rest));
            }
            sum = sum + influence.weight * to_twist(motion);
        }
        return transform_point(to_quat_vec(sum), rest);
    }
};

}  // namespace sinew
