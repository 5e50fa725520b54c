// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace sinew {

/// A square matrix by columns: columns[column][row].
template <std::size_t N>
using Columns = std::array<std::array<double, N>, N>;

/// The decomposition a = u diag(values) v^T. `scaled` has the columns of u times their values; v is a rotation
/// with determinant 1.
template <std::size_t N>
struct SingularValues {
    Columns<N> scaled{};
    Columns<N> v{};
    std::array<double, N> values{};  ///< non-increasing, >= 0
};

namespace detail {

template <std::size_t N>
[[nodiscard]] double dot(const std::array<double, N>& a, const std::array<double, N>& b) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < N; ++i) sum += a[i] * b[i];
    return sum;
}

template <std::size_t N>
void rotate_columns(Columns<N>& columns, std::size_t p, std::size_t q, double cosine, double sine) noexcept {
    for (std::size_t row = 0; row < N; ++row) {
        const double a = columns[p][row];
        const double b = columns[q][row];
        columns[p][row] = cosine * a - sine * b;
        columns[q][row] = sine * a + cosine * b;
    }
}

/// Makes columns p and q perpendicular. Returns whether they were not yet, to within rounding.
template <std::size_t N>
bool make_perpendicular(SingularValues<N>& s, std::size_t p, std::size_t q) noexcept {
    const double product = dot(s.scaled[p], s.scaled[q]);
    const double pp = dot(s.scaled[p], s.scaled[p]);
    const double qq = dot(s.scaled[q], s.scaled[q]);
    if (std::abs(product) <= std::numeric_limits<double>::epsilon() * std::sqrt(pp) * std::sqrt(qq))
        return false;
    const double slope = (qq - pp) / (2.0 * product);
    const double tangent = (slope < 0.0 ? -1.0 : 1.0) / (std::abs(slope) + std::sqrt(slope * slope + 1.0));
    const double cosine = 1.0 / std::sqrt(tangent * tangent + 1.0);
    rotate_columns(s.scaled, p, q, cosine, tangent * cosine);
    rotate_columns(s.v, p, q, cosine, tangent * cosine);
    return true;
}

}  // namespace detail

/// Singular values by rotating pairs of columns (one-sided Jacobi; Hestenes 1958): small values are as accurate
/// as large ones, relative to their columns. `a` must be finite, with its largest absolute entry between 1e-70
/// and 1e70, or 0.
template <std::size_t N>
[[nodiscard]] SingularValues<N> singular_values(const Columns<N>& a) noexcept {
    SingularValues<N> s;
    s.scaled = a;
    for (std::size_t i = 0; i < N; ++i) s.v[i][i] = 1.0;
    // Converges quadratically: reaches rounding errors in 5 to 8 sweeps.
    for (int sweep = 0; sweep < 30; ++sweep) {
        bool is_done = true;
        for (std::size_t p = 0; p + 1 < N; ++p) {
            for (std::size_t q = p + 1; q < N; ++q) {
                if (detail::make_perpendicular(s, p, q)) is_done = false;
            }
        }
        if (is_done) break;
    }
    for (std::size_t i = 0; i < N; ++i) s.values[i] = std::sqrt(detail::dot(s.scaled[i], s.scaled[i]));
    for (std::size_t i = 0; i + 1 < N; ++i) {
        const auto largest = static_cast<std::size_t>(
            std::max_element(s.values.begin() + static_cast<std::ptrdiff_t>(i), s.values.end()) -
            s.values.begin());
        if (largest == i) continue;
        std::swap(s.values[i], s.values[largest]);
        // Rotate by 90 degrees in the plane of the two columns, so that v stays a rotation.
        detail::rotate_columns(s.scaled, i, largest, 0.0, 1.0);
        detail::rotate_columns(s.v, i, largest, 0.0, 1.0);
    }
    return s;
}

}  // namespace sinew
