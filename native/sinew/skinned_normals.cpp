// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skinned_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <string>
#include <vector>

#include "sinew/base/fork_safe.h"
#include "sinew/base/thread_pool.h"
#include "sinew/deformer_state.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/normals/skinned_normal_kernel.h"

namespace sinew {
namespace {

constexpr std::size_t kFramesWorthAThread = 8192;

// A vector with a smaller squared length has no direction.
constexpr float kShortest = 1e-35f;

void check(const RestFrames& rest, std::size_t vertex_count) {
    const std::size_t count = rest.normals.size();
    if (rest.vertices.empty() && count != vertex_count) {
        fail("normals", "one for each of the " + std::to_string(vertex_count) + " vertices",
             std::to_string(count));
    }
    check_optional("vertices", rest.vertices.size(), count, "normals");
    check_optional("tangents", rest.tangents.size(), count, "normals");
    for (std::size_t i = 0; i < rest.vertices.size(); ++i) {
        if (rest.vertices[i] < 0 || static_cast<std::size_t>(rest.vertices[i]) >= vertex_count) {
            fail("vertices", "vertices below " + std::to_string(vertex_count),
                 std::to_string(rest.vertices[i]) + " at index " + std::to_string(i));
        }
    }
    check_finite("normals", rest.normals, "index");
    check_finite("tangents", rest.tangents, "index");
}

/// A power of two of about the mesh's size, so that differences of points have as many digits as the points.
float step_of(std::span<const Vec3<float>> points) {
    float largest = 0.0f;
    for (const Vec3<float>& point : points) {
        const Vec3<float> away = glm::abs(point - points.front());
        largest = std::max({largest, away.x, away.y, away.z});
    }
    if (!(largest > 0.0f) || !std::isfinite(largest)) return 1.0f;
    return std::clamp(std::exp2(std::ceil(std::log2(largest))), 1e-12f, 1e12f);
}

Vec3<float> unit(const Vec3<float>& v) {
    const float squared = glm::dot(v, v);
    return squared > kShortest && std::isfinite(squared) ? v / std::sqrt(squared) : Vec3<float>(0.0f);
}

}  // namespace

struct SkinnedNormals::State {
    State(const Binding& binding, const MethodInfo& method, const RestFrames& rest,
          const std::optional<MixData>& mix)
        : deformer(binding, method, mix),
          normals(rest.normals.begin(), rest.normals.end()),
          tangents(rest.tangents.begin(), rest.tangents.end()),
          vertices(rest.vertices.begin(), rest.vertices.end()) {
        const PackedMesh& mesh = deformer.state().packed->mesh;
        const std::vector<Vec3<float>> points = binding.unpack().rest_points;
        const float step = step_of(points);
        inverse_step = 1.0f / step;
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<Vec3<float>> stepped = points;
            for (Vec3<float>& point : stepped) point[axis] += step;
            const auto i = static_cast<std::size_t>(axis);
            if (status_of_points(stepped, points.size()) != Status::ok) {
                fail("rest_points", "finite values", "infinity beside them");
            }
            stepped_points[i].resize(mesh.rest_points.size());
            pack_points(mesh, stepped, stepped_points[i]);
            moved[i].resize(points.size());
            if (!vertices.empty()) cofactors[i].resize(points.size());
        }
    }

