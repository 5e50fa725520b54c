// SPDX-License-Identifier: GPL-3.0-or-later
// Gathers points of arbitrary vertices into lanes. Compiled once for each instruction set.
#if defined(SINEW_LANES_GATHER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_GATHER_INL_H_
#undef SINEW_LANES_GATHER_INL_H_
#else
#define SINEW_LANES_GATHER_INL_H_
#endif

#include <cstdint>

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR

/// Loads a point into the first three lanes.
///
/// kIsLast  nothing may be read behind the point
template <bool kIsLast, class D4>
HWY_INLINE Vec<D4> row(D4 d, const Vec3<float>* points, std::int32_t i) {
    const float* const from = &points[i].x;
    if constexpr (kIsLast) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
        return hn::MaskedLoad(hn::FirstN(d, 3), d, from);  // x86 does not need its alignment
#else
        const hn::Half<D4> two;
        const hn::Half<decltype(two)> one;
        return hn::Combine(d, hn::ZeroExtendVector(two, hn::LoadU(one, from + 2)), hn::LoadU(two, from));
#endif
    } else {
        return hn::LoadU(d, from);
    }
}

template <bool, class D4>
HWY_INLINE Vec<D4> row(D4 d, const Float4* normals, std::int32_t i) {
    return hn::Load(d, normals[i].value.data());
}

/// Row r of four: its lane 4 b + c is coordinate c of the point for lane 4 b + r.
template <bool kIsLast, class D, class Point>
HWY_INLINE Vec<D> rows(D d, const Point* points, const std::int32_t* vertices) {
    if constexpr (hn::MaxLanes(D()) == 4) {
        return row<kIsLast>(d, points, vertices[0]);
    } else {
        const hn::Half<D> half;
        return hn::Combine(d, rows<kIsLast>(half, points, vertices + hn::MaxLanes(half)),
                           rows<kIsLast>(half, points, vertices));
    }
}

#endif

/// One point for each lane. Whole points are read and then transposed: a gather of each number takes several times
/// as long on some processors.
template <bool kIsLast, class D, class Point>
HWY_INLINE Points<D> points_of(D d, const Point* points, const std::int32_t* vertices) {
#if HWY_TARGET != HWY_SCALAR
    if constexpr (hn::MaxLanes(D()) >= 4) {
        const hn::RepartitionToWide<D> pairs;
        const auto r0 = rows<kIsLast>(d, points, vertices);
        const auto r1 = rows<kIsLast>(d, points, vertices + 1);
        const auto r2 = rows<kIsLast>(d, points, vertices + 2);
        const auto r3 = rows<kIsLast>(d, points, vertices + 3);
        const auto xy01 = hn::BitCast(pairs, hn::InterleaveLower(d, r0, r1));
        const auto xy23 = hn::BitCast(pairs, hn::InterleaveLower(d, r2, r3));
        const auto z01 = hn::BitCast(pairs, hn::InterleaveUpper(d, r0, r1));
        const auto z23 = hn::BitCast(pairs, hn::InterleaveUpper(d, r2, r3));
        return {hn::BitCast(d, hn::InterleaveLower(pairs, xy01, xy23)),
                hn::BitCast(d, hn::InterleaveUpper(pairs, xy01, xy23)),
                hn::BitCast(d, hn::InterleaveLower(pairs, z01, z23))};
    }
#endif
    return load_consecutive(d, reinterpret_cast<const float*>(points + *vertices));
}

/// The deformed points of block `b`.
template <class D>
HWY_INLINE Points<D> load_deformed(D d, const MeshPointers& from, std::size_t b, std::size_t lane) {
    const Block& block = from.blocks[b];
    const std::int32_t* const vertices = from.vertices[b].lane.data() + lane;
    const Vec3<float>* const points = from.points;
    if constexpr (hn::MaxLanes(D()) > 1) {
        if (block.consecutive) return load_consecutive(d, &points[block.output + lane].x);
#if HWY_TARGET == HWY_AVX3
        if (block.runs > 0) return load_runs(d, from.runs + block.output, block.runs, &points->x);
#endif
    }
    return points_of<true>(d, points, vertices);
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
