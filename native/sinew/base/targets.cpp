// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/base/targets.h"

#include <atomic>
#include <iterator>
#include <string>

#include "hwy/highway.h"
#include "sinew/base/fail.h"
#include "sinew/base/simd.h"
#include "sinew/base/x86_support.h"

namespace sinew {
namespace {

/// In the order of SINEW_TARGETS.
constexpr std::int64_t kTargets[kTargetCount] = {HWY_AVX3, HWY_AVX2, HWY_SSE4, HWY_STATIC_TARGET};

std::string_view name_of_target(std::size_t target) { return hwy::TargetName(kTargets[target]); }

bool runs_here(std::int64_t bit) {
    // The target that the compiler may use everywhere.
    if (bit == HWY_STATIC_TARGET) return true;
#if HWY_ARCH_X86
    const X86Support support = x86_support();
    switch (bit) {
        case HWY_SSE4: return support.sse4;
        case HWY_AVX2: return support.avx2;
        case HWY_AVX3: return support.avx3;
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
        // The static target is listed twice if the compiler was told to use a better one.
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
    fail("simd target", "one of simd_targets()", std::string("'").append(name).append("'"));
}

}  // namespace sinew
