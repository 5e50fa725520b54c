// SPDX-License-Identifier: GPL-3.0-or-later
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/deform/kernels.h"

#include <atomic>
#include <cmath>
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
#include "sinew/deform/methods-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

// Above this many influences a set's signs are found vertex by vertex.
constexpr std::size_t kMostResolved = 32;

template <class Kernel>
constexpr std::size_t kRow = 4 * Kernel::kQuads;

HWY_INLINE float dot(const float* a, const float* b) {
    return (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3]);
}

/// Whether a term's side of the running sum of those before it is the same whatever the weights: it is
/// where the term lies on one side of each of them.
HWY_INLINE bool signs_agree(const float* rows, std::size_t stride, std::size_t count) {
    // Far beyond the rounding of a sum, so that it decides as the sum in floats would.
    constexpr float kTie = 1e-5f;
    for (std::size_t i = 1; i < count; ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            if (!(dot(rows + stride * i, rows + stride * j) > kTie)) return false;
        }
    }
    return true;
}

/// Copies the bones of a set to `rows`, each turned to the side on which it is added. False where that
/// depends on the weights, or where a bone has scale and so depends on the vertex.
template <class Kernel>
HWY_INLINE bool resolve(const Palette& palette, const std::int32_t* bones, std::size_t count, float* rows) {
    if (count > kMostResolved) return false;
    bool close = true;
    for (std::size_t k = 0; k < count; ++k) {
        const auto bone = static_cast<std::size_t>(bones[k]);
        if (Kernel::kSignedQuads > 0 && !palette.has_scale.empty() && palette.has_scale[bone] != 0) {
            return false;
        }
        float* const row = rows + kRow<Kernel> * k;
        std::memcpy(row, &palette.bones[Kernel::kQuads * bone], sizeof(Quad) * Kernel::kQuads);
        if (Kernel::kSignedQuads > 0 && k > 0) {
            const float cosine = dot(row, rows);
            // Within 45 degrees of the first, all lie within 90 of each other.
            close = close && std::abs(cosine) > 0.7072f;
            if (cosine < 0.0f) {
                for (std::size_t i = 0; i < 4 * Kernel::kSignedQuads; ++i) row[i] = -row[i];
            }
        }
    }
    return close || signs_agree(rows, kRow<Kernel>, count);
}

/// Lanes [lane, lane + N) of a block whose bones are resolved.
template <class Kernel, class D>
HWY_INLINE Sum<D, kRow<Kernel>> blend_rows(D d, const float* rows, std::size_t count, const float* weights) {
    Sum<D, kRow<Kernel>> sum;
    for (auto& value : sum.value) value = hn::Zero(d);
    for (std::size_t k = 0; k < count; ++k) {
        add_row(d, hn::Load(d, weights + kLanes * k), rows + kRow<Kernel> * k, 0, kRow<Kernel>, sum);
    }
    return sum;
}

/// The same for bones with scale, or with signs that depend on the weights.
template <class Kernel, class D>
HWY_INLINE Sum<D, kRow<Kernel>> blend_bones(D d, const Palette& palette, const std::int32_t* bones,
                                            std::size_t count, const float* weights, const Points<D>& rest) {
    Sum<D, kRow<Kernel>> sum;
    for (auto& value : sum.value) value = hn::Zero(d);
    for (std::size_t k = 0; k < count; ++k) {
        Kernel::add(d, palette, static_cast<std::size_t>(bones[k]), hn::Load(d, weights + kLanes * k), rest,
                    sum);
    }
    return sum;
}

template <class Kernel, class D>
HWY_INLINE void finish_and_store(D d, const Frame& frame, std::size_t b, std::size_t lane,
                                 const Sum<D, kRow<Kernel>>& sum, const Points<D>& rest) {
    Points<D> points = Kernel::finish(d, sum, rest);
    if (frame.model_from_bones != nullptr) {
        points = displaced(d, frame.model_from_bones->value.data(), points);
    }
    store_points(d, frame, b, lane, points);
}

template <class D>
HWY_INLINE Points<D> load_rest(D d, const Frame& frame, const Block& block, std::size_t lane) {
    const Points<D> rest = load_points(d, &frame.mesh->rows[block.first_row], lane);
    if (frame.bones_from_model == nullptr) return rest;
    return displaced(d, frame.bones_from_model->value.data(), rest);
}

void keep_block(const Frame& frame, std::size_t b) {
    const Full d;
    const Block& block = frame.mesh->blocks[b];
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        store_points(d, frame, b, lane, load_points(d, &frame.mesh->rows[block.first_row], lane));
    }
}

template <class Kernel>
void deform_block(const Frame& frame, std::size_t b, const float* resolved) {
    const Full d;
    const Block& block = frame.mesh->blocks[b];
    const float* const weights = frame.mesh->rows[block.first_row + 3].lane.data();
    const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        const Points<Full> rest = load_rest(d, frame, block, lane);
        const auto sum =
            resolved != nullptr
                ? blend_rows<Kernel>(d, resolved, block.influences, weights + lane)
                : blend_bones<Kernel>(d, *frame.palette, bones, block.influences, weights + lane, rest);
        finish_and_store<Kernel>(d, frame, b, lane, sum, rest);
    }
}

