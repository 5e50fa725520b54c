// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `delta_mush` on whole chunks: see skinning/delta_mush.h for what it computes.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include <array>
#include <cmath>
#include <cstdint>

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

/// kValence  neighbours of each vertex; 0: `valence` of them
template <std::size_t kValence>
HWY_INLINE void smooth_run(const MushFrame& frame, const MushRun& run, std::size_t valence) {
    const Four d;
    if constexpr (kValence > 0) valence = kValence;
    const std::int32_t* neighbours = frame.mesh->neighbours.data() + run.first_neighbour;
    const float* const from = numbers_of(frame.from);
    float* const to = numbers_of(frame.to);
    const float* const factors = frame.factors;
    const auto count = hn::Set(d, static_cast<float>(valence));
    const std::size_t end = run.end;
    for (std::size_t i = run.begin; i < end; ++i, neighbours += valence) {
        const auto factor = hn::Set(d, factors[i]);
        for (std::size_t c = 0; c < 4; c += hn::Lanes(d)) {
            auto sum = hn::Load(d, from + 4 * static_cast<std::size_t>(neighbours[0]) + c);
            for (std::size_t k = 1; k < valence; ++k) {
                sum = hn::Add(sum, hn::Load(d, from + 4 * static_cast<std::size_t>(neighbours[k]) + c));
            }
            const auto point = hn::Load(d, from + 4 * i + c);
            hn::Store(hn::MulAdd(factor, hn::NegMulAdd(count, point, sum), point), d, to + 4 * i + c);
        }
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
            case 3: smooth_run<3>(frame, run, 3); break;
            case 4: smooth_run<4>(frame, run, 4); break;
            case 5: smooth_run<5>(frame, run, 5); break;
            case 6: smooth_run<6>(frame, run, 6); break;
            case 7: smooth_run<7>(frame, run, 7); break;
            default: smooth_run<0>(frame, run, run.valence); break;
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

/// first_numbers  of each lane's point
template <class D>
HWY_INLINE Points<D> gathered_points(D d, const Float4* points, const std::int32_t* first_numbers) {
    const hn::RebindToSigned<D> indices;
    const auto at = hn::Load(indices, first_numbers);
    const float* const numbers = numbers_of(points);
    return {hn::GatherIndex(d, numbers, at), hn::GatherIndex(d, numbers + 1, at),
            hn::GatherIndex(d, numbers + 2, at)};
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

template <class D>
HWY_INLINE Points<D> unit(D d, const Points<D>& v) {
    const auto squared = dot_of<D>(v, v);
    const auto is_long = hn::Gt(squared, hn::Set(d, static_cast<float>(DeltaMushStage::kShortest)));
    const auto inverse = hn::IfThenElseZero(is_long, hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared)));
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

/// Calls call(corner index, corner, lane) for each corner of the vertices of a block from `lane` on.
template <class D, class Call>
HWY_INLINE void for_each_corner(D d, const MushFrame& frame, const MushBlock& block, std::size_t lane,
                                const Points<D>& current, const Call& call) {
    for (std::size_t k = block.first_corner; k < block.first_corner + block.corners; ++k) {
        const MushCorners& corners = frame.mesh->corners[k];
        const Points<D> previous = gathered_points(d, frame.from, corners.previous.lane.data() + lane);
        const Points<D> next = gathered_points(d, frame.from, corners.next.lane.data() + lane);
        call(k, corner_of(d, previous, current, next));
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

/// An iteration by length.
void smooth_by_length(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const MushMesh& mesh = *frame.mesh;
    for (std::size_t r = mesh.first_runs[begin]; r < mesh.first_runs[end]; ++r) {
        const MushRun& run = mesh.runs[r];
        if (run.valence == 0) {
            copy_run(frame, run);
            continue;
        }
        const std::int32_t* neighbours = mesh.neighbours.data() + run.first_neighbour;
        const auto count = static_cast<float>(run.valence);
        for (std::size_t i = run.begin; i < run.end; ++i, neighbours += run.valence) {
            const float* const point = numbers_of(frame.from + i);
            float sum[3] = {0.0f, 0.0f, 0.0f};
            float lengths = 0.0f;
            for (std::size_t k = 0; k < run.valence; ++k) {
                const float* const neighbour = numbers_of(frame.from + neighbours[k]);
                const float x = neighbour[0] - point[0];
                const float y = neighbour[1] - point[1];
                const float z = neighbour[2] - point[2];
                const float length = std::sqrt(x * x + y * y + z * z);
                sum[0] += length * x;
                sum[1] += length * y;
                sum[2] += length * z;
                lengths += length;
            }
            const bool is_long = lengths * count > static_cast<float>(DeltaMushStage::kLeastLength);
            const float factor = is_long ? frame.factors[i] / lengths : 0.0f;
            float* const to = numbers_of(frame.to + i);
            for (std::size_t c = 0; c < 3; ++c) to[c] = point[c] + factor * sum[c];
            to[3] = 0.0f;
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
