// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deformer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "sinew/base/thread_pool.h"
#include "sinew/lanes/kernels.h"
#include "sinew/lanes/palette_store.h"
#include "sinew/mesh/bone_sets.h"
#include "sinew/mesh/check_bind_data.h"
#include "sinew/mesh/packed_mesh.h"
#include "sinew/methods/ddm/bone_moments.h"
#include "sinew/stages/mix/mixed_blocks.h"
#include "sinew/transform/convert.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

// Below this, waking a second thread costs more than it saves.
constexpr std::size_t kVerticesWorthAThread = 32768;

// 4096 vertices: few enough to balance threads of unequal speed, many enough that fetching a chunk costs nothing.
constexpr std::size_t kBlocksOfAChunk = 256;

/// The kernel of each method, in the order of Methods.
const Kernel& kernel_at(std::size_t method) noexcept {
    static const auto kernels =
        std::apply([](const auto&... methods) { return std::array{&methods.kernel()...}; }, Methods{});
    return *kernels[method];
}

std::size_t checked_method(const std::string& argument, const MethodInfo& method) {
    const std::size_t index = index_of(method);
    if (index < kMethodCount) return index;
    std::string names;
    for (const MethodInfo& known : kMethods) names += (names.empty() ? "" : ", ") + std::string(known.name);
    fail(argument, "one of " + names, "a method of number " + std::to_string(method.number));
}

void check_moments(const std::string& name, std::span<const float> rows, std::size_t vertex_count) {
    if (rows.size() % kMomentFloats != 0) {
        fail("vertex_data", "rows of " + std::to_string(kMomentFloats) + " numbers of " + name,
             std::to_string(rows.size()) + " numbers");
    }
    const auto fail_at = [&](std::size_t row, const std::string& wanted, const std::string& got) {
        fail("vertex_data", wanted, got + " of " + name + " in row " + std::to_string(row));
    };
    const auto is_number = [](float value, std::size_t count) {
        return value >= 0.0f && value < static_cast<float>(count) && value == std::floor(value);
    };
    for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
        const auto row = rows.subspan(i, kMomentFloats);
        const std::size_t number = i / kMomentFloats;
        for (const float value : row) {
            if (!std::isfinite(value)) fail_at(number, "finite values", "NaN or infinity");
        }
        if (!is_number(row[0], vertex_count)) fail_at(number, "numbers of vertices", "another");
        if (!is_number(row[1], kMaxBones)) fail_at(number, "numbers of bones", "another");
        if (row[2] < 0.0f) fail_at(number, "weights of 0 and more", "a negative one");
        if (i == 0) continue;
        const float* const before = row.data() - kMomentFloats;
        if (row[0] < before[0] || (row[0] == before[0] && row[1] <= before[1])) {
            fail_at(number, "rising vertices and bones", "others");
        }
    }
}

/// Checks vertex data and returns the index of its method.
std::size_t checked_vertex_data(const VertexData& data, std::size_t vertex_count) {
    const std::size_t index = checked_method("vertex_data", data.method);
    const std::string name(kMethods[index].name);
    const std::size_t floats = kMethods[index].vertex_floats;
    if (floats == 0) fail("vertex_data", "that of methods that need it", "that of " + name);
    if (kMethods[index].keeps_moments) {
        check_moments(name, data.values, vertex_count);
        return index;
    }
    if (data.values.size() != vertex_count * floats) {
        fail("vertex_data", std::to_string(vertex_count * floats) + " numbers of " + name,
             std::to_string(data.values.size()));
    }
    for (std::size_t i = 0; i < data.values.size(); ++i) {
        if (!std::isfinite(data.values[i])) {
            fail("vertex_data", "finite values",
                 "NaN or infinity of " + name + " at vertex " + std::to_string(i / floats));
        }
    }
    return index;
}

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

struct Binding::Packed {
    explicit Packed(const BindData& data);

    /// rest_points  mesh.rest_points, or others
    [[nodiscard]] BoundMesh unpack(std::span<const Lanes<float>> rest_points) const;

