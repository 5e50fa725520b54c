// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sinew/deform/deformer.h"
#include "sinew/deform/packed_mesh.h"
#include "sinew/skinning/influence.h"

namespace sinew {

/// Throws std::invalid_argument "`argument`: expected `wanted`, got `got`".
[[noreturn]] void fail(const std::string& argument, const std::string& wanted, const std::string& got);

/// Throws where a point is not finite.
void check_points(std::span<const Vec3<float>> points);

/// bone_count  one more than the highest bone that an influence names
void check_rest_bones(std::span<const Affine<float>> rest_bones, std::size_t bone_count);

/// Throws as Binding says, but for rest bones and vertex data.
void check(const BindData& data);

/// Influences of positive weight, of sum 1 for each vertex that has any.
struct NormalisedInfluences {
    std::vector<std::uint32_t> offsets{0};  // [vertices + 1]
    std::vector<Influence<float>> influences;
};

/// Throws where `triangles` [3 x any number] has a corner that is no vertex.
void check_triangles(std::span<const std::int32_t> triangles, std::size_t vertex_count);

/// What `mesh` was packed of, as far as points, weights and the highest bone are concerned.
///
/// rows        of `mesh`, or with other rest points
/// bone_count  one more than the highest bone that was named; a bone named without weight is named so again
[[nodiscard]] BoundMesh bound_mesh(const PackedMesh& mesh, std::span<const Lanes<float>> rows,
                                   std::size_t vertex_count, std::size_t bone_count);

/// data  checked
[[nodiscard]] NormalisedInfluences normalised_influences(const BindData& data);

}  // namespace sinew
