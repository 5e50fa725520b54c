// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deformer.h"

#include <algorithm>
#include <array>
#include <vector>

#include "sinew/lanes/palette_store.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/methods/signs.h"
#include "sinew/stages/mix/mix_blocks.h"

namespace sinew {
namespace {

/// The parameters of one method for one frame. One more than the maximum, which may be 0.
using ParameterValues = std::array<double, kMaxMethodParameters + 1>;

ParameterValues valid_values(const MethodInfo& method, std::span<const double> given) noexcept {
    ParameterValues values{};
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

struct Deformer::State {
    State(std::shared_ptr<const PackedBinding> packed, std::vector<Lanes<float>> own_rest_points,
          const MethodInfo& method, const std::optional<MixData>& mix);

    /// With its own binding, whose rest points it moves out of `packed`, since nothing else reads them.
    static Owned<State> alone(const BindData& data, const MethodInfo& method,
                              const std::optional<MixData>& mix) {
        const auto packed = std::make_shared<PackedBinding>(data);
        std::vector<Lanes<float>> rest_points = std::move(packed->mesh.rest_points);
        return make_owned<State>(packed, std::move(rest_points), method, mix);
    }

    [[nodiscard]] std::span<const Kernel* const> kernels_in_use() const {
        return std::span(kernels).first(mix ? 2 : 1);
    }

    [[nodiscard]] std::span<const Lanes<float>> rest_points() const {
        return own_rest_points.empty() ? std::span(packed->mesh.rest_points) : std::span(own_rest_points);
    }

    std::shared_ptr<const PackedBinding> packed;
    std::vector<Lanes<float>> own_rest_points;  // empty: use those of the binding
    std::array<std::size_t, 2> methods;         // indices into Methods; the second is that of the mix
    std::array<const Kernel*, 2> kernels;
    std::optional<MixWeights> mix;
    BoneSets sets;  // empty unless a kernel needs sets
    PaletteStore palettes;

private:
    [[nodiscard]] BoneSets wanted_sets() const {
        const auto wants = [](const Kernel* kernel) { return kernel->set_rows != nullptr; };
        return std::ranges::any_of(kernels_in_use(), wants) ? find_bone_sets(packed->mesh) : BoneSets{};
    }
};

Deformer::State::State(std::shared_ptr<const PackedBinding> from, std::vector<Lanes<float>> rest_points,
                       const MethodInfo& method, const std::optional<MixData>& with)
    : packed(std::move(from)),
      own_rest_points(std::move(rest_points)),
      methods{checked_method("method", method, *packed),
              with ? checked_method("mix", with->method, *packed) : 0},
      kernels{&kernel_at(methods[0]), &kernel_at(methods[1])},
      mix(with ? std::optional(checked_mix(packed->mesh, with->weights, packed->vertex_count))
               : std::nullopt),
      sets(wanted_sets()),
      palettes(kernels_in_use(), packed->mesh.used_bones.size(), sets.bones.size()) {}

Deformer::Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix)
    : state_(make_owned<State>(binding.packed(), std::vector<Lanes<float>>{}, method, mix)) {}

Deformer::Deformer(const BindData& data, const MethodInfo& method, const std::optional<MixData>& mix)
    : state_(State::alone(data, method, mix)) {}

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

Status Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    const PackedBinding& packed = *state_->packed;
    if (points.size() != packed.vertex_count) return Status::size;
    const PaletteStore::Reading reading(state_->palettes);
    const Bones bones{packed.mesh.used_bones,   packed.stretched_bones, posed_from_rest,  packed.rest_bones,
                      options.bones_from_model, &state_->sets,          options.rotations};
    const SpaceRows rows(options.bones_from_model);
    const std::array<ParameterValues, 2> parameters{
        valid_values(kMethods[state_->methods[0]], options.parameters),
        valid_values(kMethods[state_->methods[1]], options.mix_parameters)};
    std::array<Frame, 2> frames;
    for (std::size_t k = 0; k < state_->kernels_in_use().size(); ++k) {
        const Kernel& kernel = *state_->kernels[k];
        Palette& palette = reading.palette(k);
        // Methods whose kernel can keep signs have that parameter first.
        fill_palette(kernel, packed.mesh.pairs, bones, Signs::are_kept(parameters[k]), palette);
        frames[k] = {&packed.mesh,
                     state_->rest_points().data(),
                     packed.vertex_data[state_->methods[k]].get(),
                     kernel.set_rows != nullptr ? state_->sets.entries.data() : packed.mesh.bones.data(),
                     &palette,
                     rows.spaces(),
                     parameters[k].data(),
                     points.data()};
    }
    parallel_for_blocks(packed.mesh, points.size(), options.threads, [&](std::size_t begin, std::size_t end) {
        if (state_->mix) {
            deform_mix(state_->kernels, frames, *state_->mix, begin, end);
        } else {
            state_->kernels[0]->deform[target_in_use()](frames[0], begin, end);
        }
    });
    return Status::ok;
}

}  // namespace sinew
