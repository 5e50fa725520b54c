// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deformer.h"

#include <algorithm>
#include <array>
#include <vector>

#include "sinew/deformer_state.h"
#include "sinew/methods/signs.h"

namespace sinew {
namespace {

/// The parameters of one method for one frame.
PreparedPose::ParameterValues valid_values(const MethodInfo& method, std::span<const double> given) noexcept {
    PreparedPose::ParameterValues values{};
    for (std::size_t i = 0; i < method.parameters.size(); ++i) {
        const Parameter& parameter = method.parameters[i];
        values[i] = i < given.size() ? valid_value(parameter, given[i]) : parameter.initial;
    }
    return values;
}

MixWeights checked_mix(const PackedMesh& mesh, std::span<const float> weights, std::size_t vertex_count) {
    check_weights("mix", weights, vertex_count);
    return pack_mix(mesh, weights);
}

}  // namespace

BoneSets Deformer::State::wanted_sets() const {
    const auto wants = [](const Kernel* kernel) { return kernel->rows.are_of_sets; };
    return std::ranges::any_of(kernels_in_use(), wants) ? find_bone_sets(packed->mesh) : BoneSets{};
}

Deformer::State::State(std::shared_ptr<const PackedBinding> from, const MethodInfo& method,
                       const std::optional<MixData>& mix_data)
    : packed(std::move(from)),
      methods{checked_method("method", method, *packed),
              mix_data ? checked_method("mix", mix_data->method, *packed) : 0},
      kernels{&kernel_at(methods[0]), &kernel_at(methods[1])},
      mix(mix_data ? std::optional(checked_mix(packed->mesh, mix_data->weights, packed->vertex_count))
                   : std::nullopt),
      sets(wanted_sets()),
      palettes({kernels[0]->rows, kernels[1]->rows}, mix ? 2 : 1, packed->mesh.used_bones.size(),
               sets.bones.size()) {}

Deformer::Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix)
    : state_(make_owned<State>(binding.packed(), method, mix)) {}

Deformer::Deformer(const BindData& data, const MethodInfo& method, const std::optional<MixData>& mix)
    : Deformer(Binding(data), method, mix) {
    state_->own_rest_points = state_->packed->mesh.rest_points;
}

const MethodInfo& Deformer::method() const noexcept { return kMethods[state_->methods[0]]; }
const MethodInfo* Deformer::mixed_method() const noexcept {
    return state_->mix ? &kMethods[state_->methods[1]] : nullptr;
}
std::size_t Deformer::vertex_count() const noexcept { return state_->packed->vertex_count; }
std::size_t Deformer::influence_count() const noexcept { return state_->packed->influence_count; }
std::size_t Deformer::bone_count() const noexcept { return state_->packed->bone_count; }

BoundMesh Deformer::unpack() const {
    const PaletteStore::Reading reading(state_->palettes);
    const PackedBinding& packed = *state_->packed;
    return packed.unpack(state_->rest_points());
}

std::vector<float> Deformer::mix_weights() const {
    if (!state_->mix) return {};
    return unpack_values(state_->packed->mesh, state_->mix->weights, vertex_count());
}

Status Deformer::set_rest_points(std::span<const Vec3<float>> rest_points) noexcept {
    const Status status = status_of_points(rest_points, vertex_count());
    if (status != Status::ok) return status;
    const PaletteStore::Writing writing(state_->palettes);
    return set_own_points(state_->packed->mesh, rest_points, state_->own_rest_points);
}

PreparedPose Deformer::State::prepare(const Pose& pose, const DeformOptions& options,
                                      const PaletteStore::Reading& reading) const noexcept {
    PreparedPose prepared{SpaceRows(pose.bones_from_model),
                          {valid_values(kMethods[methods[0]], options.parameters),
                           valid_values(kMethods[methods[1]], options.mix_parameters)}};
    const std::vector<std::int32_t>& used = packed->mesh.used_bones;
    // Nearly always all of them.
    std::size_t posed = used.size();
    while (posed > 0 && static_cast<std::size_t>(used[posed - 1]) >= pose.posed_from_rest.size()) --posed;
    const Bones bones{.used = used,
                      .posed = posed,
                      .stretched = packed->stretched_bones,
                      .rest_bones = packed->rest_bones,
                      .pairs = &packed->mesh.pairs,
                      .sets = &sets,
                      .pose = pose};
    for (std::size_t k = 0; k < kernels_in_use().size(); ++k) {
        Palette& palette = reading.palette(k);
        const bool keeps_signs = Signs::are_kept(kMethods[methods[k]], prepared.parameters[k]);
        kernels[k]->fill_palette[target_in_use()](bones, keeps_signs, palette);
        prepared.palettes[k] = &palette;
    }
    return prepared;
}

void Deformer::State::deform(const PreparedPose& pose, std::span<const Lanes<float>> rest_points,
                             std::size_t threads, Vec3<float>* points) const noexcept {
    const PackedMesh& mesh = packed->mesh;
    std::array<Frame, 2> frames;
    for (std::size_t k = 0; k < kernels_in_use().size(); ++k) {
        frames[k] = {.mesh = &mesh,
                     .rest_points = rest_points.data(),
                     .vertex_data = packed->vertex_data[methods[k]].get(),
                     .bones = kernels[k]->rows.are_of_sets ? sets.entries.data() : mesh.bones.data(),
                     .palette = pose.palettes[k],
                     .spaces = pose.space_rows.spaces(),
                     .parameters = pose.parameters[k].data(),
                     .points = points};
    }
    parallel_for_blocks(mesh, packed->vertex_count, threads, [&](std::size_t begin, std::size_t end) {
        if (mix) {
            deform_mix(kernels, frames, *mix, begin, end);
        } else {
            kernels[0]->deform[target_in_use()](frames[0], begin, end);
        }
    });
}

Status Deformer::deform(const Pose& pose, const DeformOptions& options,
                        std::span<Vec3<float>> points) const noexcept {
    if (points.size() != vertex_count()) return Status::size;
    const PaletteStore::Reading reading(state_->palettes);
    const PreparedPose prepared = state_->prepare(pose, options, reading);
    state_->deform(prepared, state_->rest_points(), options.threads, points.data());
    return Status::ok;
}

}  // namespace sinew
