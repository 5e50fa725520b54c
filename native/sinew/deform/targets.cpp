// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/targets.h"

#include <atomic>
#include <iterator>
#include <stdexcept>
#include <string>

#include "hwy/highway.h"
#include "sinew/deform/kernels.h"
#include "sinew/deform/simd.h"

namespace sinew {
namespace {

/// In the order of SINEW_TARGETS.
constexpr std::int64_t kTargets[kTargetCount] = {HWY_AVX3, HWY_AVX2, HWY_SSE4, HWY_SSSE3, HWY_STATIC_TARGET};

std::string_view name_of_target(std::size_t target) { return hwy::TargetName(kTargets[target]); }

bool runs_here(std::int64_t bit) {
    // What the compiler may use anywhere.
    if (bit == HWY_STATIC_TARGET) return true;
#if HWY_ARCH_X86 && (HWY_COMPILER_GCC || HWY_COMPILER_CLANG)
    __builtin_cpu_init();
    const bool ssse3 = __builtin_cpu_supports("ssse3");
    const bool sse4 = ssse3 && __builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("sse4.2") &&
                      __builtin_cpu_supports("pclmul") && __builtin_cpu_supports("aes");
    // Highway also lets the compiler use LZCNT and F16C, which no processor with AVX2 and FMA lacks and
    // not every compiler can ask for.
    const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                      __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512cd");
    switch (bit) {
        case HWY_SSSE3: return ssse3;
        case HWY_SSE4: return sse4;
        case HWY_AVX2: return avx2;
        case HWY_AVX3: return avx3;
        default: return false;
    }
#else
    return false;
#endif
}

bool is_available(std::size_t target) {
    return (kTargets[target] & HWY_TARGETS) != 0 && runs_here(kTargets[target]);
}

std::size_t best() {
    std::size_t target = 0;
    while (target + 1 < kTargetCount && !is_available(target)) ++target;
    return target;
}

std::atomic<std::size_t>& chosen() {
    static std::atomic<std::size_t> target{best()};
    return target;
}

}  // namespace

std::size_t target_in_use() noexcept { return chosen().load(std::memory_order_relaxed); }

std::vector<std::string_view> simd_targets() {
    std::vector<std::string_view> names;
    for (std::size_t target = 0; target < kTargetCount; ++target) {
        // The static one is also in the list by its name where the compiler was told to use more.
        if (is_available(target) && (names.empty() || names.back() != name_of_target(target))) {
            names.push_back(name_of_target(target));
        }
    }
    return names;
}

std::string_view simd_target() noexcept { return name_of_target(target_in_use()); }

void use_simd_target(std::string_view name) {
    for (std::size_t target = 0; target < kTargetCount; ++target) {
        if (is_available(target) && name_of_target(target) == name) {
            chosen().store(target, std::memory_order_relaxed);
            return;
        }
    }
    throw std::invalid_argument("simd target: expected one of simd_targets(), got '" + std::string(name) +
                                "'");
}

}  // namespace sinew
