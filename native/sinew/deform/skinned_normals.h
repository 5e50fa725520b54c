// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "sinew/deform/deformer.h"

namespace sinew {

/// Normals and tangents at rest, of vertices or of their corners.
struct RestFrames {
    std::span<const Vec3<float>> normals;      // [frames] of any length
    std::span<const Vec3<float>> tangents{};   // [frames], or none
    std::span<const std::int32_t> vertices{};  // [frames] the vertex of each; none: one frame for each vertex
};

/// Normals and tangents that move with the skin, as engines have them: each by the blend of its own vertex, as if that
/// blend were the same all around it. So rotations of corners that are kept apart at rest stay so; what the change of
/// weights from vertex to vertex does to the surface is not in them (Normals has it).
///
/// The blend of a vertex, its influences and vertex data kept, is an affine map of its rest point, under every method: x to
/// M x + t. A tangent t becomes M t, and a normal n the cofactors of M times n, which is the inverse transpose times
/// the determinant of M: perpendicular to what the plane of n becomes, under scale and shear too. Where M mirrors, it
/// is on the side that the order of a face's vertices gives, as Blender's. Where M flattens the plane of n to a line or a
/// point, and where M t is 0, the result is 0. Tangents that were perpendicular to their normals stay so.
///
/// M is the difference of four points that the deformer's kernels move: of 22 bits where the mesh moves by its own size.
///
/// Once constructed it is valid, and deforming can not fail and allocates nothing. Calls of one object wait for each
/// other. One that was moved from can only be assigned to or destroyed.
class SINEW_EXPORT SkinnedNormals {
public:
    /// Throws std::invalid_argument as Deformer does, and that names the field for frames that are not as many as
    /// vertices, tangents or vertices that are not as many as normals, vertices that there are not, and values that are
    /// not finite.
    SkinnedNormals(const Binding& binding, const MethodInfo& method, const RestFrames& rest,
                   const std::optional<MixData>& mix = {});

    SkinnedNormals(SkinnedNormals&&) noexcept;
    SkinnedNormals& operator=(SkinnedNormals&&) noexcept;
    ~SkinnedNormals();

    [[nodiscard]] std::size_t frame_count() const noexcept;
    [[nodiscard]] bool has_tangents() const noexcept;
    /// Of the points: what it was made of, and what says which bones there are.
    [[nodiscard]] const Deformer& deformer() const noexcept;

    /// Writes the deformed points, to the bit those of a Deformer, and unit vectors.
    ///
    /// posed_from_rest  [bones, at least deformer().bone_count()] finite; bones that it lacks stay at rest
    /// points           [vertices]
    /// normals          [frames]
    /// tangents         [frames], or none; without tangents at rest none. Where one has another size nothing is written
    ///
    /// A vertex without influences keeps its own. The result does not depend on the number of threads.
    void deform(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                std::span<Vec3<float>> points, std::span<Vec3<float>> normals,
                std::span<Vec3<float>> tangents = {}) const noexcept;

    /// The same normals, where the points of the same pose and options are known: a fourth less to deform.
    ///
    /// points   [vertices] as deform() or the Deformer wrote them. Where they are not as many nothing is written
    /// normals  [frames]
    void deform_normals(std::span<const Affine<float>> posed_from_rest, const DeformOptions& options,
                        std::span<const Vec3<float>> points, std::span<Vec3<float>> normals) const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
