// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sinew/transform/convert.h"
#include "sinew/transform/screw.h"
#include "sinew/transform/twist.h"

namespace sinew {

// Functions for all three representations: from_translation<DualQuat>(v). The identity is each type's default
// value, such as DualQuat<double>{}.

/// Converts `source`, a representation, a Screw or a Twist, to the named representation: to<DualQuat>(affine).
template <template <class> class Target, template <class> class Source, class T>
[[nodiscard]] Target<T> to(const Source<T>& source) noexcept {
    if constexpr (requires { source.moment; }) {
        return to<Target>(to_dual_quat(source));
    } else if constexpr (requires { source.angular; }) {
        return to<Target>(to_quat_vec(source));
    } else if constexpr (requires(Target<T> target) { target.linear; }) {
        return to_affine(source);
    } else if constexpr (requires(Target<T> target) { target.rotation; }) {
        return to_quat_vec(source);
    } else {
        return to_dual_quat(source);
    }
}

/// The rotation by `angle` radians about `axis` through the origin. The axis may have any length; length 0 gives
/// the identity.
template <template <class> class Target, class T>
[[nodiscard]] Target<T> from_axis_angle(const Vec3<T>& axis, T angle) noexcept {
    return to<Target>(QuatVec<T>{quat_from_axis_angle(axis, angle), Vec3<T>(T(0))});
}

/// The given rotation. Requires orthonormal columns and determinant +1 to within rounding.
template <template <class> class Target, class T>
[[nodiscard]] Target<T> from_rotation_matrix(const Mat3<T>& rotation) noexcept {
    return to<Target>(Affine<T>{rotation, Vec3<T>(T(0))});
}

template <template <class> class Target, class T>
[[nodiscard]] Target<T> from_translation(const Vec3<T>& translation) noexcept {
    return to<Target>(QuatVec<T>{Quat<T>(T(1), Vec3<T>(T(0))), translation});
}

}  // namespace sinew
