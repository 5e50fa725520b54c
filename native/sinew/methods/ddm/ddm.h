// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "sinew/mesh/influence.h"
#include "sinew/methods/ddm/moments.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"
#include "sinew/transform/nearest_rotation.h"

namespace sinew {

/// A neighbourhood counts as a point, without a rotation of its own, if the trace of its second moments is less
/// than this times its centroid's square.
inline constexpr double kLeastExtent = 1e-10;

/// If NearestRotation::gap is less than this times the largest entry, no rotation is the nearest.
inline constexpr double kLeastGap = 1e-6;

/// Direct delta mush (Le, Lewis 2019): the shape that smoothing both the rest mesh and the posed mesh would give,
/// computed as sums over bones. methods/ddm/direct_delta_mush.h precomputes the moments that the sums read.
///
/// Variant 0 rotates a vertex about its neighbourhood's centroid by the rotation that fits the posed
/// neighbourhood best, variant 2 by the blended quaternion. Variant 4 also rotates by the blended quaternion, and
/// moves the centroid as if the whole neighbourhood were at the centroid.
struct Ddm : BlendsQuatVecs {
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
             "How far the smoothing reaches, in units of the scene, however dense the mesh is; another "
             "value has the mesh bound anew",
         .unit = "length",
         .kind = ParameterKind::number,
         .initial = 0.05,
         .minimum = 0.0,
         .maximum = 1e6},
        {"weld", "Weld",
         "Vertices at one place that the same bones move count as one, as if seams were closed", "",
         ParameterKind::boolean, 1.0, 0.0, 1.0}};
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

    /// bones       also one for each bone that `rows` name
    /// influences  only blend the bones' scales
    /// rows        [any number][kMomentFloats] of the vertex, in ascending order of bones, weights >= 0 with sum
    ///             1; if empty, the vertex is blended linearly
    /// parameters  empty, or the index in kVariants and the radius; the radius is not read
    ///
    /// Quaternions are added in the order of rows, each in the hemisphere of the sum before it, so rotations that
    /// are 180 degrees apart may blend either way. Under variant 0, a neighbourhood that is a point, or that no
    /// single rotation fits best, uses the blended quaternion. Where the neighbourhood is folded so far that
    /// another rotation becomes the nearest, the vertex jumps.
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
        T extent(0);
        for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
            const Moments<T> moments = moments_of(rows.subspan(i, kMomentFloats));
            centroid += moments.first;
            extent += moments.second[0][0] + moments.second[1][1] + moments.second[2][2];
        }
        Quat<T> rotation(T(0), Vec3<T>(T(0)));
        Vec3<T> by_bones(T(0));
        for (std::size_t i = 0; i < rows.size(); i += kMomentFloats) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(rows[i + 1])];
            const Moments<T> moments = moments_of(rows.subspan(i, kMomentFloats));
            const Quat<T>& q = bone.rigid.rotation;
            rotation = rotation + q * (glm::dot(q, rotation) < T(0) ? -moments.weight : moments.weight);
            by_bones +=
                moved_by(bone, variant == 2 ? moments.weight * centroid : moments.first, moments.weight);
        }
        if (variant == 0 && extent > T(kLeastExtent) * glm::dot(centroid, centroid)) {
            const Mat3<T> matrix = correlation(bones, rows, centroid, by_bones);
            const NearestRotation<T> nearest = nearest_rotation(matrix);
            if (nearest.gap > T(kLeastGap) * largest_entry(matrix)) rotation = nearest.rotation;
        }
        const T length = glm::length(rotation);
        return rest + rotation_displacement(rotation * (T(1) / length), rest - centroid) + by_bones +
               displacement;
    }

private:
    /// How far the bone moves a point, times `weight`; `point` is already multiplied by it.
    template <class T>
    static Vec3<T> moved_by(const Bone<T>& bone, const Vec3<T>& point, T weight) noexcept {
        return rotation_displacement(bone.rigid.rotation, point) + weight * bone.rigid.translation;
    }

    template <class T>
    static T largest_entry(const Mat3<T>& matrix) noexcept {
        T largest(0);
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(matrix[column][row]));
        }
        return largest;
    }

    /// The correlation matrix of the posed neighbourhood with the neighbourhood at rest, each about its centroid.
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
            // The from_centroid vectors have sum 0, so subtracting the common displacement changes nothing but
            // rounding.
            const Vec3<T> moved = moved_by(bone, centroid, T(1)) - displacement;
            sum += to_mat3(bone.rigid.rotation) * moments.second + glm::outerProduct(moved, from_centroid);
        }
        return sum;
    }
};

}  // namespace sinew
