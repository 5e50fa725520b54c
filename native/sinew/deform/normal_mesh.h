// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sinew/deform/normals.h"
#include "sinew/deform/packed_mesh.h"
#include "sinew/deform/palette.h"

namespace sinew {

/// Up to kLanes faces of as many corners, or one face of more than kMaxBlockCorners.
///
/// A face has a slot for each four of its corners: two Float4, its normal and their angles, so that they are read
/// together. Slot s of the face in lane l of a block is number first_slot + s * lanes + l.
struct FaceBlock {
    static constexpr std::uint32_t kNoLoneFans = std::numeric_limits<std::uint32_t>::max();

    std::size_t first_vertex;  // of NormalMesh::corner_vertices: [corners][lanes]
    std::uint32_t first_slot;
    std::uint32_t corners;
    std::uint8_t lanes;                      // kLanes or 1; those without a face repeat the last
    bool reads_last_point;                   // behind which nothing may be read
    std::uint32_t first_lone = kNoLoneFans;  // of NormalMesh::lone_fans: one for each of the corners
};

/// Corners whose normals are added up: of group g, sources [offsets[g], offsets[g + 1]), in the order of the corners.
struct CornerGroups {
    std::vector<std::uint32_t> offsets{0};
    // The corner's angle, as an index into the numbers of all slots, which are eight each.
    std::vector<std::uint32_t> sources;

    [[nodiscard]] std::size_t size() const noexcept { return offsets.size() - 1; }
};

/// One corner of each face of a block, where most of the block's corners are fans by themselves: their custom normals are
/// computed along with the faces, whose edges these fans have. As of FanBlock; 0 for those of other fans.
struct LoneFans {
    Lanes<float> tilt;
    Lanes<float> turn;
};

/// Up to kLanes fans of as many edges. Lanes without a fan repeat the last.
struct FanBlock {
    std::size_t
        first_vertex;  // of NormalMesh::fan_vertices: [2 + edges][kLanes] the fan's, then the end of its last
                       // edge, then those of all edges, each once; from the first on in the order of a walk
    std::uint32_t edges;
    bool reads_last_point;        // behind which nothing may be read
    Lanes<std::int32_t> normals;  // as NormalMesh::corner_sources, of what they are turned from
    Lanes<float>
        tilt;  // from that normal, as a part of the mean angle of edges, or of what is left of a turn
    Lanes<float>
        turn;  // about it, from the first edge on, as a part of the angle to the last, or of the rest
};

/// A mesh as its normals are computed.
struct NormalMesh {
    static constexpr std::size_t kMaxBlockCorners = 32;

    std::vector<FaceBlock> blocks;
    std::vector<std::int32_t> corner_vertices;
    std::vector<std::int32_t> face_sources;  // [faces] as corner_sources
    std::size_t slot_count = 0;

    CornerGroups vertices;
    CornerGroups fans;  // of at least two corners; only of the domain `corner`
    std::vector<LoneFans> lone_fans;
    std::vector<FanBlock> fan_blocks;  // of all other fans; none without custom normals
    std::vector<std::int32_t> fan_vertices;

    // [corners] where the normal of each is: among the Float4 of all slots, then of fans, then of lanes of lone fans and of
    // fan blocks. Empty in the domain `vertex`: corners have the normals of their vertices, which are in the place of the
    // fans'.
    std::vector<std::int32_t> corner_sources;

    /// Float4 of all these, with room for kLanes behind each kind.
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

/// topology  checked
/// domain    of the mesh: Normals::domain()
[[nodiscard]] NormalMesh make_normal_mesh(const MeshTopology& topology, std::size_t vertex_count,
                                          const Sharpness& sharpness, NormalDomain domain);

/// What the kernels of one call read and write. Pointers to normals point into one array, see NormalMesh::corner_sources.
struct NormalFrame {
    const NormalMesh* mesh;
    const Vec3<float>* points;
    Float4* slots;               // [slots][2]
    const CornerGroups* groups;  // to be added up
    Float4* group_normals;       // [groups], and room for kLanes
    Float4* lone_normals;        // [lone fans][kLanes], written along with angles; null for none
    Float4* block_normals;       // [fan blocks][kLanes]
    Vec3<float>* normals;        // [groups] the caller's
};

/// Functions compiled once for each instruction set, with the same results on all.
struct NormalKernel {
    /// The normals of the faces of blocks [begin, end).
    void (*faces)(const NormalFrame& frame, std::size_t begin, std::size_t end);
    /// And the angles, and the custom normals of lone fans.
    void (*corners)(const NormalFrame& frame, std::size_t begin, std::size_t end);
    /// Groups [begin, end), to `normals`.
    void (*sum)(const NormalFrame& frame, std::size_t begin, std::size_t end);
    /// The same, to `group_normals`; `begin` is a multiple of kLanes.
    void (*sum_groups)(const NormalFrame& frame, std::size_t begin, std::size_t end);
    /// Custom normals of fan blocks [begin, end), to `block_normals`.
    void (*customise)(const NormalFrame& frame, std::size_t begin, std::size_t end);
};

/// For the instruction set in use.
[[nodiscard]] NormalKernel normal_kernel() noexcept;

}  // namespace sinew
