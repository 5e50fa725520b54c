// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/deformer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "sinew/deform/kernels.h"
#include "sinew/deform/mixed_blocks.h"
#include "sinew/deform/packed_mesh.h"
#include "sinew/deform/palette_store.h"
#include "sinew/deform/thread_pool.h"
#include "sinew/transform/convert.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

// Below this, waking a second thread costs more than it saves.
constexpr std::size_t kVerticesWorthAThread = 32768;

// 4096 vertices: small enough to even out threads of unequal speed, large enough that taking one costs
// nothing.
constexpr std::size_t kBlocksOfAChunk = 256;

// How far from 1 the sum of normalised weights may be, each of which was rounded.
constexpr double kNormalised = 1e-5;

[[noreturn]] void fail(const std::string& argument, const std::string& wanted, const std::string& got) {
    throw std::invalid_argument(argument + ": expected " + wanted + ", got " + got);
}

template <class T>
bool is_finite(const Vec3<T>& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check_points(std::span<const Vec3<float>> points) {
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        if (!is_finite(points[vertex])) {
            fail("rest_points", "finite values", "NaN or infinity at vertex " + std::to_string(vertex));
        }
    }
}

void check_limit(const std::string& argument, const std::string& of, std::size_t limit, std::size_t got) {
    if (got > limit) fail(argument, "at most " + std::to_string(limit) + " " + of, std::to_string(got));
}

/// bone_count  one more than the highest bone that an influence names
void check_rest_bones(std::span<const Affine<float>> rest_bones, std::size_t bone_count) {
    if (!rest_bones.empty() && rest_bones.size() < bone_count) {
        fail("rest_bones", "at least " + std::to_string(bone_count) + " bones",
             std::to_string(rest_bones.size()));
    }
    for (std::size_t bone = 0; bone < rest_bones.size(); ++bone) {
        const auto& [linear, translation] = rest_bones[bone];
        if (!is_finite(linear[0]) || !is_finite(linear[1]) || !is_finite(linear[2]) ||
            !is_finite(translation)) {
            fail("rest_bones", "finite values", "NaN or infinity at bone " + std::to_string(bone));
        }
    }
}

