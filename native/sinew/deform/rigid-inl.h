// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks under a rigid method: compiled once for each instruction set, see kernels.cpp.
#if defined(SINEW_DEFORM_RIGID_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_DEFORM_RIGID_INL_H_
#undef SINEW_DEFORM_RIGID_INL_H_
#else
#define SINEW_DEFORM_RIGID_INL_H_
#endif

#include <cmath>
#include <cstring>

#include "sinew/deform/rigid_methods-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

inline constexpr std::size_t kRowQuads = kRow / 4;

// Above this many influences a set's signs are found vertex by vertex.
inline constexpr std::size_t kMostResolved = 32;

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

#if HWY_TARGET != HWY_SCALAR

using Four = hn::CappedTag<float, 4>;

/// The dot product in every lane, rounded as dot().
HWY_INLINE Vec<Four> dot(Vec<Four> a, Vec<Four> b) {
    const Vec<Four> product = hn::Mul(a, b);
    const Vec<Four> pairs = hn::Add(product, hn::Shuffle1032(product));
    return hn::Add(pairs, hn::Shuffle2301(pairs));
}

/// Copies rows of the palette, each turned to the side of the first; the least of their cosines.
template <class Kernel>
HWY_INLINE float copy_turned(const Palette& palette, const std::int32_t* bones, std::size_t count,
                             float* rows) {
    const Four d;
    const auto quad_of = [&](std::size_t k, std::size_t q) HWY_ATTR {
        return hn::Load(d, palette.bones[kRowQuads * static_cast<std::size_t>(bones[k]) + q].value.data());
    };
    const Vec<Four> first = quad_of(0, 0);
    Vec<Four> least = hn::Set(d, 1.0f);
    for (std::size_t k = 0; k < count; ++k) {
        const Vec<Four> quad = quad_of(k, 0);
        const Vec<Four> cosine = dot(quad, first);
        const Vec<Four> sign = hn::And(cosine, hn::SignBit(d));
        least = hn::Min(least, hn::Abs(cosine));
        hn::Store(hn::Xor(quad, sign), d, rows + kRow * k);
        const Vec<Four> second = quad_of(k, 1);
        hn::Store(Kernel::kSignedQuads == 2 ? hn::Xor(second, sign) : second, d, rows + kRow * k + 4);
    }
    return hn::GetLane(least);
}

#else

template <class Kernel>
float copy_turned(const Palette& palette, const std::int32_t* bones, std::size_t count, float* rows) {
    float least = 1.0f;
    for (std::size_t k = 0; k < count; ++k) {
        float* const row = rows + kRow * k;
        std::memcpy(row, &palette.bones[kRowQuads * static_cast<std::size_t>(bones[k])],
                    sizeof(Quad) * kRowQuads);
        const float cosine = dot(row, rows);
        least = std::min(least, std::abs(cosine));
        if (cosine < 0.0f) {
            for (std::size_t i = 0; i < 4 * Kernel::kSignedQuads; ++i) row[i] = -row[i];
        }
    }
    return least;
}

#endif

/// Copies the bones of a set to `rows`, each turned to the side on which it is added. False where that
/// depends on the weights, or where a bone has scale and so depends on the vertex.
template <class Kernel>
HWY_INLINE bool resolve(const Palette& palette, const std::int32_t* bones, std::size_t count, float* rows) {
    if (count > kMostResolved) return false;
    if (!palette.has_scale.empty()) {
        for (std::size_t k = 0; k < count; ++k) {
            if (palette.has_scale[static_cast<std::size_t>(bones[k])] != 0) return false;
        }
    }
    // Within 45 degrees of the first, all lie within 90 of each other.
    return copy_turned<Kernel>(palette, bones, count, rows) > 0.7072f || signs_agree(rows, kRow, count);
}

/// Lanes [lane, lane + N) of a block whose bones are resolved. That the first is not added to zeros and
/// that a fixed count makes one run of instructions saves a twentieth of the time.
template <std::size_t kCount, class D>
HWY_INLINE Sum<D> blend_rows(D d, const float* rows, std::size_t count, const float* weights) {
    Sum<D> sum;
    if constexpr (kCount == 1) {
        for (std::size_t i = 0; i < kRow; ++i) sum.value[i] = hn::Set(d, rows[i]);
        return sum;
    }
    const std::size_t last = (kCount > 0 ? kCount : count) - 1;
    const Vec<D> first = hn::Load(d, weights);
    Vec<D> left = hn::Sub(hn::Set(d, 1.0f), first);
    for (std::size_t i = 0; i < kRow; ++i) sum.value[i] = hn::Mul(first, hn::Set(d, rows[i]));
    for (std::size_t k = 1; k < last; ++k) {
        const Vec<D> weight = hn::Load(d, weights + kLanes * k);
        left = hn::Sub(left, weight);
        add_row(d, weight, rows + kRow * k, 0, kRow, sum);
    }
    add_row(d, left, rows + kRow * last, 0, kRow, sum);
    return sum;
}

/// The same for bones with scale, or with signs that depend on the weights.
///
/// kMixed  the last weight is with the others
template <class Kernel, bool kMixed, class D>
HWY_INLINE Sum<D> blend_bones(D d, const Palette& palette, const std::int32_t* bones, std::size_t count,
                              const float* weights, const Points<D>& rest) {
    Sum<D> sum;
    for (auto& value : sum.value) value = hn::Zero(d);
    Vec<D> left = hn::Set(d, 1.0f);
    for (std::size_t k = 0; k < count; ++k) {
        const Vec<D> weight = kMixed || k + 1 < count ? hn::Load(d, weights + kLanes * k) : left;
        left = hn::Sub(left, weight);
        Kernel::add(d, palette, static_cast<std::size_t>(bones[k]), weight, rest, sum);
    }
    return sum;
}

