// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "sinew/deformer.h"

namespace sinew {

/// Normals and tangents at rest, for vertices or for their corners.
struct RestFrames {
    std::span<const Vec3<float>> normals;     // [frames] any length
    std::span<const Vec3<float>> tangents{};  // [frames], or empty
    // [frames] the vertex of each; empty: one frame for each vertex
    std::span<const std::int32_t> vertices{};
};

/// Normals and tangents that move with the skin, as in engines: each is transformed by the blend of its vertex,
/// as if that blend were constant around the vertex. Sharp corners at rest thus stay sharp. The effect of weights
/// that change from vertex to vertex is not included; Normals includes it.
///
/// For fixed influences and vertex data, under every method the blend of a vertex is an affine map of its rest
/// point, x to M x + t. A tangent u becomes M u. A normal n is multiplied by the cofactor matrix of M, which is
/// det(M) times the inverse transpose: the result is perpendicular to the image of n's plane, under scale and
/// shear too. Where M mirrors, the normal points to the side given by the order of a face's vertices, as in
/// Blender. The result is 0 where M collapses the plane of n to a line or a point, and where M u is 0. Tangents
/// perpendicular to their normals stay perpendicular.
///
/// M is computed from the images of four points, which the deformer's kernels move. It has 22 correct bits where
/// the mesh moves by its own size.
class SINEW_EXPORT SkinnedNormals {
public:
    /// Throws as Deformer does, and for indices of vertices that do not exist.
    SkinnedNormals(const Binding& binding, const MethodInfo& method, const RestFrames& rest,
                   const std::optional<MixData>& mix = {});

    [[nodiscard]] std::size_t frame_count() const noexcept;
    [[nodiscard]] bool has_tangents() const noexcept;
    /// The deformer of the points. It tells how the object was constructed and which bones it has.
    [[nodiscard]] const Deformer& deformer() const noexcept;

    /// Writes the deformed points, bit for bit those of a Deformer, and normals and tangents of unit length.
    ///
    /// pose      of at least deformer().bone_count() bones
    /// points    [vertices]
    /// normals   [frames]
    /// tangents  [frames], or empty; empty if there are none at rest
    ///
    /// A vertex without influences keeps its normals and tangents.
    Status deform(const Pose& pose, const DeformOptions& options, std::span<Vec3<float>> points,
                  std::span<Vec3<float>> normals, std::span<Vec3<float>> tangents = {}) const noexcept;

    /// Writes the normals of deform() where its points are known. This saves a quarter of the time.
    ///
    /// points   [vertices] as deform() or the Deformer writes them for this pose and these options
    /// normals  [frames]
    Status deform_normals(const Pose& pose, const DeformOptions& options, std::span<const Vec3<float>> points,
                          std::span<Vec3<float>> normals) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
