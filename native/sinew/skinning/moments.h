// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "sinew/transform/affine.h"

namespace sinew {

/// What a vertex's neighbourhood has of one bone: the moments of the bone's weight about the vertex, model space. A row
/// of vertex data has the numbers of vertex and bone, then these.
///
/// The weights of a vertex's rows have sum 1. Their first moments have the neighbourhood's centroid as their sum.
template <class T>
struct Moments {
    T weight;
    Vec3<T> first;   // weight times the centroid of what the bone has, from the origin
    Mat3<T> second;  // symmetric, about the centroid of the whole neighbourhood
};

/// vertex, bone, weight, first (x, y, z), second (xx, yy, zz, yz, xz, xy)
inline constexpr std::size_t kMomentFloats = 12;

/// Vertices beyond this have no number as a float.
inline constexpr std::size_t kMaxMomentVertices = std::size_t{1} << 24;

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
