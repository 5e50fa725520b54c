// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sinew/base/targets.h"
#include "sinew/mesh/packed_mesh.h"
#include "sinew/normals.h"
#include "sinew/pose/palette.h"

namespace sinew {

/// Up to kLanes faces with the same number of corners, or one face with more than kMaxBlockCorners corners.
///
/// A face has a slot for every four of its corners. A slot is two Float4, the face's normal and the corners'
/// angles, so that both are read together. Slot s of the face in lane l of a block has the number first_slot + s
/// * lanes + l.
struct FaceBlock {
    static constexpr std::uint32_t kNoLoneFans = std::numeric_limits<std::uint32_t>::max();

    std::size_t first_vertex;  // into NormalMesh::corner_vertices: [corners][lanes]
    std::uint32_t first_slot;
    std::uint32_t corners;
    std::uint8_t lanes;                      // kLanes or 1; lanes without a face repeat the last one
    bool reads_last_point;                   // if so, nothing may be read behind it
    std::uint32_t first_lone = kNoLoneFans;  // into NormalMesh::lone_fans: one for each of the corners
};

/// Groups of corners whose normals are summed: group g has sources [offsets[g], offsets[g + 1]), in the order of
/// corners.
struct CornerGroups {
    std::vector<std::uint32_t> offsets{0};
    // The position of the corner's angle among the floats of all slots, of which each slot has eight.
    std::vector<std::uint32_t> sources;

    [[nodiscard]] std::size_t size() const noexcept { return offsets.size() - 1; }
};

/// One corner of each face of a block in which most corners are fans by themselves. Their custom normals are
/// computed along with the face normals, since the edges of these fans are edges of the faces. Members as in
/// FanBlock; 0 for corners that belong to other fans.
struct LoneFans {
    Lanes<float> tilt;
    Lanes<float> spin;
};

/// Up to kLanes fans with the same number of edges. Lanes without a fan repeat the last one.
struct FanBlock {
    // into NormalMesh::fan_vertices: [2 + edges][kLanes] the fan's vertex, the end of its last edge, then the
    // ends of all edges, each once, in the order in which the edges follow each other around the vertex
    std::size_t first_vertex;
    std::uint32_t edges;
    bool reads_last_point;        // if so, nothing may be read behind it
    Lanes<std::int32_t> normals;  // the normals that are tilted and rotated, as NormalMesh::corner_sources
    // the angle by which the normal is tilted, relative to the mean angle of the edges, or to 360 degrees minus
    // that
    Lanes<float> tilt;
    // the angle of the rotation about that normal from the first edge on, relative to the angle to the last edge,
    // or to 360 degrees minus that
    Lanes<float> spin;
};

/// A mesh in the form that the normal kernels read.
struct NormalMesh {
    static constexpr std::size_t kMaxBlockCorners = 32;

    std::vector<FaceBlock> blocks;
    std::vector<std::int32_t> corner_vertices;
    std::vector<std::int32_t> face_sources;  // [faces] as corner_sources
    std::size_t slot_count = 0;

    CornerGroups vertices;
    CornerGroups fans;  // of at least two corners; only for the domain `corner`
    std::vector<LoneFans> lone_fans;
    std::vector<FanBlock> fan_blocks;  // all other fans; empty without custom normals
    std::vector<std::int32_t> fan_vertices;

    // [corners] the index of each corner's normal in one array: the Float4 of all slots, then fans, then the
    // lanes of lone fans, then the lanes of fan blocks. Empty for the domain `vertex`, where corners have the
    // normals of their vertices and the vertices' normals take the position of the fans'.
    std::vector<std::int32_t> corner_sources;

    /// The size of that array in Float4, with room for kLanes more after each kind.
    [[nodiscard]] std::size_t normal_count() const noexcept {
        return first_of_blocks() + kLanes * fan_blocks.size();
    }
    [[nodiscard]] std::size_t first_of_groups() const noexcept { return 2 * slot_count; }
    [[nodiscard]] std::size_t first_of_lone_fans() const noexcept {
        return first_of_groups() + (corner_sources.empty() ? vertices : fans).size() + kLanes;
    }
    [[nodiscard]] std::size_t first_of_blocks() const noexcept {
        return first_of_lone_fans() + kLanes * lone_fans.size();
    }
};

/// Builds the mesh.
///
/// topology  checked
/// domain    of the mesh: Normals::domain()
[[nodiscard]] NormalMesh make_normal_mesh(const MeshTopology& topology, std::size_t vertex_count,
                                          const Sharpness& sharpness, NormalDomain domain);

/// The arguments of one call of the kernels. Pointers to normals point into one array, see
/// NormalMesh::corner_sources.
struct NormalFrame {
    const NormalMesh* mesh;
    const Vec3<float>* points;
    Float4* slots;               // [slots][2]
    const CornerGroups* groups;  // to be summed
    Float4* group_normals;       // [groups], with room for kLanes more
    Float4* lone_normals;        // [lone fans][kLanes], written along with angles; null if there are none
    Float4* block_normals;       // [fan blocks][kLanes]
    Vec3<float>* normals;        // [groups] the caller's
};

/// Functions compiled once for each instruction set. All instruction sets give the same results.
struct NormalKernel {
    using OfRange = OfTargets<void(const NormalFrame& frame, std::size_t begin, std::size_t end)>;

    /// The normals of the faces of blocks [begin, end).
    OfRange faces;
    /// The normals of these faces, their corners' angles, and the custom normals of lone fans.
    OfRange corners;
    /// Sums groups [begin, end), to `normals`.
    OfRange sum;
    /// Sums groups [begin, end), to `group_normals`; `begin` is a multiple of kLanes.
    OfRange sum_groups;
    /// Custom normals for fan blocks [begin, end), to `block_normals`.
    OfRange customise;
};
extern const NormalKernel kNormalKernel;

}  // namespace sinew
