// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "sinew/deform/deformer.h"
#include "sinew/export.h"
#include "sinew/skinning/bulge_limit.h"

namespace sinew {

/// What a BulgeLimit is made of. Nothing is kept by reference.
struct BulgeLimitData {
    BindData mesh;                                 // rest bones and vertex data are not read
    std::span<const BoneSegment<float>> segments;  // [bones] at rest, in the space of posed_from_rest
    Affine<float> bones_from_model{};              // takes rest points to that space; invertible
    std::span<const float> weights{};  // [vertices] of the vertex group, clamped to 0 to 1; empty: all 1
};

/// How one frame is limited.
struct BulgeLimitOptions {
    BulgeForm form = BulgeForm::continuous;
    float strength = 1.0f;    // clamped to 0 to 1; NaN: 1
    std::size_t threads = 0;  // 0: as many as help
};

/// The stage `bulge_limit` (skinning/bulge_limit.h) of one mesh, after Deformer::deform(). Once constructed it is valid,
/// and applying it can not fail and allocates nothing. Calls of one object wait for each other. One that was moved from
/// can only be assigned to or destroyed.
class SINEW_EXPORT BulgeLimit {
public:
    /// Throws std::invalid_argument that names the field, what was wanted and what came: as Binding does, and for fewer
    /// segments than bones, values that are not finite, a transform of determinant 0 and weights that are NaN or not one
    /// for each vertex.
    explicit BulgeLimit(const BulgeLimitData& data);

    BulgeLimit(BulgeLimit&&) noexcept;
    BulgeLimit& operator=(BulgeLimit&&) noexcept;
    ~BulgeLimit();

    /// Other rest points [vertices], or the same in another space: it takes about as long as to apply it. Throws as the
    /// constructor does, and is then as it was.
    void set_rest_points(std::span<const Vec3<float>> rest_points,
                         const Affine<float>& bones_from_model = {});

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// One more than the highest bone that an influence names.
    [[nodiscard]] std::size_t bone_count() const noexcept;

    /// Limits in place.
    ///
    /// points           [vertices] deformed, model space; of another size nothing is written
    /// posed_from_rest  [bones, at least bone_count()] finite; bones that it lacks stay at rest
    ///
    /// A vertex of fewer than two bones stays, as do all in the rest pose, to the bit. The result does not depend on the
    /// number of threads.
    void apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
               const BulgeLimitOptions& options = {}) const noexcept;

    /// What it was made of, to make it anew with the same bits.
    struct Parts {
        BoundMesh mesh;
        std::vector<BoneSegment<float>> segments;
        Affine<float> bones_from_model;
        std::vector<float> weights;
    };
    [[nodiscard]] Parts parts() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
