// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/bulge_limit/bulge_limit.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sinew/stages/stage_state.h"
#include "sinew/transform/split_scale.h"

#define SINEW_THIS_FILE "sinew/stages/bulge_limit/bulge_limit.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/gather-inl.h"

#ifndef SINEW_BULGE_FRAME
#define SINEW_BULGE_FRAME
namespace sinew {

/// A bone's segment in the form that the kernel reads: the head and the stretch; the vector from head to tail;
/// and the coefficients that map a point (x, y, z, 1) to its position along that vector, 0 at the head and 1 at
/// the tail.
struct BulgeBone {
    Float4 head;
    Float4 along;
    Float4 share;
};

/// The arguments of one call of the kernels.
struct BulgeFrame : StageFrame {
    const BulgeBone* segments;                     // for each of PackedMesh::used_bones
    std::array<const Lanes<float>*, 2> distances;  // for each form: [blocks] at rest, with the allowance
    BulgeForm form;
    float strength;
    bool is_stretched;  // some bone has a stretch other than 1
};

}  // namespace sinew
#endif

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

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
        const Points<D> on_segment = nearest_of_segment(d, bone, p);
        const Vec<D> stretch = hn::Set(d, bone.head.value[3]);
        if constexpr (kForm == BulgeForm::continuous) {
            nearest = add_scaled<D>(nearest, weight, on_segment);
            if constexpr (kStretched) stretched = hn::MulAdd(weight, stretch, stretched);
        } else {
            const auto heavier = hn::Gt(weight, most);
            most = hn::Max(weight, most);
            nearest = {hn::IfThenElse(heavier, on_segment.x, nearest.x),
                       hn::IfThenElse(heavier, on_segment.y, nearest.y),
                       hn::IfThenElse(heavier, on_segment.z, nearest.z)};
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
                    return frame.segments[static_cast<std::size_t>(bones[k])];
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
                return frame.segments[static_cast<std::size_t>(bones[k])];
            },
            [&](std::size_t k) HWY_ATTR { return hn::Load(d, weights + kLanes * k); },
            load_deformed(d, pointers, b, lane), changes);
        if (changes) store_points(d, pointers, b, lane, points);
    }
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

/// Measures the distances of rest points, to the weighted bones and to the heaviest: [blocks].
void measure(const BulgeFrame& frame, std::size_t begin, std::size_t end,
             std::span<Lanes<float>> mean_distances, std::span<Lanes<float>> heaviest_distances) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    constexpr auto kAllowance = static_cast<float>(BulgeLimitDefinition::kAllowance);
    for (std::size_t b = begin; b < end; ++b) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Points<One> p = load_rest(d, pointers, frame.spaces, b, lane);
            float mean = 0.0f;
            Points<One> nearest{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
            float to_heaviest = 0.0f;
            float most = 0.0f;
            for (std::size_t k = 0; k < pointers.blocks[b].influences; ++k) {
                const auto [bone, weight] = influence_at(*frame.mesh, b, lane, k);
                const auto on_segment =
                    nearest_of_segment(d, frame.segments[static_cast<std::size_t>(bone)], p);
                nearest = add_scaled<One>(nearest, hn::Set(d, weight), on_segment);
                const float distance = length_of(subtract<One>(on_segment, p));
                mean += weight * distance;
                if (weight > most) to_heaviest = distance;
                most = weight > most ? weight : most;
            }
            // Also with limited()'s rounding of the mean vector, so that rest points are not moved where that
            // vector is as long as the mean distance: for bones in one line.
            mean_distances[b].lane[lane] = kAllowance * HWY_MAX(mean, length_of(subtract<One>(nearest, p)));
            heaviest_distances[b].lane[lane] = kAllowance * to_heaviest;
        }
    }
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr OfTargets<void(const BulgeFrame& frame, std::size_t begin, std::size_t end)> kLimit
    SINEW_TARGETS(limit);
constexpr OfTargets<void(const BulgeFrame& frame, std::size_t begin, std::size_t end,
                         std::span<Lanes<float>> mean_distances, std::span<Lanes<float>> heaviest_distances)>
    kMeasure SINEW_TARGETS(measure);

