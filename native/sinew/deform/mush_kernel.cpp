// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `delta_mush` on whole chunks: see skinning/delta_mush.h for what it computes.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include <array>
#include <cstdint>
#include <limits>

#include "sinew/deform/kernels.h"
#include "sinew/deform/mush_mesh.h"
#include "sinew/deform/targets.h"
#include "sinew/skinning/delta_mush.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/mush_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

// The four numbers of a point at once, or one after the other where vectors have one lane.
using Four = hn::CappedTag<float, 4>;

HWY_INLINE const float* numbers_of(const Float4* points) { return reinterpret_cast<const float*>(points); }
HWY_INLINE float* numbers_of(Float4* points) { return reinterpret_cast<float*>(points); }

/// One iteration of the numbers from `at` on.
///
/// neighbour(k)  the numbers of the k-th neighbour
template <std::size_t kValence, class D, class Neighbour>
HWY_INLINE void smooth_numbers(D d, const float* point, float* to, std::size_t valence, Vec<D> factor,
                               const Neighbour& neighbour) {
    if constexpr (kValence > 0) valence = kValence;
    auto sum = hn::LoadU(d, neighbour(0));
    for (std::size_t k = 1; k < valence; ++k) sum = hn::Add(sum, hn::LoadU(d, neighbour(k)));
    const auto old = hn::LoadU(d, point);
    const auto count = hn::Set(d, static_cast<float>(valence));
    hn::StoreU(hn::MulAdd(factor, hn::NegMulAdd(count, old, sum), old), d, to);
}

/// kValence  neighbours of each vertex; 0: those of the run
template <std::size_t kValence>
HWY_INLINE void smooth_run(const MushFrame& frame, const MushRun& run) {
    const Four four;
    const Full full;
    const std::size_t valence = run.valence;
    const std::int32_t* const first = frame.mesh->neighbours.data() + run.first_neighbour;
    const float* const from = numbers_of(frame.from);
    float* const to = numbers_of(frame.to);
    const std::size_t end = 4 * static_cast<std::size_t>(run.end);
    std::size_t at = 4 * static_cast<std::size_t>(run.begin);
    const std::size_t begin = at;
    if (run.is_consecutive && frame.is_uniform) {
        // The numbers of several vertices at once.
        const auto factor = hn::Set(full, frame.factors[run.begin]);
        for (; at + hn::Lanes(full) <= end; at += hn::Lanes(full)) {
            smooth_numbers<kValence>(full, from + at, to + at, valence, factor, [&](std::size_t k) HWY_ATTR {
                return from + 4 * static_cast<std::size_t>(first[k]) + (at - begin);
            });
        }
    }
    const std::size_t step = run.is_consecutive ? 0 : valence;
    for (; at < end; at += hn::Lanes(four)) {
        const std::size_t vertex = (at - begin) / 4;
        const std::int32_t* const neighbours = first + vertex * step;
        const std::size_t number = run.is_consecutive ? at - begin : at % 4;
        smooth_numbers<kValence>(four, from + at, to + at, valence, hn::Set(four, frame.factors[at / 4]),
                                 [&](std::size_t k) HWY_ATTR {
                                     return from + 4 * static_cast<std::size_t>(neighbours[k]) + number;
                                 });
    }
}

/// Vertices without neighbours stay.
HWY_INLINE void copy_run(const MushFrame& frame, const MushRun& run) {
    for (std::size_t i = run.begin; i < run.end; ++i) frame.to[i] = frame.from[i];
}

void smooth(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const MushMesh& mesh = *frame.mesh;
    for (std::size_t r = mesh.first_runs[begin]; r < mesh.first_runs[end]; ++r) {
        const MushRun& run = mesh.runs[r];
        switch (run.valence) {
            case 0: copy_run(frame, run); break;
            case 3: smooth_run<3>(frame, run); break;
            case 4: smooth_run<4>(frame, run); break;
            case 5: smooth_run<5>(frame, run); break;
            case 6: smooth_run<6>(frame, run); break;
            case 7: smooth_run<7>(frame, run); break;
            default: smooth_run<0>(frame, run); break;
        }
    }
}