    PackedMesh mesh;
    std::vector<Affine<float>> rest_bones;  // for each of mesh.used_bones; empty: all identity
    // indices into mesh.used_bones of bones whose axes are not of unit length
    std::vector<std::int32_t> stretched_bones;
    std::array<std::vector<Lanes<float>>, kMethodCount> vertex_rows;  // for each method; empty: none
    std::array<BoneMoments, kMethodCount> moments;                    // for methods that keep moments
    std::size_t vertex_count;
    std::size_t influence_count;
    std::size_t bone_count = 0;
};

Binding::Packed::Packed(const BindData& data) {
    check(data);
    vertex_count = data.rest_points.size();
    for (const std::int32_t bone : data.influence_bones) {
        bone_count = std::max(bone_count, static_cast<std::size_t>(bone) + 1);
    }
    // Vertex data may name bones that no influence names, since its weights may depend on the vertices'
    // positions.
    std::vector<std::int32_t> bones_of_vertex_data;
    for (const VertexData& of_method : data.vertex_data) {
        if (!kMethods[checked_vertex_data(of_method, vertex_count)].keeps_moments) continue;
        for (const std::int32_t bone : bones_of_moments(of_method.values)) {
            bones_of_vertex_data.push_back(bone);
            bone_count = std::max(bone_count, static_cast<std::size_t>(bone) + 1);
        }
    }
    check_rest_bones(data.rest_bones, bone_count);

    const NormalisedInfluences normalised = normalised_influences(data);
    influence_count = normalised.influences.size();
    mesh = pack(data.rest_points, normalised.offsets, normalised.influences, bones_of_vertex_data);
    for (const VertexData& of_method : data.vertex_data) {
        const std::size_t method = index_of(of_method.method);
        if (kMethods[method].keeps_moments) {
            moments[method] = pack_moments(mesh, of_method.values);
        } else {
            vertex_rows[method] = pack_values(mesh, of_method.values, of_method.method.vertex_floats);
        }
    }

    if (data.rest_bones.empty()) return;
    for (const std::int32_t bone : mesh.used_bones) {
        const Affine<float>& rest_bone = data.rest_bones[static_cast<std::size_t>(bone)];
        if (!has_unit_axes(cast<double>(rest_bone))) {
            stretched_bones.push_back(static_cast<std::int32_t>(rest_bones.size()));
        }
        rest_bones.push_back(rest_bone);
    }
}

BoundMesh Binding::Packed::unpack(std::span<const Lanes<float>> rest_points) const {
    BoundMesh bound = bound_mesh(mesh, rest_points, vertex_count, bone_count);
    for (std::size_t i = 0; i < kMethodCount; ++i) {
        if (!moments[i].blocks.empty())
            bound.vertex_data.push_back({kMethods[i], unpack_moments(mesh, moments[i])});
        if (vertex_rows[i].empty()) continue;
        bound.vertex_data.push_back(
            {kMethods[i], unpack_values(mesh, vertex_rows[i], vertex_count, kMethods[i].vertex_floats)});
    }
    if (rest_bones.empty()) return bound;
    bound.rest_bones.resize(bone_count);
    for (std::size_t i = 0; i < mesh.used_bones.size(); ++i) {
        bound.rest_bones[static_cast<std::size_t>(mesh.used_bones[i])] = rest_bones[i];
    }
    return bound;
}

Binding::Binding(const BindData& data) : packed_(std::make_shared<const Packed>(data)) {}

std::size_t Binding::vertex_count() const noexcept { return packed_->vertex_count; }
std::size_t Binding::influence_count() const noexcept { return packed_->influence_count; }
std::size_t Binding::bone_count() const noexcept { return packed_->bone_count; }
BoundMesh Binding::unpack() const { return packed_->unpack(packed_->mesh.rest_points); }

struct Deformer::State {
    State(std::shared_ptr<const Binding::Packed> packed, std::vector<Lanes<float>> own_rest_points,
          const MethodInfo& method, const std::optional<MixData>& mix);

    /// With its own binding, whose rest points it moves out of `packed`, since nothing else reads them.
    static std::unique_ptr<State> alone(const BindData& data, const MethodInfo& method,
                                        const std::optional<MixData>& mix) {
        const auto packed = std::make_shared<Binding::Packed>(data);
        std::vector<Lanes<float>> rest_points = std::move(packed->mesh.rest_points);
        return std::make_unique<State>(packed, std::move(rest_points), method, mix);
    }

    [[nodiscard]] std::span<const Kernel* const> kernels_in_use() const {
        return std::span(kernels).first(mix ? 2 : 1);
    }

