// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "sinew/interpolate/dual.h"
#include "sinew/transform/nearest_rotation.h"
#include "sinew/transform/rigid_distance.h"

namespace sinew {

/// The mean of poses, and whether it is the only one (see average() and robust_average()).
template <class T>
struct Averaged {
    DualQuat<T> transform;
    bool is_defined = true;
};

namespace detail {

/// Steps after which an average counts as not defined. Poses within 90 degrees take 5 to 20, with outliers 50.
inline constexpr int kAverageSteps = 300;

struct Poses {
    std::vector<DualQuat<double>> poses;
    std::vector<double> weights;  ///< of sum 1; none is 0
    double longest = 0.0;         ///< translation

    [[nodiscard]] std::size_t size() const noexcept { return poses.size(); }
};

/// The poses of weight above 0; none where the sum of weights is not above 0.
template <class T>
[[nodiscard]] Poses poses_of(std::span<const DualQuat<T>> poses, std::span<const T> weights) {
    Poses result;
    double largest = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        largest = std::max(largest, weights.empty() ? 1.0 : static_cast<double>(weights[i]));
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const double weight = weights.empty() ? 1.0 : static_cast<double>(weights[i]);
        if (!(weight > 0.0)) continue;
        result.poses.push_back(normalized(cast<double>(poses[i])));
        result.weights.push_back(weight / largest);
        sum += weight / largest;
        result.longest = std::max(result.longest, safe_length(translation(result.poses.back())));
    }
    for (double& weight : result.weights) weight /= sum;
    return result;
}

/// The mean of the rotations whose signs do not count: the eigenvector of the sum of q q^T (Markley et al. 2007);
/// and the mean of the translations. Not defined where two rotations are as good.
[[nodiscard]] inline Blended<DualQuat<double>> chordal_mean(const Poses& poses) noexcept {
    Mat4Rows<double> k{};
    Mat4Rows<double> vectors{};
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
    for (std::size_t i = 0; i < 4; ++i) vectors[i][i] = 1.0;
    jacobi(k, vectors);
    std::size_t best = 0;
    for (std::size_t i = 1; i < 4; ++i) {
        if (k[i][i] > k[best][best]) best = i;
    }
    double second = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (i != best) second = std::max(second, k[i][i]);
    }
    const Quat<double> rotation =
        glm::normalize(Quat<double>(vectors[0][best], vectors[1][best], vectors[2][best], vectors[3][best]));
    return {to_dual_quat(QuatVec<double>{rotation.w < 0.0 ? -rotation : rotation, translations}),
            k[best][best] - second > kDegenerateBlend};
}

struct Deviation {
    double angle = 0.0;
    double distance = 0.0;
};

[[nodiscard]] inline Deviation deviation(const DualQuat<double>& mean,
                                         const DualQuat<double>& pose) noexcept {
    const RigidDistance<double> apart = rigid_distance(mean, pose);
    return {apart.angle, apart.translation};
}

/// The weighted median, of those as good the least.
[[nodiscard]] inline double median(std::vector<std::pair<double, double>>& values_and_weights) noexcept {
    std::sort(values_and_weights.begin(), values_and_weights.end());
    double sum = 0.0;
    for (const auto& [value, weight] : values_and_weights) sum += weight;
    double before = 0.0;
    for (const auto& [value, weight] : values_and_weights) {
        before += weight;
        if (before >= 0.5 * sum) return value;
    }
    return 0.0;
}

/// The medians of the deviations from `mean`, not below rounding.
[[nodiscard]] inline Deviation spread(const Poses& poses, const DualQuat<double>& mean, double rounding) {
    std::vector<std::pair<double, double>> angles;
    std::vector<std::pair<double, double>> distances;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Deviation off = deviation(mean, poses.poses[i]);
        angles.emplace_back(off.angle, poses.weights[i]);
        distances.emplace_back(off.distance, poses.weights[i]);
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
        const Deviation medians = spread(poses, poses.poses[i], rounding);
        // Of two numbers without common unit, the product does not depend on either unit.
        const double size = medians.angle * std::max(medians.distance, std::numeric_limits<double>::min());
        if (size < least) {
            least = size;
            best = poses.poses[i];
        }
    }
    return best;
}

