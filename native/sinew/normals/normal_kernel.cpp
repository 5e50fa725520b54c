// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of whole meshes: see normals.h for the definition. Products and sums are rounded one by one, in
// Blender's order and without fused multiply-add, so that results equal Blender's and are the same on each
// instruction set.
#include <cstdint>
#include <limits>

#include "sinew/lanes/kernel.h"
#include "sinew/normals/normal_mesh.h"

#define SINEW_THIS_FILE "sinew/normals/normal_kernel.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

// A vector with a smaller squared length has no direction.
constexpr float kShortest = 1e-35f;

// Blender defines no custom normals where the absolute cosine reaches this.
constexpr float kTooSteep = 0.9999f;

template <class D>
HWY_INLINE Vec<D> rounded_dot(const Points<D>& a, const Points<D>& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

/// The unit vector of `v`; 0 if it has no direction, or a length beyond the range of floats.
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

/// Blender's polynomial for acos.
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

/// Stores the four numbers of each lane to every other Float4 of `to`.
template <class D>
HWY_INLINE void store_slots(D d, Vec<D> a, Vec<D> b, Vec<D> c, Vec<D> e, Float4* to) {
    alignas(64) Float4 numbers[hn::MaxLanes(D())];
    store_float4s(d, a, b, c, e, numbers);
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) to[2 * lane] = numbers[lane];
}

/// The unit vector of Newell's sum.
template <class D>
HWY_INLINE Points<D> face_normal(D d, const Points<D>& newell) {
    const auto squared = rounded_dot<D>(newell, newell);
    const auto has_area = hn::Gt(squared, hn::Set(d, kShortest));
    const auto is_finite = hn::Le(squared, hn::Set(d, std::numeric_limits<float>::max()));
    const auto one = hn::Set(d, 1.0f);
    // 0 if the squared length is infinite.
    const auto inverse = hn::IfThenElseZero(hn::And(has_area, is_finite), hn::Div(one, hn::Sqrt(squared)));
    const auto scaled = [inverse, is_finite](Vec<D> number)
                            HWY_ATTR { return hn::IfThenElseZero(is_finite, hn::Mul(number, inverse)); };
    return {scaled(newell.x), scaled(newell.y), hn::IfThenElse(has_area, scaled(newell.z), one)};
}

template <class D>
struct SineCosine {
    Vec<D> sine;
    Vec<D> cosine;
};

/// Sine and cosine of angles up to about 360 degrees, to 1e-7: by Taylor polynomials on 45 degrees, fitted by
/// Moshier (Cephes).
template <class D>
HWY_INLINE SineCosine<D> sine_cosine(D d, Vec<D> angle) {
    const auto set = [d](float value) HWY_ATTR { return hn::Set(d, value); };
    const auto quarters = hn::Round(hn::Mul(angle, set(0.636619772367581f)));
    // 90 degrees as the sum of two numbers, the first of them with few digits, so that its products are exact.
    auto r = hn::Sub(angle, hn::Mul(quarters, set(1.5703125f)));
    r = hn::Sub(r, hn::Mul(quarters, set(4.83826794896619e-4f)));
    const auto r2 = hn::Mul(r, r);
    auto sine = hn::Add(hn::Mul(r2, set(-1.9515295891e-4f)), set(8.3321608736e-3f));
    sine = hn::Add(hn::Mul(r2, sine), set(-1.6666654611e-1f));
    sine = hn::Add(r, hn::Mul(hn::Mul(r, r2), sine));
    auto cosine = hn::Add(hn::Mul(r2, set(2.443315711809948e-5f)), set(-1.388731625493765e-3f));
    cosine = hn::Add(hn::Mul(r2, cosine), set(4.166664568298827e-2f));
    cosine = hn::Add(hn::Sub(set(1.0f), hn::Mul(r2, set(0.5f))), hn::Mul(hn::Mul(r2, r2), cosine));
    const auto quadrant = hn::Sub(quarters, hn::Mul(hn::Floor(hn::Mul(quarters, set(0.25f))), set(4.0f)));
    const auto is_odd = hn::Or(hn::Eq(quadrant, set(1.0f)), hn::Eq(quadrant, set(3.0f)));
    const auto a = hn::IfThenElse(is_odd, cosine, sine);
    const auto b = hn::IfThenElse(is_odd, sine, cosine);
    const auto is_first_or_last = hn::Or(hn::Eq(quadrant, hn::Zero(d)), hn::Eq(quadrant, set(3.0f)));
    return {hn::IfThenElse(hn::Lt(quadrant, set(2.0f)), a, hn::Neg(a)),
            hn::IfThenElse(is_first_or_last, b, hn::Neg(b))};
}

