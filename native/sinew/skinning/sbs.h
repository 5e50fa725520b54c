// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <span>

#include "sinew/skinning/influence.h"
#include "sinew/skinning/method_info.h"
#include "sinew/skinning/rotation_about.h"
#include "sinew/skinning/scaled_rigid.h"

namespace sinew {

/// A bone of Sbs.
template <class T>
struct SphericalBone : ScaledRigid<QuatVec<T>, T> {
    Vec3<T> head{T(0)};  // at rest
};

template <class To, class From>
[[nodiscard]] SphericalBone<To> cast(const SphericalBone<From>& bone) noexcept {
    return {{cast<To>(bone.rigid), cast<To>(bone.scale), bone.has_scale}, Vec3<To>(bone.head)};
}

/// Spherical blend skinning (Kavan, Zara 2005; Smith 2013, section 3.6.2): vertices rotate by the blended
/// quaternion about the point that the bones of their set move most alike. With two bones that share a joint this is
/// the joint, and the shape that of dual quaternions.
///
/// Each set of bones has a point of its own, whatever the weights: where a bone joins the set, the surface is torn if
/// the bones have no common point. The influences of positive weight are the set.
struct Sbs {
    static constexpr MethodInfo info{
        6,
        "sbs",
        "Spherical Blend",
        MethodGroup::report,
        "Dual quaternions' shape where two bones share a joint; tears where sets of "
        "three or more bones change",
        "Kavan, Zara 2005",
        Needs::rest_bones};
    static const Kernel& kernel() noexcept;

    template <class T>
    using Bone = SphericalBone<T>;

    /// Below this the rotations of a set agree along a direction: the root of the mean squared difference of its
    /// images from their mean. Of two bones it is the sine of half the angle between them.
    static constexpr double kSameRotation = 1e-3;

    /// rest_bone  orthonormal; its axes are only read where the motion has scale
    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& rest_bone) noexcept {
        return {scaled_rigid(posed_from_rest, rest_bone), rest_bone.translation};
    }

    /// The point r of least sum of |(R_a - R_b) r + t_a - t_b|^2 over all pairs of a set's motions; of several the
    /// nearest to the mean of the bones' heads. Directions along which the rotations agree (kSameRotation) count as
    /// free.
    ///
    /// count    of bones
    /// bone_at  Bone<double> of each number below that
    template <class BoneAt>
    [[nodiscard]] static Vec3<double> rotation_centre(std::size_t count, const BoneAt& bone_at) noexcept;

    /// The deformed vertex.
    ///
    /// bones       one for each index in `influences`; the signs of their quaternions are free
    /// influences  at least one; weights >= 0 with sum 1
    ///
    /// If the rotations cancel (sum below kDegenerateBlend), the heaviest influence alone moves the vertex.
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences,
                                               const Vec3<T>& rest) noexcept {
        std::size_t count = 0;
        for (const Influence<T>& influence : influences) count += influence.weight > T(0) ? 1 : 0;
        const auto bone_at = [&](std::size_t wanted) {
            std::size_t i = 0;
            for (std::size_t found = 0; influences[i].weight <= T(0) || found++ < wanted;) ++i;
            return cast<double>(bones[static_cast<std::size_t>(influences[i].bone)]);
        };
        const Vec3<T> centre(rotation_centre(count, bone_at));
        return rotated_about(centre, bones, influences, rest);
    }

