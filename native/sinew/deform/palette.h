// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "sinew/deform/packed_mesh.h"
#include "sinew/transform/affine.h"

namespace sinew {

struct alignas(16) Float4 {
    std::array<float, 4> value;
};

/// The rows x, y, z of an affine transform without the identity: what it adds to a point.
inline constexpr std::size_t kDisplacementRows = 3;

/// A vertex's bones are added up in one of two ways, which differ by rounding alone.
///
/// Mostly the first is added whole, and by weight the difference of each other from it: fewer operations. All is then
/// rounded as the first is, whatever its weight. So where the first has more than kAlike times the size of another,
/// as a bone that is far away, each is added by its weight: plainly. Which way is taken depends on the bones alone.
inline constexpr float kAlike = 4.0f;

/// Bones smaller than this are alike: their rounding is far below any mesh's.
inline constexpr float kMinSize = 1e-5f;

/// A linear bone whose columns differ from the identity's by this square may make vectors much longer: a rotation
/// differs by 8 at most.
inline constexpr float kLong = 64.0f;

/// Sizes are written by this many: behind the last bone there is room for one less.
inline constexpr std::size_t kSizesAtOnce = 8;

/// The bones of one frame as a kernel reads them, indexed as Frame::bones. Its memory is a PaletteStore's.
struct Palette {
    Float4* bones = nullptr;  // Kernel::rest_row.size() a bone
    float* sizes = nullptr;   // squares, of the translation, from that of kMinSize on; infinite: kLong
    // Whether some vertex of which this bone is the first may be added plainly.
    std::uint8_t* may_be_plain = nullptr;
    Float4* scales = nullptr;           // kDisplacementRows a bone, where it has scale
    std::uint8_t* has_scale = nullptr;  // not written where no bone has
    std::int32_t* scaled = nullptr;     // indices of bones to be prepared one by one
    std::byte* set_bones = nullptr;     // Kernel::set_bone_size a bone
    std::size_t scaled_count = 0;
    bool any_scale = false;
};

struct BoneSets;

/// The bones of a mesh in one pose.
struct Bones {
    std::span<const std::int32_t> used;       // as the pose numbers them
    std::span<const std::int32_t> stretched;  // indices into `used`: their rest bones are not of unit length
    std::span<const Affine<float>> posed_from_rest;
    std::span<const Affine<float>> rest_bones;  // one for each of `used`; or empty: all identity
    Affine<float> bones_from_model;
    const BoneSets* sets;  // null unless the kernel wants them
};

template <class T>
[[nodiscard]] Float4 float4(T a, T b, T c, T d) noexcept {
    return {{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), static_cast<float>(d)}};
}

[[nodiscard]] inline Float4 float4(const Quat<double>& q) noexcept { return float4(q.w, q.x, q.y, q.z); }

/// The kDisplacementRows of a transform whose linear part less the identity is `m`.
void write_displacement(const Mat3<double>& m, const Vec3<double>& translation, Float4* rows) noexcept;
void write_displacement(const Affine<double>& a, Float4* rows) noexcept;

/// Palette::sizes of a bone with this translation.
[[nodiscard]] float size_of(const Vec3<double>& translation, double length_squared = 0.0) noexcept;

/// Whether bones are added plainly of which the first and the smallest have these of Palette::sizes.
[[nodiscard]] inline bool is_plain(float first, float least) noexcept {
    return !(first < kAlike * kAlike * least);
}

[[nodiscard]] bool is_identity(const Affine<float>& a) noexcept;

}  // namespace sinew
