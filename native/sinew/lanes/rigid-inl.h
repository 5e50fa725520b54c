// SPDX-License-Identifier: GPL-3.0-or-later
// Deforms blocks with a rigid method; agrees with methods/NAME/NAME.h. Compiled once for each instruction set.
//
// Rows of bones are summed as described at Palette; `finish` computes points from the sums. Blends cancel only where
// signs are kept: else every term is added in the hemisphere of the sum before it, so |sum|^2 >= the sum of squared
// weights >= 1 / influences, which reaches kDegenerateBlend only with 1e12 influences.
#if defined(SINEW_LANES_RIGID_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_RIGID_INL_H_
#undef SINEW_LANES_RIGID_INL_H_
#else
#define SINEW_LANES_RIGID_INL_H_
#endif

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstring>
#include <type_traits>

#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/bones-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

/// A row of numbers for each bone, which are summed by weights. A row's first four numbers are the quaternion, or
/// numbers without a sign. Numbers after the first kRow are the same in all rows of a set of bones, except in
/// CentreRows.
///
/// kNumbers        numbers in a row, a multiple of 4
/// kSignedFloat4s  how many Float4 of a row change sign with the quaternion: 0 to 2
/// write_row       writes the numbers of rigid motions, one in each lane (not for rows of sets)
/// write_scale     writes the Palette::scales of a bone, of what add_scale reads
/// add_scale       adds the effect of a bone's scale to a sum, with the weight and with the weight that has the sign
///                 of the row
template <class Rows>
concept BlendedRows = Rows::kNumbers % 4 == 0 && Rows::kNumbers <= kMaxRow&& Rows::kSignedFloat4s <= 2 &&
                      requires(Full d, const Palette& palette, Vec<Full> w, Points<Full> p,
                               Sum<Full, Rows::kNumbers> sum) {
    Rows::add_scale(d, palette, std::int32_t{0}, w, w, p, sum);
};

/// Computes the deformed points from sums and rest points.
template <class Rows>
concept SumKernel = BlendedRows<Rows> && requires(Full d, Points<Full> p, Sum<Full, Rows::kNumbers> sum) {
    { Rows::finish(d, sum, p) } -> std::same_as<Points<Full>>;
};

/// CentreRows, which are summed at a centre, a point of the space of the bones. Computes the deformed points from the
/// motion of the centre, the centre and the rest points.
template <class Rows>
concept CentreKernel = BlendedRows<Rows> && std::is_base_of_v<CentreRows, Rows> &&
    requires(Full d, Points<Full> p, MeshPointers pointers, Spaces spaces, Motion<Full> motion) {
    { Rows::centre(d, pointers, spaces, std::size_t{0}, std::size_t{0}, p) } -> std::same_as<Points<Full>>;
    { Rows::finish(d, motion, p, p) } -> std::same_as<Points<Full>>;
};

/// What deform_rigid() takes. In an anonymous namespace, such a struct costs up to 21 % more instructions (GCC 12).
template <class Rows>
concept RigidKernel = SumKernel<Rows> || CentreKernel<Rows>;

/// A weighted sum of rows, and the weighted sum of only their quaternions, which decides the hemisphere of the
/// next term.
template <class D, std::size_t kNumbers>
struct Blend {
    Sum<D, kNumbers> sum;
    Vec<D> quaternion[4];
};

/// The base of rows whose sum is absolute: the row before the first, of weight 1.
alignas(64) inline constexpr float kNoBase[kMaxRow] = {};

/// The dot product of a quaternion [4] with those of the lanes. Products and sums are rounded one by one, in the order
/// of blend_vertex(), because both must decide ties alike.
template <class D>
HWY_INLINE Vec<D> dot(D d, const float* a, const Vec<D>* b) {
    return hn::Add(hn::Add(hn::Mul(hn::Set(d, a[0]), b[0]), hn::Mul(hn::Set(d, a[2]), b[2])),
                   hn::Add(hn::Mul(hn::Set(d, a[1]), b[1]), hn::Mul(hn::Set(d, a[3]), b[3])));
}

