// SPDX-License-Identifier: GPL-3.0-or-later
// The instruction sets that kernels are built for. To be included before Highway.
#pragma once

// Disabled are those that have the vectors of another and add integer instructions (AVX3_DL and after it),
// or whose vectors have a size that the compiler does not know: they can not be members (SVE, RVV).
// SSSE3 is left out, too: Blender needs SSE4.2.
// Of several NEON, whose vectors are the same, the one is left that every 64-bit ARM runs; Highway numbers the others
// from SVE to NEON.
#ifdef SINEW_HWY_HAS_NEON_WITHOUT_AES
#define SINEW_OTHER_NEON (HWY_NEON | (HWY_NEON - HWY_SVE))
#else
#define SINEW_OTHER_NEON 0
#endif
#define HWY_DISABLED_TARGETS                                                                         \
    (HWY_AVX3_DL | (HWY_AVX3_DL - 1) | HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | \
     HWY_RVV | SINEW_OTHER_NEON)

// Kernel::targets, the fastest first. The last is what the compiler may use anywhere.
//
// Highway's own choice (HWY_DYNAMIC_DISPATCH) needs libhwy, which Debian ships as a shared library only: a
// wheel would then need it on the user's machine. Its headers do without; so the choice is made in targets.cpp.
#define SINEW_TARGETS(deform, prepare)                                         \
    {                                                                          \
        {                                                                      \
            {HWY_CHOOSE_AVX3(deform), HWY_CHOOSE_AVX3(prepare)},               \
                {HWY_CHOOSE_AVX2(deform), HWY_CHOOSE_AVX2(prepare)},           \
                {HWY_CHOOSE_SSE4(deform), HWY_CHOOSE_SSE4(prepare)},           \
                {&HWY_STATIC_DISPATCH(deform), &HWY_STATIC_DISPATCH(prepare)}, \
        }                                                                      \
    }

// The same for a single function: an array of pointers to it.
#define SINEW_TARGETS_OF(function)                                                       \
    {                                                                                    \
        HWY_CHOOSE_AVX3(function), HWY_CHOOSE_AVX2(function), HWY_CHOOSE_SSE4(function), \
            &HWY_STATIC_DISPATCH(function)                                               \
    }
