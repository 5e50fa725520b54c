// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/normals.h"

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "sinew/base/fork_safe.h"
#include "sinew/base/thread_pool.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/mesh/topology.h"
#include "sinew/normals/normal_mesh.h"

namespace sinew {
namespace {

// Below this, waking a second thread costs more than it saves.
constexpr std::size_t kCornersWorthAThread = 16384;

constexpr std::size_t kBlocksOfChunk = 64;
constexpr std::size_t kGroupsOfChunk = 64 * kLanes;

bool any(std::span<const std::uint8_t> flags) {
    return std::ranges::any_of(flags, [](std::uint8_t flag) { return flag != 0; });
}

/// Whether there are flags, and all are set.
bool all(std::span<const std::uint8_t> flags) {
    return !flags.empty() && std::ranges::all_of(flags, [](std::uint8_t flag) { return flag != 0; });
}

void check(const MeshTopology& topology, std::size_t vertex_count, const Sharpness& sharpness) {
    check(topology, vertex_count, "vertex_count", kMaxNormalVertices);
    if (topology.corner_vertices.size() > kMaxNormalCorners) {
        fail("corner_vertices", "at most " + std::to_string(kMaxNormalCorners),
             std::to_string(topology.corner_vertices.size()));
    }
    if (topology.face_offsets.size() > kMaxNormalCorners) {
        fail("face_offsets", "at most " + std::to_string(kMaxNormalCorners) + " faces",
             std::to_string(topology.face_offsets.size() - 1));
    }
    check_optional("sharp_edges", sharpness.edges.size(), topology.edges.size() / 2, "edges");
    check_optional("sharp_faces", sharpness.faces.size(), topology.face_offsets.size() - 1, "faces");
    const std::size_t numbers = 2 * topology.corner_vertices.size();
    if (!sharpness.custom.empty() && sharpness.custom.size() != numbers) {
        fail("custom_normals", "none, or two numbers for each corner, " + std::to_string(numbers),
             std::to_string(sharpness.custom.size()));
    }
}

NormalDomain domain_of(const MeshTopology& topology, const Sharpness& sharpness) {
    if (topology.corner_vertices.empty()) return NormalDomain::vertex;
    if (!sharpness.custom.empty()) return NormalDomain::corner;
    if (all(sharpness.faces) || all(sharpness.edges)) return NormalDomain::face;
    return any(sharpness.faces) || any(sharpness.edges) ? NormalDomain::corner : NormalDomain::vertex;
}

/// Runs a kernel's function on [0, count).
void run(const NormalKernel::OfRange& function, const NormalFrame& frame, std::size_t count,
         std::size_t threads, std::size_t chunk) {
    const auto part = [&](std::size_t begin, std::size_t end) {
        function[target_in_use()](frame, begin, end);
    };
    parallel_for(count, threads, part, chunk);
}

}  // namespace

struct Normals::State {
    State(const MeshTopology& topology, std::size_t vertices, const Sharpness& sharpness)
        : corner_vertices(topology.corner_vertices.begin(), topology.corner_vertices.end()),
          domain(domain_of(topology, sharpness)),
          mesh(make_normal_mesh(topology, vertices, sharpness, domain)),
          normals(mesh.normal_count()) {}

    /// The groups whose normals corners have, unless they have the faces' normals.
    [[nodiscard]] const CornerGroups& corner_groups() const noexcept {
        return domain == NormalDomain::corner ? mesh.fans : mesh.vertices;
    }

    [[nodiscard]] std::size_t threads_for(std::size_t threads) const noexcept {
        return useful_threads(threads, corner_vertices.size(), kCornersWorthAThread);
    }

    /// Writes to each element of `to` the normal that `sources` names.
    void write(std::span<Vec3<float>> to, const std::int32_t* sources, const Float4* from,
               std::size_t threads) const noexcept {
        const auto part = [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Float4& normal = from[index(sources[i])];
                to[i] = {normal.value[0], normal.value[1], normal.value[2]};
            }
        };
        parallel_for(to.size(), threads, part);
    }

    std::vector<std::int32_t> corner_vertices;  // as given to the constructor
    NormalDomain domain;
    NormalMesh mesh;

    // Scratch for one call at a time.
    mutable ForkSafeMutex mutex;
    mutable std::vector<Float4> normals;  // indexed as NormalMesh::corner_sources
};

Normals::Normals(const MeshTopology& topology, std::size_t vertex_count, const Sharpness& sharpness)
    : state_(
          (check(topology, vertex_count, sharpness), make_owned<State>(topology, vertex_count, sharpness))) {}

NormalDomain Normals::domain() const noexcept { return state_->domain; }

std::size_t Normals::count(NormalDomain domain) const noexcept {
    switch (domain) {
        case NormalDomain::vertex: return state_->mesh.vertices.size();
        case NormalDomain::corner: return state_->corner_vertices.size();
        case NormalDomain::face: return state_->mesh.face_sources.size();
    }
    return 0;
}

Status Normals::compute(NormalDomain domain, std::span<const Vec3<float>> points,
                        std::span<Vec3<float>> normals, std::size_t threads) const noexcept {
    const State& state = *state_;
    if (points.size() != count(NormalDomain::vertex) || normals.size() != count(domain)) return Status::size;
    const NormalMesh& mesh = state.mesh;
    const std::scoped_lock lock(state.mutex);
    threads = state.threads_for(threads);
    const bool is_of_vertices = domain == NormalDomain::vertex;
    Float4* const all = state.normals.data();
    const NormalFrame frame{&mesh,
                            points.data(),
                            all,
                            is_of_vertices ? &mesh.vertices : &state.corner_groups(),
                            all + mesh.first_of_groups(),
                            domain == NormalDomain::corner ? all + mesh.first_of_lone_fans() : nullptr,
                            all + mesh.first_of_blocks(),
                            normals.data()};
    // If the whole mesh is flat, corners have the normals of their faces.
    if (domain == NormalDomain::face ||
        (domain == NormalDomain::corner && state.domain == NormalDomain::face)) {
        run(kNormalKernel.faces, frame, mesh.blocks.size(), threads, kBlocksOfChunk);
    } else {
        run(kNormalKernel.corners, frame, mesh.blocks.size(), threads, kBlocksOfChunk);
        run(is_of_vertices ? kNormalKernel.sum : kNormalKernel.sum_groups, frame, frame.groups->size(),
            threads, kGroupsOfChunk);
    }
    if (domain == NormalDomain::face) state.write(normals, mesh.face_sources.data(), all, threads);
    if (domain != NormalDomain::corner) return Status::ok;
    run(kNormalKernel.customise, frame, mesh.fan_blocks.size(), threads, kBlocksOfChunk);
    if (mesh.corner_sources.empty()) {
        state.write(normals, state.corner_vertices.data(), frame.group_normals, threads);
    } else {
        state.write(normals, mesh.corner_sources.data(), all, threads);
    }
    return Status::ok;
}

}  // namespace sinew
