// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "sinew/interpolate/blended.h"

namespace sinew {

/// The position of a time in a Catmull-Rom spline: four keys (at an end, one of them twice) and their weights,
/// which have sum 1 and may be negative.
template <class T>
struct SplineSpan {
    std::array<std::size_t, 4> keys{};
    std::array<T, 4> weights{T(0), T(1), T(0), T(0)};
};

/// The keys and weights at `time` (Catmull and Rom 1974; Smith 2013, section 2.3.2, with the tangents scaled to
/// the interval as its text says; in its algorithm 3 the terms printed as 2t^3 0 3t^2 + 1 and t^3 + t^2 are 2t^3
/// - 3t^2 + 1 and t^3 - t^2).
///
/// times  [n] non-decreasing, finite. Without any, all keys are 0
///
/// The tangents at the first and the last key have the direction of the straight line to the next one. The curve
/// is constant before the first time and after the last. Keys of equal time are a cut: the curve ends at the
/// first of them and starts again at the last, which is the value at that time.
template <class T>
[[nodiscard]] SplineSpan<T> spline_span(std::span<const T> times, T time) noexcept {
    const std::size_t last = times.size() - 1;
    const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, time) - times.begin());
    if (next == 0) return {{0, 0, 0, 0}};
    if (next > last) return {{last, last, last, last}};
    const std::size_t key = next - 1;
    const std::size_t before = key > 0 && times[key - 1] < times[key] ? key - 1 : key;
    const std::size_t beyond = next < last && times[next] < times[next + 1] ? next + 1 : next;

    const T length = times[next] - times[key];
    const T u = (time - times[key]) / length;
    const T u2 = u * u;
    const T u3 = u2 * u;
    const T leave = (u3 - T(2) * u2 + u) * (length / (times[next] - times[before]));
    const T arrive = (u3 - u2) * (length / (times[beyond] - times[key]));
    const T onto = T(3) * u2 - T(2) * u3;
    return {{before, key, next, beyond}, {-leave, T(1) - onto - arrive, onto + leave, arrive}};
}

/// The four keys of a span with signs chosen along the chain, from the second key outwards, so that adjacent keys
/// are in one hemisphere: each step of the curve takes the shorter way, and no sign changes within it. Defined if
/// no step of weight other than 0 is 180 degrees.
template <class Transform, class T>
[[nodiscard]] Blended<std::array<Transform, 4>> along_chain(const SplineSpan<T>& span,
                                                            const std::array<Transform, 4>& keys) noexcept {
    const Transform& key = keys[1];
    const Transform next = aligned(keys[2], key);
    Blended<std::array<Transform, 4>> chain{{aligned(keys[0], key), key, next, aligned(keys[3], next)}};
    const auto& w = span.weights;
    const bool is_tie = (w[0] != T(0) && is_half_turn_apart(keys[0], key)) ||
                        ((w[2] != T(0) || w[3] != T(0)) && is_half_turn_apart(key, next)) ||
                        (w[3] != T(0) && is_half_turn_apart(next, keys[3]));
    chain.is_defined = !is_tie;
    return chain;
}

/// Vector form: the weighted sum of the components. It passes through the keys and is rigid only there;
/// normalized() makes it rigid (Smith 2013, algorithm 3). The sign is that of the second key.
///
/// Not defined if adjacent keys are 180 degrees apart (quaternions): the signs as given then decide.
template <class Transform, class T>
[[nodiscard]] Blended<Transform> spline_vector(const SplineSpan<T>& span,
                                               const std::array<Transform, 4>& keys) noexcept {
    const auto chain = along_chain(span, keys);
    const std::span<const Transform> terms(chain.transform);
    const std::span<const T> weights(span.weights);
    const Blended<Transform> sum = weighted_sum<BlendSigns::kAsGiven>(terms, weights, {1, T(1), T(1), true});
    return finite_or<Transform>({sum.transform, chain.is_defined}, keys[1]);
}

/// Blend form: the blend of the keys by Method, with the weights of the spline. Rigid for every method except
/// MatrixLinear (Smith 2013, section 3.2.2).
///
/// Not defined where spline_vector() is not, or where the blend is not: if keys are more than about 100 degrees
/// apart, the negative weights may keep the iterations of QvSlerp and Sclerp from converging.
template <class Method, class Transform, class T>
[[nodiscard]] Blended<Transform> spline_blend(const SplineSpan<T>& span,
                                              const std::array<Transform, 4>& keys) noexcept {
    const auto chain = along_chain(span, keys);
    Blended<Transform> result =
        Method::template blend<BlendSigns::kAsGiven, T>(chain.transform, span.weights);
    if (!chain.is_defined) result.is_defined = false;
    return result;
}

/// The four elements of `keys` that `span` refers to.
template <class Transform, class T>
[[nodiscard]] std::array<Transform, 4> keys_of(const SplineSpan<T>& span,
                                               std::span<const Transform> keys) noexcept {
    return {keys[span.keys[0]], keys[span.keys[1]], keys[span.keys[2]], keys[span.keys[3]]};
}

/// The Catmull-Rom spline through `keys` at `time`, in blend form.
///
/// keys   [n] in a representation of Method
/// times  [n], n >= 1, non-decreasing. Without any, and for another number of keys, the result is not defined: the
///        identity
template <class Method, class T>
[[nodiscard]] Blended<typename Method::template Transform<T>> catmull_rom(
    std::span<const typename Method::template Transform<T>> keys, std::span<const T> times, T time) noexcept {
    if (keys.empty() || keys.size() != times.size()) return {{}, false};
    const SplineSpan<T> span = spline_span(times, time);
    return spline_blend<Method>(span, keys_of(span, keys));
}

/// catmull_rom() in vector form. Not rigid between keys. Transform may be Vec3, for points, whose identity is 0.
template <class Transform, class T>
[[nodiscard]] Blended<Transform> catmull_rom_vector(std::span<const Transform> keys, std::span<const T> times,
                                                    T time) noexcept {
    if (keys.empty() || keys.size() != times.size()) return {Transform{}, false};
    const SplineSpan<T> span = spline_span(times, time);
    return spline_vector(span, keys_of(span, keys));
}

}  // namespace sinew
