// SPDX-License-Identifier: GPL-3.0-or-later
// Normals that move with the skin: see skinned_normals.h for the definition.
#include "sinew/normals/skinned_normal_kernel.h"

#include <limits>

#include "sinew/lanes/kernel.h"

#define SINEW_THIS_FILE "sinew/normals/skinned_normal_kernel.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

// A vector with a smaller squared length has no direction.
constexpr float kShortest = 1e-35f;

/// The images of a unit vector along the axis under the blends of the vertices from `i` on.
template <class D>
HWY_INLINE Points<D> column(D d, const SkinnedNormalFrame& frame, std::size_t axis, const Points<D>& points,
                            std::size_t i) {
    const Points<D> moved = load_consecutive(d, &frame.moved[axis][i].x);
    return times<D>(hn::Set(d, frame.inverse_step), subtract<D>(moved, points));
}

/// The cofactor matrices of the blends, by columns.
template <class D>
struct Cofactors {
    Points<D> axis[3];
};

template <class D>
HWY_INLINE Cofactors<D> cofactors_of(D d, const SkinnedNormalFrame& frame, std::size_t i) {
    const Points<D> points = load_consecutive(d, &frame.points[i].x);
    const Points<D> x = column(d, frame, 0, points, i);
    const Points<D> y = column(d, frame, 1, points, i);
    const Points<D> z = column(d, frame, 2, points, i);
    return {{cross<D>(y, z), cross<D>(z, x), cross<D>(x, y)}};
}

/// Unit vectors; 0 if a vector has no direction, or a length beyond the range of floats.
template <class D>
HWY_INLINE Points<D> moved_normals(D d, const Cofactors<D>& cofactors, const Points<D>& n) {
    const Points<D> v = add_scaled<D>(add_scaled<D>(times<D>(n.x, cofactors.axis[0]), n.y, cofactors.axis[1]),
                                      n.z, cofactors.axis[2]);
    const Vec<D> squared = dot<D>(v, v);
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
        const auto rest = load_consecutive(d, &frame.rest_normals[i].x);
        store_consecutive(d, moved_normals(d, cofactors_of(d, frame, i), rest), &frame.normals[i].x);
    });
}

void cofactors(const SkinnedNormalFrame& f, std::size_t begin, std::size_t end) {
    const SkinnedNormalFrame frame = f;
    in_lanes(begin, end, [&frame](auto d, std::size_t i) HWY_ATTR {
        const auto found = cofactors_of(d, frame, i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto& v = found.axis[axis];
            store_float4s(d, v.x, v.y, v.z, v.z, &frame.cofactors[axis][i]);
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
        const auto rest = load_consecutive(d, &frame.rest_normals[i].x);
        store_consecutive(d, moved_normals(d, of, rest), &frame.normals[i].x);
    });
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
constinit const SkinnedNormalKernel kSkinnedNormalKernel{SINEW_TARGETS(of_vertices), SINEW_TARGETS(cofactors),
                                                         SINEW_TARGETS(of_frames)};

}  // namespace sinew

#endif