/// Adds the weighted difference of `row` from `base`, with `row` in the hemisphere of the blend. `base` is the
/// first row, or kNoBase. Returns the weight, negative where the row was negated.
///
/// keeps_signs  Palette::keeps_signs
template <class Rigid, class D>
HWY_INLINE Vec<D> add_to_blend(D d, const float* base, const float* row, Vec<D> weight, bool keeps_signs,
                               Blend<D, Rigid::kNumbers>& blend) {
    Vec<D>* const quaternion = blend.quaternion;
    const auto away = hn::Lt(keeps_signs ? hn::Zero(d) : dot(d, row, quaternion), hn::Zero(d));
    const Vec<D> signed_weight = hn::IfThenElse(away, hn::Neg(weight), weight);
    for (std::size_t i = 0; i < Rigid::kNumbers; ++i) {
        const Vec<D> difference = hn::Set(d, row[i] - base[i]);
        const Vec<D> negated = hn::Set(d, -row[i] - base[i]);
        const Vec<D> term =
            i < 4 * Rigid::kSignedFloat4s ? hn::IfThenElse(away, negated, difference) : difference;
        blend.sum.value[i] = hn::MulAdd(weight, term, blend.sum.value[i]);
    }
    for (std::size_t i = 0; i < 4; ++i)
        quaternion[i] = hn::MulAdd(signed_weight, hn::Set(d, row[i]), quaternion[i]);
    return signed_weight;
}

template <class Rigid>
inline constexpr std::size_t kRowFloat4s = Rigid::kNumbers / 4;

// Slightly more than the cosine of 45 degrees.
inline constexpr float kCosine45 = 0.7072f;

// For sets with more influences, signs are found vertex by vertex.
inline constexpr std::size_t kMaxResolved = 32;

HWY_INLINE float dot(const float* a, const float* b) {
    return (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3]);
}

/// Whether each row joins the running sum of the rows before it with the same sign for all weights: it does if it
/// is in the hemisphere of each of them.
HWY_INLINE bool signs_agree(const float* rows, std::size_t stride, std::size_t count) {
    // Far above the rounding error of a sum, so that the result agrees with signs decided by the sum in floats.
    constexpr float kTie = 1e-5f;
    for (std::size_t i = 1; i < count; ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            if (!(dot(rows + stride * i, rows + stride * j) > kTie)) return false;
        }
    }
    return true;
}

/// Subtracts the first row from each other row.
template <std::size_t kNumbers>
HWY_INLINE void subtract_first(float* rows, std::size_t count) {
    // Vectors of 8 only if a row's size is a multiple of 8.
    const hn::CappedTag<float, kNumbers % 8 == 0 ? 8 : 4> d;
    for (std::size_t i = 0; i < kNumbers; i += hn::Lanes(d)) {
        const auto first = hn::LoadU(d, rows + i);
        for (std::size_t k = 1; k < count; ++k) {
            float* const row = rows + kNumbers * k + i;
            hn::StoreU(hn::Sub(hn::LoadU(d, row), first), d, row);
        }
    }
}

#if HWY_TARGET != HWY_SCALAR

/// The dot product in every lane, rounded as by the scalar dot().
HWY_INLINE Vec<Four> dot(Vec<Four> a, Vec<Four> b) {
    const Vec<Four> product = hn::Mul(a, b);
    const Vec<Four> pairs = hn::Add(product, hn::Shuffle1032(product));
    return hn::Add(pairs, hn::Shuffle2301(pairs));
}

/// Copies rows of the palette, each in the hemisphere of the first, unless signs are kept. Returns the smallest of
/// their absolute cosines with the first.
///
/// kDifferences  copy the differences from the first row, for all rows but the first
template <class Rigid, bool kDifferences>
HWY_INLINE float copy_aligned(const Palette& palette, const std::int32_t* bones, std::size_t count,
                              float* rows) {
    const Four d;
    constexpr std::size_t kFloat4s = kRowFloat4s<Rigid>;
    const auto float4_of = [&](std::size_t k, std::size_t q) HWY_ATTR {
        return hn::Load(d, palette.bones[kFloat4s * static_cast<std::size_t>(bones[k]) + q].value.data());
    };
    Vec<Four> first[kFloat4s];
    for (std::size_t q = 0; q < kFloat4s; ++q) {
        first[q] = float4_of(0, q);
        hn::Store(first[q], d, rows + 4 * q);
    }
    Vec<Four> least = hn::Set(d, 1.0f);
    const Vec<Four> free_sign = palette.keeps_signs ? hn::Zero(d) : hn::SignBit(d);
    for (std::size_t k = 1; k < count; ++k) {
        Vec<Four> float4 = float4_of(k, 0);
        const Vec<Four> cosine = dot(float4, first[0]);
        const Vec<Four> sign = hn::And(cosine, free_sign);
        least = hn::Min(least, hn::Abs(cosine));
        for (std::size_t q = 0; q < kFloat4s; ++q) {
            if (q > 0) float4 = float4_of(k, q);
            if (q < Rigid::kSignedFloat4s) float4 = hn::Xor(float4, sign);
            hn::Store(kDifferences ? hn::Sub(float4, first[q]) : float4, d,
                      rows + Rigid::kNumbers * k + 4 * q);
        }
    }
    return hn::GetLane(least);
}

