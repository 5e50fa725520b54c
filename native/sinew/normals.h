// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/export.h"
#include "sinew/mesh/mesh_topology.h"
#include "sinew/transform/quat.h"

namespace sinew {

/// Limits of Normals. More is refused.
inline constexpr std::size_t kMaxNormalVertices = 0x1FFFFFFF;  // 2^29 - 1
inline constexpr std::size_t kMaxNormalCorners = 0x0FFFFFFF;   // 2^28 - 1; faces have the same limit

/// What each normal belongs to.
enum class NormalDomain { vertex, corner, face };

/// Which edges and faces are shaded flat, and which corners have custom normals.
struct Sharpness {
    std::span<const std::uint8_t> edges{};  // [edges] not 0: sharp; empty: none are
    std::span<const std::uint8_t> faces{};  // [faces] not 0: flat; empty: none are
    // [corners][2] custom normals as in Blender's attribute `custom_normal`; empty: none
    std::span<const std::int16_t> custom{};
};

/// Normals of a mesh that deforms, as Blender defines them. The arithmetic is that of Blender 4.2 to 5.2; on x86,
/// results equal Blender's to the last bit, except for the order in which a fan's corners are summed.
///
///   face    by Newell's method; (0, 0, 1) for a face without area (squared doubled area at most 1e-35)
///   vertex  the sum of the normals of its faces, each times the angle of the face's corner at the vertex (by
///           Blender's polynomial for acos), normalised; 0 where they cancel. Without faces: the direction of its
///           point
///   corner  the same sum over the corners of its fan; the face's normal if it is a fan by itself. A fan is a set
///           of corners of a vertex whose faces meet there at smooth edges. An edge is smooth if it is not sharp,
///           is not an edge of a flat face, and has exactly two faces that traverse it in opposite directions. If
///           nothing is sharp or custom, the vertex's normal
///   custom  the normal n of the fan, tilted towards its first edge, in the plane of n and that edge, by the
///           first number of its corners, then rotated about n by the second. Each number is the mean over the
///           fan, rounded towards 0. 32767 tilts by the mean angle between n and the fan's edges, -32767 by 360
///           degrees minus that, backwards. 32767 rotates by the angle from the fan's first edge to its last,
///           which is 360 degrees for a fan all around a vertex. Edges are numbered from a corner's following edge
///           to its preceding one, starting at the sharp edge, or at the fan's first corner. 0 where the first or
///           last edge is within 0.8 degrees of n or -n (absolute cosine at least 0.9999)
///
/// Any polygons, also with less than three corners. A vertex that a face names twice has both of the corners.
/// Points that are not finite, and faces beyond the range of floats, give finite normals, which may be 0.
class SINEW_EXPORT Normals {
public:
    /// Throws also for sizes that exceed the limits, and indices of vertices that do not exist. If something is sharp
    /// or custom, `topology.edges` is read and must contain every edge of each face.
    Normals(const MeshTopology& topology, std::size_t vertex_count, const Sharpness& sharpness = {});

    /// The simplest domain that describes the mesh's shading, as Blender's Mesh.normals_domain: `face` if every
    /// face is flat or every edge sharp, else `corner` if anything is sharp, else `vertex`. With custom normals
    /// always `corner`.
    [[nodiscard]] NormalDomain domain() const noexcept;

    /// The number of normals in a domain: that of the mesh's vertices, corners or faces.
    [[nodiscard]] std::size_t count(NormalDomain domain) const noexcept;

    /// Writes unit vectors. Some may be 0, see above; custom normals of fans whose edges have length 0 may be
    /// shorter.
    ///
    /// domain   of the result; any, independently of domain()
    /// points   [vertices]
    /// normals  [count(domain)] must not overlap `points`
    ///
    /// The result does not depend on the instruction set.
    Status compute(NormalDomain domain, std::span<const Vec3<float>> points, std::span<Vec3<float>> normals,
                   std::size_t threads = 0) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
