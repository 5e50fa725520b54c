// SPDX-License-Identifier: GPL-3.0-or-later
// Points in lanes: compiled once for each instruction set, see kernels.cpp.
#if defined(SINEW_DEFORM_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_DEFORM_LANES_INL_H_
#undef SINEW_DEFORM_LANES_INL_H_
#else
#define SINEW_DEFORM_LANES_INL_H_
#endif

#include "hwy/highway.h"
#include "sinew/deform/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Full = hn::CappedTag<float, kLanes>;
using One = hn::CappedTag<float, 1>;

template <class D>
using Vec = hn::Vec<D>;

/// One coordinate of several vertices in each vector.
template <class D>
struct Points {
    Vec<D> x;
    Vec<D> y;
    Vec<D> z;
};

template <class D>
HWY_INLINE Points<D> load_points(D d, const Lanes<float>* rows, std::size_t lane) {
    return {hn::Load(d, rows[0].lane.data() + lane), hn::Load(d, rows[1].lane.data() + lane),
            hn::Load(d, rows[2].lane.data() + lane)};
}

/// rows  [3] of `displacement`, each (x, y, z, shift)
template <class D>
HWY_INLINE Points<D> displacement(D d, const float* rows, const Points<D>& p) {
    const auto row = [d, &p](const float* r) HWY_ATTR {
        return hn::MulAdd(
            hn::Set(d, r[0]), p.x,
            hn::MulAdd(hn::Set(d, r[1]), p.y, hn::MulAdd(hn::Set(d, r[2]), p.z, hn::Set(d, r[3]))));
    };
    return {row(rows), row(rows + 4), row(rows + 8)};
}

template <class D>
HWY_INLINE Points<D> displaced(D d, const float* rows, const Points<D>& p) {
    const Points<D> by = displacement(d, rows, p);
    return {hn::Add(p.x, by.x), hn::Add(p.y, by.y), hn::Add(p.z, by.z)};
}

template <class D>
HWY_INLINE Points<D> cross(const Points<D>& a, const Points<D>& b) {
    return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
            hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

/// a + b x c
template <class D>
HWY_INLINE Points<D> add_cross(const Points<D>& a, const Points<D>& b, const Points<D>& c) {
    return {hn::NegMulAdd(b.z, c.y, hn::MulAdd(b.y, c.z, a.x)),
            hn::NegMulAdd(b.x, c.z, hn::MulAdd(b.z, c.x, a.y)),
            hn::NegMulAdd(b.y, c.x, hn::MulAdd(b.x, c.y, a.z))};
}

/// a + scale * b
template <class D>
HWY_INLINE Points<D> add_scaled(const Points<D>& a, Vec<D> scale, const Points<D>& b) {
    return {hn::MulAdd(scale, b.x, a.x), hn::MulAdd(scale, b.y, a.y), hn::MulAdd(scale, b.z, a.z)};
}

/// Apart from store_points, so that its stack is not that of every block.
template <class D>
HWY_NOINLINE void scatter_points(D d, const std::int32_t* place, Vec3<float>* points, Vec<D> x, Vec<D> y,
                                 Vec<D> z) {
    // Numbers one by one: turning lanes into points first costs a fifth more of the whole.
    alignas(64) float xs[hn::MaxLanes(D())];
    alignas(64) float ys[hn::MaxLanes(D())];
    alignas(64) float zs[hn::MaxLanes(D())];
    hn::Store(x, d, xs);
    hn::Store(y, d, ys);
    hn::Store(z, d, zs);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) points[place[i]] = {xs[i], ys[i], zs[i]};
}

/// Writes lanes [lane, lane + N) of block `b`. Lanes that repeat the last vertex write it once more.
template <class D>
HWY_INLINE void store_points(D d, const Frame& frame, std::size_t b, std::size_t lane, const Points<D>& p) {
    const Block& block = frame.mesh->blocks[b];
    const std::int32_t* const place = frame.mesh->vertices[b].lane.data() + lane;
    if constexpr (hn::MaxLanes(D()) == 1) {
        frame.points[*place] = {hn::GetLane(p.x), hn::GetLane(p.y), hn::GetLane(p.z)};
    } else if (block.consecutive) {
        hn::StoreInterleaved3(p.x, p.y, p.z, d,
                              &frame.points[static_cast<std::size_t>(block.first_vertex) + lane].x);
    } else {
        scatter_points(d, place, frame.points, p.x, p.y, p.z);
    }
}

inline void keep_block(const Frame& frame, std::size_t b) {
    const Full d;
    const Block& block = frame.mesh->blocks[b];
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        store_points(d, frame, b, lane, load_points(d, &frame.mesh->rows[block.first_row], lane));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