/// The angle for a stored number: `part` of `whole`, or if negative, backwards by that part of 360 degrees minus
/// `whole`.
template <class D>
HWY_INLINE Vec<D> stored_angle(D d, Vec<D> part, Vec<D> whole) {
    const auto rest = hn::Sub(hn::Set(d, 6.28318530717959f), whole);
    return hn::Mul(part, hn::IfThenElse(hn::Gt(part, hn::Zero(d)), whole, rest));
}

template <class D>
HWY_INLINE Points<D> rounded_cross(const Points<D>& a, const Points<D>& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

/// The direction of the component of `v` perpendicular to `n`; `along` is their cosine.
template <class D>
HWY_INLINE Points<D> perpendicular(D d, const Points<D>& v, const Points<D>& n, Vec<D> along) {
    return direction(d, subtract<D>(v, times<D>(along, n)));
}

/// The edges of fans that define the space of their custom normals.
template <class D>
struct FanEdges {
    Points<D> first;
    Points<D> last;
    // Cosines of their angles to the normal.
    Vec<D> along_first;
    Vec<D> along_last;
    Vec<D> mean_angle;  // of all edges to the normal
};

/// The normals `n`, tilted and then rotated.
template <class D>
HWY_INLINE Points<D> custom_normals(D d, const Points<D>& n, const FanEdges<D>& edges, Vec<D> tilt,
                                    Vec<D> spin) {
    const Points<D> x = perpendicular<D>(d, edges.first, n, edges.along_first);
    const Points<D> y = direction(d, rounded_cross<D>(n, x));
    const Points<D> to_last = perpendicular<D>(d, edges.last, n, edges.along_last);
    const auto steep = hn::Set(d, kTooSteep);
    const auto whole = hn::Set(d, 6.28318530717959f);
    const auto cosine = rounded_dot<D>(x, to_last);
    const auto acute = polynomial_angle(d, cosine);
    const auto is_behind = hn::Lt(rounded_dot<D>(y, to_last), hn::Zero(d));
    const auto beta =
        hn::IfThenElse(hn::Lt(cosine, steep), hn::IfThenElse(is_behind, hn::Sub(whole, acute), acute), whole);
    const SineCosine<D> of_tilt = sine_cosine(d, stored_angle(d, tilt, edges.mean_angle));
    const SineCosine<D> of_spin = sine_cosine(d, stored_angle(d, spin, beta));
    const auto on_x = hn::Mul(of_tilt.sine, of_spin.cosine);
    const auto on_y = hn::Mul(of_tilt.sine, of_spin.sine);
    const auto zero = hn::Zero(d);
    const auto stays = hn::Or(hn::Eq(tilt, zero), hn::Or(hn::Eq(edges.mean_angle, zero), hn::Eq(beta, zero)));
    const auto has_space =
        hn::And(hn::Lt(hn::Abs(edges.along_first), steep), hn::Lt(hn::Abs(edges.along_last), steep));
    const auto tilted = [&](Vec<D> a, Vec<D> b, Vec<D> c) HWY_ATTR {
        const auto sum = hn::Add(hn::Add(hn::Mul(a, of_tilt.cosine), hn::Mul(b, on_x)), hn::Mul(c, on_y));
        return hn::IfThenElseZero(has_space, hn::IfThenElse(stays, a, sum));
    };
    return {tilted(n.x, x.x, y.x), tilted(n.y, x.y, y.y), tilted(n.z, x.z, y.z)};
}

// --- Face normals and the angles of corners

/// Computes the lanes of a block from `lane` on.
///
/// kCorners  of each face; 0: those of the block
/// kLone     also compute the custom normals of lone fans
template <std::size_t kCorners, bool kAngles, bool kIsLast, bool kLone, class D>
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
    Float4* const slots = frame.slots + 2 * (block.first_slot + lane);
    // The edge from each corner to the next.
    [[maybe_unused]] Points<D> edges[kLone ? kCorners : 1];
    if (count > 0) {
        const Points<D> first = points_of<kIsLast>(d, frame.points, vertices);
        const Points<D> last = points_of<kIsLast>(d, frame.points, vertices + (count - 1) * lanes);
        add_edge(last, first);
        // Directions of the edges before and after the corner, along the face.
        const Points<D> closing = kAngles ? direction(d, subtract<D>(first, last)) : first;
        Points<D> before = closing;
        Points<D> current = first;
        Vec<D> of_slot[4] = {zero, zero, zero, zero};
        const auto step = [&](std::size_t k, const Points<D>& next) HWY_ATTR {
            if (k + 1 < count) add_edge(current, next);
            if constexpr (kAngles) {
                const Points<D> after = k + 1 < count ? direction(d, subtract<D>(next, current)) : closing;
                of_slot[k % 4] = polynomial_angle(d, hn::Neg(rounded_dot<D>(before, after)));
                before = after;
                if constexpr (kLone) edges[k] = after;
                if (k % 4 == 3 || k + 1 == count) {
                    store_slots(d, of_slot[0], of_slot[1], of_slot[2], of_slot[3],
                                slots + 2 * (k / 4) * lanes + 1);
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
    for (std::size_t k = 0; k == 0 || k < count; k += 4) {
        store_slots(d, normal.x, normal.y, normal.z, zero, slots + 2 * (k / 4) * lanes);
    }
    if constexpr (kLone) {
        for (std::size_t k = 0; k < kCorners; ++k) {
            const LoneFans& fans = frame.mesh->lone_fans[block.first_lone + k];
            const Points<D> back = subtract<D>({zero, zero, zero}, edges[(k + kCorners - 1) % kCorners]);
            const auto along_first = rounded_dot<D>(edges[k], normal);
            const auto along_last = rounded_dot<D>(back, normal);
            const auto angles = hn::Add(polynomial_angle(d, along_first), polynomial_angle(d, along_last));
            const auto mean = hn::Div(angles, hn::Set(d, 2.0f));
            const Points<D> normals = custom_normals<D>(
                d, normal, {edges[k], back, along_first, along_last, mean},
                hn::Load(d, fans.tilt.lane.data() + lane), hn::Load(d, fans.spin.lane.data() + lane));
            store_float4s(d, normals.x, normals.y, normals.z, zero,
                          frame.lone_normals + kLanes * (block.first_lone + k) + lane);
        }
    }
}

template <std::size_t kCorners, bool kAngles, bool kIsLast, bool kLone = false>
HWY_INLINE void compute_block(const NormalFrame& frame, const FaceBlock& block) {
    if (block.lanes == 1) return compute_lanes<kCorners, kAngles, kIsLast, kLone>(One(), frame, block, 0);
    const Full d;
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
        compute_lanes<kCorners, kAngles, kIsLast, kLone>(d, frame, block, lane);
    }
}

/// Not inlined, so that its stack frame does not burden every block.
template <bool kAngles>
HWY_NOINLINE void compute_any_block(const NormalFrame& frame, const FaceBlock& block) {
    compute_block<0, kAngles, true>(frame, block);
}

template <std::size_t kCorners>
HWY_NOINLINE void compute_block_with_lone_fans(const NormalFrame& frame, const FaceBlock& block) {
    compute_block<kCorners, true, false, true>(frame, block);
}

template <bool kAngles>
HWY_INLINE void compute_blocks(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
        const FaceBlock& block = frame.mesh->blocks[b];
        if (block.reads_last_point || block.corners < 3 || block.corners > 4) {
            compute_any_block<kAngles>(frame, block);
        } else if (kAngles && block.first_lone != FaceBlock::kNoLoneFans && frame.lone_normals != nullptr) {
            block.corners == 3 ? compute_block_with_lone_fans<3>(frame, block)
                               : compute_block_with_lone_fans<4>(frame, block);
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

/// Sums the corners of a group.
HWY_INLINE void sum_group(const NormalFrame& frame, std::size_t group, Float4& sum) {
    const Four d;
    const std::uint32_t* const offsets = frame.groups->offsets.data() + group;
    const std::uint32_t* const sources = frame.groups->sources.data();
    const float* const slots = numbers_of(frame.slots);
    if (offsets[0] == offsets[1]) {
        // A vertex without faces (fans always have corners).
        const Vec3<float>& point = frame.points[group];
        sum = {{point.x, point.y, point.z, 0.0f}};
        return;
    }
    for (std::size_t number = 0; number < 4; number += hn::Lanes(d)) {
        auto numbers = hn::Zero(d);
        for (std::uint32_t i = offsets[0]; i < offsets[1]; ++i) {
            const std::uint32_t source = sources[i];
            const auto normal = hn::Load(d, slots + (source & ~7u) + number);
            numbers = hn::Add(numbers, hn::Mul(normal, hn::Set(d, slots[source])));
        }
        hn::Store(numbers, d, sum.value.data() + number);
    }
}

/// Calls store(first group, number of groups, unit vectors in lanes) for groups [begin, end).
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

// --- Custom normals of other fans

/// The custom normals for the lanes of a block from `lane` on.
template <bool kIsLast, class D>
HWY_INLINE Points<D> fan_normals(D d, const NormalFrame& frame, const FanBlock& block, std::size_t lane) {
    const std::int32_t* const vertices = frame.mesh->fan_vertices.data() + block.first_vertex + lane;
    // The index applies to the array of all normals, which starts at the slots.
    const Points<D> n =
        points_of<false>(d, static_cast<const Float4*>(frame.slots), block.normals.lane.data() + lane);
    const Points<D> point = points_of<kIsLast>(d, frame.points, vertices);
    const auto edge = [&](std::size_t k) HWY_ATTR {
        return direction(
            d, subtract<D>(points_of<kIsLast>(d, frame.points, vertices + (1 + k) * kLanes), point));
    };
    const Points<D> last = edge(0);
    const Points<D> first = edge(1);
    const auto along_first = rounded_dot<D>(first, n);
    const auto along_last = rounded_dot<D>(last, n);
    auto angles = polynomial_angle(d, along_first);
    for (std::size_t k = 1; k < block.edges; ++k) {
        angles = hn::Add(angles, polynomial_angle(d, rounded_dot<D>(edge(1 + k), n)));
    }
    const auto mean = hn::Div(angles, hn::Set(d, static_cast<float>(block.edges)));
    return custom_normals<D>(d, n, {first, last, along_first, along_last, mean},
                             hn::Load(d, block.tilt.lane.data() + lane),
                             hn::Load(d, block.spin.lane.data() + lane));
}

void customise(const NormalFrame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    for (std::size_t b = begin; b < end; ++b) {
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const FanBlock& block = frame.mesh->fan_blocks[b];
            const Points<Full> normals = block.reads_last_point ? fan_normals<true>(d, frame, block, lane)
                                                                : fan_normals<false>(d, frame, block, lane);
            store_float4s(d, normals.x, normals.y, normals.z, hn::Zero(d),
                          frame.block_normals + kLanes * b + lane);
        }
    }
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
constinit const NormalKernel kNormalKernel{SINEW_TARGETS(faces), SINEW_TARGETS(corners), SINEW_TARGETS(sum),
                                           SINEW_TARGETS(sum_groups), SINEW_TARGETS(customise)};

}  // namespace sinew

#endif
