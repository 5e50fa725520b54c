// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/interpolate/spline.h"
#include "sinew/skeleton/skeleton.h"

namespace sinew {

// Keyframes store each bone relative to its parent, and are interpolated in that form; root_relative() follows.
// If root-relative transforms were interpolated, bones would rotate about wrong centres and separate from their
// parents (Smith 2013, figure 3.3).

/// Interpolates the skeleton between two keyframes (Smith 2013, algorithm 2), each bone with Method::between().
///
/// from, onto        [bones] parent_from_bone at t = 0 and at t = 1, in a representation of Method
/// parent_from_bone  [bones] the result; may be the same memory as either
///
/// Returns whether all bones' results are defined. For others the result is as described at Method. Returns false, and
/// writes nothing, if a size is wrong.
template <class Method, class T>
bool interpolate_keyframes(const Skeleton& skeleton,
                           std::span<const typename Method::template Transform<T>> from,
                           std::span<const typename Method::template Transform<T>> onto, T t,
                           std::span<typename Method::template Transform<T>> parent_from_bone) noexcept {
    const std::size_t bones = skeleton.bone_count();
    if (from.size() != bones || onto.size() != bones || parent_from_bone.size() != bones) return false;
    bool are_defined = true;
    for (std::size_t bone = 0; bone < bones; ++bone) {
        const auto between = Method::between(from[bone], onto[bone], t);
        parent_from_bone[bone] = between.transform;
        are_defined = are_defined && between.is_defined;
    }
    return are_defined;
}

namespace detail {

template <class Transform, class T, class Combine>
bool spline_bones(const Skeleton& skeleton, std::span<const Transform> keyframes, std::span<const T> times,
                  T time, std::span<Transform> parent_from_bone, Combine combine) noexcept {
    const std::size_t bones = skeleton.bone_count();
    if (times.empty() || keyframes.size() != bones * times.size() || parent_from_bone.size() != bones)
        return false;
    const SplineSpan<T> span = spline_span(times, time);
    bool are_defined = true;
    for (std::size_t bone = 0; bone < bones; ++bone) {
        const auto key = [&](std::size_t i) { return keyframes[span.keys[i] * bones + bone]; };
        const Blended<Transform> value = combine(span, std::array{key(0), key(1), key(2), key(3)});
        parent_from_bone[bone] = value.transform;
        are_defined = are_defined && value.is_defined;
    }
    return are_defined;
}

}  // namespace detail

/// The skeleton on a Catmull-Rom spline through keyframes (Smith 2013, algorithm 3), in blend form:
/// spline_blend() for each bone.
///
/// keyframes         [keys * bones] parent_from_bone, key after key, in a representation of Method
/// times             [keys], keys >= 1, non-decreasing
/// parent_from_bone  [bones] the result
///
/// Returns whether all bones' results are defined. Returns false, and writes nothing, if a size is wrong.
template <class Method, class T>
bool spline_keyframes(const Skeleton& skeleton,
                      std::span<const typename Method::template Transform<T>> keyframes,
                      std::span<const T> times, T time,
                      std::span<typename Method::template Transform<T>> parent_from_bone) noexcept {
    using Transform = typename Method::template Transform<T>;
    return detail::spline_bones<Transform, T>(
        skeleton, keyframes, times, time, parent_from_bone,
        [](const auto& span, const auto& keys) { return spline_blend<Method>(span, keys); });
}

/// spline_keyframes() in vector form, as algorithm 3 is printed. Not rigid between keys.
template <class Transform, class T>
bool spline_keyframes_vector(const Skeleton& skeleton, std::span<const Transform> keyframes,
                             std::span<const T> times, T time,
                             std::span<Transform> parent_from_bone) noexcept {
    return detail::spline_bones<Transform, T>(
        skeleton, keyframes, times, time, parent_from_bone,
        [](const auto& span, const auto& keys) { return spline_vector(span, keys); });
}

}  // namespace sinew
