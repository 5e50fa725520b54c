// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/export.h"
#include "sinew/mesh/mesh_topology.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// Limit of DeltaMush. More is refused.
inline constexpr std::size_t kMaxMushVertices = 0x1FFFFFFF;  // 2^29 - 1

/// How neighbours are weighted. In the order of DeltaMushStage::kSmoothTypes.
enum class SmoothType { simple, length_weighted };

/// How the stage `delta_mush` smooths.
struct DeltaMushSettings {
    /// Number of smoothing iterations, at most DeltaMushStage::kMaxIterations. Not used with a radius.
    std::size_t iterations = 5;
    /// How far the smoothing reaches, in units of the points; 0: use `iterations`.
    ///
    /// n iterations over edges of length h spread a detail as a Gaussian of width h sqrt(n factor / 2); with
    /// SmoothType::length_weighted the square of the width is halved. The factor of each vertex is chosen so that
    /// this width is the radius: h is the root mean square of the vertex's edges at rest, n is the number of
    /// iterations that the vertices with the shortest edges need, without the shortest tenth of them, and longer
    /// edges get a smaller factor.
    ///
    /// Limits: the shortest tenth reaches less far, and so do all vertices if n would exceed
    /// DeltaMushStage::kMaxIterations. Where a vertex has edges of different lengths, the smoothing reaches
    /// farther along the longer ones. Parts narrower than the radius, such as fingers, are smoothed as a whole.
    float radius = 0.0f;
    /// 0 to 1.
    float factor = 0.5f;
    SmoothType type = SmoothType::simple;
    /// Whether vertices on edges with a single face are left as they are.
    bool pin_boundary = false;
    /// [vertices] how much each vertex is smoothed, clamped to 0 to 1; empty: fully.
    std::span<const float> weights{};
};

/// The stage `delta_mush` (Mancewicz et al. 2014), as Blender's Corrective Smooth with the rest source Original
/// Coordinates: see stages/delta_mush/delta_mush.h. Takes any polygons, edges without faces, and edges of many faces.
class SINEW_EXPORT DeltaMush {
public:
    /// Throws also for sizes that exceed the limits, indices of vertices that do not exist, an edge of a face that is
    /// not among the edges, and values out of range.
    ///
    /// rest_points  [vertices] the mesh without shape keys
    DeltaMush(const MeshTopology& topology, std::span<const Vec3<float>> rest_points,
              const DeltaMushSettings& settings);

    /// Sets other rest points or settings for the same faces and edges. Takes about as long as apply(). Throws as
    /// the constructor does; the object is then unchanged.
    void bind(std::span<const Vec3<float>> rest_points, const DeltaMushSettings& settings);

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// The number of smoothing iterations, also if a radius determines it.
    [[nodiscard]] std::size_t iterations() const noexcept;

    /// Smooths the points in place and adds their details back.
    ///
    /// points  [vertices] in the space of the rest points
    /// scale   how much of the details is added back; 1: all
    ///
    /// A vertex without faces is smoothed and has no details.
    Status apply(std::span<Vec3<float>> points, float scale = 1.0f, std::size_t threads = 0) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