#else

template <class Rigid, bool kDifferences>
float copy_aligned(const Palette& palette, const std::int32_t* bones, std::size_t count, float* rows) {
    float least = 1.0f;
    for (std::size_t k = 0; k < count; ++k) {
        float* const row = rows + Rigid::kNumbers * k;
        std::memcpy(row, &palette.bones[kRowFloat4s<Rigid> * static_cast<std::size_t>(bones[k])],
                    sizeof(Float4) * kRowFloat4s<Rigid>);
        const float cosine = dot(row, rows);
        least = std::min(least, std::abs(cosine));
        if (cosine < 0.0f && !palette.keeps_signs) {
            for (std::size_t i = 0; i < 4 * Rigid::kSignedFloat4s; ++i) row[i] = -row[i];
        }
    }
    if (kDifferences) subtract_first<Rigid::kNumbers>(rows, count);
    return least;
}

#endif

/// Copies the first bone of a set to `rows`, and the others or, if kDifferences, their differences from it, each with
/// the sign with which it is added. Returns false if a sign depends on the weights, or if a bone has scale and
/// therefore depends on the vertex.
template <class Rigid, bool kDifferences>
HWY_INLINE bool resolve_signs(const Palette& palette, const std::int32_t* bones, std::size_t count,
                              float* rows) {
    if (count > kMaxResolved) return false;
    if (palette.any_scale) {
        for (std::size_t k = 0; k < count; ++k) {
            if (palette.has_scale[static_cast<std::size_t>(bones[k])] != 0) return false;
        }
    }
    // Within 45 degrees of the first, all are within 90 degrees of each other.
    const float least = copy_aligned<Rigid, kDifferences>(palette, bones, count, rows);
    if (Rigid::kSignedFloat4s == 0 || least > kCosine45 || palette.keeps_signs) return true;
    if (kDifferences) copy_aligned<Rigid, false>(palette, bones, count, rows);
    if (!signs_agree(rows, Rigid::kNumbers, count)) return false;
    if (kDifferences) subtract_first<Rigid::kNumbers>(rows, count);
    return true;
}

/// Blends numbers [begin, begin + kSize) of a set's rows for kVectors neighbouring vectors, with resolved signs. With
/// a fixed kCount the loop is unrolled.
///
/// count    of the rows
/// weights  of the second row and those after it
/// sums     [kVectors][kSize]
template <std::size_t kNumbers, std::size_t kCount, std::size_t kSize, std::size_t kVectors, class D>
HWY_INLINE void blend_numbers(D d, const float* rows, std::size_t begin, std::size_t count,
                              const float* weights, Vec<D>* sums) {
    const std::size_t step = hn::Lanes(d);
    for (std::size_t v = 0; v < kVectors; ++v) {
        for (std::size_t i = 0; i < kSize; ++i) sums[kSize * v + i] = hn::Set(d, rows[begin + i]);
    }
    for (std::size_t k = 1; k < (kCount > 0 ? kCount : count); ++k) {
        const float* const row = rows + kNumbers * k + begin;
        Vec<D> weight[kVectors];
        for (std::size_t v = 0; v < kVectors; ++v) {
            weight[v] = hn::Load(d, weights + kLanes * (k - 1) + v * step);
        }
        for (std::size_t i = 0; i < kSize; ++i) {
            const Vec<D> number = hn::Set(d, row[i]);
            for (std::size_t v = 0; v < kVectors; ++v) {
                Vec<D>& sum = sums[kSize * v + i];
                sum = hn::MulAdd(weight[v], number, sum);
            }
        }
    }
}

