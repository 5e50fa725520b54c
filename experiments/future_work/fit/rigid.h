// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "sinew/transform/convert.h"
#include "sinew/transform/nearest_rotation.h"

namespace sinew {

/// Points and directions of a source, and the points and directions of a target that a rigid transform should map
/// them to.
///
/// source, target                        [n] points, finite
/// weights                               [n] of points, not negative; empty: 1 each
/// source_directions, target_directions  [m] of any length, which is ignored; a pair in which either has length 0
///                                       does not count
/// direction_weights                     [m] not negative; empty: 1 each. A direction counts as a point at
///                                       distance 1 from the middle, so its weight is in squares of lengths
template <class T>
struct Pairs {
    std::span<const Vec3<T>> source{};
    std::span<const Vec3<T>> target{};
    std::span<const T> weights{};
    std::span<const Vec3<T>> source_directions{};
    std::span<const Vec3<T>> target_directions{};
    std::span<const T> direction_weights{};
};

/// The result of fit_rigid().
///
/// transform    target_from_source: minimises the weighted sum of squared distances
/// error        the root of the weighted mean of the remaining squared distances, of points and directions
/// is_defined   false if other rotations are equally good to within rounding of T: points on one line or all in
///              one position, a mirror image with a symmetry, no positive weight. The transform is then one of
///              the best, finite; without positive weights, and where the numbers of Pairs differ, the identity
/// is_mirrored  a mirror image would fit better, by more than rounding
template <class T>
struct RigidFit {
    QuatVec<T> transform;
    T error = T(0);
    bool is_defined = true;
    bool is_mirrored = false;
};

namespace detail {

/// Sums over pairs, in double. Coordinates are relative to the two middles and divided by `scale`; weights are
/// divided by the largest.
struct PairMoments {
    Vec3<double> source_middle{0.0};
    Vec3<double> target_middle{0.0};
    double scale = 1.0;
    double weight = 0.0;            ///< of all points
    double direction_weight = 0.0;  ///< of all directions that count
    Mat3<double> covariance{0.0};   ///< the weighted sum of target source^T
    double size = 0.0;              ///< upper bound of the singular values of `covariance`
    /// contribution of the input's rounding errors to a direction without extent
    double noise = 0.0;
    double largest_weight = 1.0;
};

/// Whether there is one of `others` for each of `count`, and a weight, if there are any.
template <class Others, class Weights>
[[nodiscard]] bool are_paired(std::size_t count, const Others& others, const Weights& weights) noexcept {
    return others.size() == count && (weights.empty() || weights.size() == count);
}

template <class T>
[[nodiscard]] double weight_at(std::span<const T> weights, std::size_t i) noexcept {
    return weights.empty() ? 1.0 : static_cast<double>(weights[i]);
}

inline double largest_component(const Vec3<double>& v) noexcept {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// Calls f(source, target, weight) for each pair of points with positive weight.
template <class T, class F>
void for_points(const Pairs<T>& pairs, F f) noexcept {
    for (std::size_t i = 0; i < pairs.source.size(); ++i) {
        const double weight = weight_at(pairs.weights, i);
        if (weight > 0.0) f(Vec3<double>(pairs.source[i]), Vec3<double>(pairs.target[i]), weight);
    }
}

/// Calls f(source, target, weight) for each pair of directions that counts, normalised.
template <class T, class F>
void for_directions(const Pairs<T>& pairs, F f) noexcept {
    const Vec3<double> none(0.0);
    for (std::size_t i = 0; i < pairs.source_directions.size(); ++i) {
        const double weight = weight_at(pairs.direction_weights, i);
        const Vec3<double> source = unit(Vec3<double>(pairs.source_directions[i]), none);
        const Vec3<double> target = unit(Vec3<double>(pairs.target_directions[i]), none);
        if (weight > 0.0 && source != none && target != none) f(source, target, weight);
    }
}

template <class T>
[[nodiscard]] PairMoments moments_of(const Pairs<T>& pairs) noexcept {
    PairMoments m;
    double largest = 0.0;
    const auto note_weight = [&](const auto&, const auto&, double weight) {
        largest = std::max(largest, weight);
    };
    for_points(pairs, note_weight);
    for_directions(pairs, note_weight);
    if (!(largest > 0.0)) return m;
    m.largest_weight = largest;

    for_points(pairs, [&](const auto&, const auto&, double weight) { m.weight += weight / largest; });
    double reach = 0.0;
    for_points(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        const double share = weight / largest / m.weight;
        m.source_middle += share * source;
        m.target_middle += share * target;
        reach = std::max({reach, largest_component(source), largest_component(target)});
    });
    double extent = 0.0;
    for_points(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double) {
        extent = std::max({extent, largest_component(source - m.source_middle),
                           largest_component(target - m.target_middle)});
    });
    bool has_directions = false;
    for_directions(pairs, [&](const auto&, const auto&, double) { has_directions = true; });
    if (has_directions) extent = std::max(extent, 1.0);
    if (extent > 0.0) m.scale = extent;

