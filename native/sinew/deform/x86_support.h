// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sinew {

/// Which of Highway's instruction sets the processor and its operating system run. Each implies those before it.
struct X86Support {
    // SSSE3 to SSE4.2. Highway adds AES and CLMUL, which no kernel uses and some processors lack that have SSE4.2.
    bool sse4 = false;
    bool avx2 = false;  // with FMA, F16C, LZCNT, BMI and BMI2
    bool avx3 = false;  // AVX-512 F, CD, BW, DQ, VL
};

/// By the CPUID and XGETBV instructions, as no function for this is the same in all compilers, and some lack any.
/// All false elsewhere than on x86. Source: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A,
/// CPUID, and volume 1, 14.3 and 15.2.
[[nodiscard]] X86Support x86_support() noexcept;

}  // namespace sinew
