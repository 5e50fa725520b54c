// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `delta_mush` on whole chunks: see stages/delta_mush/delta_mush.h for the definition.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "sinew/lanes/kernel.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "sinew/stages/delta_mush/mush_mesh.h"

#define SINEW_THIS_FILE "sinew/stages/delta_mush/mush_kernel.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

constexpr float kRootOfTwo = 1.41421356237f;

/// One iteration for the numbers of one vector.
///
/// neighbour(k)  pointer to the numbers of the k-th neighbour
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

/// Smooths a consecutive run, several vertices at once. All must have the same factor.
///
/// kValence  neighbours of each vertex
template <std::size_t kValence>
HWY_INLINE void smooth_consecutive(const MushFrame& frame, const MushRun& run) {
    const Full d;
    const float* const point = numbers_of(frame.from + run.begin);
    float* const to = numbers_of(frame.to + run.begin);
    const float* neighbours[kValence];
    for (std::size_t k = 0; k < kValence; ++k) {
        neighbours[k] = numbers_of(frame.from + frame.mesh->neighbours[run.first_neighbour + k]);
    }
    const auto factor = hn::Set(d, frame.factors[run.begin]);
    const auto smooth_at = [&](std::size_t at) HWY_ATTR {
        smooth_numbers<kValence>(d, point + at, to + at, kValence, factor,
                                 [&](std::size_t k) HWY_ATTR { return neighbours[k] + at; });
    };
    // The first and the last vector overlap their neighbours, so that all stores between them are aligned to
    // cache lines.
    const std::size_t lanes = hn::Lanes(d);
    const std::size_t last = 4 * static_cast<std::size_t>(run.end - run.begin) - lanes;
    smooth_at(0);
    const std::size_t beyond_line = reinterpret_cast<std::uintptr_t>(to) / sizeof(float) % lanes;
    for (std::size_t at = lanes - beyond_line; at < last; at += lanes) smooth_at(at);
    smooth_at(last);
}

/// Smooths a run.
///
/// kValence  neighbours of each vertex; 0: that of the run
template <std::size_t kValence>
HWY_INLINE void smooth_run(const MushFrame& frame, const MushRun& run) {
    if constexpr (kValence > 0) {
        if (run.is_consecutive && frame.is_uniform) return smooth_consecutive<kValence>(frame, run);
    }
    const Four d;
    const std::int32_t* neighbours = frame.mesh->neighbours.data() + run.first_neighbour;
    const std::size_t step = run.is_consecutive ? 0 : run.valence;
    for (std::size_t i = run.begin; i < run.end; ++i, neighbours += step) {
        const std::size_t behind = run.is_consecutive ? i - run.begin : 0;
        for (std::size_t at = 0; at < 4; at += hn::Lanes(d)) {
            smooth_numbers<kValence>(
                d, numbers_of(frame.from + i) + at, numbers_of(frame.to + i) + at, run.valence,
                hn::Set(d, frame.factors[i]), [&](std::size_t k) HWY_ATTR {
                    return numbers_of(frame.from + static_cast<std::size_t>(neighbours[k]) + behind) + at;
                });
        }
    }
}

/// Vertices without neighbours are not moved.
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

/// The offset of the vertex in a lane, for a batch of kLanes consecutive vertices. Four vectors of points become
/// vectors of x, y and z by exchanging numbers only within quarters of a 16-lane vector, which is cheaper than
/// across quarters. Shorter vectors use the same order, since the details are stored in it.
HWY_INLINE std::size_t vertex_of(std::size_t lane) { return 4 * (lane % 4) + lane / 4; }

#if HWY_TARGET == HWY_SCALAR

/// Points for the lanes from `lane` on, for a batch of kLanes consecutive vertices.
template <class D>
HWY_INLINE Points<D> consecutive_points(D d, const Float4* points, std::size_t lane) {
    const float* const numbers = numbers_of(points + vertex_of(lane));
    return in_all_lanes(d, numbers);
}

