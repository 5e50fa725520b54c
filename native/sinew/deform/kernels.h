// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sinew/deform/packed_mesh.h"
#include "sinew/deform/palette.h"
#include "sinew/skinning/methods.h"

namespace sinew {

/// What every block of one frame reads.
struct Frame {
    MethodId method;
    const PackedMesh* mesh;
    const Palette* palette;
    const Quad* bones_from_model;  // displacements of points to the space of the bones and back;
    const Quad* model_from_bones;  // null: the same space
    Vec3<float>* points;
};

/// Writes the rows of the bones `used` to `palette.bones`, and their sizes. Under the rigid methods as if each were
/// rigid; the indices of those that are not are added to `palette.scaled`.
void prepare_bones(MethodId method, std::span<const std::int32_t> used,
                   std::span<const Affine<float>> posed_from_rest, Palette& palette) noexcept;

/// Deforms the blocks [begin, end) on the instruction set in use. What a method means is in skinning/;
/// the kernels agree with it.
///
/// A vertex's result depends on its own rest point and influences and on the pose alone: not on its lane,
/// its block or on other vertices. On other instruction sets it may differ by rounding, as only some of
/// them multiply and add in one step.
void deform_blocks(const Frame& frame, std::size_t begin, std::size_t end) noexcept;

}  // namespace sinew