/// A mixed block vertex by vertex: with scale, or without vectors.
template <class Kernel>
void deform_one_by_one(const Frame& frame, std::size_t b) {
    const One d;
    const Block& block = frame.mesh->blocks[b];
    const float* const weights = frame.mesh->rows[block.first_row + 3].lane.data();
    const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const Points<One> rest = load_rest(d, frame, block, lane);
        const auto sum = blend_bones<Kernel>(d, *frame.palette, bones + block.influences * lane,
                                             block.influences, weights + lane, rest);
        finish_and_store<Kernel>(d, frame, b, lane, sum, rest);
    }
}

#if HWY_TARGET != HWY_SCALAR

/// A mixed block: a bone's row is added as it lies in memory, quad by quad, and the sums of all vertices
/// are then turned into lanes.
template <class Kernel>
void deform_mixed(const Frame& frame, std::size_t b) {
    const hn::CappedTag<float, 4> four;
    using V4 = Vec<hn::CappedTag<float, 4>>;
    const Block& block = frame.mesh->blocks[b];
    const Lanes<float>* const weights = &frame.mesh->rows[block.first_row + 3];
    const std::int32_t* bones = &frame.mesh->bones[block.first_bone];
    alignas(64) float sums[Kernel::kQuads][4 * kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        V4 sum[Kernel::kQuads];
        for (V4& quad : sum) quad = hn::Zero(four);
        for (std::size_t k = 0; k < block.influences; ++k, ++bones) {
            const Quad* const row = &frame.palette->bones[Kernel::kQuads * static_cast<std::size_t>(*bones)];
            const V4 weight = hn::Set(four, weights[k].lane[lane]);
            V4 side = weight;
            if constexpr (Kernel::kSignedQuads > 0) {
                V4 dot = hn::Mul(hn::Load(four, row->value.data()), sum[0]);
                dot = hn::Add(dot, hn::Shuffle1032(dot));
                dot = hn::Add(dot, hn::Shuffle2301(dot));
                side = hn::IfThenElse(hn::Lt(dot, hn::Zero(four)), hn::Neg(weight), weight);
            }
            for (std::size_t q = 0; q < Kernel::kQuads; ++q) {
                sum[q] = hn::MulAdd(q < Kernel::kSignedQuads ? side : weight,
                                    hn::Load(four, row[q].value.data()), sum[q]);
            }
        }
        for (std::size_t q = 0; q < Kernel::kQuads; ++q) hn::Store(sum[q], four, sums[q] + 4 * lane);
    }
    const Full d;
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        Sum<Full, kRow<Kernel>> sum;
        for (std::size_t q = 0; q < Kernel::kQuads; ++q) {
            Vec<Full>* const value = sum.value + 4 * q;
            hn::LoadInterleaved4(d, sums[q] + 4 * lane, value[0], value[1], value[2], value[3]);
        }
        finish_and_store<Kernel>(d, frame, b, lane, sum, load_rest(d, frame, block, lane));
    }
}

#else

template <class Kernel>
void deform_mixed(const Frame& frame, std::size_t b) {
    deform_one_by_one<Kernel>(frame, b);
}

#endif

template <class Kernel>
void deform_with(const Frame& frame, std::size_t begin, std::size_t end) {
    alignas(64) float rows[kMostResolved * kRow<Kernel>];
    const Block* of_rows = nullptr;
    const float* resolved = nullptr;
    for (std::size_t b = begin; b < end; ++b) {
        const Block& block = frame.mesh->blocks[b];
        if (block.influences == 0) {
            keep_block(frame, b);
        } else if (!block.mixed) {
            if (of_rows == nullptr || of_rows->first_bone != block.first_bone) {
                of_rows = &block;
                const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
                resolved = resolve<Kernel>(*frame.palette, bones, block.influences, rows) ? rows : nullptr;
            }
            deform_block<Kernel>(frame, b, resolved);
        } else if (Kernel::kSignedQuads > 0 && !frame.palette->has_scale.empty()) {
            deform_one_by_one<Kernel>(frame, b);
        } else {
            deform_mixed<Kernel>(frame, b);
        }
    }
}

void deform(const Frame& frame, std::size_t begin, std::size_t end) {
    switch (frame.method) {
        case MethodId::lbs: return deform_with<LbsKernel>(frame, begin, end);
        case MethodId::qv: return deform_with<QvKernel>(frame, begin, end);
        case MethodId::dq: return deform_with<DqKernel>(frame, begin, end);
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
    void (*deform)(const Frame&, std::size_t, std::size_t);

    [[nodiscard]] std::string_view name() const { return hwy::TargetName(bit); }
};

// Highway's own choice (HWY_DYNAMIC_DISPATCH) needs libhwy, which Debian ships as a shared library only: a
// wheel would then need it on the user's machine. Its headers do without; so the choice is made here.
constexpr Target kTargets[] = {
    {HWY_AVX3, HWY_CHOOSE_AVX3(deform)},
    {HWY_AVX2, HWY_CHOOSE_AVX2(deform)},
    {HWY_SSE4, HWY_CHOOSE_SSE4(deform)},
    {HWY_SSSE3, HWY_CHOOSE_SSSE3(deform)},
    {HWY_STATIC_TARGET, &HWY_STATIC_DISPATCH(deform)},
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