/// Blends the rows of a set of bones for one vector. Arguments are those of blend_numbers().
template <std::size_t kNumbers, std::size_t kCount, class D>
HWY_INLINE Sum<D, kNumbers> blend_rows(D d, const float* rows, std::size_t count, const float* weights) {
    Sum<D, kNumbers> sum;
    blend_numbers<kNumbers, kCount, kRow, 1>(d, rows, 0, count, weights, sum.value);
    for (std::size_t i = kRow; i < kNumbers; ++i) sum.value[i] = hn::Set(d, rows[i]);
    return sum;
}

/// Neighbouring vectors for which a bone's numbers are read once. Short vectors have no operands that repeat a
/// number, so each takes a load of its own.
inline constexpr std::size_t kVectorsAtOnce = hn::MaxLanes(Full()) < kLanes ? 2 : 1;

/// Blends CentreRows of a set of bones for kVectors neighbouring vectors, and writes their motions at the points
/// `p`. Other arguments are those of blend_numbers().
template <std::size_t kVectors, std::size_t kCount, class D>
HWY_INLINE void blend_motions(D d, const float* rows, std::size_t count, const float* weights,
                              const Points<D>* p, Motion<D>* motions) {
    constexpr std::size_t kNumbers = CentreRows::kNumbers;
    // As many numbers at once as there are registers for their sums.
    if constexpr (kVectors == 1) {
        Sum<D, kNumbers> sum;
        for (std::size_t i = 0; i < kNumbers; i += kRow) {
            blend_numbers<kNumbers, kCount, kRow, 1>(d, rows, i, count, weights, sum.value + i);
        }
        motions[0] = motion_at(sum, p[0]);
    } else {
        const auto blend = [&](std::size_t begin, Vec<D>* sums) HWY_ATTR {
            blend_numbers<kNumbers, kCount, 4, kVectors>(d, rows, begin, count, weights, sums);
        };
        const auto blend_axis = [&](std::size_t begin, Vec<D> Points<D>::*axis) HWY_ATTR {
            Vec<D> sums[4 * kVectors];
            blend(begin, sums);
            for (std::size_t v = 0; v < kVectors; ++v) {
                motions[v].displacement.*axis = moved_along(sums + 4 * v, p[v]);
            }
        };
        blend_axis(4, &Points<D>::x);
        blend_axis(8, &Points<D>::y);
        blend_axis(12, &Points<D>::z);
        Vec<D> rotations[4 * kVectors];
        blend(0, rotations);
        for (std::size_t v = 0; v < kVectors; ++v) {
            for (std::size_t i = 0; i < 4; ++i) motions[v].rotation[i] = rotations[4 * v + i];
        }
    }
}

/// Blends bones with scale, or whose signs depend on the weights, vector by vector.
template <class Rigid, class D>
HWY_INLINE Sum<D, Rigid::kNumbers> blend_bones(D d, const Palette& palette, const std::int32_t* bones,
                                               std::size_t count, bool is_absolute, const float* first_weight,
                                               const float* weights, const Points<D>& rest) {
    constexpr std::size_t kNumbers = Rigid::kNumbers;
    const float* const base = is_absolute ? kNoBase : row_of<kNumbers>(palette, bones[0]);
    const Vec<D> first = hn::Load(d, first_weight);
    Blend<D, kNumbers> blend;
    for (std::size_t i = 0; i < kNumbers; ++i) {
        blend.sum.value[i] = hn::Set(d, base[i]);
        if (i < 4) blend.quaternion[i] = hn::Mul(first, blend.sum.value[i]);
    }
    if (!is_absolute) Rigid::add_scale(d, palette, bones[0], first, first, rest, blend.sum);
    for (std::size_t k = is_absolute ? 0 : 1; k < count; ++k) {
        const Vec<D> weight = k == 0 ? first : hn::Load(d, weights + kLanes * (k - 1));
        const Vec<D> signed_weight = add_to_blend<Rigid>(d, base, row_of<kNumbers>(palette, bones[k]), weight,
                                                         palette.keeps_signs, blend);
        Rigid::add_scale(d, palette, bones[k], weight, signed_weight, rest, blend.sum);
    }
    return blend.sum;
}

