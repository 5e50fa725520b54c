// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/export.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// Pairs of triangles of a surface that cross: an edge of one meets the other, and they share no vertex. The lower
/// index comes first, and pairs ascend. Triangles in one plane do not cross, nor do those of points that are NaN.
///
/// points     [vertices]
/// triangles  [triangles][3] vertices; they must exist
/// groups     [triangles], or empty: two of one group do not count, as where one bone moves both; below 0: of none
/// threads    at most so many; 0: as many as useful
[[nodiscard]] SINEW_EXPORT std::vector<std::array<std::int32_t, 2>> crossing_triangles(
    std::span<const Vec3<double>> points, std::span<const std::array<std::int32_t, 3>> triangles,
    std::span<const std::int32_t> groups = {}, std::size_t threads = 0);

}  // namespace sinew
