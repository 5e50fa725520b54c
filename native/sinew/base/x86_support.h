// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sinew {

/// Which of Highway's instruction sets the processor and operating system support. Each one implies those before
/// it.
struct X86Support {
    // SSSE3 to SSE4.2. Highway's target adds AES and CLMUL, which no kernel uses and some processors with SSE4.2
    // lack.
    bool sse4 = false;
    bool avx2 = false;  // with FMA, F16C, LZCNT, BMI and BMI2
    bool avx3 = false;  // AVX-512 F, CD, BW, DQ, VL
};

/// Determined with the CPUID and XGETBV instructions, since no built-in function for this is the same in all
/// compilers, and some have none. All false on other architectures. Source: Intel 64 and IA-32 Architectures
/// Software Developer's Manual, volume 2A, CPUID, and volume 1, 14.3 and 15.2.
[[nodiscard]] X86Support x86_support() noexcept;

}  // namespace sinew
