// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sinew/base/targets.h"
#include "sinew/lanes/palette.h"
#include "sinew/mesh/packed_mesh.h"

namespace sinew {

struct BoneMoments;

/// The input and output of one frame, common to all blocks.
struct Frame {
    const PackedMesh* mesh;
    const Lanes<float>* rest_points;  // mesh->rest_points, or others
    const Lanes<float>* vertex_rows;  // [blocks][MethodInfo::vertex_floats]; null if the method has none
    const BoneMoments* moments;       // null if the method has none
    const std::int32_t* bones;        // PackedMesh::bones, or BoneSets::entries
    const Palette* palette;
    const Float4* bones_from_model;  // displacement rows that map points to the space of the bones, and
    const Float4* model_from_bones;  // back to model space; null if the spaces are the same
    const double* parameters;        // [MethodInfo::parameters] valid_value() of each
    Vec3<float>* points;
};

/// The functions of a kernel for one instruction set.
struct TargetKernel {
    /// Deforms the blocks [begin, end). The kernel agrees with the method's definition.
    ///
    /// A vertex's result depends only on its own rest point and influences and on the pose, not on its lane, its
    /// block or other vertices (for a method that keeps moments, up to rounding). Instruction sets may differ by
    /// rounding, since only some of them have a fused multiply-add.
    void (*deform)(const Frame& frame, std::size_t begin, std::size_t end);

    /// Writes the rows of the bones `used` to palette.bones, and their sizes to palette.sizes. A rigid method
    /// treats every bone as rigid, and adds the indices of those that are not to palette.scaled.
    void (*prepare)(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                    Palette& palette);
};

/// How the library deforms whole meshes with one method. Defined in methods/NAME/NAME.cpp.
struct Kernel {
    /// The rows in Palette::bones of a bone that does not move. Every bone there has as many.
    std::span<const Float4> rest_row;

    /// Whether the method blends rotations. Then the scale of bones is stored apart, and points are mapped to the
    /// space of the bones and back. Otherwise that space is part of the bones' matrices.
    bool is_rigid;

    /// Bytes of a prepared bone, if the palette has a row for each bone of each set of bones (BoneSets); 0 if it
    /// has one for each bone.
    std::size_t set_bone_size;

    /// Fills `palette`. Every one of bones.used is posed, unless the palette has rows for sets.
    void (*prepare)(const Kernel& kernel, const Bones& bones, Palette& palette);

    std::array<TargetKernel, kTargetCount> targets;

    /// The functions for the instruction set in use.
    [[nodiscard]] const TargetKernel& target() const noexcept;
};

inline const TargetKernel& Kernel::target() const noexcept { return targets[target_in_use()]; }

/// Fills Palette::may_be_plain from the sizes, once per frame for each pair of bones, so that the test runs for
/// few vertices.
void find_plain(const BonePairs& pairs, std::size_t bones, Palette& palette) noexcept;

/// Fills `palette`. Bones that the pose lacks stay at rest.
void prepare(const Kernel& kernel, const Bones& bones, Palette& palette) noexcept;

}  // namespace sinew
