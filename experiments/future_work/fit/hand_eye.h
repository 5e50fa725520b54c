// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>

#include "future_work/fit/rigid.h"
#include "future_work/fit/singular_values.h"
#include "sinew/interpolate/blended.h"
#include "sinew/transform/rigid_distance.h"

namespace sinew {

/// The result of hand_eye().
///
/// transform   x
/// error       roots of the weighted means of the squared angles (radians) and distances between a x and x b
/// is_defined  false if the motions do not determine x to within rounding of T: fewer than two motions, rotations
///             only about parallel axes, only rotations by 180 degrees, no positive weight, or different numbers
///             of motions. The transform is then one of many, finite
template <class T>
struct HandEye {
    DualQuat<T> transform;
    RigidDistance<T> error;
    bool is_defined = true;
};

namespace detail {

/// The triangular factor of a matrix of 8 columns, to which rows are added one after the other (Givens 1958).
class Triangle {
public:
    void add(std::array<double, 8> row) noexcept {
        for (std::size_t k = 0; k < 8; ++k) {
            if (row[k] == 0.0) continue;
            const double length = std::hypot(columns_[k][k], row[k]);
            const double cosine = columns_[k][k] / length;
            const double sine = row[k] / length;
            for (std::size_t j = k; j < 8; ++j) {
                const double above = columns_[j][k];
                columns_[j][k] = cosine * above + sine * row[j];
                row[j] = cosine * row[j] - sine * above;
            }
        }
    }

    [[nodiscard]] const Columns<8>& columns() const noexcept { return columns_; }

private:
    Columns<8> columns_{};
};

/// Adds the six equations of a x = x b for x = (x0, x1, .., x7), multiplied by `factor`. The scalar parts of a
/// and b must be equal (Daniilidis 1999, eq. 31).
inline void add_equations(Triangle& rows, const DualQuat<double>& a, const DualQuat<double>& b,
                          double factor) noexcept {
    const auto block = [factor](const Quat<double>& p, const Quat<double>& q) {
        const Vec3<double> d = factor * (vector_part(p) - vector_part(q));
        const Vec3<double> c = factor * (vector_part(p) + vector_part(q));
        return std::array<std::array<double, 4>, 3>{
            {{d.x, 0.0, -c.z, c.y}, {d.y, c.z, 0.0, -c.x}, {d.z, -c.y, c.x, 0.0}}};
    };
    const auto real = block(a.real, b.real);
    const auto dual = block(a.dual, b.dual);
    for (std::size_t i = 0; i < 3; ++i) {
        rows.add({real[i][0], real[i][1], real[i][2], real[i][3], 0.0, 0.0, 0.0, 0.0});
        rows.add(
            {dual[i][0], dual[i][1], dual[i][2], dual[i][3], real[i][0], real[i][1], real[i][2], real[i][3]});
    }
}

/// The unit dual quaternion in the span of the last two columns of `s.v` (Daniilidis 1999, eqs. 34 to 36).
[[nodiscard]] inline DualQuat<double> unit_in_null_space(const SingularValues<8>& s) noexcept {
    const auto part = [&](std::size_t column, std::size_t first) {
        const auto& v = s.v[column];
        return Quat<double>(v[first], {v[first + 1], v[first + 2], v[first + 3]});
    };
    const Quat<double> u1 = part(6, 0);
    const Quat<double> w1 = part(6, 4);
    const Quat<double> u2 = part(7, 0);
    const Quat<double> w2 = part(7, 4);
    // l1^2 a + l1 l2 b + l2^2 c = 0: dot(real, dual) of l1 v1 + l2 v2.
    const double a = glm::dot(u1, w1);
    const double b = glm::dot(u1, w2) + glm::dot(u2, w1);
    const double c = glm::dot(u2, w2);
    const double root = std::sqrt(std::max(b * b - 4.0 * a * c, 0.0));
    const double q = -0.5 * (b + (b < 0.0 ? -root : root));
    const auto combined = [&](double l1, double l2) {
        const double length = std::hypot(l1, l2);
        const double scale = length > 0.0 ? 1.0 / length : 0.0;
        return DualQuat<double>{(scale * l1) * u1 + (scale * l2) * u2, (scale * l1) * w1 + (scale * l2) * w2};
    };
    // One of the roots is a pure translation, with a real part of 0.
    const DualQuat<double> first = combined(q, a);
    const DualQuat<double> second = combined(c, q);
    const bool takes_first = glm::dot(first.real, first.real) >= glm::dot(second.real, second.real);
    const DualQuat<double> best = normalized(takes_first ? first : second);
    return best.real.w < 0.0 ? -best : best;
}

template <class T>
[[nodiscard]] DualQuat<double> with_lengths_divided(const DualQuat<T>& a, double length) noexcept {
    const DualQuat<double> exact = normalized(cast<double>(a));
    return {exact.real, exact.dual / length};
}

/// The singular values of the equations. With `known`, an approximate solution, the sign of each b is chosen to
/// fit it. Without it, signs make both scalar parts positive, and equations have less weight the nearer these are
/// to 0.
template <class T>
[[nodiscard]] SingularValues<8> hand_eye_values(std::span<const DualQuat<T>> a,
                                                std::span<const DualQuat<T>> b, std::span<const T> weights,
                                                double largest_weight, double length,
                                                const DualQuat<double>* known) noexcept {
    Triangle rows;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = weight_at(weights, i);
        if (!(weight > 0.0)) continue;
        DualQuat<double> from = with_lengths_divided(a[i], length);
        DualQuat<double> onto = with_lengths_divided(b[i], length);
        double factor = std::sqrt(weight / largest_weight);
        if (known != nullptr) {
            if (glm::dot((from * *known).real, (*known * onto).real) < 0.0) onto = -onto;
        } else {
            factor *= std::abs(from.real.w);
            if (from.real.w < 0.0) from = -from;
            if (onto.real.w < 0.0) onto = -onto;
        }
        add_equations(rows, from, onto, factor);
    }
    return singular_values<8>(rows.columns());
}

/// `x` with the translation that best fits its rotation: the least squares solution of (R_a - 1) t = R_x t_b -
/// t_a (Park, Martin 1994). In directions that the rotations do not determine it is not changed.
template <class T>
[[nodiscard]] DualQuat<double> with_best_translation(const DualQuat<double>& x,
                                                     std::span<const DualQuat<T>> a,
                                                     std::span<const DualQuat<T>> b,
                                                     std::span<const T> weights, double largest_weight,
                                                     double length) noexcept {
    const Vec3<double> start = translation(x);
    Mat3<double> normal(0.0);
    Vec3<double> residual(0.0);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = weight_at(weights, i) / largest_weight;
        if (!(weight > 0.0)) continue;
        const DualQuat<double> from = with_lengths_divided(a[i], length);
        const DualQuat<double> onto = with_lengths_divided(b[i], length);
        const Mat3<double> rows = to_mat3(from.real) - Mat3<double>(1.0);
        const Vec3<double> wanted = rotate(x.real, translation(onto)) - translation(from);
        normal += weight * (glm::transpose(rows) * rows);
        residual += weight * (glm::transpose(rows) * (wanted - rows * start));
    }
    Columns<3> columns{};
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3<double>& column = normal[static_cast<int>(i)];
        columns[i] = {column.x, column.y, column.z};
    }
    const SingularValues<3> s = singular_values<3>(columns);
    Vec3<double> correction(0.0);
    for (std::size_t i = 0; i < 3; ++i) {
        // Symmetric: left and right singular vectors are the same.
        const Vec3<double> v(s.v[i][0], s.v[i][1], s.v[i][2]);
        if (s.values[i] > 1e-12 * s.values[0]) correction += (glm::dot(v, residual) / s.values[i]) * v;
    }
    return to_dual_quat(QuatVec<double>{x.real, start + correction});
}

}  // namespace detail