/// Points of a block's vertices, which follow each other.
template <class D>
HWY_INLINE Points<D> consecutive_points(D d, const Float4* points, std::size_t first) {
    Points<D> p;
    Vec<D> rest;
    hn::LoadInterleaved4(d, numbers_of(points + first), p.x, p.y, p.z, rest);
    return p;
}

/// By way of memory, which is faster than to gather each number.
///
/// index_of(lane)  of the point
template <class D, class Index>
HWY_INLINE Points<D> collected_points(D d, const Float4* points, const Index& index_of) {
    alignas(64) Float4 collected[kLanes];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
        collected[lane] = points[static_cast<std::size_t>(index_of(lane))];
    }
    return consecutive_points(d, collected, 0);
}

/// Points of a block from `lane` on.
template <class D>
HWY_INLINE Points<D> points_at(D d, const Float4* points, const Lanes<std::int32_t>& indices,
                               std::size_t lane) {
    const std::int32_t* const of_lanes = indices.lane.data() + lane;
    return collected_points(d, points, [of_lanes](std::size_t i) HWY_ATTR { return of_lanes[i]; });
}

template <class D>
HWY_INLINE Points<D> subtract(const Points<D>& a, const Points<D>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class D>
HWY_INLINE Vec<D> dot_of(const Points<D>& a, const Points<D>& b) {
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

template <class D>
HWY_INLINE Points<D> cross_of(const Points<D>& a, const Points<D>& b) {
    return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
            hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

/// 1 / sqrt(x), x positive and finite; a root and a division of 16 lanes take longer than the rest of a corner.
template <class D>
HWY_INLINE Vec<D> inverse_root(D d, Vec<D> x) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    // 12 digits, by two of Newton's steps all of them.
    auto root = hn::ApproximateReciprocalSqrt(x);
    const auto half = hn::Mul(x, hn::Set(d, 0.5f));
    for (int step = 0; step < 2; ++step) {
        root = hn::Mul(root, hn::NegMulAdd(hn::Mul(half, root), root, hn::Set(d, 1.5f)));
    }
    return root;
#else
    return hn::Div(hn::Set(d, 1.0f), hn::Sqrt(x));
#endif
}

template <class D>
HWY_INLINE Points<D> unit(D d, const Points<D>& v) {
    const auto squared = dot_of<D>(v, v);
    const auto is_long = hn::Gt(squared, hn::Set(d, static_cast<float>(DeltaMushStage::kShortest)));
    const auto is_finite = hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max()));
    const auto inverse = hn::IfThenElseZero(hn::And(is_long, is_finite), inverse_root(d, squared));
    return {hn::Mul(v.x, inverse), hn::Mul(v.y, inverse), hn::Mul(v.z, inverse)};
}

template <class D>
HWY_INLINE Vec<D> angle(D d, Vec<D> cosine) {
    const auto one = hn::Set(d, 1.0f);
    const auto m = hn::Min(hn::Abs(cosine), one);
    auto sum = hn::MulAdd(m, hn::Set(d, -0.02164095f), hn::Set(d, 0.077980478f));
    sum = hn::MulAdd(m, sum, hn::Set(d, -0.213300989f));
    sum = hn::MulAdd(m, sum, hn::Set(d, 1.5707963267f));
    const auto of_size = hn::Mul(hn::Sqrt(hn::Sub(one, m)), sum);
    const auto is_negative = hn::Lt(cosine, hn::Zero(d));
    return hn::IfThenElse(is_negative, hn::Sub(hn::Set(d, 3.14159265358979f), of_size), of_size);
}

template <class D>
struct CornerLanes {
    Points<D> x, y, z;
    Vec<D> weight;
};

template <class D>
HWY_INLINE CornerLanes<D> corner_of(D d, const Points<D>& previous, const Points<D>& current,
                                    const Points<D>& next) {
    const Points<D> a = unit(d, subtract<D>(previous, current));
    const Points<D> b = unit(d, subtract<D>(current, next));
    const auto straight = hn::Set(d, static_cast<float>(DeltaMushStage::kStraight));
    const Points<D> apart = subtract<D>(a, b);
    const auto is_bent =
        hn::Or(hn::Gt(hn::Abs(apart.x), straight),
               hn::Or(hn::Gt(hn::Abs(apart.y), straight), hn::Gt(hn::Abs(apart.z), straight)));
    const Points<D> z = unit(d, cross_of<D>(a, b));
    const Points<D> x = unit(d, Points<D>{hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)});
    return {x, cross_of<D>(z, x), z, hn::IfThenElseZero(is_bent, angle(d, dot_of<D>(a, b)))};
}

