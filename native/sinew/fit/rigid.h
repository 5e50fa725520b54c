// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string_view>
#include <tuple>

#include "sinew/fit/pairs.h"
#include "sinew/fit/singular_values.h"
#include "sinew/transform/nearest_rotation.h"

namespace sinew {

// Fits the rigid transform from a source to a target, with one solver for each representation: a type with a
// name, its Transform, and fit(pairs). All minimise the same squares and differ only by rounding. Sums are in
// double, with coordinates relative to the middle of the points; nothing is allocated.

/// Rotation from the singular value decomposition of the covariance, translation between the middles (Kabsch
/// 1976, 1978; Umeyama 1991 for mirrors).
struct Kabsch {
    static constexpr std::string_view name = "kabsch";
    template <class T>
    using Transform = Affine<T>;

    template <class T>
    [[nodiscard]] static Fitted<Affine<T>, T> fit(const Pairs<T>& pairs) noexcept {
        const detail::PairMoments m = detail::moments_of(pairs);
        Columns<3> covariance{};
        for (std::size_t i = 0; i < 3; ++i) {
            const Vec3<double>& column = m.covariance[static_cast<int>(i)];
            covariance[i] = {column.x, column.y, column.z};
        }
        const SingularValues<3> s = singular_values<3>(covariance);
        const auto vector = [](const std::array<double, 3>& a) { return Vec3<double>(a[0], a[1], a[2]); };
        // The third axes are cross products, so both are rotations and the last value has the sign of the
        // determinant.
        const Mat3<double> v(vector(s.v[0]), vector(s.v[1]), glm::cross(vector(s.v[0]), vector(s.v[1])));
        const Vec3<double> u0 = unit(vector(s.scaled[0]), v[0]);
        const Vec3<double> across = vector(s.scaled[1]) - u0 * glm::dot(u0, vector(s.scaled[1]));
        const bool is_line = s.values[1] <= 8.0 * std::numeric_limits<double>::epsilon() * s.values[0];
        const Vec3<double> u1 = is_line ? beside(u0, v[0], v[1]) : unit(across, v[1]);
        const Mat3<double> u(u0, u1, glm::cross(u0, u1));
        const double last = glm::dot(u[2], m.covariance * v[2]);
        const Quat<double> rotation = to_quat(u * glm::transpose(v));
        const Vec3<double> translation = m.target_middle - rotate(rotation, m.source_middle);
        return detail::rounded<Affine<T>, T>(
            detail::judged(pairs, m, {rotation, translation}, s.values[1] + last));
    }

private:
    /// A direction perpendicular to `u0`: the image of `v1` under the shortest rotation from `v0` to `u0`.
    [[nodiscard]] static Vec3<double> beside(const Vec3<double>& u0, const Vec3<double>& v0,
                                             const Vec3<double>& v1) noexcept {
        const Vec3<double> sum = u0 + v0;
        const double square = glm::dot(sum, sum);
        // Opposite: rotates by 180 degrees about v1.
        if (square < 1e-12) return v1;
        return unit(v1 - (2.0 * glm::dot(sum, v1) / square) * sum, v1);
    }
};

/// Rotation as an eigenvector of a symmetric 4x4 matrix, translation between the middles (Horn 1987).
struct Horn {
    static constexpr std::string_view name = "horn";
    template <class T>
    using Transform = QuatVec<T>;

    template <class T>
    [[nodiscard]] static Fitted<QuatVec<T>, T> fit(const Pairs<T>& pairs) noexcept {
        const detail::PairMoments m = detail::moments_of(pairs);
        const NearestRotation<double> nearest = nearest_rotation(m.covariance);
        const Vec3<double> translation = m.target_middle - rotate(nearest.rotation, m.source_middle);
        return detail::rounded<QuatVec<T>, T>(
            detail::judged(pairs, m, {nearest.rotation, translation}, 0.5 * nearest.gap));
    }
};

/// Rotation and translation at once, as a dual quaternion r + e s (Walker, Shao, Volz 1991). The squared distance
/// of a pair is |q r - r p - 2 s|^2, whose argument is linear in r and s. The best s is linear in r, and r is an
/// eigenvector.
struct Walker {
    static constexpr std::string_view name = "walker";
    template <class T>
    using Transform = DualQuat<T>;

    template <class T>
    [[nodiscard]] static Fitted<DualQuat<T>, T> fit(const Pairs<T>& pairs) noexcept {
        using glm::transpose;
        const detail::PairMoments m = detail::moments_of(pairs);
        // Relative to the first pair: sums of coordinates far from the origin would cancel.
        bool has_origin = false;
        Vec3<double> source_origin(0.0);
        Vec3<double> target_origin(0.0);
        Mat4 squares(0.0);
        Mat4 sum(0.0);
        detail::for_points(pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
            if (!has_origin) {
                has_origin = true;
                source_origin = source;
                target_origin = target;
            }
            const Mat4 row =
                difference((target - target_origin) / m.scale, (source - source_origin) / m.scale);
            sum += weight / m.largest_weight * row;
            squares += weight / m.largest_weight * (transpose(row) * row);
        });
        detail::for_directions(
            pairs, [&](const Vec3<double>& source, const Vec3<double>& target, double weight) {
                const Mat4 row = difference(target, source);
                squares += weight / m.largest_weight / m.scale / m.scale * (transpose(row) * row);
            });
        if (m.weight > 0.0) squares -= transpose(sum) * sum / m.weight;

        detail::Mat4Rows<double> k{};
        detail::Mat4Rows<double> vectors{};
        for (std::size_t i = 0; i < 4; ++i) {
            vectors[i][i] = 1.0;
            for (std::size_t j = 0; j < 4; ++j) k[i][j] = squares[static_cast<int>(j)][static_cast<int>(i)];
        }
        detail::jacobi(k, vectors);
        std::size_t best = 0;
        for (std::size_t i = 1; i < 4; ++i) {
            if (k[i][i] < k[best][best]) best = i;
        }
        double second = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < 4; ++i) {
            if (i != best) second = std::min(second, k[i][i]);
        }
        const glm::dvec4 r(vectors[0][best], vectors[1][best], vectors[2][best], vectors[3][best]);
        const glm::dvec4 s = m.weight > 0.0 ? sum * r * (0.5 * m.scale / m.weight) : glm::dvec4(0.0);
        const DualQuat<double> about_origins = normalized(
            DualQuat<double>{Quat<double>(r[0], r[1], r[2], r[3]), Quat<double>(s[0], s[1], s[2], s[3])});
        const QuatVec<double> local = to_quat_vec(r[0] < 0.0 ? -about_origins : about_origins);
        const QuatVec<double> fit{local.rotation,
                                  local.translation + target_origin - rotate(local.rotation, source_origin)};
        return detail::rounded<DualQuat<T>, T>(
            detail::judged(pairs, m, fit, 0.25 * (second - k[best][best])));
    }

private:
    using Mat4 = glm::dmat4;

    /// The antisymmetric matrix that maps a quaternion r to q r - r p.
    [[nodiscard]] static Mat4 difference(const Vec3<double>& q, const Vec3<double>& p) noexcept {
        const Vec3<double> d = q - p;
        const Vec3<double> c = q + p;
        return Mat4(0.0, d.x, d.y, d.z,     //
                    -d.x, 0.0, c.z, -c.y,   //
                    -d.y, -c.z, 0.0, c.x,   //
                    -d.z, c.y, -c.x, 0.0);  //
    }
};

/// All solvers. The Python package and the tests read this list.
using RigidFits = std::tuple<Kabsch, Horn, Walker>;

}  // namespace sinew
