// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/bulge_limit.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>

#include "sinew/base/fork_safe.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/stages/bulge_limit/bulge_kernel.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

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

}  // namespace

struct BulgeLimit::State {
    State(const Binding& binding, const BulgeLimitData& data) : packed(binding.packed()) {
        check_segments(data.segments, packed->bone_count);
        if (!data.weights.empty()) check_weights("weights", data.weights, packed->vertex_count);
        check_space(data.bones_from_model);
        for (const std::int32_t bone : mesh.used_bones) {
            segments.push_back(data.segments[static_cast<std::size_t>(bone)]);
        }
        bones.resize(segments.size());
        for (std::vector<Lanes<float>>& of_form : distances) of_form.resize(mesh.blocks.size());
        weights = pack_weights(mesh, data.weights);
        measure(unpack(mesh, mesh.rest_points, packed->vertex_count).rest_points, data.bones_from_model);
    }

    void measure(std::span<const Vec3<float>> points, const Affine<float>& space) {
        space_rows = SpaceRows(space);
        for (std::size_t i = 0; i < bones.size(); ++i) {
            bones[i] = bulge_bone({Vec3<double>(segments[i].head), Vec3<double>(segments[i].tail)}, 1.0);
        }
        // The kernel only reads them here.
        const BulgeFrame all = frame(const_cast<Vec3<float>*>(points.data()));
        parallel_for_blocks(mesh, points.size(), 0, [&](std::size_t begin, std::size_t end) {
            kBulgeKernel.measure[target_in_use()](all, begin, end);
        });
    }

    [[nodiscard]] BulgeFrame frame(Vec3<float>* points) const {
        // measure() alone writes the distances, and no other call runs at the same time.
        return {
            &mesh,
            bones.data(),
            {const_cast<Lanes<float>*>(distances[0].data()), const_cast<Lanes<float>*>(distances[1].data())},
            weights.empty() ? nullptr : weights.data(),
            BulgeForm::continuous,
            1.0f,
            false,
            space_rows.spaces(),
            points};
    }

    std::shared_ptr<const PackedBinding> packed;
    const PackedMesh& mesh = packed->mesh;
    std::vector<BoneSegment<float>> segments;  // for each of mesh.used_bones
    std::vector<Lanes<float>> weights;         // [blocks], or empty
    std::vector<Lanes<float>> distances[2];    // as in BulgeFrame
    SpaceRows space_rows{Affine<float>{}};
    mutable std::vector<BulgeBone> bones;  // scratch for one call
    mutable ForkSafeMutex mutex;
};

BulgeLimit::BulgeLimit(const Binding& binding, const BulgeLimitData& data)
    : state_(make_owned<State>(binding, data)) {}

Status BulgeLimit::set_rest_points(std::span<const Vec3<float>> rest_points,
                                   const Affine<float>& bones_from_model) noexcept {
    const Status status = status_of_rest(rest_points, vertex_count(), bones_from_model);
    if (status != Status::ok) return status;
    const std::scoped_lock lock(state_->mutex);
    state_->measure(rest_points, bones_from_model);
    return Status::ok;
}

std::size_t BulgeLimit::vertex_count() const noexcept { return state_->packed->vertex_count; }
std::size_t BulgeLimit::bone_count() const noexcept { return state_->packed->bone_count; }

Status BulgeLimit::apply(std::span<Vec3<float>> points, const Pose& pose,
                         const BulgeLimitOptions& options) const noexcept {
    const State& state = *state_;
    if (points.size() != vertex_count()) return Status::size;
    const std::scoped_lock lock(state.mutex);
    bool is_stretched = false;
    for (std::size_t i = 0; i < state.bones.size(); ++i) {
        const BoneSegment<double> rest{Vec3<double>(state.segments[i].head),
                                       Vec3<double>(state.segments[i].tail)};
        const auto number = static_cast<std::size_t>(state.mesh.used_bones[i]);
        Affine<double> motion{};
        if (number < pose.posed_from_rest.size()) motion = cast<double>(pose.posed_from_rest[number]);
        const double stretch =
            is_orthonormal(motion.linear) ? 1.0 : BulgeLimitStage::stretch(motion.linear, rest);
        is_stretched = is_stretched || stretch != 1.0;
        state.bones[i] =
            bulge_bone({transform_point(motion, rest.head), transform_point(motion, rest.tail)}, stretch);
    }
    BulgeFrame frame = state.frame(points.data());
    frame.form = options.form;
    frame.is_stretched = is_stretched;
    frame.strength = std::isnan(options.strength) ? 1.0f : std::clamp(options.strength, 0.0f, 1.0f);
    parallel_for_blocks(state.mesh, points.size(), options.threads, [&](std::size_t begin, std::size_t end) {
        kBulgeKernel.limit[target_in_use()](frame, begin, end);
    });
    return Status::ok;
}

}  // namespace sinew
