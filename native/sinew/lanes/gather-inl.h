// SPDX-License-Identifier: GPL-3.0-or-later
// Gathers points of arbitrary vertices into lanes; reads and writes deformed ones, which other data may lie between.
// Compiled once for each instruction set.
#if defined(SINEW_LANES_GATHER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_GATHER_INL_H_
#undef SINEW_LANES_GATHER_INL_H_
#else
#define SINEW_LANES_GATHER_INL_H_
#endif

#include <cstdint>

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

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

/// Stores each point by itself.
///
/// to_point  returns where that of a lane is
///
/// Not inlined into loops, whose stack frame would grow for every block.
template <class D, class ToPoint>
HWY_NOINLINE void store_apart(D d, Vec<D> x, Vec<D> y, Vec<D> z, const ToPoint& to_point) {
    alignas(64) float rows[3][hn::MaxLanes(D())];
    hn::Store(x, d, rows[0]);
    hn::Store(y, d, rows[1]);
    hn::Store(z, d, rows[2]);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) to_point(i) = {rows[0][i], rows[1][i], rows[2][i]};
}

/// The inverse of store_apart().
template <class D, class ToPoint>
HWY_NOINLINE Points<D> load_apart(D d, const ToPoint& to_point) {
    alignas(64) float rows[3][hn::MaxLanes(D())];
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        const Vec3<float>& point = to_point(i);
        rows[0][i] = point.x, rows[1][i] = point.y, rows[2][i] = point.z;
    }
    return {hn::Load(d, rows[0]), hn::Load(d, rows[1]), hn::Load(d, rows[2])};
}

/// Elements from `i` on.
template <class D>
HWY_INLINE Points<D> load_at(D d, const Strided<const Vec3<float>>& from, std::size_t i) {
    if (from.is_contiguous()) return load_consecutive(d, &from[i].x);
    return load_apart(
        d, [ from, i ](std::size_t k) -> auto& { return from[i + k]; });
}

template <class D>
HWY_INLINE void store_at(D d, const Points<D>& p, const Strided<Vec3<float>>& to, std::size_t i) {
    if (to.is_contiguous()) return store_consecutive(d, p, &to[i].x);
    store_apart(
        d, p.x, p.y, p.z, [ to, i ](std::size_t k) -> auto& { return to[i + k]; });
}

/// The deformed points of block `b`.
template <class D>
HWY_INLINE Points<D> load_deformed(D d, const MeshPointers& from, std::size_t b, std::size_t lane) {
    const Block& block = from.blocks[b];
    const std::int32_t* const vertices = from.vertices[b].lane.data() + lane;
    if (HWY_UNLIKELY(!from.points.is_contiguous())) {
        return load_apart(
            d, [ vertices, points = from.points ](std::size_t i) -> auto& { return points[vertices[i]]; });
    }
    const Vec3<float>* const points = from.points.data();
    if constexpr (hn::MaxLanes(D()) > 1) {
        if (block.consecutive) return load_consecutive(d, &points[block.output + lane].x);
#if HWY_TARGET == HWY_AVX3
        if (block.runs > 0) return load_runs(d, from.runs + block.output, block.runs, &points->x);
#endif
    }
    return points_of<true>(d, points, vertices);
}

/// The inverse of load_deformed().
template <class D>
HWY_INLINE void store_deformed(D d, const MeshPointers& to, std::size_t b, std::size_t lane,
                               const Points<D>& p) {
    if (to.points.is_contiguous()) return store_points(d, to, b, lane, p);
    const std::int32_t* const vertices = to.vertices[b].lane.data() + lane;
    store_apart(
        d, p.x, p.y, p.z,
        [ vertices, points = to.points ](std::size_t i) -> auto& { return points[vertices[i]]; });
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
