// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "sinew/transform/quat.h"

namespace sinew {

template <class T>
struct NearestRotation {
    Quat<T> rotation{T(1), Vec3<T>(T(0))};
    T gap = T(0);
};

namespace detail {

template <class T>
using Mat4Rows = std::array<std::array<T, 4>, 4>;

/// The eigenvector of the symmetric matrix `k` with the largest eigenvalue, as a unit quaternion with w >= 0, and how
/// much larger this is than the second (Jacobi 1846).
template <class T>
[[nodiscard]] NearestRotation<T> largest_eigenvector(Mat4Rows<T> k) noexcept {
    using std::abs;
    using std::sqrt;
    Mat4Rows<T> vectors{};
    for (std::size_t i = 0; i < 4; ++i) vectors[i][i] = T(1);
    // Converges quadratically: reaches rounding errors in 4 or 5 sweeps.
    bool is_diagonal = false;
    for (int sweep = 0; sweep < 12 && !is_diagonal; ++sweep) {
        is_diagonal = true;
        for (std::size_t p = 0; p < 3; ++p) {
            for (std::size_t q = p + 1; q < 4; ++q) {
                // An off-diagonal entry that does not change the diagonal when added to it is rounding.
                if (abs(k[p][p]) + abs(k[p][q]) == abs(k[p][p]) &&
                    abs(k[q][q]) + abs(k[p][q]) == abs(k[q][q])) {
                    continue;
                }
                is_diagonal = false;
                const T slope = (k[q][q] - k[p][p]) / (T(2) * k[p][q]);
                const T tangent = (slope < T(0) ? T(-1) : T(1)) / (abs(slope) + sqrt(slope * slope + T(1)));
                const T cosine = T(1) / sqrt(tangent * tangent + T(1));
                const T sine = tangent * cosine;
                for (std::size_t i = 0; i < 4; ++i) {
                    const T kp = k[i][p];
                    const T kq = k[i][q];
                    k[i][p] = cosine * kp - sine * kq;
                    k[i][q] = sine * kp + cosine * kq;
                    const T vp = vectors[i][p];
                    const T vq = vectors[i][q];
                    vectors[i][p] = cosine * vp - sine * vq;
                    vectors[i][q] = sine * vp + cosine * vq;
                }
                for (std::size_t i = 0; i < 4; ++i) {
                    const T kp = k[p][i];
                    const T kq = k[q][i];
                    k[p][i] = cosine * kp - sine * kq;
                    k[q][i] = sine * kp + cosine * kq;
                }
                k[p][q] = k[q][p] = T(0);
            }
        }
    }
    std::size_t best = 0;
    for (std::size_t i = 1; i < 4; ++i) {
        if (k[i][i] > k[best][best]) best = i;
    }
    T second = best == 0 ? k[1][1] : k[0][0];
    for (std::size_t i = 1; i < 4; ++i) {
        if (i != best && k[i][i] > second) second = k[i][i];
    }
    const Quat<T> q =
        glm::normalize(Quat<T>(vectors[0][best], {vectors[1][best], vectors[2][best], vectors[3][best]}));
    return {q.w < T(0) ? -q : q, k[best][best] - second};
}

}  // namespace detail

/// The rotation nearest to `linear` in the sum of squared differences, as a unit quaternion with w >= 0. If the
/// determinant is positive, it is the rotation of the polar decomposition (Horn 1987, section 4).
///
/// `gap` is 2 (s2 + s3), with the singular values in descending order, the last one negative if `linear` mirrors.
/// If it is 0, the nearest rotation is not unique and the result is one of them; for the zero matrix, the
/// identity.
template <class T>
[[nodiscard]] NearestRotation<T> nearest_rotation(const Mat3<T>& linear) noexcept {
    const auto m = [&](int row, int column) { return linear[column][row]; };
    detail::Mat4Rows<T> k{};
    k[0] = {m(0, 0) + m(1, 1) + m(2, 2), m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)};
    k[1] = {k[0][1], m(0, 0) - m(1, 1) - m(2, 2), m(0, 1) + m(1, 0), m(0, 2) + m(2, 0)};
    k[2] = {k[0][2], k[1][2], m(1, 1) - m(0, 0) - m(2, 2), m(1, 2) + m(2, 1)};
    k[3] = {k[0][3], k[1][3], k[2][3], m(2, 2) - m(0, 0) - m(1, 1)};
    return detail::largest_eigenvector(k);
}

}  // namespace sinew
