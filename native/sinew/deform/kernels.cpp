// SPDX-License-Identifier: GPL-3.0-or-later
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/deform/kernels.h"

#include <atomic>
#include <stdexcept>
#include <string>

#include "sinew/deform/simd.h"

// What is left out has the vectors of what is there and adds integer instructions (AVX3_DL and after it),
// or has vectors whose size the compiler does not know, which can not be members (SVE, RVV).
#define HWY_DISABLED_TARGETS \
    (HWY_AVX3_DL | (HWY_AVX3_DL - 1) | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/kernels.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/lbs-inl.h"
#include "sinew/deform/palette-inl.h"
#include "sinew/deform/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

void deform(const Frame& frame, std::size_t begin, std::size_t end) {
    switch (frame.method) {
        case MethodId::lbs: return deform_lbs(frame, begin, end);
        case MethodId::qv: return deform_rigid<QvKernel>(frame, begin, end);
        case MethodId::dq: return deform_rigid<DqKernel>(frame, begin, end);
    }
}

void prepare_of_target(MethodId method, std::span<const std::int32_t> used,
                       std::span<const Affine<float>> posed_from_rest, Palette& palette) {
    switch (method) {
        case MethodId::lbs: return prepare_columns(used, posed_from_rest, palette);
        case MethodId::qv: return prepare_rigid<QvKernel>(used, posed_from_rest, palette);
        case MethodId::dq: return prepare_rigid<DqKernel>(used, posed_from_rest, palette);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

struct Target {
    std::int64_t bit;
    decltype(&HWY_STATIC_DISPATCH(deform)) deform;
    decltype(&HWY_STATIC_DISPATCH(prepare_of_target)) prepare;

    [[nodiscard]] std::string_view name() const { return hwy::TargetName(bit); }
};

// Highway's own choice (HWY_DYNAMIC_DISPATCH) needs libhwy, which Debian ships as a shared library only: a
// wheel would then need it on the user's machine. Its headers do without; so the choice is made here.
#define SINEW_TARGET(name) \
    { HWY_##name, HWY_CHOOSE_##name(deform), HWY_CHOOSE_##name(prepare_of_target) }
constexpr Target kTargets[] = {
    SINEW_TARGET(AVX3),
    SINEW_TARGET(AVX2),
    SINEW_TARGET(SSE4),
    SINEW_TARGET(SSSE3),
    {HWY_STATIC_TARGET, &HWY_STATIC_DISPATCH(deform), &HWY_STATIC_DISPATCH(prepare_of_target)},
};

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

bool is_available(const Target& target) { return target.deform != nullptr && runs_here(target.bit); }

const Target& best() {
    for (const Target& target : kTargets) {
        if (is_available(target)) return target;
    }
    return *(std::end(kTargets) - 1);
}

std::atomic<const Target*>& chosen() {
    static std::atomic<const Target*> target{&best()};
    return target;
}

}  // namespace

void deform_blocks(const Frame& frame, std::size_t begin, std::size_t end) noexcept {
    chosen().load(std::memory_order_relaxed)->deform(frame, begin, end);
}

void prepare_bones(MethodId method, std::span<const std::int32_t> used,
                   std::span<const Affine<float>> posed_from_rest, Palette& palette) noexcept {
    chosen().load(std::memory_order_relaxed)->prepare(method, used, posed_from_rest, palette);
}

std::vector<std::string_view> simd_targets() {
    std::vector<std::string_view> names;
    for (const Target& target : kTargets) {
        // The static one is also in the list by its name where the compiler was told to use more.
        if (is_available(target) && (names.empty() || names.back() != target.name())) {
            names.push_back(target.name());
        }
    }
    return names;
}

std::string_view simd_target() noexcept { return chosen().load(std::memory_order_relaxed)->name(); }

void use_simd_target(std::string_view name) {
    for (const Target& target : kTargets) {
        if (is_available(target) && target.name() == name) {
            chosen().store(&target, std::memory_order_relaxed);
            return;
        }
    }
    throw std::invalid_argument("simd target: expected one of simd_targets(), got '" + std::string(name) +
                                "'");
}

}  // namespace sinew

#endif
