// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of whole meshes: see normals.h for what they are. Products and sums are rounded one by one, in Blender's
// order: no multiply-add, so that results are Blender's, and the same on each instruction set.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include <array>
#include <cstdint>
#include <limits>

#include "sinew/deform/kernels.h"
#include "sinew/deform/normal_mesh.h"
#include "sinew/deform/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/normal_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

// Shorter than its root, a vector has no direction.
constexpr float kShortest = 1e-35f;

// A point or normal at once, or one number after the other where vectors have one lane.
using Four = hn::CappedTag<float, 4>;

template <class D>
HWY_INLINE Points<D> minus(const Points<D>& a, const Points<D>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class D>
HWY_INLINE Vec<D> rounded_dot(const Points<D>& a, const Points<D>& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

/// 0 where it has no direction, or a length beyond the range of floats.
template <class D>
HWY_INLINE Points<D> direction(D d, const Points<D>& v) {
    const auto squared = rounded_dot<D>(v, v);
    const auto has_one = hn::And(hn::Gt(squared, hn::Set(d, kShortest)),
                                 hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max())));
    const auto length = hn::Sqrt(squared);
    return {hn::IfThenElseZero(has_one, hn::Div(v.x, length)),
            hn::IfThenElseZero(has_one, hn::Div(v.y, length)),
            hn::IfThenElseZero(has_one, hn::Div(v.z, length))};
}

/// Blender's acos.
template <class D>
HWY_INLINE Vec<D> polynomial_angle(D d, Vec<D> cosine) {
    const auto one = hn::Set(d, 1.0f);
    const auto m = hn::Sub(one, hn::Sub(one, hn::Min(hn::Abs(cosine), one)));
    auto sum = hn::Add(hn::Mul(m, hn::Set(d, -0.02164095f)), hn::Set(d, 0.077980478f));
    sum = hn::Add(hn::Mul(m, sum), hn::Set(d, -0.213300989f));
    sum = hn::Add(hn::Mul(m, sum), hn::Set(d, 1.5707963267f));
    const auto of_size = hn::Mul(hn::Sqrt(hn::Sub(one, m)), sum);
    const auto is_negative = hn::Lt(cosine, hn::Zero(d));
    return hn::IfThenElse(is_negative, hn::Sub(hn::Set(d, 3.14159265358979f), of_size), of_size);
}

#if HWY_TARGET != HWY_SCALAR

/// A point in the first three lanes.
///
/// kIsLast  nothing may be read behind it
template <bool kIsLast, class D4>
HWY_INLINE Vec<D4> row(D4 d, const Vec3<float>* points, std::int32_t i) {
    const float* const from = &points[i].x;
    if constexpr (kIsLast) {
        alignas(16) const float numbers[4] = {from[0], from[1], from[2], 0.0f};
        return hn::Load(d, numbers);
    } else {
        return hn::LoadU(d, from);
    }
}

/// Row r of four: lane 4 b + c is coordinate c of the point of the lane 4 b + r.
template <bool kIsLast, class D>
HWY_INLINE Vec<D> rows(D d, const Vec3<float>* points, const std::int32_t* vertices) {
    if constexpr (hn::MaxLanes(D()) == 4) {
        return row<kIsLast>(d, points, vertices[0]);
    } else {
        const hn::Half<D> half;
        return hn::Combine(d, rows<kIsLast>(half, points, vertices + hn::MaxLanes(half)),
                           rows<kIsLast>(half, points, vertices));
    }
}

#endif

/// One point of each lane: whole points are read and transposed, as to gather each number takes longer.
template <bool kIsLast, class D>
HWY_INLINE Points<D> points_of(D d, const Vec3<float>* points, const std::int32_t* vertices) {
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
    const Vec3<float>& point = points[*vertices];
    return {hn::Set(d, point.x), hn::Set(d, point.y), hn::Set(d, point.z)};
}

HWY_INLINE float* numbers_of(Float4* slots) { return reinterpret_cast<float*>(slots); }
HWY_INLINE const float* numbers_of(const Float4* slots) { return reinterpret_cast<const float*>(slots); }

template <class D>
HWY_INLINE void store_interleaved(D d, Vec<D> a, Vec<D> b, Vec<D> c, Vec<D> e, float* to) {
    if constexpr (hn::MaxLanes(D()) == 1) {
        to[0] = hn::GetLane(a);
        to[1] = hn::GetLane(b);
        to[2] = hn::GetLane(c);
        to[3] = hn::GetLane(e);
    } else {
        hn::StoreInterleaved4(a, b, c, e, d, to);
    }
}