/// Lanes of the first vertex data number; the others follow, kLanes apart. Null if there are none.
template <std::size_t kVertexFloats>
HWY_INLINE const float* vertex_rows_of(const MeshPointers& pointers, std::size_t b, std::size_t lane) {
    if (pointers.vertex_rows == nullptr) return nullptr;
    return pointers.vertex_rows[kVertexFloats * b].lane.data() + lane;
}

template <class Rigid, class D>
HWY_INLINE void finish_and_store(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                                 std::size_t lane, const Sum<D, Rigid::kNumbers>& sum,
                                 const Points<D>& rest) {
    Points<D> points;
    if constexpr (CentreKernel<Rigid>) {
        const Points<D> centre = Rigid::centre(d, pointers, spaces, b, lane, rest);
        points = Rigid::finish(d, motion_at(sum, centre), centre, rest);
    } else {
        points = Rigid::finish(d, sum, rest);
    }
    store_in_model(d, pointers, spaces, b, lane, points);
}

/// Deforms lanes [lane, lane + kVectors * N) of a block with resolved signs.
///
/// weights  of these lanes, of the second row and those after it
template <class Rigid, std::size_t kVectors, std::size_t kCount>
HWY_INLINE void deform_vectors(const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                               std::size_t lane, const float* bone_rows, std::size_t count,
                               const float* weights) {
    const Full d;
    if constexpr (CentreKernel<Rigid>) {
        Points<Full> rest[kVectors];
        Points<Full> centres[kVectors];
        Motion<Full> motions[kVectors];
        const std::size_t step = hn::Lanes(d);
        for (std::size_t v = 0; v < kVectors; ++v) {
            rest[v] = load_rest(d, pointers, spaces, b, lane + v * step);
            centres[v] = Rigid::centre(d, pointers, spaces, b, lane + v * step, rest[v]);
        }
        blend_motions<kVectors, kCount>(d, bone_rows, count, weights, centres, motions);
        for (std::size_t v = 0; v < kVectors; ++v) {
            store_in_model(d, pointers, spaces, b, lane + v * step,
                           Rigid::finish(d, motions[v], centres[v], rest[v]));
        }
    } else {
        const auto sum = blend_rows<Rigid::kNumbers, kCount>(d, bone_rows, count, weights);
        finish_and_store<Rigid>(d, pointers, spaces, b, lane, sum, load_rest(d, pointers, spaces, b, lane));
    }
}

/// Deforms blocks [begin, end) with the same bones, whose signs are resolved.
///
/// kCount       the number of rows, or 0 for any number
/// is_absolute  whether a row of weight 1 precedes those of the bones; only if kCount is 0
///
/// Not inlined, so that the loops of each count have all registers.
template <class Rigid, std::size_t kCount>
HWY_NOINLINE void deform_resolved(const Frame& frame, std::size_t begin, std::size_t end,
                                  const float* bone_rows, bool is_absolute = false) {
    const Full d;
    constexpr std::size_t kVectors = CentreKernel<Rigid> ? kVectorsAtOnce : 1;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const std::size_t influences = pointers.blocks[begin].influences;
    const std::size_t count = influences + (is_absolute ? 1 : 0);
    alignas(64) float all_weights[kCount == 0 ? kMaxResolved * kLanes : 1];
    for (std::size_t b = begin; b < end; ++b) {
        const float* weights = weights_of(pointers, b);
        if (kCount == 0 && is_absolute) {
            std::copy_n(first_weights_of(frame, b), kLanes, all_weights);
            std::copy_n(weights, kLanes * (influences - 1), all_weights + kLanes);
            weights = all_weights;
        }
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += kVectors * hn::Lanes(d)) {
            if (kVectors > 1 && lane + hn::Lanes(d) >= lanes) {
                deform_vectors<Rigid, 1, kCount>(pointers, spaces, b, lane, bone_rows, count, weights + lane);
            } else {
                deform_vectors<Rigid, kVectors, kCount>(pointers, spaces, b, lane, bone_rows, count,
                                                        weights + lane);
            }
        }
    }
}

