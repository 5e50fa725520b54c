// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sinew/export.h"
#include "sinew/skinning/methods.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// What a Binding takes at most; more is refused.
inline constexpr std::size_t kMaxVertices = 0x7FFFFFFF;    // 2^31 - 1
inline constexpr std::size_t kMaxInfluences = 0x7FFFFFFF;  // of all vertices
inline constexpr std::size_t kMaxVertexInfluences = std::size_t{1} << 16;
inline constexpr std::size_t kMaxBones = std::size_t{1}
                                         << 20;  // an influence names one of 0 to kMaxBones - 1

/// What a method keeps of each vertex, as the function that makes it gives it: of Cor, centres_of_rotation(). It
/// belongs to the rest points that it was made from, and stays as it is where set_rest_points() gives others.
struct VertexData {
    MethodInfo method;
    // [vertices][method.vertex_floats], or [rows][vertex_floats] of a method that keeps moments, by rising vertices and
    // bones, each once. Finite; model space.
    std::span<const float> values;
};

/// What a Binding is made of. Nothing is kept by reference.
struct BindData {
    std::span<const Vec3<float>> rest_points;  // [vertices] model space
    std::span<const std::int32_t>
        influence_offsets;  // [vertices + 1] first influence of each vertex, then the end
    std::span<const std::int32_t> influence_bones;  // [influences] bone of each
    std::span<const float> influence_weights;       // [influences] >= 0; any sum, normalised inside
    std::span<const Affine<float>>
        rest_bones{};  // [bones] orthonormal, Y along the bone; empty: all identity.
                       // Read where a bone is scaled and the method is rigid, and by Sbs
    std::span<const VertexData>
        vertex_data{};  // of each method once at most; a method whose data is not here
                        // does without, as its deform_vertex() says
    bool is_normalised =
        false;  // of a BoundMesh: weights have sum 1 but for rounding, and are taken as they are
};

/// What a Binding keeps of its BindData, to store it and to make one anew that gives the same bits. Influences have
/// weights of sum 1. One of weight 0 may name the highest bone that was named.
struct BoundMesh {
    /// VertexData that is not only referred to.
    struct OwnVertexData {
        MethodInfo method;
        std::vector<float> values;
    };

    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> influence_offsets;
    std::vector<std::int32_t> influence_bones;
    std::vector<float> influence_weights;
    std::vector<Affine<float>> rest_bones;  // of bones without influences: identity
    std::vector<OwnVertexData> vertex_data;

    /// Without vertex data.
    [[nodiscard]] BindData data() const {
        return {rest_points, influence_offsets, influence_bones, influence_weights, rest_bones, {}, true};
    }
};

/// How one frame is deformed.
struct DeformOptions {
    /// Takes model space to the space that `posed_from_rest` and the rest bones are given in, where the
    /// blending happens; the result is taken back. Invertible.
    Affine<float> bones_from_model{};
    /// 0: as many as help.
    std::size_t threads = 0;
    /// [at most MethodInfo::parameters] values of the method's parameters, as valid_value() takes them; those that are
    /// not here have their defaults.
    std::span<const double> parameters{};
    /// Of the method that the stage `mix` adds.
    std::span<const double> mix_parameters{};
};

/// A mesh bound to bones: immutable, and shared by all its copies and by the deformers made of it. Binding sorts the
/// vertices by their bones, which takes longer than many frames; a Deformer made of a Binding takes next to nothing.
class SINEW_EXPORT Binding {
public:
    /// Throws std::invalid_argument that names the field, what was wanted and what came: sizes that do not
    /// fit or are beyond the limits above, offsets that do not rise from 0 to the number of influences, a
    /// negative bone, a weight that is negative, a value that is not finite, vertex data of a method that keeps none.
    explicit Binding(const BindData& data);

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Influences of positive weight.
    [[nodiscard]] std::size_t influence_count() const noexcept;
    /// One more than the highest bone that an influence names.
    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] BoundMesh unpack() const;

private:
    friend class Deformer;
    struct Packed;
    std::shared_ptr<const Packed> packed_;
};

/// The stage `mix`: a second method, and the share of it that each vertex takes. See skinning/mix.h.
struct MixData {
    MethodInfo method;
    std::span<const float> weights;  // [vertices] clamped to 0 to 1; not NaN; copied
};

/// A binding and a method, ready to deform at any pose. Once constructed it is valid, and deforming can not
/// fail and allocates nothing. Any number of threads may use one Deformer at once; of more than 16 that deform,
/// some wait for others. One that was moved from can only be assigned to or destroyed.
class SINEW_EXPORT Deformer {
public:
    /// Throws std::invalid_argument, as Binding does, for a method that is not in the list of methods, for a number
    /// of mix weights that is not that of vertices, and for one that is NaN.
    Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix = {});

    /// With a binding of its own, from which nothing else deforms.
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
    /// One more than the highest bone that an influence names.
    [[nodiscard]] std::size_t bone_count() const noexcept;

    /// Its binding, with the rest points that it has now.
    [[nodiscard]] BoundMesh unpack() const;
    /// The weights of the stage `mix` [vertices], clamped; empty without it.
    [[nodiscard]] std::vector<float> mix_weights() const;

    /// New rest points [vertices] for this deformer alone, as when shape keys change. Throws std::invalid_argument
    /// for another number of points or a value that is not finite. Waits for threads that deform, and they for it:
    /// each of their results has the old points or the new ones. The first call on a deformer of a shared binding
    /// copies the mesh; later ones allocate nothing.
    void set_rest_points(std::span<const Vec3<float>> rest_points);

    /// Writes the deformed points, model space.
    ///
    /// posed_from_rest  [bones, at least bone_count()] finite; bones that it lacks stay at rest
    /// points           [vertices]; of another size nothing is written
    ///
    /// A vertex without influences, or with all weights zero, stays at rest. The result does not depend
    /// on the number of threads.
    void deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                std::span<Vec3<float>> points) const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
