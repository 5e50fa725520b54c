// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/binding.h"
#include "sinew/export.h"
#include "sinew/skeleton/pose.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"

namespace sinew {

/// What a BulgeLimit is constructed from besides a Binding.
struct BulgeLimitData {
    std::span<const BoneSegment<float>> segments;  // [bones] at rest, in the space of posed_from_rest
    Affine<float> bones_from_model{};              // maps rest points to that space; invertible
    std::span<const float> weights{};  // [vertices] of the vertex group, clamped to 0 to 1; empty: all 1
};

/// How to limit one frame.
struct BulgeLimitOptions {
    BulgeForm form = BulgeForm::continuous;
    float strength = 1.0f;  // clamped to 0 to 1; NaN: 1
    std::size_t threads = 0;
};

/// The stage `bulge_limit` (stages/bulge_limit/bulge_limit.h) for one mesh, applied after Deformer::deform().
class SINEW_EXPORT BulgeLimit {
public:
    /// Shares the memory of `binding`. Throws also for fewer segments than bones, and for a singular transform.
    BulgeLimit(const Binding& binding, const BulgeLimitData& data);

    /// Sets other rest points [vertices], or the same points with another bones_from_model. Takes about as long
    /// as apply().
    ///
    /// bones_from_model  invertible
    Status set_rest_points(std::span<const Vec3<float>> rest_points,
                           const Affine<float>& bones_from_model = {}) noexcept;

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// As Binding::bone_count().
    [[nodiscard]] std::size_t bone_count() const noexcept;

    /// Limits the points in place.
    ///
    /// points  [vertices] deformed, model space
    /// pose    only its bones are read: the space is that of the rest points
    ///
    /// Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit for bit.
    Status apply(std::span<Vec3<float>> points, const Pose& pose,
                 const BulgeLimitOptions& options = {}) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