void check(const BindData& data) {
    const std::size_t vertex_count = data.rest_points.size();
    const std::size_t influence_count = data.influence_bones.size();
    check_limit("rest_points", "vertices", kMaxVertices, vertex_count);
    check_limit("influence_bones", "influences", kMaxInfluences, influence_count);
    check_points(data.rest_points);
    if (data.influence_weights.size() != influence_count) {
        fail("influence_weights",
             "one for each of the " + std::to_string(influence_count) + " influence_bones",
             std::to_string(data.influence_weights.size()));
    }
    if (data.influence_offsets.size() != vertex_count + 1) {
        fail("influence_offsets", std::to_string(vertex_count + 1) + " values (vertices + 1)",
             std::to_string(data.influence_offsets.size()));
    }
    if (data.influence_offsets.front() != 0) {
        fail("influence_offsets", "0 at the start", std::to_string(data.influence_offsets.front()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        if (data.influence_offsets[vertex + 1] < data.influence_offsets[vertex]) {
            fail("influence_offsets", "values that never fall",
                 std::to_string(data.influence_offsets[vertex + 1]) + " after " +
                     std::to_string(data.influence_offsets[vertex]) + " at vertex " + std::to_string(vertex));
        }
    }
    if (static_cast<std::size_t>(data.influence_offsets.back()) != influence_count) {
        fail("influence_offsets", std::to_string(influence_count) + " at the end (the number of influences)",
             std::to_string(data.influence_offsets.back()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const auto count =
            static_cast<std::size_t>(data.influence_offsets[vertex + 1] - data.influence_offsets[vertex]);
        if (count > kMaxVertexInfluences) {
            fail("influence_offsets",
                 "at most " + std::to_string(kMaxVertexInfluences) + " influences a vertex",
                 std::to_string(count) + " at vertex " + std::to_string(vertex));
        }
    }
    for (std::size_t i = 0; i < influence_count; ++i) {
        const std::int32_t bone = data.influence_bones[i];
        if (bone < 0) {
            fail("influence_bones", "indices of bones, 0 or more",
                 std::to_string(bone) + " at influence " + std::to_string(i));
        }
        if (static_cast<std::size_t>(bone) >= kMaxBones) {
            fail("influence_bones", "indices of bones below " + std::to_string(kMaxBones),
                 std::to_string(bone) + " at influence " + std::to_string(i));
        }
        const float weight = data.influence_weights[i];
        if (!std::isfinite(weight) || weight < 0.0f) {
            fail("influence_weights", "finite values, 0 or more",
                 std::to_string(weight) + " at influence " + std::to_string(i));
        }
    }
}

/// The kernel of each method, in the order of the list.
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

    /// With the rest points of `rows`.
    [[nodiscard]] BoundMesh unpack(std::span<const Lanes<float>> rows) const;

    PackedMesh mesh;
    std::vector<Affine<float>> rest_bones;      // of mesh.used_bones; or empty: all identity
    std::vector<std::int32_t> stretched_bones;  // of mesh.used_bones, those whose axes are not of unit length
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
    check_rest_bones(data.rest_bones, bone_count);

    std::vector<std::uint32_t> offsets{0};
    std::vector<Influence<float>> influences;
    offsets.reserve(vertex_count + 1);
    influences.reserve(data.influence_bones.size());
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const auto begin = static_cast<std::size_t>(data.influence_offsets[vertex]);
        const auto end = static_cast<std::size_t>(data.influence_offsets[vertex + 1]);
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(data.influence_weights[i]);
        if (data.is_normalised && sum != 0.0 && !(std::abs(sum - 1.0) < kNormalised)) {
            fail("influence_weights", "normalised ones, of sum 1",
                 "sum " + std::to_string(sum) + " at vertex " + std::to_string(vertex));
        }
        for (std::size_t i = begin; i < end; ++i) {
            const float weight = data.influence_weights[i];
            if (weight > 0.0f) {
                const double share = static_cast<double>(weight) / (data.is_normalised ? 1.0 : sum);
                influences.push_back({data.influence_bones[i], static_cast<float>(share)});
            }
        }
        offsets.push_back(static_cast<std::uint32_t>(influences.size()));
    }
    influence_count = influences.size();
    mesh = pack(data.rest_points, offsets, influences);

    if (data.rest_bones.empty()) return;
    for (const std::int32_t bone : mesh.used_bones) {
        const Affine<float>& rest_bone = data.rest_bones[static_cast<std::size_t>(bone)];
        if (!has_unit_axes(cast<double>(rest_bone))) {
            stretched_bones.push_back(static_cast<std::int32_t>(rest_bones.size()));
        }
        rest_bones.push_back(rest_bone);
    }
}

BoundMesh Binding::Packed::unpack(std::span<const Lanes<float>> rows) const {
    const UnpackedMesh unpacked = sinew::unpack(mesh, rows, vertex_count);
    BoundMesh bound{unpacked.rest_points, {}, {}, {}, {}};
    bound.influence_offsets.assign(unpacked.offsets.begin(), unpacked.offsets.end());
    for (const auto& [bone, weight] : unpacked.influences) {
        bound.influence_bones.push_back(bone);
        bound.influence_weights.push_back(weight);
    }
    const std::size_t named = mesh.used_bones.empty() ? 0 : static_cast<std::size_t>(mesh.used_bones.back()) + 1;
    if (named < bone_count) {
        // Named without weight, and dropped: of the last vertex, which takes it without weight.
        bound.influence_bones.push_back(static_cast<std::int32_t>(bone_count) - 1);
        bound.influence_weights.push_back(0.0f);
        ++bound.influence_offsets.back();
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
BoundMesh Binding::unpack() const { return packed_->unpack(packed_->mesh.rows); }

struct Deformer::State {
    State(std::shared_ptr<const Binding::Packed> packed, std::vector<Lanes<float>> own_rows,
          const MethodInfo& method, const std::optional<MixData>& mix);

    /// With the rows of `packed`, which nothing else reads.
    static std::unique_ptr<State> alone(const BindData& data, const MethodInfo& method,
                                        const std::optional<MixData>& mix) {
        const auto packed = std::make_shared<Binding::Packed>(data);
        std::vector<Lanes<float>> rows = std::move(packed->mesh.rows);
        return std::make_unique<State>(packed, std::move(rows), method, mix);
    }

    [[nodiscard]] std::span<const Kernel* const> kernels_in_use() const {
        return std::span(kernels).first(mix ? 2 : 1);
    }

    std::shared_ptr<const Binding::Packed> packed;
    std::vector<Lanes<float>> own_rows;  // empty: those of the binding
    std::array<std::size_t, 2> methods;  // indices in the list; the second is that of the mix
    std::array<const Kernel*, 2> kernels;
    std::optional<MixWeights> mix;
    PaletteStore palettes;
};

Deformer::State::State(std::shared_ptr<const Binding::Packed> from, std::vector<Lanes<float>> rows,
                       const MethodInfo& method, const std::optional<MixData>& with)
    : packed(std::move(from)),
      own_rows(std::move(rows)),
      methods{checked_method("method", method), with ? checked_method("mix", with->method) : 0},
      kernels{&kernel_at(methods[0]), &kernel_at(methods[1])},
      mix(with ? std::optional(checked_mix(packed->mesh, with->weights, packed->vertex_count))
               : std::nullopt),
      palettes(kernels_in_use(), packed->mesh.used_bones.size()) {}

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
    return packed.unpack(state_->own_rows.empty() ? packed.mesh.rows : state_->own_rows);
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
    if (state_->own_rows.empty()) state_->own_rows = mesh.rows;
    repack_points(mesh, rest_points, state_->own_rows);
}

void Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    const Binding::Packed& packed = *state_->packed;
    if (points.size() != packed.vertex_count) return;
    const PaletteStore::Reading reading(state_->palettes);
    const Bones bones{packed.mesh.used_bones, packed.stretched_bones, posed_from_rest, packed.rest_bones,
                      options.bones_from_model};
    const Lanes<float>* const rows =
        state_->own_rows.empty() ? packed.mesh.rows.data() : state_->own_rows.data();
    const bool same_space = is_identity(options.bones_from_model);
    std::array<Float4, kDisplacementRows> bones_from_model;
    std::array<Float4, kDisplacementRows> model_from_bones;
    if (!same_space) {
        const auto transform = cast<double>(options.bones_from_model);
        write_displacement(transform, bones_from_model.data());
        write_displacement(inverse(transform), model_from_bones.data());
    }
    struct Work {
        const State& state;
        std::array<Frame, 2> frames;
    } work{*state_, {}};
    for (std::size_t k = 0; k < state_->kernels_in_use().size(); ++k) {
        const Kernel& kernel = *state_->kernels[k];
        Palette& palette = reading.palette(k);
        prepare(kernel, bones, palette);
        find_plain(packed.mesh.pairs, packed.mesh.used_bones.size(), palette);
        const bool changes_space = kernel.is_rigid && !same_space;
        work.frames[k] = {&packed.mesh,
                          rows,
                          &palette,
                          changes_space ? bones_from_model.data() : nullptr,
                          changes_space ? model_from_bones.data() : nullptr,
                          points.data()};
    }
    const std::size_t threads = options.threads > 0
                                    ? options.threads
                                    : std::min(hardware_threads(), 1 + points.size() / kVerticesWorthAThread);
    // By one reference: a larger capture makes std::function allocate.
    parallel_for(
        packed.mesh.blocks.size(), threads,
        [&work](std::size_t begin, std::size_t end) {
            if (work.state.mix) {
                deform_mixed_blocks(work.state.kernels, work.frames, *work.state.mix, begin, end);
            } else {
                work.state.kernels[0]->target().deform(work.frames[0], begin, end);
            }
        },
        kBlocksOfAChunk);
}

}  // namespace sinew