/// One point for each lane, from anywhere: index_of(vertex) returns the index of the point.
template <class D, class Index>
HWY_INLINE Points<D> collected_points(D d, const Float4* points, const Index& index_of, std::size_t lane) {
    return consecutive_points(d, points + static_cast<std::size_t>(index_of(vertex_of(lane))), 0);
}

template <class D>
HWY_INLINE void store_lanes(D, const Points<D>& p, Float4* to, std::size_t lane) {
    to[vertex_of(lane)] = {{hn::GetLane(p.x), hn::GetLane(p.y), hn::GetLane(p.z), 0.0f}};
}

#else

/// The first halves of all quarters, alternating between `a` and `b`.
template <class D>
HWY_INLINE Vec<D> first_halves(D d, Vec<D> a, Vec<D> b) {
    const hn::RepartitionToWide<D> wide;
    return hn::BitCast(d, hn::InterleaveLower(wide, hn::BitCast(wide, a), hn::BitCast(wide, b)));
}
template <class D>
HWY_INLINE Vec<D> second_halves(D d, Vec<D> a, Vec<D> b) {
    const hn::RepartitionToWide<D> wide;
    return hn::BitCast(d, hn::InterleaveUpper(wide, hn::BitCast(wide, a), hn::BitCast(wide, b)));
}

/// Transposes points into lanes.
///
/// points(i)  the i-th of four vectors of points
template <class D, class OfPoints>
HWY_INLINE Points<D> to_lanes(D d, const OfPoints& points) {
    const Vec<D> a = points(0), b = points(1), e = points(2), f = points(3);
    const Vec<D> xy_ab = hn::InterleaveLower(d, a, b), xy_ef = hn::InterleaveLower(d, e, f);
    const Vec<D> z_ab = hn::InterleaveUpper(d, a, b), z_ef = hn::InterleaveUpper(d, e, f);
    return {first_halves(d, xy_ab, xy_ef), second_halves(d, xy_ab, xy_ef), first_halves(d, z_ab, z_ef)};
}

/// Points for the lanes from `lane` on, for a batch of kLanes consecutive vertices.
template <class D>
HWY_INLINE Points<D> consecutive_points(D d, const Float4* points, std::size_t lane) {
    return to_lanes(d, [&](std::size_t i)
                           HWY_ATTR { return hn::LoadU(d, numbers_of(points + 4 * i + vertex_of(lane))); });
}

/// A vector of the points for `vertex` and the next vertices.
template <class D, class Index>
HWY_INLINE Vec<D> collected(D d, const Float4* points, const Index& index_of, std::size_t vertex) {
    if constexpr (hn::MaxLanes(D()) <= 4) {
        return hn::LoadU(d, numbers_of(points + static_cast<std::size_t>(index_of(vertex))));
    } else {
        const hn::Half<D> half;
        return hn::Combine(d, collected(half, points, index_of, vertex + hn::MaxLanes(D()) / 8),
                           collected(half, points, index_of, vertex));
    }
}

/// One point for each lane, from anywhere: index_of(vertex) returns the index of the point.
template <class D, class Index>
HWY_INLINE Points<D> collected_points(D d, const Float4* points, const Index& index_of, std::size_t lane) {
    return to_lanes(
        d, [&](std::size_t i) HWY_ATTR { return collected(d, points, index_of, 4 * i + vertex_of(lane)); });
}

template <class D>
HWY_INLINE void store_lanes(D d, const Points<D>& p, Float4* to, std::size_t lane) {
    const Vec<D> xy_low = hn::InterleaveLower(d, p.x, p.y), xy_high = hn::InterleaveUpper(d, p.x, p.y);
    const Vec<D> zero = hn::Zero(d);
    const Vec<D> z_low = hn::InterleaveLower(d, p.z, zero), z_high = hn::InterleaveUpper(d, p.z, zero);
    float* const numbers = numbers_of(to + vertex_of(lane));
    hn::StoreU(first_halves(d, xy_low, z_low), d, numbers);
    hn::StoreU(second_halves(d, xy_low, z_low), d, numbers + 16);
    hn::StoreU(first_halves(d, xy_high, z_high), d, numbers + 32);
    hn::StoreU(second_halves(d, xy_high, z_high), d, numbers + 48);
}

