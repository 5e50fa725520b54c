// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/deformer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "sinew/deform/kernels.h"
#include "sinew/deform/thread_pool.h"

namespace sinew {
namespace {

// Below this, waking a second thread costs more than it saves.
constexpr std::size_t kVerticesWorthAThread = 8192;

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
    rest_points_.assign(data.rest_points.begin(), data.rest_points.end());
    for (const std::int32_t bone : data.influence_bones) {
        bone_count_ = std::max(bone_count_, static_cast<std::size_t>(bone) + 1);
    }
    if (!data.rest_bones.empty() && data.rest_bones.size() < bone_count_) {
        fail("rest_bones", "at least " + std::to_string(bone_count_) + " bones",
             std::to_string(data.rest_bones.size()));
    }
    rest_bones_.assign(data.rest_bones.begin(), data.rest_bones.end());
    rest_bones_.resize(std::max(rest_bones_.size(), bone_count_));

    offsets_.reserve(data.rest_points.size() + 1);
    offsets_.push_back(0);
    influences_.reserve(data.influence_bones.size());
    for (std::size_t vertex = 0; vertex < data.rest_points.size(); ++vertex) {
        const auto begin = static_cast<std::size_t>(data.influence_offsets[vertex]);
        const auto end = static_cast<std::size_t>(data.influence_offsets[vertex + 1]);
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(data.influence_weights[i]);
        for (std::size_t i = begin; i < end; ++i) {
            const float weight = data.influence_weights[i];
            if (weight > 0.0f) {
                influences_.push_back(
                    {data.influence_bones[i], static_cast<float>(static_cast<double>(weight) / sum)});
            }
        }
        offsets_.push_back(static_cast<std::uint32_t>(influences_.size()));
    }
}

void Deformer::set_rest_points(std::span<const Vec3<float>> rest_points) {
    if (rest_points.size() != rest_points_.size()) {
        fail("rest_points", std::to_string(rest_points_.size()) + " points",
             std::to_string(rest_points.size()));
    }
    check_points(rest_points);
    std::copy(rest_points.begin(), rest_points.end(), rest_points_.begin());
}

void Deformer::deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                      std::span<Vec3<float>> points) const noexcept {
    assert(posed_from_rest.size() >= bone_count_);
    assert(points.size() == rest_points_.size());
    const MeshView mesh{rest_points_, offsets_, influences_};
    const std::size_t threads =
        options.threads > 0 ? options.threads
                            : std::min(hardware_threads(), 1 + rest_points_.size() / kVerticesWorthAThread);
    deform_mesh(method_, mesh, posed_from_rest.first(bone_count_), rest_bones_, options.bones_from_model,
                threads, points);
}

}  // namespace sinew
