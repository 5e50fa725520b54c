// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sinew/base/job.h"
#include "sinew/binding.h"
#include "sinew/methods/ddm/moments.h"

namespace sinew {

/// The vertex data of Ddm: the moments of each bone's weight in the neighbourhood of each vertex (Le, Lewis 2019:
/// Psi, which equals Omega where their alpha is 0). Rows of kMomentFloats (methods/ddm/moments.h), in ascending
/// order of vertices and bones.
///
///     Psi_ij = sum over vertices k of B_ik w_kj (v_k, 1) (v_k, 1)^T
///     B = (M + t L)^-4 M^4 in the order of application, t = radius^2 / 8
///
/// L is the cotangent Laplacian, with an edge's weight clamped to 0 where it is negative. M is the diagonal
/// matrix with a third of the area of each vertex's triangles. B is thus the heat that diffuses from a vertex to its
/// neighbours, independently of their density; on a plane the radius is the standard deviation along each axis.
/// The paper divides by L's diagonal instead, and has one number for the whole mesh.
///
/// Unless `exact`, a bone whose weight in the neighbourhood is below kLeastMoment is left out and the other
/// weights are divided by their sum. This moves a vertex by at most kLeastMoment times the number of omitted
/// bones times their motion relative to the others. Vertices without influences contribute nothing and have no
/// rows. A vertex without triangles is its own neighbourhood.
///
/// data       rest points and influences; the rest is not read
/// triangles  [3 x triangles] vertices of the corners; triangles may have area 0
/// radius     finite, >= 0; in units of the rest points
///
/// Returns nothing useful if the job was cancelled. Throws as Binding does, for a corner that is no vertex, for an
/// invalid radius, and for more than kMaxMomentVertices.
[[nodiscard]] SINEW_EXPORT std::vector<float> direct_delta_mush(const BindData& data,
                                                                std::span<const std::int32_t> triangles,
                                                                double radius, Job& job, bool exact = false);

inline constexpr double kLeastMoment = 1e-6;

}  // namespace sinew
