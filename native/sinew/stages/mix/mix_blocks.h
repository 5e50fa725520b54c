// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/lanes/kernel.h"

namespace sinew {

/// Which vertices of a block the second method deforms.
enum class Share : std::uint8_t { none, some, all };

/// The weights of the stage `mix` in the order of a packed mesh.
struct MixWeights {
    std::vector<Lanes<float>> weights;  // [blocks] 0 to 1
    std::vector<Share> shares;          // [blocks]
};

/// Packs the weights of a mix.
///
/// weights  [vertices] not NaN; clamped to 0 to 1
[[nodiscard]] MixWeights pack_mix(const PackedMesh& mesh, std::span<const float> weights);

/// Deforms the blocks [begin, end) with two kernels and mixes the results (stages/mix/mix.h). A kernel that has no
/// share in a block does not run for it, so the other kernel's bits are unchanged there.
///
/// frames  one for each kernel, with the same mesh and the same points to write
void deform_mix(const std::array<const Kernel*, 2>& kernels, const std::array<Frame, 2>& frames,
                const MixWeights& mix, std::size_t begin, std::size_t end) noexcept;

}  // namespace sinew
