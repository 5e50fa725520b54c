// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>

#include "sinew/fit/singular_values.h"
#include "sinew/interpolate/blended.h"
#include "sinew/transform/rigid_distance.h"

namespace sinew {

/// What hand_eye() gives.
///
/// transform   x
/// error       roots of the weighted means of the squared angles (radians) and distances between a x and x b
/// is_defined  false where the motions do not decide x to within rounding of T: fewer than two, rotations about
///             parallel axes alone, half turns alone, or no weight above 0. It is then one of many, finite
template <class T>
struct HandEye {
    DualQuat<T> transform;
    RigidDistance<T> error;
    bool is_defined = true;
};

namespace detail {

/// The triangular factor of a matrix of 8 columns whose rows come one after the other (Givens 1958).
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

/// The six equations of a x = x b for x = (x0, x1, .., x7), where the scalar parts of a and b agree, times `factor`
/// (Daniilidis 1999, eq. 31).
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

/// The unit dual quaternion in the space of the last two columns of `s.v` (Daniilidis 1999, eqs. 34 to 36).
[[nodiscard]] inline DualQuat<double> unit_in_null_space(const SingularValues<8>& s) noexcept {
    const auto part = [&](std::size_t column, std::size_t first) {
        const auto& v = s.v[column];
        return Quat<double>(v[first], v[first + 1], v[first + 2], v[first + 3]);
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
    // One of the roots is a translation alone, whose real part is 0.
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

/// The singular values of the equations. The sign of b is that by `known`, which nearly fits; without it, that which
/// makes both scalar parts positive, with the less weight the nearer to 0 they are.
template <class T>
[[nodiscard]] SingularValues<8> hand_eye_values(std::span<const DualQuat<T>> a,
                                                std::span<const DualQuat<T>> b, std::span<const T> weights,
                                                double largest_weight, double length,
                                                const DualQuat<double>* known) noexcept {
    Triangle rows;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = weights.empty() ? 1.0 : static_cast<double>(weights[i]);
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

/// `x` with the translation that fits its rotation best: (R_a - 1) t = R_x t_b - t_a by least squares (Park, Martin
/// 1994). Along what the rotations leave open it stays.
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
        const double weight = (weights.empty() ? 1.0 : static_cast<double>(weights[i])) / largest_weight;
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
        // Symmetric: its left and right vectors are one.
        const Vec3<double> v(s.v[i][0], s.v[i][1], s.v[i][2]);
        if (s.values[i] > 1e-12 * s.values[0]) correction += (glm::dot(v, residual) / s.values[i]) * v;
    }
    return to_dual_quat(QuatVec<double>{x.real, start + correction});
}

}  // namespace detail

/// x of a x = x b, for n motions a of one body and b of another that is fixed to it: where the one is, seen from the
/// other, as of a camera on a robot's hand or a marker on a bone (Daniilidis 1999, by dual quaternions: rotation and
/// translation at once).
///
/// a, b     [n] unit, in one unit of length; of each pair angle and pitch are alike but for noise, and a[i] is
///          where the first body goes, seen from where it was
/// weights  [n] not negative; empty: 1 each
///
/// Lengths are divided by the longest translation of a and b first, so that their unit does not matter. Of half
/// turns, whose signs are free, others decide the sign. Where motions are noisy the translation that comes with the
/// rotation is not the best for it, and is solved for again (Park, Martin 1994). Computed in double; nothing is
/// allocated.
template <class T>
[[nodiscard]] HandEye<T> hand_eye(std::span<const DualQuat<T>> a, std::span<const DualQuat<T>> b,
                                  std::span<const T> weights = {}) noexcept {
    assert(a.size() == b.size());
    double length = 0.0;
    double largest_weight = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = weights.empty() ? 1.0 : static_cast<double>(weights[i]);
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

    // Where scalar parts are but rounding, the first equations, of which they are factors, decide nothing.
    const double rounding = 32.0 * std::numeric_limits<T>::epsilon() * s.values[0];
    HandEye<T> result{cast<T>(x), {}, std::min(first.values[5], s.values[5]) > rounding};
    double angles = 0.0;
    double distances = 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double weight = weights.empty() ? 1.0 : static_cast<double>(weights[i]);
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
