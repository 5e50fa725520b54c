// SPDX-License-Identifier: GPL-3.0-or-later
// Deformed points, which stages read again, in lanes. Compiled once for each instruction set.
#if defined(SINEW_LANES_DEFORMED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_DEFORMED_INL_H_
#undef SINEW_LANES_DEFORMED_INL_H_
#else
#define SINEW_LANES_DEFORMED_INL_H_
#endif

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_AVX2

/// Loads points of arbitrary vertices, each with a masked load. A gather takes several times as long on some
/// processors.
HWY_INLINE Points<Full> load_each(Full d, const std::int32_t* vertices, const Vec3<float>* points) {
    const hn::CappedTag<float, 4> four;
    const auto three = hn::FirstN(four, 3);
    const auto point = [&](std::size_t lane)
                           HWY_ATTR { return hn::MaskedLoad(three, four, &points[vertices[lane]].x); };
    const auto pair = [&](std::size_t lane) HWY_ATTR { return hn::Combine(d, point(lane + 4), point(lane)); };
    const Vec<Full> a = pair(0), b = pair(1), e = pair(2), f = pair(3);
    const hn::RepartitionToWide<Full> wide;
    const auto xy_ab = hn::BitCast(wide, hn::InterleaveLower(d, a, b));
    const auto xy_ef = hn::BitCast(wide, hn::InterleaveLower(d, e, f));
    const auto z_ab = hn::BitCast(wide, hn::InterleaveUpper(d, a, b));
    const auto z_ef = hn::BitCast(wide, hn::InterleaveUpper(d, e, f));
    return {hn::BitCast(d, hn::InterleaveLower(wide, xy_ab, xy_ef)),
            hn::BitCast(d, hn::InterleaveUpper(wide, xy_ab, xy_ef)),
            hn::BitCast(d, hn::InterleaveLower(wide, z_ab, z_ef))};
}

#endif

/// The deformed points of block `b`.
template <class D>
HWY_INLINE Points<D> load_deformed(D d, const MeshPointers& from, std::size_t b, std::size_t lane) {
    const Block& block = from.blocks[b];
    const std::int32_t* const vertices = from.vertices[b].lane.data() + lane;
    if constexpr (hn::MaxLanes(D()) == 1) {
        const Vec3<float>& point = from.points[*vertices];
        return {hn::Set(d, point.x), hn::Set(d, point.y), hn::Set(d, point.z)};
    } else {
        if (block.consecutive) return load_consecutive(d, &from.points[block.output + lane].x);
#if HWY_TARGET == HWY_AVX3
        if (block.runs > 0) return load_runs(d, from.runs + block.output, block.runs, &from.points->x);
#endif
#if HWY_TARGET == HWY_AVX2
        return load_each(d, vertices, from.points);
#else
        const hn::RebindToSigned<D> integers;
        const auto vertex = hn::LoadU(integers, vertices);
        const auto first = hn::Add(vertex, hn::Add(vertex, vertex));
        const float* const points = &from.points->x;
        return {hn::GatherIndex(d, points, first), hn::GatherIndex(d, points + 1, first),
                hn::GatherIndex(d, points + 2, first)};
#endif
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
