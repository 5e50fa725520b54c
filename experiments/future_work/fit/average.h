// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "future_work/fit/rigid.h"
#include "sinew/interpolate/dual.h"
#include "sinew/transform/rigid_distance.h"

namespace sinew {

/// The mean of poses, and whether it is unique (see average() and robust_average()).
template <class T>
struct Averaged {
    DualQuat<T> transform;
    bool is_defined = true;
};

namespace detail {

/// Number of iterations after which an average counts as not defined. Poses within 90 degrees take 5 to 20, with
/// outliers 50.
inline constexpr int kAverageSteps = 300;

struct Poses {
    std::vector<DualQuat<double>> poses;
    std::vector<double> weights;       ///< with sum 1; all positive before they are rounded
    std::vector<std::size_t> numbers;  ///< where each is among those given
    double longest = 0.0;              ///< the longest translation

    [[nodiscard]] std::size_t size() const noexcept { return poses.size(); }
};

/// The poses whose share of the largest weight is positive; none if there are none.
template <class T>
[[nodiscard]] Poses poses_of(std::span<const DualQuat<T>> poses, std::span<const T> weights) {
    Poses result;
    double largest = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) largest = std::max(largest, weight_at(weights, i));
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const double share = weight_at(weights, i) / largest;
        if (!(share > 0.0)) continue;
        result.poses.push_back(normalized(cast<double>(poses[i])));
        result.weights.push_back(share);
        result.numbers.push_back(i);
        sum += share;
        result.longest = std::max(result.longest, safe_length(translation(result.poses.back())));
    }
    for (double& weight : result.weights) weight /= sum;
    return result;
}

/// The mean of the rotations, independent of their signs: the eigenvector of the sum of q q^T (Markley et al.
/// 2007); and the mean of the translations. Not defined if two rotations are equally good.
[[nodiscard]] inline Blended<DualQuat<double>> chordal_mean(const Poses& poses) noexcept {
    Mat4Rows<double> k{};
    Vec3<double> translations(0.0);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Quat<double>& q = poses.poses[i].real;
        const std::array<double, 4> v{q.w, q.x, q.y, q.z};
        for (std::size_t row = 0; row < 4; ++row) {
            for (std::size_t column = 0; column < 4; ++column) {
                k[row][column] += poses.weights[i] * v[row] * v[column];
            }
        }
        translations += poses.weights[i] * translation(poses.poses[i]);
    }
    const NearestRotation<double> found = largest_eigenvector(k);
    return {to_dual_quat(QuatVec<double>{found.rotation, translations}), found.gap > kDegenerateBlend};
}

/// The weighted median; if several values are, the smallest.
[[nodiscard]] inline double median(std::vector<std::pair<double, double>>& values_and_weights) noexcept {
    std::ranges::sort(values_and_weights);
    double sum = 0.0;
    for (const auto& [value, weight] : values_and_weights) sum += weight;
    double before = 0.0;
    for (const auto& [value, weight] : values_and_weights) {
        before += weight;
        if (before >= 0.5 * sum) return value;
    }
    return 0.0;
}

/// The medians of the deviations from `mean`, but at least rounding errors.
[[nodiscard]] inline RigidDistance<double> spread(const Poses& poses, const DualQuat<double>& mean,
                                                  double rounding) {
    std::vector<std::pair<double, double>> angles;
    std::vector<std::pair<double, double>> distances;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const RigidDistance<double> off = rigid_distance(mean, poses.poses[i]);
        angles.emplace_back(off.angle, poses.weights[i]);
        distances.emplace_back(off.translation, poses.weights[i]);
    }
    return {std::max(median(angles), rounding), std::max(median(distances), rounding * poses.longest)};
}

/// The pose with the smallest product of the median deviations of all poses from it. Tries at most 64 candidates,
/// evenly spaced. If more than half of the poses are near each other, they are near the result.
[[nodiscard]] inline DualQuat<double> medoid(const Poses& poses, double rounding) {
    const std::size_t step = (poses.size() + 63) / 64;
    DualQuat<double> best = poses.poses.front();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < poses.size(); i += step) {
        const RigidDistance<double> medians = spread(poses, poses.poses[i], rounding);
        // The two deviations have no common unit; their product does not depend on either unit.
        const double size = medians.angle * std::max(medians.translation, std::numeric_limits<double>::min());
        if (size < least) {
            least = size;
            best = poses.poses[i];
        }
    }
    return best;
}

/// Tukey's biweight: 1 in the middle, 0 from 3.5 medians on (Beaton and Tukey 1974).
[[nodiscard]] inline double biweight(double deviation, double median) noexcept {
    constexpr double kMedians = 3.5;
    const double part = median > 0.0 ? deviation / (kMedians * median) : deviation > 0.0 ? 1.0 : 0.0;
    return part < 1.0 ? (1.0 - part * part) * (1.0 - part * part) : 0.0;
}

}  // namespace detail