    [[nodiscard]] std::span<const Lanes<float>> rest_points() const {
        return own_rest_points.empty() ? std::span(packed->mesh.rest_points) : std::span(own_rest_points);
    }

    std::shared_ptr<const Binding::Packed> packed;
    std::vector<Lanes<float>> own_rest_points;  // empty: use those of the binding
    std::array<std::size_t, 2> methods;         // indices into Methods; the second is that of the mix
    std::array<const Kernel*, 2> kernels;
    std::optional<MixWeights> mix;
    BoneSets sets;  // empty unless a kernel needs sets
    PaletteStore palettes;

private:
    [[nodiscard]] BoneSets wanted_sets() const {
        const auto wants = [](const Kernel* kernel) { return kernel->set_bone_size > 0; };
        return std::ranges::any_of(kernels_in_use(), wants) ? find_bone_sets(packed->mesh) : BoneSets{};
    }
};

Deformer::State::State(std::shared_ptr<const Binding::Packed> from, std::vector<Lanes<float>> rest_points,
                       const MethodInfo& method, const std::optional<MixData>& with)
    : packed(std::move(from)),
      own_rest_points(std::move(rest_points)),
      methods{checked_method("method", method), with ? checked_method("mix", with->method) : 0},
      kernels{&kernel_at(methods[0]), &kernel_at(methods[1])},
      mix(with ? std::optional(checked_mix(packed->mesh, with->weights, packed->vertex_count))
               : std::nullopt),
      sets(wanted_sets()),
      palettes(kernels_in_use(), packed->mesh.used_bones.size(), sets.bones.size()) {}

Deformer::Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix)
    : state_(std::make_unique<State>(binding.packed_, std::vector<Lanes<float>>{}, method, mix)) {}

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
    const Binding::Packed& packed = *state_->packed;
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
    const Binding::Packed& packed = *state_->packed;
    if (points.size() != packed.vertex_count) return false;
    const PaletteStore::Reading reading(state_->palettes);
    const Bones bones{packed.mesh.used_bones, packed.stretched_bones,   posed_from_rest,
                      packed.rest_bones,      options.bones_from_model, &state_->sets};
    const bool same_space = is_identity(options.bones_from_model);
    std::array<Float4, kDisplacementRows> bones_from_model;
    std::array<Float4, kDisplacementRows> model_from_bones;
    if (!same_space) {
        const auto transform = cast<double>(options.bones_from_model);
        write_displacement(transform, bones_from_model.data());
        write_displacement(inverse(transform), model_from_bones.data());
    }
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
        prepare(kernel, bones, palette);
        if (kernel.set_bone_size > 0) {
            // mesh.pairs are pairs of bones, but these rows belong to sets, so each set has to be tested.
            std::fill_n(palette.may_be_plain, state_->sets.bones.size(), std::uint8_t{1});
        } else {
            find_plain(packed.mesh.pairs, packed.mesh.used_bones.size(), palette);
        }
        const bool changes_space = kernel.is_rigid && !same_space;
        const std::vector<Lanes<float>>& vertex_rows = packed.vertex_rows[state_->methods[k]];
        const BoneMoments& moments = packed.moments[state_->methods[k]];
        work.frames[k] = {&packed.mesh,
                          state_->rest_points().data(),
                          vertex_rows.empty() ? nullptr : vertex_rows.data(),
                          moments.blocks.empty() ? nullptr : &moments,
                          kernel.set_bone_size > 0 ? state_->sets.entries.data() : packed.mesh.bones.data(),
                          &palette,
                          changes_space ? bones_from_model.data() : nullptr,
                          changes_space ? model_from_bones.data() : nullptr,
                          parameters[k].data(),
                          points.data()};
    }
    // A single reference: with a larger capture std::function would allocate.
    parallel_for(
        packed.mesh.blocks.size(), useful_threads(options.threads, points.size(), kVerticesWorthAThread),
        [&work](std::size_t begin, std::size_t end) {
            if (work.state.mix) {
                deform_mixed_blocks(work.state.kernels, work.frames, *work.state.mix, begin, end);
            } else {
                work.state.kernels[0]->target().deform(work.frames[0], begin, end);
            }
        },
        kBlocksOfAChunk);
    return true;
}

}  // namespace sinew