#endif

/// 1 / length of a vector, from its square; 0 if the vector has no direction.
template <class D>
HWY_INLINE Vec<D> inverse_length(D d, Vec<D> squared) {
    const auto is_long = hn::Gt(squared, hn::Set(d, static_cast<float>(DeltaMushDefinition::kShortest)));
    return hn::IfThenElseZero(is_long, inverse_root(d, squared));
}

template <class D>
HWY_INLINE Points<D> unit(D d, const Points<D>& v) {
    const auto squared = dot<D>(v, v);
    const auto is_finite = hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max()));
    const auto inverse = hn::IfThenElseZero(is_finite, inverse_length(d, squared));
    return {hn::Mul(v.x, inverse), hn::Mul(v.y, inverse), hn::Mul(v.z, inverse)};
}

/// The frame of a corner: axes of any length, the factors that normalise them, and the corner's weight.
template <class D>
struct CornerLanes {
    Points<D> x, y, z;
    Vec<D> unit_x, unit_y, unit_z;
    Vec<D> weight;
};

/// The frame of the corner between the spokes to the next and to the previous vertex of the face, which are unit
/// vectors or 0.
template <class D>
HWY_INLINE CornerLanes<D> corner_of(D d, const Points<D>& next, const Points<D>& previous) {
    // The definition's a is `previous` and its b is -next. Its y axis, along (a x b) x (a + b), has the direction
    // of b - a; here it is a - b, which cancels out, since details are stored in the same axes. For unit vectors,
    // |a + b| |a - b| = 2 |a x b| and (a + b)^2 + (a - b)^2 = 4, so these two lengths determine everything.
    CornerLanes<D> corner;
    corner.x = subtract<D>(previous, next);
    corner.y = add<D>(previous, next);
    corner.z = cross<D>(next, previous);
    const auto squared_x = dot<D>(corner.x, corner.x);
    const auto squared_y = dot<D>(corner.y, corner.y);
    const auto are_two = hn::Gt(hn::Add(squared_x, squared_y), hn::Set(d, 3.0f));
    const auto inverse_y = inverse_length(d, squared_y);
    corner.unit_x = inverse_length(d, squared_x);
    const auto length_x = hn::Mul(squared_x, corner.unit_x);
    const auto length_y = hn::Mul(squared_y, inverse_y);
    const auto half_unit_z = hn::IfThenElseZero(are_two, hn::Mul(corner.unit_x, inverse_y));
    corner.unit_z = hn::Add(half_unit_z, half_unit_z);
    corner.unit_y = hn::Mul(half_unit_z, length_x);

    // DeltaMushDefinition::angle() of the cosine c = a b. (a + b)^2 = 2 + 2 c and (a - b)^2 = 2 - 2 c, so the smaller
    // is 2 (1 - |c|), and the polynomial's factor is the square root of half of it. If an edge has no direction,
    // c is 0.
    const auto least = hn::IfThenElse(are_two, hn::Min(squared_x, squared_y), hn::Set(d, 2.0f));
    const auto least_length = hn::IfThenElse(are_two, hn::Min(length_x, length_y), hn::Set(d, kRootOfTwo));
    const auto m = hn::NegMulAdd(least, hn::Set(d, 0.5f), hn::Set(d, 1.0f));
    auto sum = hn::MulAdd(m, hn::Set(d, -0.02164095f / kRootOfTwo), hn::Set(d, 0.077980478f / kRootOfTwo));
    sum = hn::MulAdd(m, sum, hn::Set(d, -0.213300989f / kRootOfTwo));
    sum = hn::MulAdd(m, sum, hn::Set(d, 1.5707963267f / kRootOfTwo));
    const auto of_size = hn::Mul(least_length, sum);
    const auto is_negative = hn::Lt(squared_x, squared_y);
    const auto angle = hn::IfThenElse(is_negative, hn::Sub(hn::Set(d, 3.14159265358979f), of_size), of_size);
    const auto largest = hn::Max(hn::Abs(corner.y.x), hn::Max(hn::Abs(corner.y.y), hn::Abs(corner.y.z)));
    const auto is_bent = hn::Gt(largest, hn::Set(d, static_cast<float>(DeltaMushDefinition::kStraight)));
    corner.weight = hn::IfThenElseZero(is_bent, angle);
    return corner;
}

