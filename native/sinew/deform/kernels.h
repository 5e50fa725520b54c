// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sinew/deform/packed_mesh.h"
#include "sinew/deform/palette.h"

namespace sinew {

struct BoneMoments;

/// What every block of one frame reads.
struct Frame {
    const PackedMesh* mesh;
    const Lanes<float>* rows;         // of the mesh, or with other rest points
    const Lanes<float>* vertex_rows;  // [blocks][MethodInfo::vertex_floats]; null: the method has none
    const BoneMoments* moments;       // null: the method has none
    const std::int32_t* bones;        // as PackedMesh::bones, or BoneSets::entries
    const Palette* palette;
    const Float4* bones_from_model;  // displacements of points to the space of the bones and back;
    const Float4* model_from_bones;  // null: the same space
    const double* parameters;        // [MethodInfo::parameters] valid_value() of each
    Vec3<float>* points;
};

/// The functions of a kernel that are compiled once for each instruction set.
struct TargetKernel {
    /// Deforms the blocks [begin, end). The meaning of each method is in skinning/; its kernel agrees with it.
    ///
    /// A vertex's result depends on its own rest point and influences and on the pose alone, not on its lane, its block or
    /// other vertices; of a method that keeps moments, but for rounding. On other instruction sets it may differ by
    /// rounding, as only some of them multiply and add in one step.
    void (*deform)(const Frame& frame, std::size_t begin, std::size_t end);

    /// Writes the rows of the bones `used` to `palette.bones`, and their sizes. Under a rigid method as if each
    /// were rigid; the indices of those that are not are added to `palette.scaled`.
    void (*prepare)(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                    Palette& palette);
};

/// Instruction sets, see targets.h.
inline constexpr std::size_t kTargetCount = 4;

/// How the library deforms whole meshes by one method. The file of this name in kernels/ defines it.
struct Kernel {
    /// A bone that does not move, in Palette::bones: its size is that of each bone there.
    std::span<const Float4> rest_row;

    /// Whether rotations are blended: the scale of bones is then kept apart, and points are taken to the space of
    /// the bones and back. A method that is not rigid has that space in its bones.
    bool is_rigid;

    /// Bytes of a prepared bone, where the palette has a row for each bone of each set of bones (BoneSets); 0 where
    /// it has one for each bone.
    std::size_t set_bone_size;

    /// Fills `palette` for `bones`, all of which are posed unless rows are those of sets.
    void (*prepare)(const Kernel& kernel, const Bones& bones, Palette& palette);

    std::array<TargetKernel, kTargetCount> targets;

    /// The functions for the instruction set in use.
    [[nodiscard]] const TargetKernel& target() const noexcept;
};

/// The index in Kernel::targets of the instruction set in use.
[[nodiscard]] std::size_t target_in_use() noexcept;

inline const TargetKernel& Kernel::target() const noexcept { return targets[target_in_use()]; }

/// Fills Palette::may_be_plain from the sizes: once in a frame for each pair of bones, so that few vertices are tested
/// one by one.
void find_plain(const BonePairs& pairs, std::size_t bones, Palette& palette) noexcept;

/// Fills `palette` for `bones`. A bone that the pose lacks stays at rest.
void prepare(const Kernel& kernel, const Bones& bones, Palette& palette) noexcept;

}  // namespace sinew
