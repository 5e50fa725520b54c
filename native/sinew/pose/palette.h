// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "sinew/mesh/packed_mesh.h"
#include "sinew/pose/pose.h"
#include "sinew/transform/scaled_rigid.h"

namespace sinew {

struct alignas(16) Float4 {
    std::array<float, 4> value;
};

/// Number of rows of a displacement: the rows x, y, z of an affine transform minus the identity. It maps a point
/// to what the transform adds to it.
inline constexpr std::size_t kDisplacementRows = 3;

/// A vertex's bones are summed as base + the sum of weight (bone - base).
///
/// Usually the base is the first bone, which then takes no weight: the fewest operations. The rounding error is that of
/// the first bone, whatever its weight. If the first bone is more than kMaxSizeRatio times as large as another, such
/// as a bone that is far away, the base is 0 instead, and the first bone is one of the others: an absolute sum. Both
/// differ only by rounding. The choice depends only on the bones.
inline constexpr float kMaxSizeRatio = 4.0f;

/// Bones smaller than this count as equally large: their rounding errors are far below any mesh's precision.
inline constexpr float kMinSize = 1e-5f;

/// A linear bone whose columns differ from the identity's by more than this, squared, may stretch vectors so much that
/// its size counts as infinite; for a rotation the squared difference is at most 8.
inline constexpr float kMaxStretchSquared = 64.0f;

/// Sizes are written in groups of this many; there is room for one less after the last bone.
inline constexpr std::size_t kSizesAtOnce = 8;

/// What a kernel keeps in a palette.
struct RowLayout {
    std::size_t float4s;       // in a row
    bool are_of_sets = false;  // one for each bone of each set of bones, instead of one for each bone
    bool have_scales = true;   // apart from them
};

/// A bone's motion in double.
using RigidBone = ScaledRigid<QuatVec<double>, double>;

/// The bones of one frame in the form that a kernel reads, indexed as Frame::bones. A PaletteStore owns the
/// memory.
struct Palette {
    Float4* bones = nullptr;  // RowLayout::float4s for each row
    // squared lengths of the translations, at least kMinSize squared; infinite beyond kMaxStretchSquared
    float* sizes = nullptr;
    // Whether a vertex whose first bone is this one may need an absolute sum.
    std::uint8_t* may_need_absolute_sum = nullptr;
    Float4* scales = nullptr;           // kDisplacementRows for each row, valid where its bone has scale
    std::uint8_t* has_scale = nullptr;  // not written if no bone has scale
    std::int32_t* scaled = nullptr;     // scratch: indices of bones that are prepared one by one
    RigidBone* rigid_bones = nullptr;   // scratch: each bone, for rows of sets
    bool any_scale = false;
    bool keeps_signs = false;  // whether rows are added with the signs that they have
};

/// The bones of a mesh in one pose.
struct Bones {
    std::span<const std::int32_t> used;  // their numbers in the pose, ascending
    std::size_t posed;                   // how many of `used` the pose has; the others stay at rest
    // indices into `used` of those whose rest axes do not have unit length
    std::span<const std::int32_t> stretched;
    std::span<const Affine<float>> rest_bones;  // one for each of `used`; empty: all identity
    const BonePairs* pairs;
    const BoneSets* sets;  // empty unless a kernel has rows of sets
    Pose pose;

    /// Of an index into `used`, below `posed`.
    [[nodiscard]] const Affine<float>& motion(std::size_t bone) const noexcept {
        return pose.posed_from_rest[static_cast<std::size_t>(used[bone])];
    }

    /// Orthonormal, for an index into `used`.
    [[nodiscard]] Affine<double> rest_bone(std::size_t bone) const noexcept {
        return rest_bones.empty() ? Affine<double>{} : cast<double>(rest_bones[bone]);
    }
};

template <class T>
[[nodiscard]] Float4 float4(T a, T b, T c, T d) noexcept {
    return {{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), static_cast<float>(d)}};
}

[[nodiscard]] inline Float4 float4(const Quat<double>& q) noexcept { return float4(q.w, q.x, q.y, q.z); }

/// Writes the kDisplacementRows of a transform whose linear part minus the identity is `m`.
void write_displacement(const Mat3<double>& m, const Vec3<double>& translation, Float4* rows) noexcept;
void write_displacement(const Affine<double>& a, Float4* rows) noexcept;
/// Writes the Palette::scales of a bone: the displacement by `scale`, rotated.
void write_rotated_scale(const Quat<double>& rotation, const Affine<double>& scale, Float4* rows) noexcept;

/// The Palette::sizes of a bone with this translation and this squared difference of its linear part from the
/// identity.
[[nodiscard]] float size_of(const Vec3<double>& translation, double length_squared = 0.0) noexcept;

/// Whether the sum of these bones of a vertex is absolute.
[[nodiscard]] inline bool needs_absolute_sum(const Palette& palette, const std::int32_t* bones,
                                             std::size_t count) noexcept {
    const float first = palette.sizes[bones[0]];
    float least = first;
    for (std::size_t k = 1; k < count; ++k) least = std::min(least, palette.sizes[bones[k]]);
    return !(first < kMaxSizeRatio * kMaxSizeRatio * least);
}

/// Whether a bone with this rotation, by its index into Bones::used, has the other sign than Pose::rotations.
[[nodiscard]] bool is_away(const Bones& bones, std::size_t bone, const Quat<double>& rotation) noexcept;

/// Gives rows the signs of Pose::rotations.
///
/// row_float4s, signed_float4s  in a row: how many there are, and how many change sign with the rotation
void take_signs(const Bones& bones, std::size_t row_float4s, std::size_t signed_float4s,
                const Palette& palette) noexcept;

[[nodiscard]] bool is_identity(const Affine<float>& a) noexcept;

/// Displacement rows that change points from model space to the space of the bones, and back. Null if both are the
/// same space.
struct Spaces {
    const float* bones_from_model = nullptr;
    const float* model_from_bones = nullptr;
};

/// Owns the rows that Spaces points to.
class SpaceRows {
public:
    /// bones_from_model  invertible
    explicit SpaceRows(const Affine<float>& bones_from_model) noexcept
        : are_same_(is_identity(bones_from_model)) {
        if (are_same_) return;
        const auto transform = cast<double>(bones_from_model);
        write_displacement(transform, bones_from_model_.data());
        write_displacement(inverse(transform), model_from_bones_.data());
    }

    [[nodiscard]] Spaces spaces() const noexcept {
        if (are_same_) return {};
        return {bones_from_model_.front().value.data(), model_from_bones_.front().value.data()};
    }

private:
    bool are_same_;
    std::array<Float4, kDisplacementRows> bones_from_model_;
    std::array<Float4, kDisplacementRows> model_from_bones_;
};

}  // namespace sinew
