// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sinew/deform/deformer.h"
#include "sinew/deform/precompute_options.h"
#include "sinew/skinning/moments.h"

namespace sinew {

/// What Ddm keeps of each vertex: the moments of each bone's weights about it (Le, Lewis 2019: Psi, which is Omega where
/// their alpha is 0). Rows of kMomentFloats, as moments.h has them, by rising vertices and bones.
///
///     Psi_ij = sum over vertices k of B_ik w_kj (v_k, 1) (v_k, 1)^T
///     B = (M + t L)^-4 M^4 in the order of application, t = radius^2 / 8
///
/// L is the Laplacian of cotangents, an edge's sum of which is 0 where it is negative; M has a third of the area of each
/// vertex's triangles. So B is the heat that a point gives its neighbours, whatever their density is: on a plane the
/// radius is the standard deviation along each axis. The paper divides by L's diagonal instead, with one number for all
/// of a mesh.
///
/// A bone whose weight about a vertex is below kLeastMoment is left out, unless exact, and the others are divided by
/// their sum: a vertex moves by at most so many times the bones left out times what these move against the others.
/// Vertices without influences count nowhere and have no rows. A vertex without triangles is its own neighbourhood.
///
/// data       rest points and influences; the rest is not read
/// triangles  [3 x triangles] vertices of the corners; may be of no area
/// radius     finite, >= 0; in units of the rest points
///
/// Nothing where `progress` cancelled it. The result does not depend on the number of threads. Throws
/// std::invalid_argument as Binding does, for a corner that is no vertex, for another radius and for more than
/// kMaxMomentVertices.
[[nodiscard]] SINEW_EXPORT std::optional<std::vector<float>> direct_delta_mush(
    const BindData& data, std::span<const std::int32_t> triangles, double radius,
    const PrecomputeOptions& options = {});

inline constexpr double kLeastMoment = 1e-6;

}  // namespace sinew
