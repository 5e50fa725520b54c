// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "sinew/base/fail.h"
#include "sinew/base/status.h"
#include "sinew/export.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// Throws if a vector is not finite.
///
/// of  what the vectors belong to, such as "vertex"
void check_finite(const std::string& argument, std::span<const Vec3<float>> vectors, const std::string& of);

/// Throws unless `got` is none, or one for each of `count`.
///
/// of  what these are, such as "edges"
void check_optional(const std::string& argument, std::size_t got, std::size_t count, const std::string& of);

/// Throws if the rest points are not `count`, or if one is not finite.
SINEW_EXPORT void check_points(std::span<const Vec3<float>> points, std::size_t count);
/// What check_points() would throw for: Status::size or Status::not_finite.
Status status_of_points(std::span<const Vec3<float>> points, std::size_t count) noexcept;

/// Throws if the weights are not one for each vertex, or if one is NaN.
void check_weights(const std::string& argument, std::span<const float> weights, std::size_t vertex_count);

/// Throws if there are some but fewer than `bone_count` rest bones, or if one is not finite.
///
/// bone_count  as Binding::bone_count()
void check_rest_bones(std::span<const Affine<float>> rest_bones, std::size_t bone_count);

/// Throws if a value is not finite, or if the transform has no inverse.
SINEW_EXPORT void check_space(const Affine<float>& bones_from_model);
/// Whether check_space() does not throw.
[[nodiscard]] bool is_space(const Affine<float>& bones_from_model) noexcept;

/// Throws if `triangles` [3 x any number] has a corner that is no vertex.
void check_triangles(std::span<const std::int32_t> triangles, std::size_t vertex_count);

}  // namespace sinew
