// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "sinew/transform/convert.h"

namespace sinew {

/// A rotation about a line and a translation along it. Every rigid transform is one (Chasles 1830).
///
/// axis         unit direction of the line
/// moment       point x axis, for any point on the line
/// angle        radians, right-handed
/// translation  along the axis
template <class T>
struct Screw {
    Vec3<T> axis{T(0), T(0), T(1)};
    Vec3<T> moment{T(0)};
    T angle = T(0);
    T translation = T(0);

    /// Translation per radian; infinite for a pure translation, 0 for the identity.
    [[nodiscard]] T pitch() const noexcept {
        if (angle != T(0)) return translation / angle;
        if (translation == T(0)) return T(0);
        const T infinity = std::numeric_limits<T>::infinity();
        return translation < T(0) ? -infinity : infinity;
    }
};

/// The screw about the line through `point` along `axis`. The axis may have any length except 0.
template <class T>
[[nodiscard]] Screw<T> screw_about(const Vec3<T>& axis, const Vec3<T>& point, T angle,
                                   T translation) noexcept {
    const Vec3<T> direction = unit(axis, Vec3<T>(T(0), T(0), T(1)));
    return {direction, glm::cross(point, direction), angle, translation};
}

/// The unit dual quaternion of `screw` (Daniilidis 1999, eq. 13; Kavan et al. 2008, section 3.3).
///
/// Axis and moment are Pluecker coordinates: both are divided by the length of the axis, and a component of the
/// moment along the axis is ignored. An axis of length 0 gives the identity.
template <class T>
[[nodiscard]] DualQuat<T> to_dual_quat(const Screw<T>& screw) noexcept {
    using std::cos;
    using std::sin;
    const T length = safe_length(screw.axis);
    if (!(length > T(0))) return {};
    const Vec3<T> axis = unit(screw.axis, screw.axis);
    Vec3<T> moment = screw.moment / length;
    moment -= axis * glm::dot(axis, moment);
    const T half = screw.angle * T(0.5);
    const T along = screw.translation * T(0.5);
    const Vec3<T> axial = sin(half) * axis;
    const Vec3<T> dual = sin(half) * moment + (along * cos(half)) * axis;
    return {Quat<T>(cos(half), axial), Quat<T>(-along * sin(half), dual)};
}

/// The screw of the unit dual quaternion `a`, with an angle of 0 to pi (Kavan et al. 2008, section 3.3).
///
/// A rotation within rounding of the identity counts as none: then the axis is the direction of the translation,
/// the moment is 0 and the translation >= 0; for the identity the axis is z. At 180 degrees the signs of `a`
/// decide between the two directions of the axis. For small rotations the moment grows as 1 / angle.
template <class T>
[[nodiscard]] Screw<T> to_screw(const DualQuat<T>& a) noexcept {
    using std::atan2;
    const DualQuat<T> near = a.real.w < T(0) ? -a : a;
    const Vec3<T> v = vector_part(near.real);
    const T sine = safe_length(v);
    if (sine <= std::numeric_limits<T>::epsilon()) {
        const Vec3<T> path = translation(near);
        return {unit(path, Vec3<T>(T(0), T(0), T(1))), Vec3<T>(T(0)), T(0), safe_length(path)};
    }
    const Vec3<T> axis = v / sine;
    const T along = glm::dot(axis, translation(near));
    // From the dual part: sin(angle/2) moment + (along/2) cos(angle/2) axis.
    Vec3<T> moment = vector_part(near.dual);
    // Twice: the difference of long vectors is perpendicular to the axis only within their rounding.
    for (int pass = 0; pass < 2; ++pass) moment -= axis * glm::dot(axis, moment);
    return {axis, moment / sine, T(2) * atan2(sine, near.real.w), along};
}

template <template <class> class Transform, class T>
[[nodiscard]] Screw<T> to_screw(const Transform<T>& a) noexcept {
    return to_screw(to_dual_quat(a));
}

}  // namespace sinew
