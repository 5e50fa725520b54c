// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/export.h"
#include "sinew/mesh/mesh_topology.h"
#include "sinew/methods/method_info.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// Delta mush (Mancewicz et al. 2014): smooths the deformed mesh, which removes creases and bulges, and then adds
/// the details that the same smoothing removed from the rest mesh, in frames that follow the smoothed surface.
/// Equals Blender's Corrective Smooth modifier after the Armature modifier.
struct DeltaMushDefinition {
    /// In the order of SmoothType.
    static constexpr std::string_view kSmoothTypes[] = {"simple", "length_weighted"};
    static constexpr double kMaxIterations = 1000.0;

    static constexpr Parameter kParameters[] = {
        {"enabled", "Delta Mush", "Smooth what the bones make of the mesh, and keep its details", "",
         ParameterKind::boolean, 0.0, 0.0, 1.0},
        {"iterations", "Iterations", "How often the mesh is smoothed; not used with a radius", "",
         ParameterKind::integer, 5.0, 0.0, kMaxIterations},
        {"radius", "Radius",
         "How far the smoothing reaches, in units of the scene, however dense the mesh is; 0 for so many "
         "iterations",
         "length", ParameterKind::number, 0.0, 0.0, 1e6},
        {"factor", "Factor", "How far one iteration moves a vertex: 1 to the middle of its neighbours",
         "factor", ParameterKind::number, 0.5, 0.0, 1.0},
        {"smooth_type", "Smooth Type", "Whether neighbours count alike, or by the length of their edges", "",
         ParameterKind::choice, 0.0, 0.0, 1.0, kSmoothTypes},
        {"pin_boundary", "Pin Boundary", "The ends of edges with one face are not smoothed", "",
         ParameterKind::boolean, 0.0, 0.0, 1.0},
        {"weld", "Weld",
         "Vertices at one place that the same bones move count as one, as if seams were closed", "",
         ParameterKind::boolean, 1.0, 0.0, 1.0},
        {"scale", "Scale", "How much of the details comes back: 1 all, 0 none", "factor",
         ParameterKind::number, 1.0, -100.0, 100.0},
        {"group", "Vertex Group", "How much each vertex is smoothed: 0 not at all, 1 fully", "factor",
         ParameterKind::vertex_group},
        {"invert_group", "Invert", "Smooth what the vertex group leaves out", "", ParameterKind::boolean, 0.0,
         0.0, 1.0},
    };
    static constexpr StageInfo info{
        "delta_mush", "Delta Mush",
        "Smooth what crude weights crease or bulge and keep the details, as Corrective Smooth does",
        "Mancewicz, Derksen, Rijpkema, Wilson 2014; Blender's Corrective Smooth", kParameters};

    /// A vector with a smaller squared length has no direction; its unit vector is 0.
    static constexpr double kShortest = 1e-35;
    /// Edge directions that differ by at most this in every coordinate span no frame.
    static constexpr double kStraight = 10.0 * std::numeric_limits<float>::epsilon();
    static constexpr double kLeastLength = 10.0 * std::numeric_limits<float>::epsilon();

    /// One iteration of SmoothType::simple. A vertex without neighbours is not moved.
    ///
    /// factor  0 to 1
    template <class T>
    [[nodiscard]] static Vec3<T> smoothed(const Vec3<T>& point, std::span<const Vec3<T>> neighbours,
                                          T factor) noexcept {
        if (neighbours.empty()) return point;
        Vec3<T> sum(T(0));
        for (const Vec3<T>& neighbour : neighbours) sum += neighbour - point;
        return point + factor / static_cast<T>(neighbours.size()) * sum;
    }

    /// One iteration of SmoothType::length_weighted. A vertex whose neighbours all coincide with it is not moved.
    template <class T>
    [[nodiscard]] static Vec3<T> smoothed_by_length(const Vec3<T>& point, std::span<const Vec3<T>> neighbours,
                                                    T factor) noexcept {
        Vec3<T> sum(T(0));
        T lengths(0);
        for (const Vec3<T>& neighbour : neighbours) {
            const Vec3<T> edge = neighbour - point;
            const T length = glm::length(edge);
            sum += length * edge;
            lengths += length;
        }
        const T divisor = lengths * static_cast<T>(neighbours.size());
        return divisor > static_cast<T>(kLeastLength) ? point + T(2) * factor / divisor * sum : point;
    }

    /// The frame of a corner of a face, and its weight at its vertex.
    template <class T>
    struct Corner {
        Mat3<T> axes;  // orthonormal; 0 where the two edges are antiparallel
        T weight;      // the angle between the edges' directions; 0 where they are collinear
    };

    /// The frame of the corner `current`, which follows `previous` and precedes `next` in the face.
    template <class T>
    [[nodiscard]] static Corner<T> corner(const Vec3<T>& previous, const Vec3<T>& current,
                                          const Vec3<T>& next) noexcept {
        const Vec3<T> a = unit(previous - current);
        const Vec3<T> b = unit(current - next);
        const Vec3<T> apart = glm::abs(a - b);
        const T straight = static_cast<T>(kStraight);
        if (apart.x <= straight && apart.y <= straight && apart.z <= straight) return {Mat3<T>(T(1)), T(0)};
        const Vec3<T> z = unit(glm::cross(a, b));
        const Vec3<T> x = unit(a + b);
        return {Mat3<T>(x, glm::cross(z, x), z), angle(glm::dot(a, b))};
    }

    /// The angle of a cosine, by the polynomial that Blender uses. Its error is up to 7e-5; the exact function
    /// would weight corners differently from Blender.
    template <class T>
    [[nodiscard]] static T angle(T cosine) noexcept {
        const T m = std::min(std::abs(cosine), T(1));
        const T of_size =
            std::sqrt(T(1) - m) *
            (T(1.5707963267) + m * (T(-0.213300989) + m * (T(0.077980478) + m * T(-0.02164095))));
        return cosine < T(0) ? T(3.14159265358979323846) - of_size : of_size;
    }

private:
    template <class T>
    [[nodiscard]] static Vec3<T> unit(const Vec3<T>& v) noexcept {
        const T squared = glm::dot(v, v);
        return squared > static_cast<T>(kShortest) ? v / std::sqrt(squared) : Vec3<T>(T(0));
    }
};

/// Limit of DeltaMush. More is refused.
inline constexpr std::size_t kMaxMushVertices = 0x1FFFFFFF;  // 2^29 - 1

/// How neighbours are weighted. In the order of DeltaMushDefinition::kSmoothTypes.
enum class SmoothType { simple, length_weighted };

/// How the stage `delta_mush` smooths.
struct DeltaMushSettings {
    /// Number of smoothing iterations, at most DeltaMushDefinition::kMaxIterations. Not used with a radius.
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
    /// DeltaMushDefinition::kMaxIterations. Where a vertex has edges of different lengths, the smoothing reaches
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
/// Coordinates; DeltaMushDefinition defines it. Takes any polygons, edges without faces, and edges of many faces.
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
    /// Returns Status::not_finite, and changes nothing, where `scale` is not finite.
    ///
    /// A vertex without faces is smoothed and has no details.
    Status apply(std::span<Vec3<float>> points, float scale = 1.0f, std::size_t threads = 0) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
