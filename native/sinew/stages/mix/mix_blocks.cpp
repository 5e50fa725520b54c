// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/mix/mix_blocks.h"

#include <algorithm>

#include "sinew/stages/mix/mix.h"

namespace sinew {
namespace {

// Few enough that what the first kernel wrote is still in the first-level cache, and enough that a set of bones
// is prepared once for many vertices.
constexpr std::size_t kBlocksAtOnce = 16;

/// Mixes blocks [begin, end), at most kBlocksAtOnce.
void mix_blocks(const std::array<const Kernel*, 2>& kernels, const std::array<Frame, 2>& frames,
                const MixWeights& mix, std::size_t begin, std::size_t end) {
    const PackedMesh& mesh = *frames[0].mesh;
    Vec3<float>* const points = frames[0].points;
    const auto for_each_vertex = [&](const auto& call) {
        for (std::size_t b = begin; b < end; ++b) {
            for (std::size_t lane = 0; lane < mesh.blocks[b].vertices; ++lane) {
                call(points[static_cast<std::size_t>(mesh.vertices[b].lane[lane])],
                     kLanes * (b - begin) + lane, mix.weights[b].lane[lane]);
            }
        }
    };
    // Both kernels write to the points themselves, since a kernel has no other output.
    std::array<Vec3<float>, kBlocksAtOnce * kLanes> by_first;
    const std::size_t target = target_in_use();
    kernels[0]->deform[target](frames[0], begin, end);
    for_each_vertex([&](const Vec3<float>& point, std::size_t i, float) { by_first[i] = point; });
    kernels[1]->deform[target](frames[1], begin, end);
    for_each_vertex([&](Vec3<float>& point, std::size_t i, float weight) {
        point = Mix::deform_vertex(by_first[i], point, weight);
    });
}

}  // namespace

MixWeights pack_mix(const PackedMesh& mesh, std::span<const float> weights) {
    MixWeights mix{pack_weights(mesh, weights), {}};
    mix.shares.reserve(mix.weights.size());
    for (const Lanes<float>& block : mix.weights) {
        const auto [least, most] = std::ranges::minmax(block.lane);
        mix.shares.push_back(most == 0.0f ? Share::none : least == 1.0f ? Share::all : Share::some);
    }
    return mix;
}

void deform_mix(const std::array<const Kernel*, 2>& kernels, const std::array<Frame, 2>& frames,
                const MixWeights& mix, std::size_t begin, std::size_t end) noexcept {
    for (std::size_t b = begin; b < end;) {
        const Share share = mix.shares[b];
        std::size_t after = b + 1;
        while (after < end && mix.shares[after] == share) ++after;
        switch (share) {
            case Share::none: kernels[0]->deform[target_in_use()](frames[0], b, after); break;
            case Share::all: kernels[1]->deform[target_in_use()](frames[1], b, after); break;
            case Share::some:
                for (std::size_t i = b; i < after; i += kBlocksAtOnce) {
                    mix_blocks(kernels, frames, mix, i, std::min(i + kBlocksAtOnce, after));
                }
                break;
        }
        b = after;
    }
}

}  // namespace sinew
