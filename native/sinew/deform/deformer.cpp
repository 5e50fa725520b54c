// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/deformer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "sinew/deform/kernels.h"
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
constexpr std::size_t kBlocksOfAPiece = 256;

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

void check_most(const std::string& argument, const std::string& of, std::size_t most, std::size_t got) {
    if (got > most) fail(argument, "at most " + std::to_string(most) + " " + of, std::to_string(got));
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
    check_most("rest_points", "vertices", kMaxVertices, vertex_count);
    check_most("influence_bones", "influences", kMaxInfluences, influence_count);
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

}  // namespace

struct Deformer::Bound {
    MethodId method;
    PackedMesh mesh;
    std::vector<Affine<float>> rest_bones;      // of mesh.used_bones; or empty: all identity
    std::vector<std::int32_t> stretched_bones;  // of mesh.used_bones, those whose axes are not of unit length
    std::size_t vertex_count;
    std::size_t influence_count;
    std::size_t bone_count;
    PaletteStore palettes;
};

Deformer::Deformer(MethodId method, const BindData& data) {
    check(data);
    const std::size_t vertex_count = data.rest_points.size();
    std::size_t bone_count = 0;
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
        for (std::size_t i = begin; i < end; ++i) {
            const float weight = data.influence_weights[i];
            if (weight > 0.0f) {
                influences.push_back(
                    {data.influence_bones[i], static_cast<float>(static_cast<double>(weight) / sum)});
            }
        }
        offsets.push_back(static_cast<std::uint32_t>(influences.size()));
    }
    PackedMesh mesh = pack(data.rest_points, offsets, influences);

    std::vector<Affine<float>> rest_bones;
    std::vector<std::int32_t> stretched_bones;
    if (!data.rest_bones.empty() && method != MethodId::lbs) {
        for (const std::int32_t bone : mesh.used_bones) {
            const Affine<float>& rest_bone = data.rest_bones[static_cast<std::size_t>(bone)];
            if (!has_unit_axes(cast<double>(rest_bone))) {
                stretched_bones.push_back(static_cast<std::int32_t>(rest_bones.size()));
            }
            rest_bones.push_back(rest_bone);
        }
    }
    const std::size_t used = mesh.used_bones.size();
    bound_.reset(new Bound{method, std::move(mesh), std::move(rest_bones), std::move(stretched_bones),
                           vertex_count, influences.size(), bone_count, PaletteStore(method, used)});
}

Deformer::Deformer(Deformer&&) noexcept = default;
Deformer& Deformer::operator=(Deformer&&) noexcept = default;
Deformer::~Deformer() = default;

MethodId Deformer::method() const noexcept { return bound_->method; }
std::size_t Deformer::vertex_count() const noexcept { return bound_->vertex_count; }
std::size_t Deformer::influence_count() const noexcept { return bound_->influence_count; }
std::size_t Deformer::bone_count() const noexcept { return bound_->bone_count; }

void Deformer::set_rest_points(std::span<const Vec3<float>> rest_points) {
    if (rest_points.size() != bound_->vertex_count) {
        fail("rest_points", std::to_string(bound_->vertex_count) + " points",
             std::to_string(rest_points.size()));
    }
    check_points(rest_points);
    const PaletteStore::Writing writing(bound_->palettes);
    repack_points(bound_->mesh, rest_points);
}

void Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    if (points.size() != bound_->vertex_count) return;
    const MethodId method = bound_->method;
    const PackedMesh& mesh = bound_->mesh;
    const PaletteStore::Reading reading(bound_->palettes);
    Palette& palette = reading.palette();
    prepare(method, mesh.used_bones, bound_->stretched_bones, posed_from_rest, bound_->rest_bones,
            options.bones_from_model, palette);

    Frame frame{method, &mesh, &palette, nullptr, nullptr, points.data()};
    std::array<Quad, kDisplacementQuads> there;
    std::array<Quad, kDisplacementQuads> back;
    if (method != MethodId::lbs && !is_identity(options.bones_from_model)) {
        const auto bones_from_model = cast<double>(options.bones_from_model);
        there = displacement_quads(bones_from_model);
        back = displacement_quads(inverse(bones_from_model));
        frame.bones_from_model = there.data();
        frame.model_from_bones = back.data();
    }
    const std::size_t threads = options.threads > 0
                                    ? options.threads
                                    : std::min(hardware_threads(), 1 + points.size() / kVerticesWorthAThread);
    // By one reference: a larger capture makes std::function allocate.
    parallel_for(
        mesh.blocks.size(), threads,
        [&frame](std::size_t begin, std::size_t end) { deform_blocks(frame, begin, end); }, kBlocksOfAPiece);
}

}  // namespace sinew
