// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "sinew/binding.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/mesh/influence.h"

namespace sinew {

/// Throws as Binding does. Does not check rest bones and vertex data.
void check(const BindData& data);

/// Influences of positive weight. The weights of each vertex that has any have sum 1.
struct NormalisedInfluences {
    std::vector<std::uint32_t> offsets{0};  // [vertices + 1]
    std::vector<Influence<float>> influences;
};

/// data  checked
[[nodiscard]] NormalisedInfluences normalised_influences(const BindData& data);

}  // namespace sinew
