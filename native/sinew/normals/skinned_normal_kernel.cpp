// SPDX-License-Identifier: GPL-3.0-or-later
// Normals that move with the skin: see skinned_normals.h for the definition.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/normals/skinned_normal_kernel.h"

#include <limits>

#include "sinew/base/targets.h"
#include "sinew/lanes/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/normals/skinned_normal_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

// A vector with a smaller squared length has no direction.
constexpr float kShortest = 1e-35f;

template <class D>
HWY_INLINE Points<D> load(D d, const Vec3<float>* from) {
    if constexpr (hn::MaxLanes(D()) == 1) {
        return {hn::Set(d, from->x), hn::Set(d, from->y), hn::Set(d, from->z)};
    } else {
        return load_consecutive(d, &from->x);
    }
}

template <class D>
HWY_INLINE void store(D d, const Points<D>& p, Vec3<float>* to) {
    if constexpr (hn::MaxLanes(D()) == 1) {
        *to = {hn::GetLane(p.x), hn::GetLane(p.y), hn::GetLane(p.z)};
    } else {
        store_consecutive(d, p, &to->x);
    }
}

/// The images of a unit vector along the axis under the blends of the vertices from `i` on.
template <class D>
HWY_INLINE Points<D> column(D d, const SkinnedNormalFrame& frame, std::size_t axis, const Points<D>& points,
                            std::size_t i) {
    const Points<D> moved = load(d, frame.moved[axis] + i);
    const Vec<D> by = hn::Set(d, frame.inverse_step);
    return {hn::Mul(by, hn::Sub(moved.x, points.x)), hn::Mul(by, hn::Sub(moved.y, points.y)),
            hn::Mul(by, hn::Sub(moved.z, points.z))};
}

/// The cofactor matrices of the blends, by columns.
template <class D>
struct Cofactors {
    Points<D> axis[3];
};

template <class D>
HWY_INLINE Cofactors<D> cofactors_of(D d, const SkinnedNormalFrame& frame, std::size_t i) {
    const Points<D> points = load(d, frame.points + i);
    const Points<D> x = column(d, frame, 0, points, i);
    const Points<D> y = column(d, frame, 1, points, i);
    const Points<D> z = column(d, frame, 2, points, i);
    return {{cross<D>(y, z), cross<D>(z, x), cross<D>(x, y)}};
}

/// Unit vectors; 0 if a vector has no direction, or a length beyond the range of floats.
template <class D>
HWY_INLINE Points<D> moved_normals(D d, const Cofactors<D>& of, const Points<D>& n) {
    const Points<D> x{hn::Mul(n.x, of.axis[0].x), hn::Mul(n.x, of.axis[0].y), hn::Mul(n.x, of.axis[0].z)};
    const Points<D> v = add_scaled<D>(add_scaled<D>(x, n.y, of.axis[1]), n.z, of.axis[2]);
    const Vec<D> squared = hn::MulAdd(v.x, v.x, hn::MulAdd(v.y, v.y, hn::Mul(v.z, v.z)));
    const auto has_direction = hn::And(hn::Gt(squared, hn::Set(d, kShortest)),
                                       hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max())));
    const Vec<D> scale = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared));
    return {hn::IfThenElseZero(has_direction, hn::Mul(v.x, scale)),
            hn::IfThenElseZero(has_direction, hn::Mul(v.y, scale)),
            hn::IfThenElseZero(has_direction, hn::Mul(v.z, scale))};
}

/// Calls `compute` with whole vectors, then with single lanes. Every lane is rounded in the same way.
template <class Compute>
HWY_INLINE void in_lanes(std::size_t begin, std::size_t end, const Compute& compute) {
    const Full full;
    const One one;
    std::size_t i = begin;
    for (; i + hn::Lanes(full) <= end; i += hn::Lanes(full)) compute(full, i);
    for (; i < end; ++i) compute(one, i);
}

void of_vertices(const SkinnedNormalFrame& f, std::size_t begin, std::size_t end) {
    const SkinnedNormalFrame frame = f;
    in_lanes(begin, end, [&frame](auto d, std::size_t i) HWY_ATTR {
        store(d, moved_normals(d, cofactors_of(d, frame, i), load(d, frame.rest_normals + i)),
              frame.normals + i);
    });
}

void cofactors(const SkinnedNormalFrame& f, std::size_t begin, std::size_t end) {
    const SkinnedNormalFrame frame = f;
    in_lanes(begin, end, [&frame](auto d, std::size_t i) HWY_ATTR {
        const auto of = cofactors_of(d, frame, i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto& v = of.axis[axis];
            float* const to = frame.cofactors[axis][i].value.data();
            if constexpr (hn::MaxLanes(decltype(d)()) == 1) {
                to[0] = hn::GetLane(v.x);
                to[1] = hn::GetLane(v.y);
                to[2] = hn::GetLane(v.z);
            } else {
                hn::StoreInterleaved4(v.x, v.y, v.z, v.z, d, to);
            }
        }
    });
}

void of_frames(const SkinnedNormalFrame& f, std::size_t begin, std::size_t end) {
    const SkinnedNormalFrame frame = f;
    in_lanes(begin, end, [&frame](auto d, std::size_t i) HWY_ATTR {
        const auto cofactor = [&](std::size_t axis) HWY_ATTR {
            const Float4* const numbers = frame.cofactors[axis];
            return points_of<false>(d, numbers, frame.vertices + i);
        };
        const Cofactors<decltype(d)> of{{cofactor(0), cofactor(1), cofactor(2)}};
        store(d, moved_normals(d, of, load(d, frame.rest_normals + i)), frame.normals + i);
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

using Compute = SkinnedNormalKernel::Compute;

constexpr std::array<Compute*, kTargetCount> kOfVertices SINEW_TARGETS(of_vertices);
constexpr std::array<Compute*, kTargetCount> kCofactors SINEW_TARGETS(cofactors);
constexpr std::array<Compute*, kTargetCount> kOfFrames SINEW_TARGETS(of_frames);

}  // namespace

SkinnedNormalKernel skinned_normal_kernel() noexcept {
    const std::size_t target = target_in_use();
    return {kOfVertices[target], kCofactors[target], kOfFrames[target]};
}

}  // namespace sinew

#endif