/// The weighted mean of n poses, independent of the signs of the quaternions and of the order: the pose relative
/// to which the weighted screws to all poses sum to 0, as in Dib (Kavan et al. 2008, algorithm 3; Pennec 1998).
/// It does not depend on the origin or on the unit of length. The iteration starts at the mean of the rotation
/// matrices (Markley et al. 2007).
///
/// poses    [n] unit
/// weights  [n] not negative; empty: 1 each
///
/// Not defined if no weight is positive or the numbers differ (the identity), if several means are equally good (such as for rotations
/// by 0, 120 and 240 degrees about one axis), if a pose is 180 degrees from the result, or if the iteration does
/// not converge; the result is then one of the candidates, finite. Computed in double. Throws std::bad_alloc.
template <class T>
[[nodiscard]] Averaged<T> average(std::span<const DualQuat<T>> poses, std::span<const T> weights = {}) {
    if (!detail::are_paired(poses.size(), poses, weights)) return {{}, false};
    const detail::Poses known = detail::poses_of(poses, weights);
    if (known.size() == 0) return {{}, false};
    const Blended<DualQuat<double>> start = detail::chordal_mean(known);
    DualQuat<double> mean = start.transform;
    for (int step = 0; step < detail::kAverageSteps; ++step) {
        Twist<double> correction;
        bool is_half_turn = false;
        for (std::size_t i = 0; i < known.size(); ++i) {
            is_half_turn = is_half_turn || is_half_turn_apart(mean, known.poses[i]);
            correction = correction + known.weights[i] * to_twist(inverse(mean) * known.poses[i]);
        }
        mean = normalized(mean * to_dual_quat(correction));
        if (!is_finite(mean)) return {{}, false};
        if (safe_length(correction.angular) <= 1e-14 &&
            safe_length(correction.linear) <= 1e-14 * known.longest) {
            return {cast<T>(mean), start.is_defined && !is_half_turn};
        }
    }
    return {cast<T>(mean), false};
}

/// The same for poses of which almost half, by weight, may be outliers: each is weighted by Tukey's biweight of
/// its angle and of its distance from the result, which is 0 from 3.5 times their medians on. The iteration
/// starts at the pose nearest to most others.
///
/// poses, weights  as for average()
/// kept            [n] how much each counts besides its weight, 0 to 1; 0 for an outlier
///
/// Distances are those between images of the origin. As in everything that compares rotations with positions, the
/// origin should be within what moves. Not defined if no weight is positive or the numbers differ (the identity), if
/// the poses that count do not have more than half of the weight or are not all within 90 degrees of the result, so
/// that other means may be equally good, or if the iteration does not converge. Throws std::bad_alloc.
template <class T>
[[nodiscard]] Averaged<T> robust_average(std::span<const DualQuat<T>> poses, std::span<const T> weights,
                                         std::span<T> kept) {
    if (!detail::are_paired(poses.size(), kept, weights)) return {{}, false};
    std::fill(kept.begin(), kept.end(), T(0));
    const detail::Poses known = detail::poses_of(poses, weights);
    if (known.size() == 0) return {{}, false};
    const double rounding = 16.0 * std::numeric_limits<T>::epsilon();
    DualQuat<double> mean = detail::medoid(known, rounding);
    RigidDistance<double> medians;
    std::vector<double> parts(known.size());
    bool has_settled = false;
    for (int step = 0; step < detail::kAverageSteps && !has_settled; ++step) {
        // If the medians kept changing, the weights could oscillate forever.
        if (step < 20) medians = detail::spread(known, mean, rounding);
        Twist<double> correction;
        double sum = 0.0;
        for (std::size_t i = 0; i < known.size(); ++i) {
            const RigidDistance<double> off = rigid_distance(mean, known.poses[i]);
            parts[i] = detail::biweight(off.angle, medians.angle) *
                       detail::biweight(off.translation, medians.translation);
            if (parts[i] == 0.0) continue;
            sum += known.weights[i] * parts[i];
            correction =
                correction + (known.weights[i] * parts[i]) * to_twist(inverse(mean) * known.poses[i]);
        }
        if (!(sum > 0.0)) break;
        correction = (1.0 / sum) * correction;
        mean = normalized(mean * to_dual_quat(correction));
        if (!is_finite(mean)) return {{}, false};
        has_settled = step > 20 && safe_length(correction.angular) <= 1e-13 &&
                      safe_length(correction.linear) <= 1e-13 * known.longest;
    }
    constexpr double kQuarterTurn = 1.5707963267948966;
    double counted = 0.0;
    bool is_within_90 = true;
    for (std::size_t i = 0; i < known.size(); ++i) {
        kept[known.numbers[i]] = static_cast<T>(parts[i]);
        if (!(parts[i] > 0.0)) continue;
        counted += known.weights[i];
        is_within_90 = is_within_90 && rigid_distance(mean, known.poses[i]).angle < kQuarterTurn;
    }
    return {cast<T>(mean), has_settled && is_within_90 && counted > 0.5 + 1e-9};
}

}  // namespace sinew
