// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

#include "sinew/export.h"

namespace sinew {

/// Instruction sets that kernels were compiled for and that this processor supports, the fastest first, with
/// Highway's names: "AVX3" (AVX-512), "AVX2", "SSE4", "SSE2", "NEON", "SCALAR".
[[nodiscard]] SINEW_EXPORT std::vector<std::string_view> simd_targets();

/// The instruction set in use: the first of simd_targets(), unless use_simd_target() chose another.
[[nodiscard]] SINEW_EXPORT std::string_view simd_target() noexcept;

/// Chooses the instruction set, for tests and benchmarks. Throws std::invalid_argument if it is not in
/// simd_targets().
SINEW_EXPORT void use_simd_target(std::string_view name);

}  // namespace sinew
