// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/convert.h"

namespace sinew {

/// The distance of two rigid transforms: two numbers, as radians and lengths have no common unit.
template <class T>
struct RigidDistance {
    T angle = T(0);
    T translation = T(0);
};

/// The angle of the rotation from `a` to `b`, 0 to pi, and the distance between the images of the origin. Both
/// are the same for x a and x b, for any rigid x; the angle is also the same for a x and b x.
///
/// Requires rotations of unit length. The signs of quaternions do not matter.
template <class T>
[[nodiscard]] RigidDistance<T> rigid_distance(const QuatVec<T>& a, const QuatVec<T>& b) noexcept {
    return {angle_between(a.rotation, b.rotation), safe_length(b.translation - a.translation)};
}

template <template <class> class Transform, class T>
[[nodiscard]] RigidDistance<T> rigid_distance(const Transform<T>& a, const Transform<T>& b) noexcept {
    return rigid_distance(to_quat_vec(a), to_quat_vec(b));
}

}  // namespace sinew
