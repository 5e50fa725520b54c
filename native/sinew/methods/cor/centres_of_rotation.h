// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sinew/base/job.h"
#include "sinew/binding.h"
#include "sinew/export.h"

namespace sinew {

/// The optimised centre of rotation of each vertex [vertices], model space: the vertex data of Cor (Le, Hodgins
/// 2016).
///
///     c_i = sum over triangles t of s(w_i, w_t) A_t g_t / sum of s(w_i, w_t) A_t
///     s(a, b) = sum over pairs of bones j, k of a_j a_k b_j b_k exp(-((a_j b_k - a_k b_j) / 0.1)^2)
///
/// A_t is the area of triangle t, g_t its centroid and w_t the mean of its corners' weights. Edges along which
/// weights change by 0.1 or more are halved first, so that weights within a triangle are similar. A vertex of one
/// bone, or one whose bones no triangle shares, is its own centre.
///
/// The term of a pair of bones depends on two weights only. Triangles whose two weights round to the same 1/64
/// are therefore summed for each pair, and represented by their mean. Centres deviate by a few thousandths of a
/// limb's diameter.
///
/// data       rest points and influences; the rest is not read
/// triangles  [3 x triangles] vertices of the corners; triangles may have area 0
/// exact      compute by the definition itself, which is slow; for tests
///
/// Returns nothing useful if the job was cancelled. Throws as Binding does, and for a corner that is no vertex.
[[nodiscard]] SINEW_EXPORT std::vector<Vec3<float>> centres_of_rotation(
    const BindData& data, std::span<const std::int32_t> triangles, Job& job, bool exact = false);

}  // namespace sinew
