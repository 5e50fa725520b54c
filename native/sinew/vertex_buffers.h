// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "sinew/base/strided.h"

namespace sinew {

/// Elements of a vertex buffer as they are in memory of their own.
template <class T>
[[nodiscard]] std::vector<std::remove_const_t<T>> copied(const Strided<T>& from) {
    std::vector<std::remove_const_t<T>> elements;
    elements.reserve(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) elements.push_back(from[i]);
    return elements;
}

/// `count` bones and weights of each vertex, as vertex buffers have them; of glTF, JOINTS_0 and WEIGHTS_0.
///
/// Bone    an unsigned integer
/// Weight  float, or an unsigned integer whose largest value stands for 1
template <class Bone, class Weight, std::size_t count>
struct InfluenceBuffer {
    static_assert(std::is_unsigned_v<Bone>);
    static_assert(std::is_same_v<Weight, float> || std::is_unsigned_v<Weight>);

    Strided<const std::array<Bone, count>> bones;
    Strided<const std::array<Weight, count>> weights;
};

/// Influences as BindData takes them.
struct BufferInfluences {
    std::vector<std::int32_t> offsets;
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
};

/// The influences of buffers, those of each vertex beside each other; without those of weight 0. Throws
/// std::invalid_argument if the buffers are of different sizes.
template <class First, class... Others>
[[nodiscard]] BufferInfluences influences_of(const First& first, const Others&... others) {
    const std::size_t vertices = first.bones.size();
    const auto fits = [&](const auto& buffer) {
        return buffer.bones.size() == vertices && buffer.weights.size() == vertices;
    };
    if (!(fits(first) && (fits(others) && ...))) {
        throw std::invalid_argument("influences_of: expected as many bones and weights in all buffers");
    }
    BufferInfluences found{{0}, {}, {}};
    found.offsets.reserve(vertices + 1);
    const auto add = [&](const auto& buffer, std::size_t v) {
        for (std::size_t k = 0; k < buffer.bones[v].size(); ++k) {
            const auto stored = buffer.weights[v][k];
            if (stored == 0) continue;
            float weight = static_cast<float>(stored);
            using Weight = std::remove_const_t<decltype(stored)>;
            if constexpr (std::is_unsigned_v<Weight>) {
                weight /= static_cast<float>(std::numeric_limits<Weight>::max());
            }
            found.bones.push_back(static_cast<std::int32_t>(buffer.bones[v][k]));
            found.weights.push_back(weight);
        }
    };
    for (std::size_t v = 0; v < vertices; ++v) {
        add(first, v);
        (add(others, v), ...);
        found.offsets.push_back(static_cast<std::int32_t>(found.bones.size()));
    }
    return found;
}

}  // namespace sinew
