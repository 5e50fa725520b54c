// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sinew/transform/rotation.h"

namespace sinew {

/// How a bone may rotate about one of its own axes, x, y (along the bone) or z, as in Blender's pose bones.
///
/// min, max   radians, -pi <= min <= 0 <= max <= pi; only read if is_limited
/// stiffness  0 to below 1: how much less the bone rotates about this axis than about others
struct AxisLimit {
    bool is_locked = false;
    bool is_limited = false;
    double min = -std::numbers::pi;
    double max = std::numbers::pi;
    double stiffness = 0.0;
};

/// The limits of the three axes x, y, z.
using BoneLimits = std::array<AxisLimit, 3>;

/// Decomposes a rotation into a twist about y followed by a swing without twist. Returns (x, y, z) in radians: y
/// is the angle of the twist, -pi to pi; x and z are twice the arcsines of the x and z of the swing's quaternion,
/// so that for a swing about x alone x is its angle.
///
/// Blender's IK limits bound these three ranges. For a swing by 180 degrees the twist is not unique, and is 0.
/// `q` has unit length; its sign does not matter.
[[nodiscard]] inline Vec3<double> swing_twist_angles(const Quat<double>& q) noexcept {
    const double length = std::hypot(q.w, q.y);
    const double cosine = length > 0.0 ? q.w / length : 1.0;
    const double sine = length > 0.0 ? q.y / length : 0.0;
    const double x = std::clamp(q.x * cosine + q.z * sine, -1.0, 1.0);
    const double z = std::clamp(q.z * cosine - q.x * sine, -1.0, 1.0);
    double twist = 2.0 * std::atan2(sine, cosine);
    if (twist > std::numbers::pi) twist -= 2.0 * std::numbers::pi;
    if (twist <= -std::numbers::pi) twist += 2.0 * std::numbers::pi;
    return {2.0 * std::asin(x), twist, 2.0 * std::asin(z)};
}

}  // namespace sinew
