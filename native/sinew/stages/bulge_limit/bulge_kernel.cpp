// SPDX-License-Identifier: GPL-3.0-or-later
// The stage `bulge_limit` on lanes: see stages/bulge_limit/bulge_limit.h for what it computes.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/stages/bulge_limit/bulge_kernel.h"

#include "sinew/base/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/stages/bulge_limit/bulge_kernel.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// The point of the bone's segment nearest to `p`.
template <class D>
HWY_INLINE Points<D> nearest_of_segment(D d, const BulgeBone& bone, const Points<D>& p) {
    const float* const share = bone.share.value.data();
    const Vec<D> t = hn::MulAdd(
        p.x, hn::Set(d, share[0]),
        hn::MulAdd(p.y, hn::Set(d, share[1]), hn::MulAdd(p.z, hn::Set(d, share[2]), hn::Set(d, share[3]))));
    const Vec<D> within = hn::Min(hn::Max(t, hn::Zero(d)), hn::Set(d, 1.0f));
    return add_scaled<D>(in_all_lanes(d, bone.head.value.data()), within,
                         in_all_lanes(d, bone.along.value.data()));
}

/// Limits the points of some lanes.
///
/// bone_of     bone_of(k) returns the k-th bone
/// weight_of   weight_of(k) returns its weight in each lane
/// kStretched  whether a bone may stretch
template <BulgeForm kForm, bool kStretched, class D, class BoneOf, class WeightOf>
HWY_INLINE Points<D> limited(D d, const BulgeFrame& frame, std::size_t b, std::size_t lane, std::size_t count,
                             const BoneOf& bone_of, const WeightOf& weight_of, const Points<D>& point,
                             bool& changes) {
    const Points<D> p = to_bones(d, frame.spaces, point);
    Points<D> nearest{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    Vec<D> stretched = hn::Zero(d);
    Vec<D> most = hn::Zero(d);
    for (std::size_t k = 0; k < count; ++k) {
        const BulgeBone& bone = bone_of(k);
        const Vec<D> weight = weight_of(k);
        const Points<D> own = nearest_of_segment(d, bone, p);
        const Vec<D> stretch = hn::Set(d, bone.head.value[3]);
        if constexpr (kForm == BulgeForm::continuous) {
            nearest = add_scaled<D>(nearest, weight, own);
            if constexpr (kStretched) stretched = hn::MulAdd(weight, stretch, stretched);
        } else {
            const auto heavier = hn::Gt(weight, most);
            most = hn::Max(weight, most);
            nearest = {hn::IfThenElse(heavier, own.x, nearest.x), hn::IfThenElse(heavier, own.y, nearest.y),
                       hn::IfThenElse(heavier, own.z, nearest.z)};
            stretched = hn::IfThenElse(heavier, stretch, stretched);
        }
    }
    const Points<D> to_nearest = subtract<D>(nearest, p);
    const float* const distances = frame.distances[static_cast<std::size_t>(kForm)][b].lane.data() + lane;
    Vec<D> allowed = hn::Load(d, distances);
    if constexpr (kStretched) allowed = hn::Mul(allowed, stretched);
    const Vec<D> squared = dot<D>(to_nearest, to_nearest);
    const auto bulges = hn::Gt(squared, hn::Mul(allowed, allowed));
    changes = !hn::AllFalse(d, bulges);
    if (!changes) return point;
    Vec<D> amount = hn::Set(d, frame.strength);
    if (frame.weights != nullptr) amount = hn::Mul(amount, hn::Load(d, frame.weights[b].lane.data() + lane));
    const Vec<D> less = hn::NegMulAdd(allowed, inverse_root(d, squared), hn::Set(d, 1.0f));
    const Points<D> moved =
        add_scaled<D>(point, hn::Mul(amount, less), vector_to_model(d, frame.spaces, to_nearest));
    // A sum with 0 would change the sign of -0.
    const auto moves = hn::And(bulges, hn::Gt(amount, hn::Zero(d)));
    return {hn::IfThenElse(moves, moved.x, point.x), hn::IfThenElse(moves, moved.y, point.y),
            hn::IfThenElse(moves, moved.z, point.z)};
}

/// Limits blocks [begin, end) with the same bones, two or more.
///
/// kCount  their influences, or 0 for any number
template <BulgeForm kForm, bool kStretched, std::size_t kCount>
void limit_set(const BulgeFrame& frame, const MeshPointers& pointers, std::size_t begin, std::size_t end) {
    const Full d;
    const Block& first = pointers.blocks[begin];
    const std::int32_t* const bones = frame.mesh->bones.data() + first.first_bone;
    const std::size_t count = kCount > 0 ? kCount : first.influences;
    for (std::size_t b = begin; b < end; ++b) {
        const float* const weights = weights_of(pointers, b);
        const float* const first_weights = frame.mesh->first_weights[b].lane.data();
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            bool changes = false;
            const Points<Full> points = limited<kForm, kStretched>(
                d, frame, b, lane, count,
                [&](std::size_t k) -> const BulgeBone& {
                    return frame.bones[static_cast<std::size_t>(bones[k])];
                },
                [&](std::size_t k) HWY_ATTR {
                    return hn::Load(d, (k == 0 ? first_weights : weights + kLanes * (k - 1)) + lane);
                },
                load_deformed(d, pointers, b, lane), changes);
            if (changes) store_points(d, pointers, b, lane, points);
        }
    }
}

