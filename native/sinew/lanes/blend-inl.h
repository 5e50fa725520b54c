// SPDX-License-Identifier: GPL-3.0-or-later
// Blending for the rigid methods on lanes; agrees with methods/NAME/NAME.h. Compiled once for each instruction set.
//
// Rows of bones are summed as described at Palette; `finish` computes points from the sums. Blends can not cancel
// here: every term is added in the hemisphere of the sum before it, so |sum|^2 >= the sum of squared weights >= 1
// / influences, which reaches kDegenerateBlend only with 1e12 influences.
#if defined(SINEW_LANES_BLEND_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_BLEND_INL_H_
#undef SINEW_LANES_BLEND_INL_H_
#else
#define SINEW_LANES_BLEND_INL_H_
#endif

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// Numbers in a bone's row, unless its method has more: two Float4.
inline constexpr std::size_t kRow = 8;

/// The largest number of them in any method.
inline constexpr std::size_t kMaxRow = 16;

/// A weighted sum of rows.
template <class D, std::size_t kNumbers = kRow>
struct Sum {
    Vec<D> value[kNumbers];
};

/// A weighted sum of rows, and the weighted sum of only their quaternions, which decides the hemisphere of the
/// next term.
template <class D, std::size_t kNumbers>
struct Blend {
    Sum<D, kNumbers> sum;
    Vec<D> quaternion[4];
};

/// The base of rows that are added plainly.
inline constexpr float kNoBase[kMaxRow] = {};

/// Starts a blend with the first row.
///
/// plain  whether the first row is added by its weight
template <std::size_t kNumbers, class D>
HWY_INLINE Blend<D, kNumbers> begin_blend(D d, const float* row, Vec<D> weight, bool plain) {
    Blend<D, kNumbers> blend;
    for (std::size_t i = 0; i < kNumbers; ++i) blend.sum.value[i] = hn::Set(d, row[i]);
    for (std::size_t i = 0; i < 4; ++i) blend.quaternion[i] = hn::Mul(weight, hn::Set(d, row[i]));
    if (plain) {
        for (std::size_t i = 0; i < kNumbers; ++i) blend.sum.value[i] = hn::Mul(weight, hn::Set(d, row[i]));
    }
    return blend;
}

/// Adds the weighted difference of `row` from `base`, with `row` in the hemisphere of the blend. `base` is the
/// first row, or kNoBase. Returns the weight, negative where the row was negated.
///
/// The products and sums of the dot product are rounded one by one, in the order of blend_vertex(), because
/// both must decide ties alike.
template <class Rigid, class D>
HWY_INLINE Vec<D> add_to_blend(D d, const float* base, const float* row, Vec<D> weight,
                               Blend<D, Rigid::kNumbers>& blend) {
    Vec<D>* const quaternion = blend.quaternion;
    const Vec<D> dot = hn::Add(
        hn::Add(hn::Mul(hn::Set(d, row[0]), quaternion[0]), hn::Mul(hn::Set(d, row[2]), quaternion[2])),
        hn::Add(hn::Mul(hn::Set(d, row[1]), quaternion[1]), hn::Mul(hn::Set(d, row[3]), quaternion[3])));
    const auto away = hn::Lt(dot, hn::Zero(d));
    const Vec<D> signed_weight = hn::IfThenElse(away, hn::Neg(weight), weight);
    for (std::size_t i = 0; i < Rigid::kNumbers; ++i) {
        const Vec<D> difference = hn::Set(d, row[i] - base[i]);
        const Vec<D> negated = hn::Set(d, -row[i] - base[i]);
        const Vec<D> by =
            i < 4 * Rigid::kSignedFloat4s ? hn::IfThenElse(away, negated, difference) : difference;
        blend.sum.value[i] = hn::MulAdd(weight, by, blend.sum.value[i]);
    }
    for (std::size_t i = 0; i < 4; ++i)
        quaternion[i] = hn::MulAdd(signed_weight, hn::Set(d, row[i]), quaternion[i]);
    return signed_weight;
}

template <std::size_t kNumbers = kRow>
HWY_INLINE const float* row_of(const Palette& palette, std::int32_t bone) {
    return palette.bones[kNumbers / 4 * static_cast<std::size_t>(bone)].value.data();
}

/// Computes the displacement of `rest` by the scale of `bone`. Returns false if the bone has no scale.
template <class D>
HWY_INLINE bool scaled(D d, const Palette& palette, std::int32_t bone, const Points<D>& rest, Points<D>& by) {
    const auto index = static_cast<std::size_t>(bone);
    if (!palette.any_scale || palette.has_scale[index] == 0) return false;
    by = displacement(d, palette.scales[kDisplacementRows * index].value.data(), rest);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
