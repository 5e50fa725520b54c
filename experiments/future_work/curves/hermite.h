// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "sinew/interpolate/dual.h"

namespace sinew {

/// The interval between two `times` that contains a time, and the elapsed part of it, 0 to 1.
template <class T>
struct KeyInterval {
    std::size_t key = 0;
    std::size_t next = 0;  ///< same as `key` before the first time, after the last, and exactly at a time
    T part = T(0);
    T length = T(0);
};

/// times  [n] non-decreasing, finite; without any, both keys are 0. Keys of equal time are a cut, as in spline_span().
template <class T>
[[nodiscard]] KeyInterval<T> key_interval(std::span<const T> times, T time) noexcept {
    const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, time) - times.begin());
    if (next == 0) return {};
    if (next == times.size()) return {next - 1, next - 1};
    const T length = times[next] - times[next - 1];
    return {next - 1, next, (time - times[next - 1]) / length, length};
}

/// The cubic Hermite spline through points (Smith 2013, section 2.3.2), with arbitrary tangents.
///
/// points, tangents  [n]; tangents are per unit of time
/// times             [n], n >= 1, non-decreasing. The curve is constant before the first time and after the last
///
/// Without any, and where the numbers differ, the result is 0.
template <class T>
[[nodiscard]] Vec3<T> hermite(std::span<const Vec3<T>> points, std::span<const Vec3<T>> tangents,
                              std::span<const T> times, T time) noexcept {
    if (times.empty() || points.size() != times.size() || tangents.size() != times.size())
        return Vec3<T>(T(0));
    const KeyInterval<T> at = key_interval(times, time);
    if (at.key == at.next) return points[at.key];
    const T u = at.part;
    const T v = T(1) - u;
    const Vec3<T> leave = (u * v * v * at.length) * tangents[at.key];
    const Vec3<T> arrive = (u * u * v * at.length) * tangents[at.next];
    return (v * v * (T(1) + T(2) * u)) * points[at.key] + (u * u * (T(3) - T(2) * u)) * points[at.next] +
           leave - arrive;
}

/// The cubic Hermite spline through rigid transforms, rigid throughout: a Bezier curve whose chords are screws (Shoemake 1985, for
/// quaternions), with arbitrary velocities.
///
/// keys        [n] unit
/// velocities  [n] the twist per unit of time at each key, in the key's own axes: after a short time h the curve
///             is key * exp(h velocity)
/// times       [n], n >= 1, non-decreasing. The curve is constant before the first time and after the last
///
/// Not defined where Sclerp is not defined between two of its control poses, such as keys 180 degrees apart; without
/// any keys, and where the numbers differ (the identity).
template <class T>
[[nodiscard]] Blended<DualQuat<T>> hermite(std::span<const DualQuat<T>> keys,
                                           std::span<const Twist<T>> velocities, std::span<const T> times,
                                           T time) noexcept {
    if (times.empty() || keys.size() != times.size() || velocities.size() != times.size()) return {{}, false};
    const KeyInterval<T> at = key_interval(times, time);
    if (at.key == at.next) return {keys[at.key], has_unit_rotation(keys[at.key])};
    const T third = at.length / T(3);
    std::array<DualQuat<T>, 4> control{keys[at.key], keys[at.key] * to_dual_quat(third * velocities[at.key]),
                                       keys[at.next] * to_dual_quat(-third * velocities[at.next]),
                                       keys[at.next]};
    bool is_defined = true;
    // De Casteljau's algorithm.
    for (std::size_t left = 3; left > 0; --left) {
        for (std::size_t i = 0; i < left; ++i) {
            const Blended<DualQuat<T>> between = Sclerp::between(control[i], control[i + 1], at.part);
            is_defined = is_defined && between.is_defined;
            control[i] = between.transform;
        }
    }
    return finite_or<DualQuat<T>>({control[0], is_defined}, keys[at.part < T(0.5) ? at.key : at.next]);
}

}  // namespace sinew