/// Calls call(index of the details, corner) for each corner of the vertices of a block from `lane` on.
template <class D, class Call>
HWY_INLINE void for_each_corner(D d, const MushFrame& frame, const MushBlock& block, std::size_t lane,
                                const Points<D>& current, const Call& call) {
    for (std::size_t k = 0; k < block.corners; ++k) {
        Points<D> previous;
        Points<D> next;
        if (block.is_consecutive) {
            const FirstEnds& first = frame.mesh->first_ends[block.first_ends + k];
            previous = consecutive_points(d, frame.from, static_cast<std::size_t>(first.previous) + lane);
            next = consecutive_points(d, frame.from, static_cast<std::size_t>(first.next) + lane);
        } else {
            const MushEnds& ends = frame.mesh->ends[block.first_ends + k];
            previous = points_at(d, frame.from, ends.previous, lane);
            next = points_at(d, frame.from, ends.next, lane);
        }
        call(block.first_detail + k, corner_of(d, previous, current, next));
    }
}

void finish(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    using D = Full;
    const MushMesh& mesh = *frame.mesh;
    HWY_ALIGN float finished[3 * kLanes];
    for (std::size_t b = mesh.first_blocks[begin]; b < mesh.first_blocks[end]; ++b) {
        const MushBlock& block = mesh.blocks[b];
        for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
            const Points<D> point = consecutive_points(d, frame.from, block.first_vertex + lane);
            Points<D> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
            auto weights = hn::Zero(d);
            for_each_corner(d, frame, block, lane, point,
                            [&](std::size_t k, const CornerLanes<D>& corner) HWY_ATTR {
                                const MushDetails& details = frame.details[k];
                                const auto weight = corner.weight;
                                const auto x = hn::Mul(weight, hn::Load(d, details.x.lane.data() + lane));
                                const auto y = hn::Mul(weight, hn::Load(d, details.y.lane.data() + lane));
                                const auto z = hn::Mul(weight, hn::Load(d, details.z.lane.data() + lane));
                                const auto add = [&](Vec<D> to, Vec<D> ax, Vec<D> ay, Vec<D> az) HWY_ATTR {
                                    return hn::MulAdd(ax, x, hn::MulAdd(ay, y, hn::MulAdd(az, z, to)));
                                };
                                sum.x = add(sum.x, corner.x.x, corner.y.x, corner.z.x);
                                sum.y = add(sum.y, corner.x.y, corner.y.y, corner.z.y);
                                sum.z = add(sum.z, corner.x.z, corner.y.z, corner.z.z);
                                weights = hn::Add(weights, weight);
                            });
            const auto share =
                hn::IfThenElseZero(hn::Gt(weights, hn::Zero(d)), hn::Div(hn::Set(d, frame.scale), weights));
            hn::StoreInterleaved3(hn::MulAdd(share, sum.x, point.x), hn::MulAdd(share, sum.y, point.y),
                                  hn::MulAdd(share, sum.z, point.z), d, finished + 3 * lane);
        }
        for (std::size_t i = 0; i < block.vertices; ++i) {
            frame.points[mesh.vertices[block.first_vertex + i]] = {finished[3 * i], finished[3 * i + 1],
                                                                   finished[3 * i + 2]};
        }
    }
}

void take_details(const MushFrame& frame, const Float4* rest, MushDetails* details, std::size_t begin,
                  std::size_t end) {
    const Full d;
    using D = Full;
    const MushMesh& mesh = *frame.mesh;
    for (std::size_t b = mesh.first_blocks[begin]; b < mesh.first_blocks[end]; ++b) {
        const MushBlock& block = mesh.blocks[b];
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const Points<D> point = consecutive_points(d, frame.from, block.first_vertex + lane);
            const Points<D> taken =
                subtract<D>(consecutive_points(d, rest, block.first_vertex + lane), point);
            for_each_corner(d, frame, block, lane, point,
                            [&](std::size_t k, const CornerLanes<D>& corner) HWY_ATTR {
                                hn::Store(dot_of<D>(corner.x, taken), d, details[k].x.lane.data() + lane);
                                hn::Store(dot_of<D>(corner.y, taken), d, details[k].y.lane.data() + lane);
                                hn::Store(dot_of<D>(corner.z, taken), d, details[k].z.lane.data() + lane);
                            });
        }
    }
}