/// The unit direction of the k-th spoke, for the vertices of a block from `lane` on.
template <bool kIsConsecutive, class D>
HWY_INLINE Points<D> spoke(D d, const MushFrame& frame, const MushBlock& block, std::size_t lane,
                           const Points<D>& point, std::size_t k) {
    if constexpr (kIsConsecutive) {
        const auto first = static_cast<std::size_t>(frame.mesh->first_spokes[block.first_spoke + k]);
        return unit(d, subtract<D>(consecutive_points(d, frame.from + first, lane), point));
    } else {
        const std::int32_t* const ends = frame.mesh->spokes[block.first_spoke + k].lane.data();
        const auto index_of = [ends](std::size_t vertex) HWY_ATTR { return ends[vertex]; };
        return unit(d, subtract<D>(collected_points(d, frame.from, index_of, lane), point));
    }
}

template <bool kIsConsecutive, class D, class Call>
HWY_INLINE void for_each_corner_of(D d, const MushFrame& frame, const MushBlock& block, std::size_t lane,
                                   const Points<D>& point, const Call& call) {
    const bool is_shared = block.spokes < 2 * block.corners;
    const Points<D> first = spoke<kIsConsecutive>(d, frame, block, lane, point, 0);
    Points<D> next = first;
    for (std::size_t k = 0; k < block.corners; ++k) {
        if (!is_shared && k > 0) next = spoke<kIsConsecutive>(d, frame, block, lane, point, 2 * k);
        const std::size_t after = is_shared ? k + 1 : 2 * k + 1;
        const Points<D> previous =
            after < block.spokes ? spoke<kIsConsecutive>(d, frame, block, lane, point, after) : first;
        call(block.first_detail + k, corner_of(d, next, previous));
        next = previous;
    }
}

/// Calls call(index of the details, corner) for each corner of the vertices of a block from `lane` on.
template <class D, class Call>
HWY_INLINE void for_each_corner(D d, const MushFrame& frame, const MushBlock& block, std::size_t lane,
                                const Points<D>& point, const Call& call) {
    if (block.corners == 0) return;
    if (block.is_consecutive) return for_each_corner_of<true>(d, frame, block, lane, point, call);
    for_each_corner_of<false>(d, frame, block, lane, point, call);
}

void finish(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    using D = Full;
    const MushMesh& mesh = *frame.mesh;
    alignas(64) Float4 finished[kLanes];
    for (std::size_t b = mesh.first_blocks[begin]; b < mesh.first_blocks[end]; ++b) {
        const MushBlock& block = mesh.blocks[b];
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            if (vertex_of(lane) >= block.vertices) continue;
            const Points<D> point = consecutive_points(d, frame.from + block.first_vertex, lane);
            Points<D> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
            auto weights = hn::Zero(d);
            for_each_corner(d, frame, block, lane, point,
                            [&](std::size_t k, const CornerLanes<D>& corner) HWY_ATTR {
                                const MushDetails& details = frame.details[k];
                                const auto along = [&](const Lanes<float>& detail, Vec<D> to_unit) HWY_ATTR {
                                    return hn::Mul(hn::Load(d, detail.lane.data() + lane),
                                                   hn::Mul(corner.weight, to_unit));
                                };
                                sum = add_scaled<D>(sum, along(details.x, corner.unit_x), corner.x);
                                sum = add_scaled<D>(sum, along(details.y, corner.unit_y), corner.y);
                                sum = add_scaled<D>(sum, along(details.z, corner.unit_z), corner.z);
                                weights = hn::Add(weights, corner.weight);
                            });
            const auto share =
                hn::IfThenElseZero(hn::Gt(weights, hn::Zero(d)), hn::Div(hn::Set(d, frame.scale), weights));
            store_lanes(d, add_scaled<D>(point, share, sum), finished, lane);
        }
        // Read once, because the compiler assumes that any stored number may change it.
        const std::uint32_t* const vertices = mesh.vertices.data() + block.first_vertex;
        Vec3<float>* const points = frame.points;
        const std::size_t count = block.vertices;
        for (std::size_t i = 0; i < count; ++i) {
            std::memcpy(&points[vertices[i]], finished + i, sizeof(Vec3<float>));
        }
    }
}

