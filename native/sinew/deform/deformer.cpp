// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/deformer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "sinew/deform/kernels.h"
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

void check_points(std::span<const Vec3<float>> points) {
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        const Vec3<float>& p = points[vertex];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            fail("rest_points", "finite values", "NaN or infinity at vertex " + std::to_string(vertex));
        }
    }
}

void check(const BindData& data) {
    check_points(data.rest_points);
    const std::size_t vertex_count = data.rest_points.size();
    const std::size_t influence_count = data.influence_bones.size();
    if (influence_count > std::numeric_limits<std::int32_t>::max()) {
        fail("influence_bones", "fewer than 2^31 influences", std::to_string(influence_count));
    }
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
    for (std::size_t i = 0; i < influence_count; ++i) {
        if (data.influence_bones[i] < 0) {
            fail("influence_bones", "indices of bones, 0 or more",
                 std::to_string(data.influence_bones[i]) + " at influence " + std::to_string(i));
        }
        const float weight = data.influence_weights[i];
        if (!std::isfinite(weight) || weight < 0.0f) {
            fail("influence_weights", "finite values, 0 or more",
                 std::to_string(weight) + " at influence " + std::to_string(i));
        }
    }
}

}  // namespace

Deformer::Deformer(MethodId method, const BindData& data) : method_(method) {
    check(data);
    vertex_count_ = data.rest_points.size();
    for (const std::int32_t bone : data.influence_bones) {
        bone_count_ = std::max(bone_count_, static_cast<std::size_t>(bone) + 1);
    }
    if (!data.rest_bones.empty() && data.rest_bones.size() < bone_count_) {
        fail("rest_bones", "at least " + std::to_string(bone_count_) + " bones",
             std::to_string(data.rest_bones.size()));
    }
    rest_bones_.assign(data.rest_bones.begin(), data.rest_bones.end());
    rest_bones_.resize(std::max(rest_bones_.size(), bone_count_));

    std::vector<std::uint32_t> offsets{0};
    std::vector<Influence<float>> influences;
    offsets.reserve(vertex_count_ + 1);
    influences.reserve(data.influence_bones.size());
    for (std::size_t vertex = 0; vertex < vertex_count_; ++vertex) {
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
    influence_count_ = influences.size();
    mesh_ = pack(data.rest_points, offsets, influences);
    for (const std::int32_t bone : mesh_.used_bones) {
        if (!has_unit_axes(cast<double>(rest_bones_[static_cast<std::size_t>(bone)]))) {
            stretched_bones_.push_back(bone);
        }
    }
}

void Deformer::set_rest_points(std::span<const Vec3<float>> rest_points) {
    if (rest_points.size() != vertex_count_) {
        fail("rest_points", std::to_string(vertex_count_) + " points", std::to_string(rest_points.size()));
    }
    check_points(rest_points);
    repack_points(mesh_, rest_points);
}

void Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    assert(posed_from_rest.size() >= bone_count_);
    assert(points.size() == vertex_count_);
    // One for each thread that deforms, kept for its next frame: nothing is allocated and nothing locked.
    thread_local Palette palette;
    prepare(method_, mesh_.used_bones, stretched_bones_, posed_from_rest.first(bone_count_), rest_bones_,
            options.bones_from_model, palette);

    Frame frame{method_, &mesh_, &palette, nullptr, nullptr, points.data()};
    std::array<Quad, kDisplacementQuads> there;
    std::array<Quad, kDisplacementQuads> back;
    if (method_ != MethodId::lbs && !is_identity(options.bones_from_model)) {
        const auto bones_from_model = cast<double>(options.bones_from_model);
        there = displacement_quads(bones_from_model);
        back = displacement_quads(inverse(bones_from_model));
        frame.bones_from_model = there.data();
        frame.model_from_bones = back.data();
    }
    const std::size_t threads = options.threads > 0
                                    ? options.threads
                                    : std::min(hardware_threads(), 1 + vertex_count_ / kVerticesWorthAThread);
    // By one reference: a larger capture makes std::function allocate.
    parallel_for(
        mesh_.blocks.size(), threads,
        [&frame](std::size_t begin, std::size_t end) { deform_blocks(frame, begin, end); }, kBlocksOfAPiece);
}

}  // namespace sinew
