// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sinew/export.h"
#include "sinew/methods/methods.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// Limits of a Binding. More is refused.
inline constexpr std::size_t kMaxVertices = 0x7FFFFFFF;    // 2^31 - 1
inline constexpr std::size_t kMaxInfluences = 0x7FFFFFFF;  // over all vertices
inline constexpr std::size_t kMaxVertexInfluences = std::size_t{1} << 16;
inline constexpr std::size_t kMaxBones = std::size_t{1} << 20;  // bones are numbered 0 to kMaxBones - 1

/// The numbers that a method keeps for each vertex, as its precomputation returns them: for Cor,
/// centres_of_rotation(). They belong to the rest points that they were computed from; set_rest_points() does not
/// change them.
struct VertexData {
    MethodInfo method;
    // [vertices][method.vertex_floats], or, if method.rows_by_bone, [rows][vertex_floats] in ascending order of
    // vertices and bones, each pair once. Finite; model space.
    std::span<const float> values;
    // true for no values: the method blends this mesh linearly
    bool is_linear = false;
};

/// The data that a Binding is constructed from.
struct BindData {
    std::span<const Vec3<float>> rest_points;  // [vertices] model space
    // [vertices + 1] first influence of each vertex, then the end
    std::span<const std::int32_t> influence_offsets;
    std::span<const std::int32_t> influence_bones;  // [influences] bone of each
    std::span<const float> influence_weights;       // [influences] >= 0; any sum, normalised by Binding
    // [bones] orthonormal, Y along the bone; empty: all identity. Read by Sbs, and by other rigid methods where
    // a bone is scaled
    std::span<const Affine<float>> rest_bones{};
    std::span<const VertexData> vertex_data{};  // at most one for each method
    // true for a BoundMesh: weights have sum 1 but for rounding, and are not normalised
    bool is_normalised = false;
};

/// What a Binding keeps of its BindData: enough to store it and to construct another that gives the same bits.
/// Weights have sum 1. An influence of weight 0 may remain to name the highest bone.
struct BoundMesh {
    /// VertexData that owns its values.
    struct OwnVertexData {
        MethodInfo method;
        std::vector<float> values;
        bool is_linear = false;
    };

    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> influence_offsets;
    std::vector<std::int32_t> influence_bones;
    std::vector<float> influence_weights;
    std::vector<Affine<float>> rest_bones;  // identity for bones without influences
    std::vector<OwnVertexData> vertex_data;

    /// Leaves out vertex_data, without which a Deformer of a method that keeps some is refused.
    [[nodiscard]] BindData data() const {
        return {rest_points, influence_offsets, influence_bones, influence_weights, rest_bones, {}, true};
    }
};

struct PackedBinding;

/// A mesh bound to bones. Immutable; copies and the deformers made from it share its memory. Constructing a
/// Binding sorts the vertices by their bones, which takes longer than many frames; constructing a Deformer from
/// it costs next to nothing.
class SINEW_EXPORT Binding {
public:
    /// Throws also for sizes that exceed the limits above, offsets that do not rise from 0 to the number of
    /// influences, a negative bone or weight, and vertex data of a method that keeps none.
    explicit Binding(const BindData& data);

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Influences of positive weight, once they are normalised.
    [[nodiscard]] std::size_t influence_count() const noexcept;
    /// One more than the highest bone that an influence names, also one of weight 0, or a row of vertex data that is
    /// not all 0.
    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] BoundMesh unpack() const;

    /// For the library's own files.
    [[nodiscard]] const std::shared_ptr<const PackedBinding>& packed() const noexcept { return packed_; }

private:
    std::shared_ptr<const PackedBinding> packed_;
};

}  // namespace sinew
