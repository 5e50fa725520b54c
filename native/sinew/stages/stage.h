// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/binding.h"
#include "sinew/export.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// A stage that follows the blend and reads the bones of a mesh. Each such stage adds its apply().
class SINEW_EXPORT BoneStage {
public:
    /// Sets other rest points [vertices] and their space. The first call allocates memory for the points. After a
    /// fork, repeat a call that was in progress.
    ///
    /// bones_from_model  invertible; not given: the identity, whatever was set before
    Status set_rest_points(std::span<const Vec3<float>> rest_points,
                           const Affine<float>& bones_from_model = {}) noexcept;

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// How many bones a whole pose has; those that a pose lacks stay at rest.
    [[nodiscard]] std::size_t bone_count() const noexcept;

protected:
    struct State;
    explicit BoneStage(Owned<State> state) noexcept;

    Owned<State> state_;
};

}  // namespace sinew
