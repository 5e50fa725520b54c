// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "sinew/deform/mesh_topology.h"
#include "sinew/export.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// What Normals takes at most; more is refused.
inline constexpr std::size_t kMaxNormalVertices = 0x1FFFFFFF;  // 2^29 - 1
inline constexpr std::size_t kMaxNormalCorners = 0x0FFFFFFF;   // 2^28 - 1, and as many faces

/// What has a normal of its own.
enum class NormalDomain { vertex, corner, face };

/// How a mesh is shaded otherwise than smoothly.
struct Sharpness {
    std::span<const std::uint8_t> edges{};  // [edges] not 0: sharp; empty: none is
    std::span<const std::uint8_t> faces{};  // [faces] not 0: flat; empty: none is
    // [corners][2] custom normals, as Blender's attribute `custom_normal` stores them; empty: none
    std::span<const std::int16_t> custom{};
};

/// Normals of a mesh that deforms, as Blender defines them: the arithmetic is that of Blender 4.2 to 5.2, so that on x86
/// results are equal to the last bit but for the order in which a fan's corners are added.
///
///   face    by Newell's method; (0, 0, 1) without area (the square of the doubled area is at most 1e-35)
///   vertex  the unit vector of the sum of the normals of its faces, each times the angle of its corner there, by the
///           polynomial that Blender has for acos; 0 where they cancel. Without faces: the direction of its point
///   corner  the same of the corners of its fan; the face's where it is a fan by itself. A fan are corners of a vertex whose
///           faces meet there at smooth edges. An edge is smooth that is neither sharp nor of a flat face, and has two
///           faces, which go along it in opposite directions. Where nothing is sharp or custom: the vertex's
///   custom  the normal n of the fan, tilted by the first number of its corners towards the plane of n and the fan's first
///           edge, then turned about n by the second; each number is the mean of the fan's, rounded to 0. 32767 tilts by the
///           mean angle between n and the fan's edges, -32767 by the rest of a turn, backwards; 32767 turns by the angle
///           from the fan's first edge to its last, which is a whole turn in a fan all around. Edges are numbered from a
///           corner's following edge to its preceding one, from the sharp edge on, or from the fan's first corner. 0 where
///           the first or last edge is within 0.8 degrees of n or -n (their cosine is at least 0.9999)
///
/// Any polygons, also with less than three corners; vertices that a face names twice have both of its corners. Points
/// that are not finite, and faces beyond the range of floats, give finite normals, which may be 0.
///
/// Once constructed it is valid, and computing can not fail and allocates nothing. Calls of one object wait for each other.
/// One that was moved from can only be assigned to or destroyed.
class SINEW_EXPORT Normals {
public:
    /// Throws std::invalid_argument that names the field, what was wanted and what came: sizes that do not fit or are
    /// beyond the limits, vertices that there are not. Edges are read where something is sharp or custom, and must then have every
    /// edge of each face. Nothing is kept by reference.
    Normals(const MeshTopology& topology, std::size_t vertex_count, const Sharpness& sharpness = {});

    Normals(Normals&&) noexcept;
    Normals& operator=(Normals&&) noexcept;
    ~Normals();

    /// The least that says how the mesh is shaded, as Blender's Mesh.normals_domain: `face` where every face is flat or
    /// every edge sharp, else `corner` where something is sharp, else `vertex`. With custom normals always `corner`.
    [[nodiscard]] NormalDomain domain() const noexcept;

    /// How many normals there are: the vertices, corners or faces of the mesh.
    [[nodiscard]] std::size_t count(NormalDomain domain) const noexcept;

    /// Unit vectors, some of them 0 as said above; custom normals of fans whose edges have no length may be shorter.
    ///
    /// domain   of the result: any, whatever domain() is
    /// points   [vertices]
    /// normals  [count(domain)] not the points; where this or `points` has another size nothing is written
    /// threads  0: as many as help
    ///
    /// The result does not depend on the number of threads, nor on the instruction set.
    void compute(NormalDomain domain, std::span<const Vec3<float>> points, std::span<Vec3<float>> normals,
                 std::size_t threads = 0) const noexcept;

    /// What it was made of. Spans are valid until the end of this.
    struct Parts {
        MeshTopology topology;
        std::size_t vertex_count;
        Sharpness sharpness;
    };
    [[nodiscard]] Parts parts() const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