    /// Deforms the rest points, unless `points` is null, and those displaced by a step along each axis.
    void move(const Pose& pose, const DeformOptions& options, Vec3<float>* points) const noexcept {
        const Deformer::State& state = deformer.state();
        const PaletteStore::Reading reading(state.palettes);
        const PreparedPose prepared = state.prepare(pose, options, reading);
        if (points != nullptr) state.deform(prepared, state.rest_points(), options.threads, points);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            state.deform(prepared, stepped_points[axis], options.threads, moved[axis].data());
        }
    }

    void move_normals(std::span<const Vec3<float>> points, std::span<Vec3<float>> to,
                      std::size_t threads) const noexcept {
        const SkinnedNormalFrame frame{
            points.data(),  {moved[0].data(), moved[1].data(), moved[2].data()},
            inverse_step,   {cofactors[0].data(), cofactors[1].data(), cofactors[2].data()},
            normals.data(), vertices.data(),
            to.data()};
        const auto compute = [&](const SkinnedNormalKernel::OfRange& function, std::size_t count) {
            const auto part = [&](std::size_t begin, std::size_t end) {
                function[target_in_use()](frame, begin, end);
            };
            parallel_for(count, useful_threads(threads, count, kFramesWorthAThread), part);
        };
        if (vertices.empty()) return compute(kSkinnedNormalKernel.of_vertices, to.size());
        compute(kSkinnedNormalKernel.cofactors, points.size());
        compute(kSkinnedNormalKernel.of_frames, to.size());
    }

    /// Moves the tangents of frames [begin, end).
    void move_tangents(std::span<const Vec3<float>> points, std::span<Vec3<float>> to, std::size_t begin,
                       std::size_t end) const noexcept {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t vertex = vertices.empty() ? i : static_cast<std::size_t>(vertices[i]);
            const auto column = [&](std::size_t axis) {
                return inverse_step * (moved[axis][vertex] - points[vertex]);
            };
            const Vec3<float>& t = tangents[i];
            to[i] = unit(t.x * column(0) + t.y * column(1) + t.z * column(2));
        }
    }

    Deformer deformer;
    // the rest points displaced by a step along each axis, as PackedMesh::rest_points
    std::array<std::vector<Lanes<float>>, 3> stepped_points;
    float inverse_step = 1.0f;
    std::vector<Vec3<float>> normals;
    std::vector<Vec3<float>> tangents;
    std::vector<std::int32_t> vertices;

    // Scratch for one call at a time.
    mutable ForkSafeMutex mutex;
    mutable std::array<std::vector<Vec3<float>>, 3> moved;
    mutable std::array<std::vector<Float4>, 3> cofactors;
};

SkinnedNormals::SkinnedNormals(const Binding& binding, const MethodInfo& method, const RestFrames& rest,
                               const std::optional<MixData>& mix)
    : state_((check(rest, binding.vertex_count()), make_owned<State>(binding, method, rest, mix))) {}

std::size_t SkinnedNormals::frame_count() const noexcept { return state_->normals.size(); }
bool SkinnedNormals::has_tangents() const noexcept { return !state_->tangents.empty(); }
const Deformer& SkinnedNormals::deformer() const noexcept { return state_->deformer; }

Status SkinnedNormals::deform(const Pose& pose, const DeformOptions& options, std::span<Vec3<float>> points,
                              std::span<Vec3<float>> normals,
                              std::span<Vec3<float>> tangents) const noexcept {
    const State& state = *state_;
    if (points.size() != deformer().vertex_count() || normals.size() != frame_count()) return Status::size;
    if (!tangents.empty() && tangents.size() != state.tangents.size()) return Status::size;
    const std::scoped_lock lock(state.mutex);
    state.move(pose, options, points.data());
    state.move_normals(points, normals, options.threads);
    if (tangents.empty()) return Status::ok;
    const auto part = [&](std::size_t begin, std::size_t end) {
        state.move_tangents(points, tangents, begin, end);
    };
    parallel_for(tangents.size(), useful_threads(options.threads, tangents.size(), kFramesWorthAThread),
                 part);
    return Status::ok;
}

Status SkinnedNormals::deform_normals(const Pose& pose, const DeformOptions& options,
                                      std::span<const Vec3<float>> points,
                                      std::span<Vec3<float>> normals) const noexcept {
    const State& state = *state_;
    if (points.size() != deformer().vertex_count() || normals.size() != frame_count()) return Status::size;
    const std::scoped_lock lock(state.mutex);
    state.move(pose, options, nullptr);
    state.move_normals(points, normals, options.threads);
    return Status::ok;
}

}  // namespace sinew
