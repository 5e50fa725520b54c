// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "sinew/deform/mesh_topology.h"
#include "sinew/export.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// What DeltaMush takes at most; more is refused.
inline constexpr std::size_t kMaxMushVertices = 0x1FFFFFFF;  // 2^29 - 1

/// How neighbours count. In the order of DeltaMushStage::kSmoothTypes.
enum class SmoothType { simple, length_weighted };

/// What the stage `delta_mush` smooths by.
struct DeltaMushSettings {
    /// How often; at most DeltaMushStage::kMaxIterations. Not used with a radius.
    std::size_t iterations = 5;
    /// How far the smoothing reaches, in units of the points; 0: so many iterations.
    ///
    /// n iterations on edges of length h spread a detail as a Gaussian of the width h sqrt(n factor / 2), half of that
    /// squared where neighbours count by length. The width is the radius at every vertex: its h is the root mean square
    /// of its edges at rest, the number of iterations is that which the vertices with the shortest edges need (but for
    /// the shortest tenth of them), and where edges are longer the factor is smaller. Limits: the shortest tenth, and
    /// all where that would be more than DeltaMushStage::kMaxIterations, reach less far; edges of unlike lengths at a
    /// vertex reach as far as they are long; what is narrower than the radius, such as a finger, is smoothed as a whole.
    float radius = 0.0f;
    /// 0 to 1.
    float factor = 0.5f;
    SmoothType type = SmoothType::simple;
    /// The ends of edges that have one face are not smoothed.
    bool pin_boundary = false;
    /// [vertices] how much each vertex is smoothed, clamped to 0 to 1; empty: fully.
    std::span<const float> weights{};
};

/// The stage `delta_mush` (Mancewicz et al. 2014), as Blender's Corrective Smooth with the rest source Original
/// Coordinates: see skinning/delta_mush.h. Any polygons, edges without faces, edges of many faces. Once constructed it is
/// valid, and applying it can not fail and allocates nothing. Calls of one object wait for each other. One that was
/// moved from can only be assigned to or destroyed.
class SINEW_EXPORT DeltaMush {
public:
    /// rest_points  [vertices] the mesh without shape keys
    ///
    /// Throws std::invalid_argument that names the field, what was wanted and what came: sizes that do not fit or
    /// are beyond the limits, vertices that there are not, an edge of a face that is not among the edges, values that
    /// are not finite or out of their range. Nothing is kept by reference.
    DeltaMush(const MeshTopology& topology, std::span<const Vec3<float>> rest_points,
              const DeltaMushSettings& settings);

    DeltaMush(DeltaMush&&) noexcept;
    DeltaMush& operator=(DeltaMush&&) noexcept;
    ~DeltaMush();

    /// Other rest points or settings on the same faces and edges: it takes about as long as to apply it. Throws as the
    /// constructor does, and is then as it was.
    void bind(std::span<const Vec3<float>> rest_points, const DeltaMushSettings& settings);

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// How often it smooths, also with a radius.
    [[nodiscard]] std::size_t iterations() const noexcept;

    /// Smooths in place.
    ///
    /// points   [vertices] in the space of the rest points; of another size nothing is written
    /// scale    how much of the details comes back; 1 all
    /// threads  0: as many as help
    ///
    /// A vertex without faces is smoothed without details. The result does not depend on the number of threads.
    void apply(std::span<Vec3<float>> points, float scale = 1.0f, std::size_t threads = 0) const noexcept;

    /// What it was made of. Spans are valid until bind() or the end of this.
    struct Parts {
        MeshTopology topology;
        std::span<const Vec3<float>> rest_points;
        DeltaMushSettings settings;
    };
    [[nodiscard]] Parts parts() const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
