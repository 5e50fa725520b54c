// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/deform/packed_mesh.h"
#include "sinew/export.h"
#include "sinew/skinning/methods.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// What a Deformer is made of. Nothing is kept by reference.
struct BindData {
    std::span<const Vec3<float>> rest_points;  // [vertices] model space
    std::span<const std::int32_t>
        influence_offsets;  // [vertices + 1] first influence of each vertex, then the end
    std::span<const std::int32_t> influence_bones;  // [influences] bone of each
    std::span<const float> influence_weights;       // [influences] >= 0; any sum, normalised inside
    std::span<const Affine<float>>
        rest_bones{};  // [bones] orthonormal, Y along the bone; empty: all identity.
                       // Read where a bone is scaled and the method is rigid
};

/// How one frame is deformed.
struct DeformOptions {
    /// Takes model space to the space that `posed_from_rest` and the rest bones are given in, where the
    /// blending happens; the result is taken back. Invertible.
    Affine<float> bones_from_model{};
    /// 0: as many as help.
    std::size_t threads = 0;
};

/// A mesh bound to bones, ready to be deformed at any pose. Once constructed it is valid, and deforming
/// can not fail. Any number of threads may deform with one Deformer at once.
class SINEW_EXPORT Deformer {
public:
    /// Throws std::invalid_argument that names the field, what was wanted and what came: sizes that do not
    /// fit, offsets that do not rise from 0 to the number of influences, a negative bone, a weight that is
    /// negative, a value that is not finite.
    Deformer(MethodId method, const BindData& data);

    [[nodiscard]] MethodId method() const noexcept { return method_; }
    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_count_; }
    [[nodiscard]] std::size_t influence_count() const noexcept { return influence_count_; }
    /// One more than the highest bone that an influence names.
    [[nodiscard]] std::size_t bone_count() const noexcept { return bone_count_; }

    /// New rest points [vertices], as when shape keys change. Throws std::invalid_argument for another
    /// number of points or a value that is not finite. Not to be called while another thread deforms.
    void set_rest_points(std::span<const Vec3<float>> rest_points);

    /// Writes the deformed points [vertices], model space.
    ///
    /// posed_from_rest  [bones, at least bone_count()] finite
    ///
    /// A vertex without influences, or with all weights zero, stays at rest. The result does not depend
    /// on the number of threads.
    void deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                std::span<Vec3<float>> points) const noexcept;

private:
    MethodId method_;
    PackedMesh mesh_;
    std::vector<Affine<float>> rest_bones_;
    std::vector<std::int32_t> stretched_bones_;  // used, and with axes that are not of unit length
    std::size_t vertex_count_ = 0;
    std::size_t influence_count_ = 0;
    std::size_t bone_count_ = 0;
};

}  // namespace sinew