template <class Kernel, class D>
HWY_INLINE void finish_and_store(D d, const Frame& frame, std::size_t b, std::size_t lane, const Sum<D>& sum,
                                 const Points<D>& rest) {
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

HWY_INLINE const float* weights_of(const Frame& frame, const Block& block) {
    return frame.mesh->rows[block.first_row].lane.data() + 3 * kLanes;
}

/// Blocks [begin, end), which have the same resolved bones.
///
/// kCount  their influences, or 0 for any number
template <class Kernel, std::size_t kCount>
void deform_resolved(const Frame& frame, std::size_t begin, std::size_t end, const float* rows) {
    const Full d;
    for (std::size_t b = begin; b < end; ++b) {
        const Block& block = frame.mesh->blocks[b];
        const float* const weights = weights_of(frame, block);
        for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
            const auto sum = blend_rows<kCount>(d, rows, block.influences, weights + lane);
            finish_and_store<Kernel>(d, frame, b, lane, sum, load_rest(d, frame, block, lane));
        }
    }
}

template <class Kernel>
void deform_unresolved(const Frame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    for (std::size_t b = begin; b < end; ++b) {
        const Block& block = frame.mesh->blocks[b];
        const float* const weights = weights_of(frame, block);
        const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
        for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
            const Points<Full> rest = load_rest(d, frame, block, lane);
            const auto sum =
                blend_bones<Kernel, false>(d, *frame.palette, bones, block.influences, weights + lane, rest);
            finish_and_store<Kernel>(d, frame, b, lane, sum, rest);
        }
    }
}

/// Blocks [begin, end), which have the same bones.
template <class Kernel>
void deform_set(const Frame& frame, std::size_t begin, std::size_t end) {
    alignas(64) float rows[kMostResolved * kRow];
    const Block& block = frame.mesh->blocks[begin];
    const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
    if (!resolve<Kernel>(*frame.palette, bones, block.influences, rows)) {
        return deform_unresolved<Kernel>(frame, begin, end);
    }
    switch (block.influences) {
        case 1: return deform_resolved<Kernel, 1>(frame, begin, end, rows);
        case 2: return deform_resolved<Kernel, 2>(frame, begin, end, rows);
        case 3: return deform_resolved<Kernel, 3>(frame, begin, end, rows);
        case 4: return deform_resolved<Kernel, 4>(frame, begin, end, rows);
        default: return deform_resolved<Kernel, 0>(frame, begin, end, rows);
    }
}

/// A mixed block vertex by vertex: with scale, or without vectors.
template <class Kernel>
void deform_one_by_one(const Frame& frame, std::size_t b) {
    const One d;
    const Block& block = frame.mesh->blocks[b];
    const float* const weights = weights_of(frame, block);
    const std::int32_t* const bones = &frame.mesh->bones[block.first_bone];
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const Points<One> rest = load_rest(d, frame, block, lane);
        const auto sum = blend_bones<Kernel, true>(d, *frame.palette, bones + block.influences * lane,
                                                   block.influences, weights + lane, rest);
        finish_and_store<Kernel>(d, frame, b, lane, sum, rest);
    }
}

#if HWY_TARGET != HWY_SCALAR

/// A mixed block: a bone's row is added as it lies in memory, quad by quad, and the sums of all vertices
/// are then turned into lanes.
template <class Kernel>
void deform_mixed(const Frame& frame, std::size_t b) {
    const Four four;
    using V4 = Vec<Four>;
    const Block& block = frame.mesh->blocks[b];
    const Lanes<float>* const weights = &frame.mesh->rows[block.first_row + 3];
    const std::int32_t* bones = &frame.mesh->bones[block.first_bone];
    alignas(64) float sums[kRowQuads][4 * kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        V4 sum[kRowQuads];
        for (V4& quad : sum) quad = hn::Zero(four);
        for (std::size_t k = 0; k < block.influences; ++k, ++bones) {
            const Quad* const row = &frame.palette->bones[kRowQuads * static_cast<std::size_t>(*bones)];
            const V4 weight = hn::Set(four, weights[k].lane[lane]);
            const V4 cosine = dot(hn::Load(four, row->value.data()), sum[0]);
            const V4 side = hn::IfThenElse(hn::Lt(cosine, hn::Zero(four)), hn::Neg(weight), weight);
            for (std::size_t q = 0; q < kRowQuads; ++q) {
                sum[q] = hn::MulAdd(q < Kernel::kSignedQuads ? side : weight,
                                    hn::Load(four, row[q].value.data()), sum[q]);
            }
        }
        for (std::size_t q = 0; q < kRowQuads; ++q) hn::Store(sum[q], four, sums[q] + 4 * lane);
    }
    const Full d;
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        Sum<Full> sum;
        for (std::size_t q = 0; q < kRowQuads; ++q) {
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
void deform_rigid(const Frame& frame, std::size_t begin, std::size_t end) {
    const bool scaled = !frame.palette->has_scale.empty();
    for (std::size_t b = begin; b < end;) {
        const Block& block = frame.mesh->blocks[b];
        if (block.mixed) {
            scaled ? deform_one_by_one<Kernel>(frame, b) : deform_mixed<Kernel>(frame, b);
            ++b;
            continue;
        }
        const std::size_t after = end_of_set(frame, b, end);
        block.influences == 0 ? keep_blocks(frame, b, after) : deform_set<Kernel>(frame, b, after);
        b = after;
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