private:
    /// The solution of least length of n y = g for a symmetric, not negative n, whose eigenvalues below `least`
    /// count as 0.
    [[nodiscard]] static Vec3<double> solved(Mat3<double> n, const Vec3<double>& g, double least) noexcept {
        const double half_trace = 0.5 * (n[0][0] + n[1][1] + n[2][2]);
        // The determinant over this square is no larger than the least eigenvalue.
        if (glm::determinant(n) > least * half_trace * half_trace) return glm::inverse(n) * g;
        // Jacobi's rotations, which leave small eigenvalues their digits.
        Mat3<double> vectors(1.0);
        for (int sweep = 0; sweep < 12; ++sweep) {
            for (int pair = 0; pair < 3; ++pair) {
                const int i = pair == 2 ? 1 : 0;
                const int j = pair == 0 ? 1 : 2;
                if (n[i][j] == 0.0) continue;
                const double theta = (n[j][j] - n[i][i]) / (2.0 * n[i][j]);
                const double t = (theta < 0.0 ? -1.0 : 1.0) / (std::abs(theta) + std::hypot(theta, 1.0));
                const double c = 1.0 / std::hypot(t, 1.0);
                const double s = t * c;
                for (Mat3<double>* m : {&n, &vectors}) {
                    const Vec3<double> a = (*m)[i];
                    const Vec3<double> b = (*m)[j];
                    (*m)[i] = c * a - s * b;
                    (*m)[j] = s * a + c * b;
                }
                for (int k = 0; k < 3; ++k) {
                    const double a = n[k][i];
                    const double b = n[k][j];
                    n[k][i] = c * a - s * b;
                    n[k][j] = s * a + c * b;
                }
                n[i][j] = n[j][i] = 0.0;
            }
            if (n[0][1] == 0.0 && n[0][2] == 0.0 && n[1][2] == 0.0) break;
        }
        Vec3<double> y(0.0);
        for (int i = 0; i < 3; ++i) {
            if (n[i][i] > least) y += (glm::dot(vectors[i], g) / n[i][i]) * vectors[i];
        }
        return y;
    }
};

template <class BoneAt>
Vec3<double> Sbs::rotation_centre(std::size_t count, const BoneAt& bone_at) noexcept {
    if (count == 0) return Vec3<double>(0.0);
    const auto n = static_cast<double>(count);
    // What each motion does differently from the first, about the mean of the heads: sums of such lose no digits where
    // all are alike. The sum over pairs is n times that of squared differences from the mean.
    const Bone<double> first = bone_at(0);
    Vec3<double> origin(0.0);
    for (std::size_t i = 0; i < count; ++i) origin += (1.0 / n) * bone_at(i).head;
    const Mat3<double> first_rotation = to_mat3(first.rigid.rotation);
    const auto difference = [&](std::size_t i) {
        const Bone<double> bone = bone_at(i);
        const Mat3<double> rotation = to_mat3(bone.rigid.rotation) - first_rotation;
        return Affine<double>{rotation, rotation * origin + bone.rigid.translation - first.rigid.translation};
    };
    if (count == 2) {
        // The square of the difference is 4 |v|^2 times what is perpendicular to v, the vector part of the rotation from
        // one to the other.
        const Vec3<double> v = vector_part(glm::conjugate(first.rigid.rotation) * bone_at(1).rigid.rotation);
        const double squared = glm::dot(v, v);
        if (squared < kSameRotation * kSameRotation) return origin;
        const Affine<double> second = difference(1);
        const Vec3<double> g = -(glm::transpose(second.linear) * second.translation);
        return origin + (1.0 / (4.0 * squared)) * (g - (glm::dot(v, g) / squared) * v);
    }
    Affine<double> mean{Mat3<double>(0.0), Vec3<double>(0.0)};
    for (std::size_t i = 1; i < count; ++i) {
        const Affine<double> d = difference(i);
        mean.linear += (1.0 / n) * d.linear;
        mean.translation += (1.0 / n) * d.translation;
    }
    Mat3<double> normal(0.0);
    Vec3<double> g(0.0);
    for (std::size_t i = 0; i < count; ++i) {
        const Affine<double> d = difference(i);
        const Mat3<double> by = glm::transpose(d.linear - mean.linear);
        normal += by * (d.linear - mean.linear);
        g -= by * (d.translation - mean.translation);
    }
    return origin + solved(normal, g, n * kSameRotation * kSameRotation);
}

}  // namespace sinew