void check_segments(std::span<const BoneSegment<float>> segments, std::size_t bone_count) {
    if (segments.size() < bone_count) {
        fail("segments", "at least " + std::to_string(bone_count) + " bones",
             std::to_string(segments.size()));
    }
    for (std::size_t bone = 0; bone < segments.size(); ++bone) {
        if (!is_finite(segments[bone].head) || !is_finite(segments[bone].tail)) {
            fail("segments", "finite values", "NaN or infinity at bone " + std::to_string(bone));
        }
    }
}

/// Whether a motion preserves lengths.
bool is_orthonormal(const Mat3<double>& m) {
    const Mat3<double> products = glm::transpose(m) * m - Mat3<double>(1.0);
    double largest = 0.0;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(products[i][k]));
    }
    return largest < kOrthonormal;
}

BulgeBone bulge_bone(const BoneSegment<double>& segment, double stretch) noexcept {
    const Vec3<double>& head = segment.head;
    const Vec3<double> along = segment.tail - head;
    return {float4(head.x, head.y, head.z, stretch), float4(along.x, along.y, along.z, 0.0),
            position_along(head, segment.tail)};
}

}  // namespace

struct BulgeLimit::State : BoneStage::State {
    State(const Binding& binding, const BulgeLimitData& data)
        : BoneStage::State(binding, binding.bone_count(), data.weights, data.bones_from_model) {
        check_segments(data.segments, bone_count);
        for (const std::int32_t bone : mesh.used_bones) {
            const auto& [head, tail] = data.segments[static_cast<std::size_t>(bone)];
            at_rest.push_back({Vec3<double>(head), Vec3<double>(tail)});
        }
        segments.resize(at_rest.size());
        for (std::vector<Lanes<float>>& form : distances) form.resize(mesh.blocks.size());
        measure();
    }

    void measure() noexcept override {
        for (std::size_t i = 0; i < segments.size(); ++i) segments[i] = bulge_bone(at_rest[i], 1.0);
        const BulgeFrame all = bulge_frame(nullptr);
        parallel_for_blocks(mesh, packed->vertex_count, 0, [&](std::size_t begin, std::size_t end) {
            kMeasure[target_in_use()](all, begin, end, distances[0], distances[1]);
        });
    }

    /// Poses the segments. Returns whether a bone is stretched.
    bool prepare(std::span<const Affine<float>> posed_from_rest) const noexcept {
        bool is_stretched = false;
        for (std::size_t i = 0; i < segments.size(); ++i) {
            const Affine<double> posed = motion(posed_from_rest, mesh.used_bones[i]);
            const double stretch =
                is_orthonormal(posed.linear) ? 1.0 : BulgeLimitDefinition::stretch(posed.linear, at_rest[i]);
            is_stretched = is_stretched || stretch != 1.0;
            const auto& [head, tail] = at_rest[i];
            segments[i] = bulge_bone({transform_point(posed, head), transform_point(posed, tail)}, stretch);
        }
        return is_stretched;
    }

    [[nodiscard]] BulgeFrame bulge_frame(Vec3<float>* points) const noexcept {
        return {frame(points), segments.data(), {distances[0].data(), distances[1].data()}, {}, 1.0f, false};
    }

    std::vector<BoneSegment<double>> at_rest;            // for each of mesh.used_bones
    std::array<std::vector<Lanes<float>>, 2> distances;  // as in BulgeFrame
    mutable std::vector<BulgeBone> segments;             // scratch for one call
};

BulgeLimit::BulgeLimit(const Binding& binding, const BulgeLimitData& data)
    : BoneStage(BoneStage::State::make<State>(binding, data)) {}

Status BulgeLimit::apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
                         const BulgeLimitOptions& options) const noexcept {
    const auto& state = static_cast<const State&>(*state_);
    if (points.size() != vertex_count()) return Status::size;
    const std::scoped_lock lock(state.mutex);
    BulgeFrame frame = state.bulge_frame(points.data());
    frame.is_stretched = state.prepare(posed_from_rest);
    frame.form = options.form;
    frame.strength = std::isnan(options.strength) ? 1.0f : std::clamp(options.strength, 0.0f, 1.0f);
    parallel_for_blocks(state.mesh, points.size(), options.threads, [&](std::size_t begin, std::size_t end) {
        kLimit[target_in_use()](frame, begin, end);
    });
    return Status::ok;
}

}  // namespace sinew

#endif
