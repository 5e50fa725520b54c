// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/check_arrays.h"

#include <algorithm>
#include <cmath>

#include "sinew/transform/convert.h"

namespace sinew {

void check_finite(const std::string& argument, std::span<const Vec3<float>> vectors, const std::string& of) {
    for (std::size_t i = 0; i < vectors.size(); ++i) {
        if (!is_finite(vectors[i])) {
            fail(argument, "finite values", "NaN or infinity at " + of + " " + std::to_string(i));
        }
    }
}

void check_optional(const std::string& argument, std::size_t got, std::size_t count, const std::string& of) {
    if (got == 0 || got == count) return;
    fail(argument, "none, or one for each of the " + std::to_string(count) + " " + of, std::to_string(got));
}

void check_points(std::span<const Vec3<float>> points, std::size_t count) {
    if (points.size() != count) {
        fail("rest_points", std::to_string(count) + " points", std::to_string(points.size()));
    }
    check_finite("rest_points", points, "vertex");
}

Status status_of_points(std::span<const Vec3<float>> points, std::size_t count) noexcept {
    if (points.size() != count) return Status::size;
    const bool are_finite =
        std::ranges::all_of(points, [](const Vec3<float>& point) { return is_finite(point); });
    return are_finite ? Status::ok : Status::not_finite;
}

void check_weights(const std::string& argument, std::span<const float> weights, std::size_t vertex_count) {
    if (weights.size() != vertex_count) {
        fail(argument, "a weight for each of the " + std::to_string(vertex_count) + " vertices",
             std::to_string(weights.size()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        if (std::isnan(weights[vertex])) {
            fail(argument, "weights from 0 to 1", "NaN at vertex " + std::to_string(vertex));
        }
    }
}

void check_rest_bones(std::span<const Affine<float>> rest_bones, std::size_t bone_count) {
    if (!rest_bones.empty() && rest_bones.size() < bone_count) {
        fail("rest_bones", "at least " + std::to_string(bone_count) + " bones",
             std::to_string(rest_bones.size()));
    }
    for (std::size_t bone = 0; bone < rest_bones.size(); ++bone) {
        if (!is_finite(rest_bones[bone])) {
            fail("rest_bones", "finite values", "NaN or infinity at bone " + std::to_string(bone));
        }
    }
}

void check_space(const Affine<float>& bones_from_model) {
    if (!is_finite(bones_from_model)) fail("bones_from_model", "finite values", "NaN or infinity");
    if (!is_space(bones_from_model)) {
        fail("bones_from_model", "an invertible transform", "one of determinant 0");
    }
}

bool is_space(const Affine<float>& bones_from_model) noexcept {
    return is_finite(bones_from_model) && glm::determinant(Mat3<double>(bones_from_model.linear)) != 0.0;
}

void check_triangles(std::span<const std::int32_t> triangles, std::size_t vertex_count) {
    if (triangles.size() % 3 != 0) fail("triangles", "three corners each", std::to_string(triangles.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (triangles[i] < 0 || static_cast<std::size_t>(triangles[i]) >= vertex_count) {
            fail("triangles", "numbers of vertices, below " + std::to_string(vertex_count),
                 std::to_string(triangles[i]) + " at triangle " + std::to_string(i / 3));
        }
    }
}

}  // namespace sinew