/// 1 in the middle, 0 from 3.5 medians on (Beaton and Tukey 1974).
[[nodiscard]] inline double biweight(double deviation, double median) noexcept {
    constexpr double kMedians = 3.5;
    const double part = median > 0.0 ? deviation / (kMedians * median) : deviation > 0.0 ? 1.0 : 0.0;
    return part < 1.0 ? (1.0 - part * part) * (1.0 - part * part) : 0.0;
}

}  // namespace detail

/// The weighted mean of n poses, whatever the signs of the quaternions and the order: where the weighted screws to
/// the poses cancel, as Dib (Kavan et al. 2008, algorithm 3; Pennec 1998), which neither origin nor unit of length
/// change; begun at the mean of rotation matrices (Markley et al. 2007).
///
/// poses    [n] unit
/// weights  [n] not negative; empty: 1 each
///
/// Not defined without weight above 0 (the identity), where several means are as good (as of rotations by 0, 120
/// and 240 degrees about one axis), a pose is 180 degrees from the result, or the iteration does not settle: it is
/// then one of them, finite. Computed in double. Throws std::bad_alloc.
template <class T>
[[nodiscard]] Averaged<T> average(std::span<const DualQuat<T>> poses, std::span<const T> weights = {}) {
    assert(weights.empty() || weights.size() == poses.size());
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

/// The same where up to almost half of the weight may be of poses that are far off: each counts by Tukey's biweight
/// of its angle and of its distance from the result, 0 from 3.5 times their medians on; begun at the pose in the
/// midst of most.
///
/// poses, weights  as of average()
/// kept            [n] how much each counts, 0 to 1, beside its weight; 0 of an outlier
///
/// Distances are those of the origin's images: as for all that weighs rotations against places, the origin should
/// lie within what moves. Not defined without weight above 0 (the identity), where the poses that count have no more
/// than half of the weight or are not all within 90 degrees of the result, so that other means may be as good, or where
/// the iteration does not settle. Throws std::bad_alloc.
template <class T>
[[nodiscard]] Averaged<T> robust_average(std::span<const DualQuat<T>> poses, std::span<const T> weights,
                                         std::span<T> kept) {
    assert(kept.size() == poses.size());
    std::fill(kept.begin(), kept.end(), T(0));
    const detail::Poses known = detail::poses_of(poses, weights);
    if (known.size() == 0) return {{}, false};
    const double rounding = 16.0 * std::numeric_limits<T>::epsilon();
    DualQuat<double> mean = detail::medoid(known, rounding);
    detail::Deviation medians;
    std::vector<double> parts(known.size());
    bool has_settled = false;
    for (int step = 0; step < detail::kAverageSteps && !has_settled; ++step) {
        // With medians that go on changing the weights could go back and forth for ever.
        if (step < 20) medians = detail::spread(known, mean, rounding);
        Twist<double> correction;
        double sum = 0.0;
        for (std::size_t i = 0; i < known.size(); ++i) {
            const detail::Deviation off = detail::deviation(mean, known.poses[i]);
            parts[i] =
                detail::biweight(off.angle, medians.angle) * detail::biweight(off.distance, medians.distance);
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
    for (std::size_t i = 0, next = 0; i < poses.size(); ++i) {
        if (!weights.empty() && !(weights[i] > T(0))) continue;
        kept[i] = static_cast<T>(parts[next]);
        if (parts[next] > 0.0) {
            counted += known.weights[next];
            is_within_90 = is_within_90 && detail::deviation(mean, known.poses[next]).angle < kQuarterTurn;
        }
        ++next;
    }
    return {cast<T>(mean), has_settled && is_within_90 && counted > 0.5 + 1e-9};
}

}  // namespace sinew