/// Vertices [begin, begin + count) of a run, at most as many as lanes.
HWY_INLINE void smooth_lanes_by_length(const MushFrame& frame, const MushRun& run, std::size_t begin,
                                       std::size_t count) {
    const Full d;
    using D = Full;
    const std::int32_t* const first = frame.mesh->neighbours.data() + run.first_neighbour;
    const std::size_t valence = run.valence;
    const std::size_t from_run = begin - run.begin;
    const Points<D> point = consecutive_points(d, frame.from, begin);
    Points<D> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    auto lengths = hn::Zero(d);
    for (std::size_t k = 0; k < valence; ++k) {
        const auto of_lane = [&](std::size_t lane) HWY_ATTR {
            return first[(from_run + HWY_MIN(lane, count - 1)) * valence + k];
        };
        const Points<D> neighbour =
            run.is_consecutive
                ? consecutive_points(d, frame.from, static_cast<std::size_t>(first[k]) + from_run)
                : collected_points(d, frame.from, of_lane);
        const Points<D> edge = subtract<D>(neighbour, point);
        const auto length = hn::Sqrt(dot_of<D>(edge, edge));
        sum.x = hn::MulAdd(length, edge.x, sum.x);
        sum.y = hn::MulAdd(length, edge.y, sum.y);
        sum.z = hn::MulAdd(length, edge.z, sum.z);
        lengths = hn::Add(lengths, length);
    }
    const auto least = hn::Set(d, static_cast<float>(DeltaMushStage::kLeastLength));
    const auto divisor = hn::Mul(lengths, hn::Set(d, static_cast<float>(valence)));
    // Beyond the last vertex there is room for a vector.
    const auto factors = hn::LoadU(d, frame.factors + begin);
    const auto factor = hn::IfThenElseZero(hn::Gt(divisor, least), hn::Div(factors, lengths));
    alignas(64) Float4 result[kLanes];
    hn::StoreInterleaved4(hn::MulAdd(factor, sum.x, point.x), hn::MulAdd(factor, sum.y, point.y),
                          hn::MulAdd(factor, sum.z, point.z), hn::Zero(d), d, numbers_of(result));
    for (std::size_t lane = 0; lane < count; ++lane) frame.to[begin + lane] = result[lane];
}

/// An iteration by length.
void smooth_by_length(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const MushMesh& mesh = *frame.mesh;
    const std::size_t lanes = hn::Lanes(Full());
    for (std::size_t r = mesh.first_runs[begin]; r < mesh.first_runs[end]; ++r) {
        const MushRun& run = mesh.runs[r];
        if (run.valence == 0) {
            copy_run(frame, run);
            continue;
        }
        for (std::size_t i = run.begin; i < run.end; i += lanes) {
            smooth_lanes_by_length(frame, run, i, HWY_MIN(lanes, run.end - i));
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

using Smooth = void(const MushFrame& frame, std::size_t begin, std::size_t end);
using Take = void(const MushFrame& frame, const Float4* rest, MushDetails* details, std::size_t begin,
                  std::size_t end);

constexpr std::array<Smooth*, kTargetCount> kSmooth SINEW_TARGETS_OF(smooth);
constexpr std::array<Smooth*, kTargetCount> kSmoothByLength SINEW_TARGETS_OF(smooth_by_length);
constexpr std::array<Smooth*, kTargetCount> kFinish SINEW_TARGETS_OF(finish);
constexpr std::array<Take*, kTargetCount> kTake SINEW_TARGETS_OF(take_details);

}  // namespace

MushKernel mush_kernel() noexcept {
    const std::size_t target = target_in_use();
    return {kSmooth[target], kSmoothByLength[target], kFinish[target], kTake[target]};
}

}  // namespace sinew

#endif
