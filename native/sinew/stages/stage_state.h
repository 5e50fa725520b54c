// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "sinew/base/fork_safe.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/stages/stage.h"

namespace sinew {

/// Maps a point (x, y, z, 1) to its position along a bone: 0 at the head, 1 at the tail; everywhere 0 for one of
/// length 0.
[[nodiscard]] inline Float4 position_along(const Vec3<double>& head, const Vec3<double>& tail) noexcept {
    const Vec3<double> along = tail - head;
    const double squared = glm::dot(along, along);
    const Vec3<double> position = along * (squared > 0.0 ? 1.0 / squared : 0.0);
    return float4(position.x, position.y, position.z, -glm::dot(position, head));
}

/// The arguments of one call that the kernels of all these stages have; palette and parameters are null.
struct StageFrame : Frame {
    const Lanes<float>* weights;  // [blocks] of the vertex group; null if all are 1
};

/// What the stages keep of a mesh. A stage adds what it measures of the rest points and of the space.
struct BoneStage::State {
    /// Shares the memory of `binding`. Throws for weights that are not one for each vertex, and a singular transform.
    ///
    /// bones             of a whole pose
    /// weights           [vertices] of the vertex group, clamped to 0 to 1; empty: all 1
    /// bones_from_model  maps rest points to the space of the bones
    State(const Binding& binding, std::size_t bones, std::span<const float> weights,
          const Affine<float>& bones_from_model);
    virtual ~State() = default;

    /// Makes the state of a stage.
    template <class Derived, class Data>
    [[nodiscard]] static Owned<State> make(const Binding& binding, const Data& data) {
        return {new Derived(binding, data), [](State* state) { delete state; }};
    }

    /// Called for other rest points or another space, and by the constructors of stages.
    virtual void measure() noexcept = 0;

    [[nodiscard]] StageFrame frame(Vec3<float>* points) const noexcept;

    /// The motion of the bone with this number in the pose.
    [[nodiscard]] static Affine<double> motion(std::span<const Affine<float>> posed_from_rest,
                                               std::int32_t bone) noexcept {
        const auto number = static_cast<std::size_t>(bone);
        return number < posed_from_rest.size() ? cast<double>(posed_from_rest[number]) : Affine<double>{};
    }

    std::shared_ptr<const PackedBinding> packed;
    const PackedMesh& mesh = packed->mesh;
    std::size_t bone_count;
    std::vector<Lanes<float>> own_rest_points;  // empty: use those of the binding
    std::vector<Lanes<float>> weights;          // [blocks], or empty
    SpaceRows space_rows;
    mutable ForkSafeMutex mutex;  // of what apply() and set_rest_points() write
};

}  // namespace sinew
