// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sinew/binding.h"
#include "sinew/lanes/kernel.h"
#include "sinew/mesh/check_arrays.h"

namespace sinew {

/// Throws as Binding does. Does not check rest bones and vertex data.
void check(const BindData& data);

/// Influences whose share of their vertex's weights, a float, is above 0. The shares of a vertex that has any have
/// sum 1.
struct NormalisedInfluences {
    std::vector<std::uint32_t> offsets{0};  // [vertices + 1]
    std::vector<Influence<float>> influences;
};

/// data  checked
[[nodiscard]] NormalisedInfluences normalised_influences(const BindData& data);

/// What a Binding is: the mesh, packed once for all deformers and stages that it is given to.
struct PackedBinding {
    explicit PackedBinding(const BindData& data);

    /// rest_points  mesh.rest_points, or others
    [[nodiscard]] BoundMesh unpack(std::span<const Lanes<float>> rest_points) const;

    PackedMesh mesh;
    std::vector<Affine<float>> rest_bones;  // for each of mesh.used_bones; empty: all identity
    // indices into mesh.used_bones of bones whose axes are not of unit length
    std::vector<std::int32_t> stretched_bones;
    // for each method; null: none, or the method is to blend linearly
    std::array<std::unique_ptr<const PackedVertexData>, kMethodCount> vertex_data;
    std::array<bool, kMethodCount> is_linear{};
    std::size_t vertex_count;
    std::size_t influence_count;
    std::size_t bone_count = 0;
};

/// The kernel of a method.
///
/// method  an index into Methods
[[nodiscard]] const Kernel& kernel_at(std::size_t method) noexcept;

/// The index in Methods of a method. Throws if it is none of them.
[[nodiscard]] std::size_t checked_method(const std::string& argument, const MethodInfo& method);

/// The index in Methods of a method that is to deform a binding. Throws if it is none of them, or if the binding
/// lacks its vertex data.
[[nodiscard]] std::size_t checked_method(const std::string& argument, const MethodInfo& method,
                                         const PackedBinding& binding);

}  // namespace sinew
