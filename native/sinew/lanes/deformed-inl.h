// SPDX-License-Identifier: GPL-3.0-or-later
// Deformed points, which stages read again, in lanes. Compiled once for each instruction set.
#if defined(SINEW_LANES_DEFORMED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_DEFORMED_INL_H_
#undef SINEW_LANES_DEFORMED_INL_H_
#else
#define SINEW_LANES_DEFORMED_INL_H_
#endif

#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

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

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