/// Limits a block whose vertices have own bones, vertex by vertex.
template <BulgeForm kForm, bool kStretched>
void limit_own_bones(const BulgeFrame& frame, const MeshPointers& pointers, std::size_t b) {
    const One d;
    const Block& block = pointers.blocks[b];
    if (block.influences < 2) return;
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const float* const weights = weights_of(pointers, b) + lane;
        if (!(weights[kLanes] > 0.0f)) continue;
        const std::int32_t* const bones =
            frame.mesh->bones.data() + block.first_bone + block.influences * lane;
        bool changes = false;
        const Points<One> points = limited<kForm, kStretched>(
            d, frame, b, lane, block.influences,
            [&](std::size_t k) -> const BulgeBone& {
                return frame.bones[static_cast<std::size_t>(bones[k])];
            },
            [&](std::size_t k) HWY_ATTR { return hn::Load(d, weights + kLanes * k); },
            load_deformed(d, pointers, b, lane), changes);
        if (changes) store_points(d, pointers, b, lane, points);
    }
}

MeshPointers pointers_of(const BulgeFrame& frame) {
    const PackedMesh& mesh = *frame.mesh;
    return {mesh.blocks.data(),   mesh.rest_points.data(), mesh.weights.data(), nullptr,
            mesh.vertices.data(), mesh.runs.data(),        frame.points};
}

template <BulgeForm kForm, bool kStretched>
void limit_blocks(const BulgeFrame& frame, std::size_t begin, std::size_t end) {
    const MeshPointers pointers = pointers_of(frame);
    for_each_set(
        *frame.mesh, begin, end,
        [&](std::size_t b, std::size_t after) HWY_ATTR {
            switch (pointers.blocks[b].influences) {
                case 0:
                case 1: break;
                case 2: limit_set<kForm, kStretched, 2>(frame, pointers, b, after); break;
                case 3: limit_set<kForm, kStretched, 3>(frame, pointers, b, after); break;
                case 4: limit_set<kForm, kStretched, 4>(frame, pointers, b, after); break;
                default: limit_set<kForm, kStretched, 0>(frame, pointers, b, after);
            }
        },
        [&](std::size_t b) HWY_ATTR { limit_own_bones<kForm, kStretched>(frame, pointers, b); });
}

void limit(const BulgeFrame& frame, std::size_t begin, std::size_t end) {
    if (frame.form == BulgeForm::kim_han) {
        limit_blocks<BulgeForm::kim_han, true>(frame, begin, end);
    } else if (frame.is_stretched) {
        limit_blocks<BulgeForm::continuous, true>(frame, begin, end);
    } else {
        limit_blocks<BulgeForm::continuous, false>(frame, begin, end);
    }
}

float length_of(const Points<One>& v) { return hn::GetLane(hn::Sqrt(dot<One>(v, v))); }

void measure(const BulgeFrame& frame, std::size_t begin, std::size_t end) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    constexpr auto kAllowance = static_cast<float>(BulgeLimitStage::kAllowance);
    for (std::size_t b = begin; b < end; ++b) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Points<One> p = to_bones(d, frame.spaces, load_deformed(d, pointers, b, lane));
            float mean = 0.0f;
            Points<One> nearest{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
            float of_heaviest = 0.0f;
            float most = 0.0f;
            for (std::size_t k = 0; k < pointers.blocks[b].influences; ++k) {
                const auto [bone, weight] = influence_at(*frame.mesh, b, lane, k);
                const auto own = nearest_of_segment(d, frame.bones[static_cast<std::size_t>(bone)], p);
                nearest = add_scaled<One>(nearest, hn::Set(d, weight), own);
                const float distance = length_of(subtract<One>(own, p));
                mean += weight * distance;
                if (weight > most) of_heaviest = distance;
                most = weight > most ? weight : most;
            }
            // Also with limited()'s rounding of the mean vector, so that rest points are not moved where that
            // vector is as long as the mean distance: for bones in one line.
            frame.distances[0][b].lane[lane] =
                kAllowance * HWY_MAX(mean, length_of(subtract<One>(nearest, p)));
            frame.distances[1][b].lane[lane] = kAllowance * of_heaviest;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
constinit const BulgeKernel kBulgeKernel{SINEW_TARGETS(limit), SINEW_TARGETS(measure)};

BulgeBone bulge_bone(const BoneSegment<double>& segment, double stretch) noexcept {
    const Vec3<double>& head = segment.head;
    const Vec3<double> along = segment.tail - head;
    const double squared = glm::dot(along, along);
    const Vec3<double> share = along * (squared > 0.0 ? 1.0 / squared : 0.0);
    return {float4(head.x, head.y, head.z, stretch), float4(along.x, along.y, along.z, 0.0),
            float4(share.x, share.y, share.z, -glm::dot(head, share))};
}

}  // namespace sinew

#endif
