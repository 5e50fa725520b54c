// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

/// A vertex's bones are added up in one of two ways, which differ by rounding alone.
///
/// Mostly as the first, unweighted, and by weight what each other differs from it: fewer operations. All is then
/// rounded as the first is, whatever its weight. So where the first is of more than kAlike times the size of another,
/// such as one that is far away, each is added by its weight: plainly. Which it is depends on the bones alone.
inline constexpr float kAlike = 4.0f;

/// Bones smaller than this are alike: what they cost is far below any mesh's rounding.
inline constexpr float kLeastSize = 1e-5f;

/// A bone under lbs whose columns differ from the identity's by this square may make vectors much longer: a rotation
/// differs by 8 at most.
inline constexpr float kLong = 64.0f;

/// Sizes are written by this many: behind the last bone there is room for one less.
inline constexpr std::size_t kSizesAtOnce = 8;

/// The bones of one frame as a kernel reads them, indexed as PackedMesh::bones. Its memory is a PaletteStore's.
struct Palette {
    Quad* bones = nullptr;
    float* sizes = nullptr;  // squares, of the translation, from that of kLeastSize on; infinite: kLong
    Quad* scales = nullptr;  // kDisplacementQuads a bone, where it has scale
    std::uint8_t* has_scale = nullptr;  // not written where no bone has
    std::int32_t* scaled = nullptr;     // indices of bones to be seen to one by one
    std::size_t scaled_count = 0;
    bool any_scale = false;
};

/// Fills `palette` for the bones `used`. A bone that `posed_from_rest` lacks stays at rest.
///
/// stretched         indices into `used` of those whose rest bones are not of unit length
/// rest_bones        one for each of `used`; or empty: all identity
/// bones_from_model  lbs: the result is in model space for points in model space; the other methods blend
///                   where they stand, and the caller takes the points there and back
void prepare(MethodId method, std::span<const std::int32_t> used, std::span<const std::int32_t> stretched,
             std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
             const Affine<float>& bones_from_model, Palette& palette) noexcept;

[[nodiscard]] std::array<Quad, kDisplacementQuads> displacement_quads(const Affine<double>& a) noexcept;

[[nodiscard]] bool is_identity(const Affine<float>& a) noexcept;

}  // namespace sinew
