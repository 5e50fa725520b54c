// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/base/x86_support.h"

#if defined(__x86_64__) || defined(__i386__) || defined(_M_X64) || defined(_M_IX86)

#include <cstdint>

#ifdef _MSC_VER
#include <intrin.h>
#else
#include <cpuid.h>
#endif

namespace sinew {
namespace {

struct Leaf {
    std::uint32_t a = 0, b = 0, c = 0, d = 0;
};

/// All zeros if the processor does not have this leaf.
Leaf cpuid(std::uint32_t leaf) {
    Leaf result;
#ifdef _MSC_VER
    int words[4];
    // Bit 31 distinguishes extended from basic leaves.
    __cpuid(words, static_cast<int>(leaf & 0x80000000u));
    if (static_cast<std::uint32_t>(words[0]) < leaf) return result;
    __cpuidex(words, static_cast<int>(leaf), 0);
    result.a = static_cast<std::uint32_t>(words[0]);
    result.b = static_cast<std::uint32_t>(words[1]);
    result.c = static_cast<std::uint32_t>(words[2]);
    result.d = static_cast<std::uint32_t>(words[3]);
#else
    __get_cpuid_count(leaf, 0, &result.a, &result.b, &result.c, &result.d);
#endif
    return result;
}

/// The registers that the operating system saves for each thread (XCR0). Only valid if OSXSAVE is set.
std::uint64_t kept_registers() {
#ifdef _MSC_VER
    return _xgetbv(0);
#else
    std::uint32_t low = 0, high = 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (std::uint64_t{high} << 32) | low;
#endif
}

constexpr bool has(std::uint64_t word, std::uint64_t bits) { return (word & bits) == bits; }

constexpr std::uint32_t bit(int index) { return 1u << index; }

}  // namespace

X86Support x86_support() noexcept {
    constexpr std::uint32_t kSse4 = bit(9) | bit(19) | bit(20);  // SSSE3, SSE4.1, SSE4.2
    constexpr std::uint32_t kXsave = bit(27);                    // the operating system uses XSAVE
    constexpr std::uint32_t kAvx = bit(28) | bit(12) | bit(29);  // AVX, FMA, F16C
    constexpr std::uint32_t kLzcnt = bit(5);
    constexpr std::uint32_t kAvx2 = bit(5) | bit(3) | bit(8);                           // AVX2, BMI, BMI2
    constexpr std::uint32_t kAvx512 = bit(16) | bit(17) | bit(28) | bit(30) | bit(31);  // F, DQ, CD, BW, VL
    constexpr std::uint64_t kKeptForAvx = 0x6;                                          // XMM, YMM
    constexpr std::uint64_t kKeptForAvx512 = 0xe6;                                      // and masks, ZMM

    const std::uint32_t basic = cpuid(1).c;
    const std::uint32_t extended = cpuid(7).b;
    const std::uint64_t kept = has(basic, kXsave) ? kept_registers() : 0;
    X86Support result;
    result.sse4 = has(basic, kSse4);
    result.avx2 = result.sse4 && has(basic, kAvx) && has(extended, kAvx2) &&
                  has(cpuid(0x80000001u).c, kLzcnt) && has(kept, kKeptForAvx);
    result.avx3 = result.avx2 && has(extended, kAvx512) && has(kept, kKeptForAvx512);
    return result;
}

}  // namespace sinew

#else

namespace sinew {

X86Support x86_support() noexcept { return {}; }

}  // namespace sinew

#endif