/// Solves a x = x b for x, given n motions a of one body and n motions b of another body that is fixed to it: x
/// is the pose of the second body relative to the first, such as of a camera on a robot's hand, or of a marker on
/// a bone (Daniilidis 1999, with dual quaternions: rotation and translation at once).
///
/// a, b     [n] unit, in one unit of length; a[i] takes the first body from its old pose to its new one, seen
///          from the old one. The angle and pitch of a[i] and b[i] are equal up to noise
/// weights  [n] not negative; empty: 1 each
///
/// Lengths are first divided by the longest translation in a and b, so their unit does not matter. Rotations by
/// 180 degrees have free signs, which the other motions decide. If motions are noisy, the translation that
/// results along with the rotation is not the best one for it, so it is solved for again (Park, Martin 1994).
/// Computed in double; does not allocate.
template <class T>
[[nodiscard]] HandEye<T> hand_eye(std::span<const DualQuat<T>> a, std::span<const DualQuat<T>> b,
                                  std::span<const T> weights = {}) noexcept {
    if (!detail::are_paired(a.size(), b, weights)) return {{}, {}, false};
    double length = 0.0;
    double largest_weight = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = detail::weight_at(weights, i);
        if (!(weight > 0.0)) continue;
        largest_weight = std::max(largest_weight, weight);
        length = std::max({length, safe_length(translation(normalized(cast<double>(a[i])))),
                           safe_length(translation(normalized(cast<double>(b[i]))))});
    }
    if (!(largest_weight > 0.0)) return {{}, {}, false};
    if (!(length > 0.0) || !std::isfinite(length)) length = 1.0;

    const SingularValues<8> first = detail::hand_eye_values(a, b, weights, largest_weight, length, nullptr);
    const DualQuat<double> rough = detail::unit_in_null_space(first);
    const SingularValues<8> s = detail::hand_eye_values(a, b, weights, largest_weight, length, &rough);
    DualQuat<double> x =
        detail::with_best_translation(detail::unit_in_null_space(s), a, b, weights, largest_weight, length);
    x.dual *= length;

    // The first equations have the scalar parts as factors: if all of these are rounding errors, they determine
    // nothing.
    const double rounding = 32.0 * std::numeric_limits<T>::epsilon() * s.values[0];
    HandEye<T> result{cast<T>(x), {}, std::min(first.values[5], s.values[5]) > rounding};
    double angles = 0.0;
    double distances = 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = detail::weight_at(weights, i);
        if (!(weight > 0.0)) continue;
        const double share = weight / largest_weight;
        const RigidDistance<double> off =
            rigid_distance(normalized(cast<double>(a[i])) * x, x * normalized(cast<double>(b[i])));
        angles += share * off.angle * off.angle;
        distances += share * std::pow(off.translation / length, 2);
        sum += share;
    }
    result.error = {static_cast<T>(std::sqrt(angles / sum)),
                    static_cast<T>(length * std::sqrt(distances / sum))};
    if (!is_finite(result.transform) || !std::isfinite(result.error.translation)) return {{}, {}, false};
    return result;
}

}  // namespace sinew
