// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/methods/check_bind_data.h"

#include <cmath>

namespace sinew {
namespace {

// How far the sum of normalised weights may be from 1, since each was rounded.
constexpr double kNormalised = 1e-5;

void check_limit(const std::string& argument, const std::string& of, std::size_t limit, std::size_t got) {
    if (got > limit) fail(argument, "at most " + std::to_string(limit) + " " + of, std::to_string(got));
}

}  // namespace

void check(const BindData& data) {
    const std::size_t vertex_count = data.rest_points.size();
    const std::size_t influence_count = data.influence_bones.size();
    check_limit("rest_points", "vertices", kMaxVertices, vertex_count);
    check_limit("influence_bones", "influences", kMaxInfluences, influence_count);
    check_points(data.rest_points, vertex_count);
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

NormalisedInfluences normalised_influences(const BindData& data) {
    NormalisedInfluences result;
    result.offsets.reserve(data.rest_points.size() + 1);
    result.influences.reserve(data.influence_bones.size());
    for (std::size_t vertex = 0; vertex < data.rest_points.size(); ++vertex) {
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
                result.influences.push_back({data.influence_bones[i], static_cast<float>(share)});
            }
        }
        result.offsets.push_back(static_cast<std::uint32_t>(result.influences.size()));
    }
    return result;
}

}  // namespace sinew
