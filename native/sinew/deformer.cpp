// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deformer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "sinew/lanes/palette_store.h"
#include "sinew/mesh/bone_sets.h"
#include "sinew/mesh/check_bind_data.h"
#include "sinew/methods/packed_binding.h"
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
    if (weights.size() != vertex_count) {
        fail("mix", "a weight for each of the " + std::to_string(vertex_count) + " vertices",
             std::to_string(weights.size()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        if (std::isnan(weights[vertex])) {
            fail("mix", "weights from 0 to 1", "NaN at vertex " + std::to_string(vertex));
        }
    }
    return pack_mix(mesh, weights);
}

}  // namespace

struct Deformer::State {
    State(std::shared_ptr<const PackedBinding> packed, std::vector<Lanes<float>> own_rest_points,
          const MethodInfo& method, const std::optional<MixData>& mix);

    /// With its own binding, whose rest points it moves out of `packed`, since nothing else reads them.
    static std::unique_ptr<State> alone(const BindData& data, const MethodInfo& method,
                                        const std::optional<MixData>& mix) {
        const auto packed = std::make_shared<PackedBinding>(data);
        std::vector<Lanes<float>> rest_points = std::move(packed->mesh.rest_points);
        return std::make_unique<State>(packed, std::move(rest_points), method, mix);
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
    : state_(std::make_unique<State>(binding.packed(), std::vector<Lanes<float>>{}, method, mix)) {}

Deformer::Deformer(const BindData& data, const MethodInfo& method, const std::optional<MixData>& mix)
    : state_(State::alone(data, method, mix)) {}

Deformer::Deformer(Deformer&&) noexcept = default;
Deformer& Deformer::operator=(Deformer&&) noexcept = default;
Deformer::~Deformer() = default;

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

void Deformer::set_rest_points(std::span<const Vec3<float>> rest_points) {
    const PackedMesh& mesh = state_->packed->mesh;
    if (rest_points.size() != vertex_count()) {
        fail("rest_points", std::to_string(vertex_count()) + " points", std::to_string(rest_points.size()));
    }
    check_points(rest_points);
    const PaletteStore::Writing writing(state_->palettes);
    state_->own_rest_points.resize(kPointRows * mesh.blocks.size());
    pack_points(mesh, rest_points, state_->own_rest_points);
}

bool Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    const PackedBinding& packed = *state_->packed;
    if (points.size() != packed.vertex_count) return false;
    const PaletteStore::Reading reading(state_->palettes);
    const Bones bones{packed.mesh.used_bones, packed.stretched_bones,   posed_from_rest,
                      packed.rest_bones,      options.bones_from_model, &state_->sets};
    const SpaceRows rows(options.bones_from_model);
    const std::array<ParameterValues, 2> parameters{
        valid_values(kMethods[state_->methods[0]], options.parameters),
        valid_values(kMethods[state_->methods[1]], options.mix_parameters)};
    struct Work {
        const State& state;
        std::array<Frame, 2> frames;
    } work{*state_, {}};
    for (std::size_t k = 0; k < state_->kernels_in_use().size(); ++k) {
        const Kernel& kernel = *state_->kernels[k];
        Palette& palette = reading.palette(k);
        fill_palette(kernel, packed.mesh.pairs, bones, palette);
        work.frames[k] = {&packed.mesh,
                          state_->rest_points().data(),
                          packed.vertex_data[state_->methods[k]].get(),
                          kernel.set_rows != nullptr ? state_->sets.entries.data() : packed.mesh.bones.data(),
                          &palette,
                          rows.spaces(),
                          parameters[k].data(),
                          points.data()};
    }
    parallel_for_blocks(packed.mesh, points.size(), options.threads,
                        [&work](std::size_t begin, std::size_t end) {
                            if (work.state.mix) {
                                deform_mix(work.state.kernels, work.frames, *work.state.mix, begin, end);
                            } else {
                                work.state.kernels[0]->deform[target_in_use()](work.frames[0], begin, end);
                            }
                        });
    return true;
}

}  // namespace sinew