    double source_square = 0.0;
    double target_square = 0.0;
    const auto add = [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        m.covariance += weight * glm::outerProduct(target, source);
        source_square += weight * glm::dot(source, source);
        target_square += weight * glm::dot(target, target);
    };
    for_points(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        add((source - m.source_middle) / m.scale, (target - m.target_middle) / m.scale, weight / largest);
    });
    for_directions(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        m.direction_weight += weight / largest;
        add(source, target, weight / largest / m.scale / m.scale);
    });
    m.size = std::sqrt(source_square) * std::sqrt(target_square);
    // Coordinates are precise to half a unit in their last digit; a factor of eight leaves room for earlier
    // errors.
    const double rounding = 8.0 * std::numeric_limits<T>::epsilon();
    m.noise = m.weight * std::pow(rounding * reach / m.scale, 2) +
              m.direction_weight * std::pow(rounding / m.scale, 2);
    return m;
}

/// The fit with this transform. `gap` is the sum of the two smaller singular values of the covariance, the last of
/// them negative if the covariance mirrors.
template <class T>
[[nodiscard]] RigidFit<T> judged(const Pairs<T>& pairs, const PairMoments& m, const QuatVec<double>& fit,
                                 double gap) noexcept {
    double square = 0.0;
    for_points(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        const Vec3<double> off = (transform_point(fit, source) - target) / m.scale;
        square += weight / m.largest_weight * glm::dot(off, off);
    });
    for_directions(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
        const Vec3<double> off = (rotate(fit.rotation, source) - target) / m.scale;
        square += weight / m.largest_weight * glm::dot(off, off);
    });
    const double weight = m.weight + m.direction_weight;
    if (!(weight > 0.0) || (m.weight == 0.0 && !pairs.source.empty())) return {{}, T(0), false, false};
    RigidFit<T> result{cast<T>(fit), static_cast<T>(m.scale * std::sqrt(square / weight))};
    if (!std::isfinite(glm::dot(glm::abs(result.transform.translation), Vec3<T>(T(1) / T(4)))) ||
        !std::isfinite(result.error)) {
        return {{}, T(0), false, false};
    }

    // The smallest singular value with its sign, from its sum and its product with the second.
    const Mat3<double> aligned = glm::transpose(to_mat3(fit.rotation)) * m.covariance;
    const double first = aligned[0][0] + aligned[1][1] + aligned[2][2] - gap;
    double product = first > 0.0 ? glm::determinant(m.covariance) / first : 0.0;
    // For points on a line the determinant is only a rounding error, which the root below would make large.
    const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * std::pow(m.size, 3);
    if (product < 0.0) product = std::min(product + rounding / first, 0.0);
    const double root = std::sqrt(std::max(gap * gap - 4.0 * product, 0.0));
    const double last = gap + root > 0.0 ? 2.0 * product / (gap + root) : 0.0;
    const double first_order = 8.0 * std::numeric_limits<T>::epsilon() * m.size;
    const double second_order = 64.0 * std::numeric_limits<double>::epsilon() * m.size + m.noise;
    result.is_mirrored = last < -first_order - m.noise;
    // If it mirrors, the gap is a difference, and rounding counts in full; otherwise it is a sum of squared
    // extents.
    result.is_defined = gap > second_order + (last < -second_order ? first_order : 0.0);
    return result;
}

}  // namespace detail

/// The rigid transform from a source to a target: the rotation as an eigenvector of a symmetric 4x4 matrix, the
/// translation between the middles (Horn 1987). Sums are in double, with coordinates relative to the middle of the
/// points; nothing is allocated.
template <class T>
[[nodiscard]] RigidFit<T> fit_rigid(const Pairs<T>& pairs) noexcept {
    if (!detail::are_paired(pairs.source.size(), pairs.target, pairs.weights) ||
        !detail::are_paired(pairs.source_directions.size(), pairs.target_directions,
                            pairs.direction_weights)) {
        return {{}, T(0), false, false};
    }
    const detail::PairMoments m = detail::moments_of(pairs);
    const NearestRotation<double> nearest = nearest_rotation(m.covariance);
    const Vec3<double> translation = m.target_middle - rotate(nearest.rotation, m.source_middle);
    return detail::judged(pairs, m, {nearest.rotation, translation}, 0.5 * nearest.gap);
}

}  // namespace sinew