template <class Rigid>
void deform_unresolved(const Frame& frame, std::size_t begin, std::size_t end, bool is_absolute) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const std::size_t influences = pointers.blocks[begin].influences;
    const std::int32_t* const bones = frame.bones + pointers.blocks[begin].first_bone;
    for (std::size_t b = begin; b < end; ++b) {
        const float* const weights_of_block = weights_of(pointers, b);
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            const Points<Full> rest = load_rest(d, pointers, spaces, b, lane);
            const auto sum =
                blend_bones<Rigid>(d, *frame.palette, bones, influences, is_absolute,
                                   first_weights_of(frame, b) + lane, weights_of_block + lane, rest);
            finish_and_store<Rigid>(d, pointers, spaces, b, lane, sum, rest);
        }
    }
}

/// Deforms blocks [begin, end) with the same bones, whose sum is absolute.
template <class Rigid>
HWY_NOINLINE void deform_absolute_set(const Frame& frame, std::size_t begin, std::size_t end) {
    constexpr std::size_t kNumbers = Rigid::kNumbers;
    alignas(64) float rows[(1 + kMaxResolved) * kNumbers];
    const Block& block = frame.mesh->blocks[begin];
    const std::int32_t* const bones = frame.bones + block.first_bone;
    if (resolve_signs<Rigid, false>(*frame.palette, bones, block.influences, rows + kNumbers)) {
        std::copy_n(rows + kNumbers, kNumbers, rows);
        std::fill_n(rows, CentreKernel<Rigid> ? kNumbers : kRow, 0.0f);
        deform_resolved<Rigid, 0>(frame, begin, end, rows, true);
    } else {
        deform_unresolved<Rigid>(frame, begin, end, true);
    }
}

/// Deforms blocks [begin, end) with the same bones.
template <class Rigid>
void deform_set(const Frame& frame, std::size_t begin, std::size_t end) {
    alignas(64) float rows[kMaxResolved * Rigid::kNumbers];
    const Block& block = frame.mesh->blocks[begin];
    const std::int32_t* const bones = frame.bones + block.first_bone;
    if (is_summed_absolutely(*frame.palette, bones, block.influences))
        return deform_absolute_set<Rigid>(frame, begin, end);
    if (!resolve_signs<Rigid, true>(*frame.palette, bones, block.influences, rows)) {
        return deform_unresolved<Rigid>(frame, begin, end, false);
    }
    switch (block.influences) {
        case 1: return deform_resolved<Rigid, 1>(frame, begin, end, rows);
        case 2: return deform_resolved<Rigid, 2>(frame, begin, end, rows);
        case 3: return deform_resolved<Rigid, 3>(frame, begin, end, rows);
        case 4: return deform_resolved<Rigid, 4>(frame, begin, end, rows);
        default: return deform_resolved<Rigid, 0>(frame, begin, end, rows);
    }
}

/// Deforms a block whose vertices have own bones one by one: for bones with scale, or without vectors.
template <class Rigid>
void deform_one_by_one(const Frame& frame, std::size_t b) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const Block& block = pointers.blocks[b];
    const float* const weights_of_block = weights_of(pointers, b);
    const std::int32_t* const bones = frame.bones + block.first_bone;
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const Points<One> rest = load_rest(d, pointers, spaces, b, lane);
        const std::int32_t* const of_vertex = bones + block.influences * lane;
        const bool is_absolute = is_summed_absolutely(*frame.palette, of_vertex, block.influences);
        const float* const weights = weights_of_block + lane;
        const auto sum = blend_bones<Rigid>(d, *frame.palette, of_vertex, block.influences, is_absolute,
                                            weights, weights + kLanes, rest);
        finish_and_store<Rigid>(d, pointers, spaces, b, lane, sum, rest);
    }
}

#if HWY_TARGET != HWY_SCALAR

