// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
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
    // [vertices][method.vertex_floats], or, if method.keeps_moments, [rows][vertex_floats] in ascending order of
    // vertices and bones, each pair once. Finite; model space.
    std::span<const float> values;
};

/// The data that a Binding is constructed from. No reference is kept.
struct BindData {
    std::span<const Vec3<float>> rest_points;  // [vertices] model space
    // [vertices + 1] first influence of each vertex, then the end
    std::span<const std::int32_t> influence_offsets;
    std::span<const std::int32_t> influence_bones;  // [influences] bone of each
    std::span<const float> influence_weights;       // [influences] >= 0; any sum, normalised by Binding
    // [bones] orthonormal, Y along the bone; empty: all identity. Read by Sbs, and by other rigid methods where
    // a bone is scaled
    std::span<const Affine<float>> rest_bones{};
    std::span<const VertexData> vertex_data{};  // at most one for each method; a method without its data
                                                // does what its deform_vertex() says for empty data
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
    };

    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> influence_offsets;
    std::vector<std::int32_t> influence_bones;
    std::vector<float> influence_weights;
    std::vector<Affine<float>> rest_bones;  // identity for bones without influences
    std::vector<OwnVertexData> vertex_data;

    /// Leaves out vertex_data.
    [[nodiscard]] BindData data() const {
        return {rest_points, influence_offsets, influence_bones, influence_weights, rest_bones, {}, true};
    }
};

/// How to deform one frame.
struct DeformOptions {
    /// Maps model space to the space of `posed_from_rest` and the rest bones, in which the bones are blended; the
    /// result is mapped back. Invertible.
    Affine<float> bones_from_model{};
    /// At most; 0: as many as useful. Everything that takes a number of threads takes it so.
    std::size_t threads = 0;
    /// [at most MethodInfo::parameters] values of the method's parameters, made valid by valid_value(). Missing
    /// ones have their defaults.
    std::span<const double> parameters{};
    /// The same for the method that the stage `mix` adds.
    std::span<const double> mix_parameters{};
};

/// A mesh bound to bones. Immutable; copies and the deformers made from it share its memory. Constructing a
/// Binding sorts the vertices by their bones, which takes longer than many frames; constructing a Deformer from
/// it costs next to nothing.
class SINEW_EXPORT Binding {
public:
    /// Throws std::invalid_argument that names the field, what was expected and what was given, for: sizes that
    /// do not match or exceed the limits above; offsets that do not rise from 0 to the number of influences; a
    /// negative bone; a negative weight; a value that is not finite; vertex data of a method that keeps none.
    explicit Binding(const BindData& data);

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Influences of positive weight.
    [[nodiscard]] std::size_t influence_count() const noexcept;
    /// One more than the highest bone index in the influences.
    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] BoundMesh unpack() const;

private:
    friend class Deformer;
    struct Packed;
    std::shared_ptr<const Packed> packed_;
};

/// The stage `mix`: a second method, and its share at each vertex. See stages/mix/mix.h.
struct MixData {
    MethodInfo method;
    std::span<const float> weights;  // [vertices] clamped to 0 to 1; not NaN; copied
};

/// A binding and a method, ready to deform any pose. A constructed object is valid; deform() can not fail, and
/// allocates only when more threads than ever before deform at once. Any number of threads may use one Deformer at
/// once; if more than 16 deform at the same time, some wait. A child that is forked meanwhile can go on with it, but
/// has to set rest points again that were being set. A moved-from object can only be assigned to or destroyed.
class SINEW_EXPORT Deformer {
public:
    /// Throws std::invalid_argument as Binding does, and for a method that is not in the list of methods, a
    /// number of mix weights other than that of vertices, and a mix weight that is NaN.
    Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix = {});

    /// Constructs its own binding, which no other deformer shares.
    Deformer(const BindData& data, const MethodInfo& method, const std::optional<MixData>& mix = {});

    Deformer(Deformer&&) noexcept;
    Deformer& operator=(Deformer&&) noexcept;
    ~Deformer();

    [[nodiscard]] const MethodInfo& method() const noexcept;
    /// The method that the stage `mix` adds, or null.
    [[nodiscard]] const MethodInfo* mixed_method() const noexcept;
    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Influences of positive weight.
    [[nodiscard]] std::size_t influence_count() const noexcept;
    /// One more than the highest bone index in the influences.
    [[nodiscard]] std::size_t bone_count() const noexcept;

    /// Its binding, with the current rest points.
    [[nodiscard]] BoundMesh unpack() const;
    /// The weights of the stage `mix` [vertices], clamped; empty without it.
    [[nodiscard]] std::vector<float> mix_weights() const;

    /// Sets the rest points [vertices] of this deformer alone, such as when shape keys change. Throws
    /// std::invalid_argument for another number of points or a value that is not finite. Readers and this writer
    /// wait for each other, so each result of a concurrent deform() has either the old points or the new ones.
    /// The first call on a deformer of a shared binding copies the mesh; later calls do not allocate.
    void set_rest_points(std::span<const Vec3<float>> rest_points);

    /// Writes the deformed points, model space.
    ///
    /// posed_from_rest  [bones, at least bone_count()] finite; missing bones stay at rest
    /// points           [vertices]
    ///
    /// A vertex without influences, or with only weights of 0, stays at rest. The result does not depend on the
    /// number of threads. Returns false, and writes nothing, if the number of points is wrong.
    [[nodiscard]] bool deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                              std::span<Vec3<float>> points) const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
