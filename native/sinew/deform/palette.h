// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/skinning/methods.h"
#include "sinew/transform/affine.h"

namespace sinew {

struct alignas(16) Quad {
    std::array<float, 4> value;
};

/// The rows x, y, z of an affine transform without the identity: what it adds to a point.
inline constexpr std::size_t kDisplacementQuads = 3;

inline constexpr std::size_t kLbsQuads = 4;

/// Quads of a bone in Palette::bones:
/// lbs  the columns x, y, z and shift of the displacement from rest to pose, each filled up with 0
/// dq   (w, x, y, z) of the real and of the dual part
/// qv   (w, x, y, z) of the rotation, then (x, y, z, 0) of the translation
[[nodiscard]] constexpr std::size_t bone_quads(MethodId method) noexcept {
    return method == MethodId::lbs ? kLbsQuads : 2;
}

/// The bones of one frame as a kernel reads them, indexed as in the mesh.
struct Palette {
    std::vector<Quad> bones;
    std::vector<Quad> scales;             // kDisplacementQuads a bone, where it has scale
    std::vector<std::uint8_t> has_scale;  // empty: no bone has
    std::vector<std::int32_t> scaled;     // bones to be looked at one by one
};

/// Fills `palette` for the bones `used`; it only allocates where it was never as large.
///
/// stretched         those of `used` whose rest bones are not of unit length
/// bones_from_model  lbs: the result is in model space for points in model space; the other methods blend
///                   where they stand, and the caller takes the points there and back
void prepare(MethodId method, std::span<const std::int32_t> used, std::span<const std::int32_t> stretched,
             std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
             const Affine<float>& bones_from_model, Palette& palette);

[[nodiscard]] std::array<Quad, kDisplacementQuads> displacement_quads(const Affine<double>& a) noexcept;

[[nodiscard]] bool is_identity(const Affine<float>& a) noexcept;

}  // namespace sinew