/// The unit vector of Newell's sum.
template <class D>
HWY_INLINE Points<D> face_normal(D d, const Points<D>& newell) {
    const auto squared = rounded_dot<D>(newell, newell);
    const auto has_area = hn::Gt(squared, hn::Set(d, kShortest));
    const auto is_finite = hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max()));
    const auto one = hn::Set(d, 1.0f);
    // 0 where it is infinite.
    const auto inverse = hn::IfThenElseZero(hn::And(has_area, is_finite), hn::Div(one, hn::Sqrt(squared)));
    const auto scaled = [inverse, is_finite](Vec<D> number)
                            HWY_ATTR { return hn::IfThenElseZero(is_finite, hn::Mul(number, inverse)); };
    return {scaled(newell.x), scaled(newell.y), hn::IfThenElse(has_area, scaled(newell.z), one)};
}

/// Lanes of a block from `lane` on.
///
/// kCorners  of each face; 0: those of the block
template <std::size_t kCorners, bool kAngles, bool kIsLast, class D>
HWY_INLINE void compute_lanes(D d, const NormalFrame& frame, const FaceBlock& block, std::size_t lane) {
    const std::size_t count = kCorners > 0 ? kCorners : block.corners;
    const std::size_t lanes = block.lanes;
    const std::int32_t* const vertices = frame.mesh->corner_vertices.data() + block.first_vertex + lane;
    const auto zero = hn::Zero(d);
    Points<D> newell{zero, zero, zero};
    const auto add_edge = [&newell](const Points<D>& from, const Points<D>& to) HWY_ATTR {
        newell.x = hn::Add(newell.x, hn::Mul(hn::Sub(from.y, to.y), hn::Add(from.z, to.z)));
        newell.y = hn::Add(newell.y, hn::Mul(hn::Sub(from.z, to.z), hn::Add(from.x, to.x)));
        newell.z = hn::Add(newell.z, hn::Mul(hn::Sub(from.x, to.x), hn::Add(from.y, to.y)));
    };
    float* const angles = frame.angles + 4 * (block.first_slot + lane);
    if (count > 0) {
        const Points<D> first = points_of<kIsLast>(d, frame.points, vertices);
        const Points<D> last = points_of<kIsLast>(d, frame.points, vertices + (count - 1) * lanes);
        add_edge(last, first);
        // Along the edge of the corner before and of this one, forwards.
        const Points<D> closing = kAngles ? direction(d, minus<D>(first, last)) : first;
        Points<D> before = closing;
        Points<D> current = first;
        Vec<D> of_slot[4] = {zero, zero, zero, zero};
        const auto step = [&](std::size_t k, const Points<D>& next) HWY_ATTR {
            if (k + 1 < count) add_edge(current, next);
            if constexpr (kAngles) {
                const Points<D> after = k + 1 < count ? direction(d, minus<D>(next, current)) : closing;
                of_slot[k % 4] = polynomial_angle(d, hn::Neg(rounded_dot<D>(before, after)));
                before = after;
                if (k % 4 == 3 || k + 1 == count) {
                    store_interleaved(d, of_slot[0], of_slot[1], of_slot[2], of_slot[3],
                                      angles + 4 * (k / 4) * lanes);
                }
            }
            current = next;
        };
        for (std::size_t k = 0; k + 2 < count; ++k) {
            step(k, points_of<kIsLast>(d, frame.points, vertices + (k + 1) * lanes));
        }
        if (count > 1) step(count - 2, last);
        step(count - 1, first);
    }
    const Points<D> normal = face_normal(d, newell);
    Float4* const slots = frame.slot_normals + block.first_slot + lane;
    for (std::size_t k = 0; k == 0 || k < count; k += 4) {
        store_interleaved(d, normal.x, normal.y, normal.z, zero, numbers_of(slots + k / 4 * lanes));
    }
}

template <std::size_t kCorners, bool kAngles, bool kIsLast>
HWY_INLINE void compute_block(const NormalFrame& frame, const FaceBlock& block) {
    if (block.lanes == 1) return compute_lanes<kCorners, kAngles, kIsLast>(One(), frame, block, 0);
    const Full d;
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
        compute_lanes<kCorners, kAngles, kIsLast>(d, frame, block, lane);
    }
}