/// Blends one vertex that has its own bones. A bone's row is added as it is in memory, Float4 by Float4.
///
/// weights  of each influence, kLanes apart
/// sums     receives the sum's Float4s, 4 * kLanes apart
template <class Rigid, bool kKeepsSigns>
HWY_INLINE void blend_vertex(const Palette& palette, const std::int32_t* bones, std::size_t count,
                             const float* weights, float* sums) {
    const Four d;
    using V4 = Vec<Four>;
    const auto row_at = [&](std::size_t k) {
        return &palette.bones[kRowFloat4s<Rigid> * static_cast<std::size_t>(bones[k])];
    };
    const bool is_absolute = is_summed_absolutely(palette, bones, count);
    const float* const base = is_absolute ? kNoBase : row_at(0)->value.data();
    V4 sum[kRowFloat4s<Rigid>];
    for (std::size_t q = 0; q < kRowFloat4s<Rigid>; ++q) sum[q] = hn::Load(d, base + 4 * q);
    V4 quaternions = hn::Mul(hn::Set(d, weights[0]), sum[0]);
    for (std::size_t k = is_absolute ? 0 : 1; k < count; ++k) {
        const Float4* const row = row_at(k);
        const V4 weight = hn::Set(d, weights[kLanes * k]);
        const V4 quaternion = hn::Load(d, row->value.data());
        V4 away = hn::Zero(d);
        if (!kKeepsSigns) {
            const auto below = hn::Lt(dot(quaternion, quaternions), hn::Zero(d));
            away = hn::And(hn::SignBit(d), hn::VecFromMask(d, below));
        }
        for (std::size_t q = 0; q < kRowFloat4s<Rigid>; ++q) {
            V4 term = hn::Load(d, row[q].value.data());
            if (q < Rigid::kSignedFloat4s) term = hn::Xor(term, away);
            sum[q] = hn::MulAdd(weight, hn::Sub(term, hn::Load(d, base + 4 * q)), sum[q]);
        }
        quaternions = hn::MulAdd(hn::Xor(weight, away), quaternion, quaternions);
    }
    for (std::size_t q = 0; q < kRowFloat4s<Rigid>; ++q) hn::Store(sum[q], d, sums + 4 * kLanes * q);
}

/// Deforms a block whose vertices have own bones. The sums of all vertices are transposed into lanes.
template <class Rigid, bool kKeepsSigns>
void deform_own_bones(const Frame& frame, std::size_t b) {
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const Block& block = pointers.blocks[b];
    const float* const weights_of_block = weights_of(pointers, b);
    const std::int32_t* bones = frame.bones + block.first_bone;
    const Palette palette = *frame.palette;
    alignas(64) float sums[kRowFloat4s<Rigid>][4 * kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane, bones += block.influences) {
        blend_vertex<Rigid, kKeepsSigns>(palette, bones, block.influences, weights_of_block + lane,
                                         sums[0] + 4 * lane);
    }
    const Full d;
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        Sum<Full, Rigid::kNumbers> sum;
        for (std::size_t q = 0; q < kRowFloat4s<Rigid>; ++q) {
            Vec<Full>* const value = sum.value + 4 * q;
            hn::LoadInterleaved4(d, sums[q] + 4 * lane, value[0], value[1], value[2], value[3]);
        }
        finish_and_store<Rigid>(d, pointers, spaces, b, lane, sum, load_rest(d, pointers, spaces, b, lane));
    }
}

#else

template <class Rigid, bool>
void deform_own_bones(const Frame& frame, std::size_t b) {
    deform_one_by_one<Rigid>(frame, b);
}

#endif

template <RigidKernel Rigid>
void deform_rigid(const Frame& frame, std::size_t begin, std::size_t end) {
    const auto of_block = frame.palette->any_scale     ? &deform_one_by_one<Rigid>
                          : frame.palette->keeps_signs ? &deform_own_bones<Rigid, true>
                                                       : &deform_own_bones<Rigid, false>;
    for_each_set(
        frame, begin, end,
        [&](std::size_t b, std::size_t after) HWY_ATTR { deform_set<Rigid>(frame, b, after); },
        [&](std::size_t b) HWY_ATTR { of_block(frame, b); });
}

/// The functions of a kernel for a method that blends rotations.
template <class Method, class Rows>
struct RigidFunctions {
    RigidFunctions() = delete;  // its functions need no object

    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        deform_rigid<Rows>(frame, begin, end);
    }
    static void fill_palette(const Bones& bones, bool keeps_signs, Palette& palette) {
        fill_rigid<Method, Rows>(bones, keeps_signs, palette);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
