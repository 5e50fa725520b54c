// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

#include "sinew/skinning/influence.h"
#include "sinew/skinning/method_info.h"
#include "sinew/skinning/moments.h"
#include "sinew/skinning/rotation_about.h"
#include "sinew/skinning/scaled_rigid.h"

namespace sinew {

/// Steps of Newton's method from the blended quaternion to the polar factor.
inline constexpr int kPolarSteps = 3;

/// Where the determinant of their matrix, over the cube of its trace, is less than this there is no such step.
inline constexpr double kSingularStep = 1e-6;

/// The rotation nearest to `matrix`, by steps of Newton's method from the rotation of `q`, of any length but 0; of any
/// length. Where a step has no maximum to go to, as where the matrix is near one of rank 1 or nearer to a reflection,
/// it is left out. From less than 60 degrees away the last step is below 1e-6.
template <class T>
[[nodiscard]] Quat<T> toward_polar_factor(Quat<T> q, const Mat3<T>& matrix) noexcept {
    for (int step = 0; step < kPolarSteps; ++step) {
        const Mat3<T> rotated = glm::transpose(to_mat3(q * (T(1) / glm::length(q)))) * matrix;
        const auto at = [&](int row, int column) { return rotated[column][row]; };
        const Vec3<T> slope(at(2, 1) - at(1, 2), at(0, 2) - at(2, 0), at(1, 0) - at(0, 1));
        const T trace = at(0, 0) + at(1, 1) + at(2, 2);
        Mat3<T> bend = Mat3<T>(trace) - (rotated + glm::transpose(rotated)) * T(0.5);
        const T determinant = glm::determinant(bend);
        const T minor = bend[0][0] * bend[1][1] - bend[0][1] * bend[1][0];
        const bool has_maximum = bend[0][0] > T(0) && minor > T(0) &&
                                 determinant > T(kSingularStep) * trace * trace * trace && trace > T(0);
        if (!has_maximum) break;
        const Vec3<T> by = glm::inverse(bend) * slope * T(0.5);
        q = q * Quat<T>(T(1), by.x, by.y, by.z);
    }
    return q;
}

/// Direct delta mush (Le, Lewis 2019): the shape that smoothing the rest mesh and the posed one would give, by sums
/// over bones alone. deform/direct_delta_mush.h finds what they take of the rest mesh.
///
/// Variant 0 rotates a vertex about its neighbourhood's centroid by the rotation that fits the neighbourhood best, 2 by
/// the blended quaternion; 4 also moves the centroid as if all of the neighbourhood were there.
struct Ddm {
    static constexpr std::string_view kVariants[] = {"0", "2", "4"};
    static constexpr Parameter kParameters[] = {
        {.id = "variant",
         .label = "Variant",
         .description =
             "0: the rotation that fits the neighbourhood best; 2: the blended quaternion, faster; 4: "
             "fastest, of smoothed weights alone",
         .unit = "",
         .kind = ParameterKind::choice,
         .choices = kVariants},
        {.id = "radius",
         .label = "Radius",
         .description =
             "How far the smoothing reaches, in units of the object, however dense the mesh is; another "
             "value has the mesh bound anew",
         .unit = "length",
         .kind = ParameterKind::number,
         .initial = 0.05,
         .minimum = 0.0,
         .maximum = 1e6}};
    static constexpr MethodInfo info{
        9,
        "ddm",
        "Direct Delta Mush",
        MethodGroup::crude_weights,
        "Makes smooth joints of crude weights, even of one bone a vertex; joints lose some volume, and large "
        "meshes are "
        "bound some seconds longer",
        "Le, Lewis 2019",
        Needs::rest_bones | Needs::vertex_data | Needs::topology | Needs::precomputation,
        kParameters,
        kMomentFloats,
        true};
    static const Kernel& kernel() noexcept;

    template <class T>
    using Bone = ScaledRigid<QuatVec<T>, T>;

    /// rest_bone  orthonormal; only read where the motion has scale
    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& rest_bone) noexcept {
        return scaled_rigid(posed_from_rest, rest_bone);
    }

    /// The deformed vertex.
    ///
    /// bones       one for each bone that `influences` or `rows` name; the signs of their quaternions are free
    /// influences  at least one; weights >= 0 with sum 1: what bones scale is blended by them
    /// rows        [any number][kMomentFloats] of the vertex, by rising numbers of bones, weights >= 0 with sum 1; or
    ///             empty: the vertex is blended linearly
    /// parameters  empty, or the index in kVariants, and the radius, which is not read
    ///
    /// Quaternions are added in the order of rows, each in the hemisphere of the sum before it: half a turn apart, a
    /// vertex rotates the one way or the other.
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                               std::span<const T> rows = {},
                                               std::span<const double> parameters = {}) noexcept {
        Vec3<T> displacement{T(0)};
        for (const Influence<T>& influence : influences) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            Vec3<T> moved(T(0));
            if (rows.empty()) moved += moved_by(bone, rest, T(1));
            if (bone.has_scale) moved += rotate(bone.rigid.rotation, bone.scale_displacement(rest));
            displacement += influence.weight * moved;
        }
        if (rows.empty()) return rest + displacement;

        const std::size_t variant = parameters.empty() ? 0 : static_cast<std::size_t>(parameters[0]);
        Vec3<T> centroid(T(0));
        for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
            centroid += moments_of(rows.subspan(i, kMomentFloats)).first;
        }
        Quat<T> rotation(T(0), T(0), T(0), T(0));
        Vec3<T> by_bones(T(0));
        for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(rows[i + 1])];
            const Moments<T> moments = moments_of(rows.subspan(i, kMomentFloats));
            const Quat<T>& q = bone.rigid.rotation;
            rotation = rotation + q * (glm::dot(q, rotation) < T(0) ? -moments.weight : moments.weight);
            by_bones +=
                moved_by(bone, variant == 2 ? moments.weight * centroid : moments.first, moments.weight);
        }
        if (variant == 0)
            rotation = toward_polar_factor(rotation, correlation(bones, rows, centroid, by_bones));
        const T length = glm::length(rotation);
        return rest + rotation_displacement(rotation * (T(1) / length), rest - centroid) + by_bones +
               displacement;
    }

private:
    /// What the bone adds to a point, times the weight that `point` was multiplied by.
    template <class T>
    static Vec3<T> moved_by(const Bone<T>& bone, const Vec3<T>& point, T weight) noexcept {
        return rotation_displacement(bone.rigid.rotation, point) + weight * bone.rigid.translation;
    }

    /// Of the posed neighbourhood with the one at rest, each about its centroid.
    ///
    /// displacement  of the centroid
    template <class T>
    static Mat3<T> correlation(std::span<const Bone<T>> bones, std::span<const T> rows,
                               const Vec3<T>& centroid, const Vec3<T>& displacement) noexcept {
        Mat3<T> sum(T(0));
        for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(rows[i + 1])];
            const Moments<T> moments = moments_of(rows.subspan(i, kMomentFloats));
            const Vec3<T> from_centroid = moments.first - moments.weight * centroid;
            // These have sum 0: only what bones differ by counts.
            const Vec3<T> moved = moved_by(bone, centroid, T(1)) - displacement;
            sum += to_mat3(bone.rigid.rotation) * moments.second + glm::outerProduct(moved, from_centroid);
        }
        return sum;
    }
};

}  // namespace sinew
