// SPDX-License-Identifier: GPL-3.0-or-later
// The instruction sets that kernels are compiled for. Include before Highway.
#pragma once

#include <array>
#include <cstddef>

// Disabled: targets that only add integer instructions to the vectors of another target (AVX3_DL and later);
// targets whose vector size is unknown at compile time, so that vectors can not be members (SVE, RVV); SSSE3,
// since Blender needs SSE4.2; and all NEON targets but the one that runs on every 64-bit ARM, since their float
// vectors are the same. Highway numbers the others from SVE to NEON.
#ifdef SINEW_HWY_HAS_NEON_WITHOUT_AES
#define SINEW_OTHER_NEON (HWY_NEON | (HWY_NEON - HWY_SVE))
#else
#define SINEW_OTHER_NEON 0
#endif
#define HWY_DISABLED_TARGETS                                                                         \
    (HWY_AVX3_DL | (HWY_AVX3_DL - 1) | HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | \
     HWY_RVV | SINEW_OTHER_NEON)

// An array of pointers to the versions of a function, the fastest first. The last is that of the target that the
// compiler may use everywhere.
//
// Highway's own choice (HWY_DYNAMIC_DISPATCH) needs libhwy, which Debian ships only as a shared library: a wheel
// would then need it on the user's machine. Highway's headers alone do not need it, so targets.cpp makes the
// choice.
#define SINEW_TARGETS(function)                                                          \
    {                                                                                    \
        HWY_CHOOSE_AVX3(function), HWY_CHOOSE_AVX2(function), HWY_CHOOSE_SSE4(function), \
            &HWY_STATIC_DISPATCH(function)                                               \
    }

namespace sinew {

/// Number of instruction sets.
inline constexpr std::size_t kTargetCount = 4;

/// The versions of a function, as SINEW_TARGETS lists them.
template <class Function>
using OfTargets = std::array<Function*, kTargetCount>;

/// The index of the instruction set in use, in the order of SINEW_TARGETS.
[[nodiscard]] std::size_t target_in_use() noexcept;

}  // namespace sinew
