// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/stage_state.h"

namespace sinew {

BoneStage::State::State(const Binding& binding, std::size_t bones, std::span<const float> group_weights,
                        const Affine<float>& bones_from_model)
    : packed(binding.packed()), bone_count(bones), space_rows(bones_from_model) {
    if (!group_weights.empty()) check_weights("weights", group_weights, packed->vertex_count);
    check_space(bones_from_model);
    weights = pack_weights(mesh, group_weights);
}

StageFrame BoneStage::State::frame(Vec3<float>* points) const noexcept {
    return {{.mesh = &mesh,
             .rest_points = own_rest_points.empty() ? mesh.rest_points.data() : own_rest_points.data(),
             .vertex_data = nullptr,
             .bones = mesh.bones.data(),
             .palette = nullptr,
             .spaces = space_rows.spaces(),
             .parameters = nullptr,
             .points = points},
            weights.empty() ? nullptr : weights.data()};
}

BoneStage::BoneStage(Owned<State> state) noexcept : state_(std::move(state)) {}

Status BoneStage::set_rest_points(std::span<const Vec3<float>> rest_points,
                                  const Affine<float>& bones_from_model) noexcept {
    State& state = *state_;
    Status status = status_of_points(rest_points, vertex_count());
    if (status == Status::ok && !is_space(bones_from_model)) status = Status::not_finite;
    if (status != Status::ok) return status;
    const std::scoped_lock lock(state.mutex);
    status = set_own_points(state.mesh, rest_points, state.own_rest_points);
    if (status != Status::ok) return status;
    state.space_rows = SpaceRows(bones_from_model);
    state.measure();
    return Status::ok;
}

std::size_t BoneStage::vertex_count() const noexcept { return state_->packed->vertex_count; }
std::size_t BoneStage::bone_count() const noexcept { return state_->bone_count; }

}  // namespace sinew
