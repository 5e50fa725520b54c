// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "plain_loops.h"
#include "sinew/deformer.h"

namespace sinew::bench {

enum class Kind {
    chain,      // vertices along a cylinder
    shuffled,   // the same, in random order within windows of 4096
    character,  // 1 to 4 influences, on average 1.85, in patches of a few dozen vertices
};
inline constexpr const char* kKindNames[] = {"chain", "shuffled", "character"};

struct Shape {
    Kind kind = Kind::chain;
    std::size_t vertices = 100'000;
    std::size_t bones = 100;
    std::size_t influences = 4;  // for chain and shuffled
    auto operator<=>(const Shape&) const = default;
};

inline constexpr std::size_t kMaxShapeInfluences = 8;

/// A mesh, its weights and a pose, for Sinew and for the plain loops.
struct Scene {
    plain::Mesh plain;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
    std::vector<Affine<float>> pose;
    std::vector<glm::mat4> matrices;
    std::vector<glm::dualquat> dual_quats;
    std::vector<glm::quat> rotations;
    std::vector<glm::vec3> translations;
    std::vector<Vec3<float>> points;
    std::vector<float> method_values;  // made by the last call of data_for()
    std::vector<VertexData> vertex_data;

    BindData data() const { return {plain.rest_points, offsets, bones, weights}; }

    /// Includes the vertex data that the method keeps.
    BindData data_for(const MethodInfo& method) {
        BindData bound = data();
        if (method.vertex_floats == 0) return bound;
        method_values.clear();
        if (method.rows_by_bone) {
            add_moments();
        } else {
            for (const glm::vec3& rest : plain.rest_points) {
                // Points on the axis: the centre for Cor; C, R0, R1 and the flag for Sdef.
                const float z = rest.z;
                const float numbers[] = {0, 0, z, 0, 0, z - 0.3f, 0, 0, z + 0.3f, 1};
                method_values.insert(method_values.end(), numbers, numbers + method.vertex_floats);
            }
        }
        vertex_data.assign(1, {method, method_values});
        bound.vertex_data = vertex_data;
        return bound;
    }

    /// Adds the moments that Ddm keeps, for as many bones as influences: neighbourhoods on the surface, wider
    /// along the axis.
    void add_moments();

    /// Adds a vertex.
    ///
    /// of, share  [count] bones and weights; the plain loops use the first four
    void add_vertex(const glm::vec3& rest, std::size_t count, const std::size_t* of, const float* share);
};

Scene make_scene(const Shape& shape);

/// A method with values of its parameters other than the default ones.
struct Variant {
    std::string name;
    std::vector<double> parameters;

    /// Options for one thread.
    DeformOptions options() const {
        DeformOptions options;
        options.threads = 1;
        options.parameters = parameters;
        return options;
    }
};

/// Variants that take another time: for ddm "ddm2" and "ddm4".
std::vector<Variant> variants_of(const MethodInfo& method);

}  // namespace sinew::bench