void take_details(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    using D = Full;
    const MushMesh& mesh = *frame.mesh;
    for (std::size_t b = mesh.first_blocks[begin]; b < mesh.first_blocks[end]; ++b) {
        const MushBlock& block = mesh.blocks[b];
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const Points<D> point = consecutive_points(d, frame.from + block.first_vertex, lane);
            const Points<D> taken =
                subtract<D>(consecutive_points(d, frame.rest + block.first_vertex, lane), point);
            const auto store = [&](Vec<D> detail, Lanes<float>& to)
                                   HWY_ATTR { hn::Store(detail, d, to.lane.data() + lane); };
            for_each_corner(d, frame, block, lane, point,
                            [&](std::size_t k, const CornerLanes<D>& corner) HWY_ATTR {
                                MushDetails& details = frame.details[k];
                                store(hn::Mul(corner.unit_x, dot<D>(corner.x, taken)), details.x);
                                store(hn::Mul(corner.unit_y, dot<D>(corner.y, taken)), details.y);
                                store(hn::Mul(corner.unit_z, dot<D>(corner.z, taken)), details.z);
                            });
        }
    }
}

/// sqrt(x) for x >= 0. For x below any relevant squared length, some similarly small number.
template <class D>
HWY_INLINE Vec<D> root([[maybe_unused]] D d, Vec<D> x) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    // As in inverse_root().
    x = hn::Max(x, hn::Set(d, 1e-37f));
    const auto inverse = hn::ApproximateReciprocalSqrt(x);
    const auto result = hn::Mul(x, inverse);
    const auto half = hn::Mul(result, hn::Set(d, 0.5f));
    return hn::MulAdd(half, hn::NegMulAdd(result, inverse, hn::Set(d, 1.0f)), result);
#else
    return hn::Sqrt(x);
#endif
}

/// 1 / x for positive x. A division takes as long as the root.
template <class D>
HWY_INLINE Vec<D> reciprocal(D d, Vec<D> x) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    const auto estimate = hn::ApproximateReciprocal(x);
    return hn::Mul(estimate, hn::NegMulAdd(x, estimate, hn::Set(d, 2.0f)));
#else
    return hn::Div(hn::Set(d, 1.0f), x);
#endif
}

