// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "sinew/transform/affine.h"

namespace sinew {

/// The moments of one bone's weight in the neighbourhood of a vertex, model space. A row of vertex data is the
/// number of the vertex, the number of the bone, and these moments.
///
/// The weights of a vertex's rows have sum 1. The sum of their first moments is the neighbourhood's centroid.
template <class T>
struct Moments {
    T weight;
    Vec3<T> first;   // weight times the centroid of the bone's part, from the origin
    Mat3<T> second;  // symmetric, about the centroid of the whole neighbourhood
};

/// Floats of a row: vertex, bone, weight, first (x, y, z), second (xx, yy, zz, yz, xz, xy).
inline constexpr std::size_t kMomentFloats = 12;

/// The limit on vertices: a float can not represent all larger numbers exactly.
inline constexpr std::size_t kMaxMomentVertices = std::size_t{1} << 24;

/// The moments in a row.
///
/// row  [kMomentFloats]
template <class T>
[[nodiscard]] Moments<T> moments_of(std::span<const T> row) noexcept {
    const Vec3<T> diagonal(row[6], row[7], row[8]);
    const T yz = row[9];
    const T xz = row[10];
    const T xy = row[11];
    return {row[2],
            {row[3], row[4], row[5]},
            Mat3<T>(Vec3<T>(diagonal.x, xy, xz), Vec3<T>(xy, diagonal.y, yz), Vec3<T>(xz, yz, diagonal.z))};
}

}  // namespace sinew