/// Apart, so that its stack is not that of every block.
template <bool kAngles>
HWY_NOINLINE void compute_any_block(const NormalFrame& frame, const FaceBlock& block) {
    compute_block<0, kAngles, true>(frame, block);
}

template <bool kAngles>
HWY_INLINE void compute_blocks(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
        const FaceBlock& block = frame.mesh->blocks[b];
        if (block.reads_last_point || block.corners < 3 || block.corners > 4) {
            compute_any_block<kAngles>(frame, block);
        } else if (block.corners == 3) {
            compute_block<3, kAngles, false>(frame, block);
        } else {
            compute_block<4, kAngles, false>(frame, block);
        }
    }
}

void faces(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    compute_blocks<false>(frame, begin, end);
}

void corners(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    compute_blocks<true>(frame, begin, end);
}

/// The sum of a group.
HWY_INLINE void sum_group(const NormalFrame& frame, std::size_t group, Float4& sum) {
    const Four d;
    const std::uint32_t* const offsets = frame.groups->offsets.data() + group;
    const std::uint32_t* const sources = frame.groups->sources.data();
    const float* const normals = numbers_of(frame.slot_normals);
    if (offsets[0] == offsets[1]) {
        // Of a vertex without faces: fans have corners.
        const Vec3<float>& point = frame.points[group];
        sum = {{point.x, point.y, point.z, 0.0f}};
        return;
    }
    for (std::size_t number = 0; number < 4; number += hn::Lanes(d)) {
        auto numbers = hn::Zero(d);
        for (std::uint32_t i = offsets[0]; i < offsets[1]; ++i) {
            const std::uint32_t source = sources[i];
            const auto normal = hn::Load(d, normals + (source & ~3u) + number);
            numbers = hn::Add(numbers, hn::Mul(normal, hn::Set(d, frame.angles[source])));
        }
        hn::Store(numbers, d, sum.value.data() + number);
    }
}

/// Calls store(first group, its number, unit vectors of the lanes) for the groups [begin, end).
template <class Store>
HWY_INLINE void sum_lanes(const NormalFrame& frame, std::size_t begin, std::size_t end, const Store& store) {
    const Full d;
    using D = Full;
    alignas(64) Float4 sums[kLanes] = {};
    for (std::size_t group = begin; group < end; group += hn::Lanes(d)) {
        const std::size_t count = HWY_MIN(hn::Lanes(d), end - group);
        for (std::size_t i = 0; i < count; ++i) sum_group(frame, group + i, sums[i]);
        Points<D> sum;
        Vec<D> rest;
        hn::LoadInterleaved4(d, numbers_of(sums), sum.x, sum.y, sum.z, rest);
        store(group, count, direction(d, sum));
    }
}

void sum(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    sum_lanes(frame, begin, end,
              [&](std::size_t group, std::size_t count, const Points<Full>& unit) HWY_ATTR {
                  if (count == hn::Lanes(d)) {
                      hn::StoreInterleaved3(unit.x, unit.y, unit.z, d, &frame.normals[group].x);
                      return;
                  }
                  alignas(64) Vec3<float> few[kLanes];
                  hn::StoreInterleaved3(unit.x, unit.y, unit.z, d, &few[0].x);
                  for (std::size_t i = 0; i < count; ++i) frame.normals[group + i] = few[i];
              });
}

void sum_groups(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    sum_lanes(frame, begin, end, [&](std::size_t group, std::size_t, const Points<Full>& unit) HWY_ATTR {
        hn::StoreInterleaved4(unit.x, unit.y, unit.z, hn::Zero(d), d,
                              numbers_of(frame.group_normals + group));
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

using Compute = void(const NormalFrame& frame, std::size_t begin, std::size_t end);

constexpr std::array<Compute*, kTargetCount> kFaces SINEW_TARGETS_OF(faces);
constexpr std::array<Compute*, kTargetCount> kCorners SINEW_TARGETS_OF(corners);
constexpr std::array<Compute*, kTargetCount> kSum SINEW_TARGETS_OF(sum);
constexpr std::array<Compute*, kTargetCount> kSumGroups SINEW_TARGETS_OF(sum_groups);

}  // namespace

NormalKernel normal_kernel() noexcept {
    const std::size_t target = target_in_use();
    return {kFaces[target], kCorners[target], kSum[target], kSumGroups[target]};
}

}  // namespace sinew

#endif