/// Smooths vertices [begin, begin + count) of a run, at most kLanes.
///
/// kValence             neighbours of each vertex; 0: `valence`
/// index_of(vertex, k)  the k-th neighbour of a vertex counted from `begin`; if kIsConsecutive, only of the first
template <std::size_t kValence, bool kIsConsecutive, class Index>
HWY_INLINE void smooth_lanes_by_length(const MushFrame& frame, std::size_t valence, std::size_t begin,
                                       std::size_t count, const Index& index_of) {
    if constexpr (kValence > 0) valence = kValence;
    const Full d;
    using D = Full;
    const auto least = hn::Set(d, static_cast<float>(DeltaMushDefinition::kLeastLength));
    // There is room beyond the last vertex.
    alignas(64) float factors[kLanes];
    for (std::size_t lane = 0; lane < kLanes && !frame.is_uniform; ++lane) {
        factors[lane] = frame.factors[begin + vertex_of(lane)];
    }
    alignas(64) Float4 rest[kLanes];
    Float4* const result = count == kLanes ? frame.to + begin : rest;
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
        if (vertex_of(lane) >= count) continue;
        const Points<D> point = consecutive_points(d, frame.from + begin, lane);
        Points<D> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        auto lengths = hn::Zero(d);
        for (std::size_t k = 0; k < valence; ++k) {
            Points<D> edge;
            if constexpr (kIsConsecutive) {
                const Float4* const neighbours = frame.from + static_cast<std::size_t>(index_of(0, k));
                edge = subtract<D>(consecutive_points(d, neighbours, lane), point);
            } else {
                const auto of_vertex = [&](std::size_t vertex)
                                           HWY_ATTR { return index_of(HWY_MIN(vertex, count - 1), k); };
                edge = subtract<D>(collected_points(d, frame.from, of_vertex, lane), point);
            }
            const auto length = root(d, dot<D>(edge, edge));
            sum = add_scaled<D>(sum, length, edge);
            lengths = hn::Add(lengths, length);
        }
        const auto divisor = hn::Mul(lengths, hn::Set(d, static_cast<float>(valence)));
        const auto factor = frame.is_uniform ? hn::Set(d, frame.factors[begin]) : hn::Load(d, factors + lane);
        const auto share =
            hn::IfThenElseZero(hn::Gt(divisor, least), hn::Mul(factor, reciprocal(d, lengths)));
        store_lanes(d, add_scaled<D>(point, share, sum), result, lane);
    }
    if (result == rest) std::copy_n(rest, count, frame.to + begin);
}

/// Calls call(begin, count) for the vertices of a run. The last kLanes may overlap those before, since writing
/// fewer takes longer.
template <class Call>
HWY_INLINE void for_each_lanes(const MushRun& run, const Call& call) {
    const std::size_t count = HWY_MIN(kLanes, static_cast<std::size_t>(run.end - run.begin));
    const std::size_t last = run.end - count;
    for (std::size_t i = run.begin; i < last; i += kLanes) call(i, count);
    call(last, count);
}

/// Smooths a consecutive run.
template <std::size_t kValence>
HWY_INLINE void smooth_consecutive_by_length(const MushFrame& frame, const MushRun& run) {
    const std::int32_t* const neighbours = frame.mesh->neighbours.data() + run.first_neighbour;
    for_each_lanes(run, [&](std::size_t i, std::size_t count) HWY_ATTR {
        const auto behind = static_cast<std::int32_t>(i - run.begin);
        smooth_lanes_by_length<kValence, true>(frame, run.valence, i, count,
                                               [&](std::size_t, std::size_t k)
                                                   HWY_ATTR { return neighbours[k] + behind; });
    });
}

HWY_INLINE void smooth_others_by_length(const MushFrame& frame, const MushRun& run) {
    const std::size_t valence = run.valence;
    for_each_lanes(run, [&](std::size_t i, std::size_t count) HWY_ATTR {
        const std::int32_t* const neighbours =
            frame.mesh->neighbours.data() + run.first_neighbour + (i - run.begin) * valence;
        smooth_lanes_by_length<0, false>(frame, valence, i, count,
                                         [&](std::size_t vertex, std::size_t k)
                                             HWY_ATTR { return neighbours[vertex * valence + k]; });
    });
}

/// One iteration of SmoothType::length_weighted.
void smooth_by_length(const MushFrame& frame, std::size_t begin, std::size_t end) {
    const MushMesh& mesh = *frame.mesh;
    for (std::size_t r = mesh.first_runs[begin]; r < mesh.first_runs[end]; ++r) {
        const MushRun& run = mesh.runs[r];
        if (run.valence == 0) {
            copy_run(frame, run);
        } else if (!run.is_consecutive) {
            smooth_others_by_length(frame, run);
        } else if (run.valence == 4) {
            smooth_consecutive_by_length<4>(frame, run);
        } else {
            smooth_consecutive_by_length<0>(frame, run);
        }
    }
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
constinit const MushKernel kMushKernel{SINEW_TARGETS(smooth), SINEW_TARGETS(smooth_by_length),
                                       SINEW_TARGETS(finish), SINEW_TARGETS(take_details)};

}  // namespace sinew

#endif
