// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/methods/rotation_about.h"
#include "sinew/transform/scaled_rigid.h"

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

/// Spherical blend skinning (Kavan, Zara 2005; Smith 2013, section 3.6.2): rotates a vertex by the blended
/// quaternion about the point on whose image the bones of its set differ least. For two bones that meet in a
/// common point this is that point, and the shape is that of dual quaternions.
///
/// The set consists of the influences with positive weight. The centre depends only on the set, not on the
/// weights, so the surface tears where a bone joins the set, unless the bones have a common point.
struct Sbs {
    static constexpr MethodInfo info{
        6,
        "sbs",
        "Spherical Blend",
        MethodGroup::report,
        "Dual quaternions' shape where two bones share a joint; tears where sets of "
        "three or more bones change",
        "Kavan, Zara 2005",
        Needs::rest_bones,
        Signs::kParameters};
    static const Kernel& kernel() noexcept;

    template <class T>
    using Bone = SphericalBone<T>;

    /// Along a direction in which the rotations differ by less than this, the set counts as agreeing. The measure
    /// is the root mean square difference of the direction's images from their mean; for two bones, the sine of
    /// half the angle between them.
    static constexpr double kSameRotation = 1e-3;

    /// rest_bone  orthonormal; its axes are only read where the motion has scale
    template <class T>
    [[nodiscard]] static Bone<T> prepare(const Affine<T>& posed_from_rest,
                                         const Affine<T>& rest_bone) noexcept {
        return {scaled_rigid(posed_from_rest, rest_bone), rest_bone.translation};
    }

    /// The point r that minimises the sum of |(R_a - R_b) r + t_a - t_b|^2 over all pairs of motions in a set.
    /// Where it is not unique, the one nearest to the mean of the bones' heads. Directions along which the
    /// rotations agree (kSameRotation) count as free.
    ///
    /// count    number of bones
    /// bone_at  bone_at(i) has the `rigid` and the `head` of bone i, 0 <= i < count
    template <class BoneAt>
    [[nodiscard]] static Vec3<double> rotation_centre(std::size_t count, const BoneAt& bone_at) noexcept;

    /// parameters  empty, or the index in Signs::kChoices
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, const Vec3<T>& rest,
                                               std::span<const double> parameters = {}) noexcept {
        std::size_t count = 0;
        for (const Influence<T>& influence : influences) count += influence.weight > T(0) ? 1 : 0;
        const auto bone_at = [&](std::size_t wanted) {
            std::size_t i = 0;
            for (std::size_t found = 0; influences[i].weight <= T(0) || found++ < wanted;) ++i;
            return cast<double>(bones[static_cast<std::size_t>(influences[i].bone)]);
        };
        const Vec3<T> centre(rotation_centre(count, bone_at));
        return rotated_about(centre, bones, influences, rest, parameters);
    }

private:
    /// The solution of n y = g of least length, for a symmetric positive semi-definite n. Eigenvalues up to
    /// `least` count as 0.
    [[nodiscard]] static Vec3<double> solved(const Mat3<double>& n, const Vec3<double>& g,
                                             double least) noexcept {
        const double trace = n[0][0] + n[1][1] + n[2][2];
        const double determinant = glm::determinant(n);
        // Divided by the square of half the trace, this is a lower bound of the least eigenvalue.
        if (4.0 * determinant > least * trace * trace) return glm::inverse(n) * g;
        const double minors = (n[0][0] * n[1][1] - n[0][1] * n[0][1]) +
                              (n[0][0] * n[2][2] - n[0][2] * n[0][2]) +
                              (n[1][1] * n[2][2] - n[1][2] * n[1][2]);
        // From 0, Newton's method rises to the least root of the characteristic polynomial.
        double a = 0.0;
        for (int step = 0; step < 60; ++step) {
            const double slope = (3.0 * a - 2.0 * trace) * a + minors;
            const double value = determinant - ((a - trace) * a + minors) * a;
            if (!(slope > 0.0 && value > 1e-17 * trace * slope)) break;
            a += value / slope;
        }
        const double sum = trace - a;
        const double product = minors - a * sum;
        const double c = 0.5 * (sum + std::sqrt(std::max(sum * sum - 4.0 * product, 0.0)));
        const double b = sum - c;
        // The inverse on the eigenvectors that count, 0 on the others, is a polynomial in n.
        const auto without = [&n](double value, const Vec3<double>& v) { return n * v - value * v; };
        if (c <= least) return Vec3<double>(0.0);
        if (b <= least) return (1.0 / ((c - a) * (c - b) * c)) * without(a, without(b, g));
        if (a > least) return glm::inverse(n) * g;
        const double size = product * (product - a * (sum - a));
        return (1.0 / size) * without(a, (sum * (sum - a) - product) * g - (sum - a) * (n * g));
    }
};

template <class BoneAt>
Vec3<double> Sbs::rotation_centre(std::size_t count, const BoneAt& bone_at) noexcept {
    if (count == 0) return Vec3<double>(0.0);
    const auto n = static_cast<double>(count);
    // Differences of the motions from the first one, with the mean of the heads as origin, lose no digits where
    // all motions are alike. The sum over pairs is n times the sum of squared differences from the mean.
    const QuatVec<double> first = bone_at(0).rigid;
    Vec3<double> origin(0.0);
    for (std::size_t i = 0; i < count; ++i) origin += (1.0 / n) * bone_at(i).head;
    const Mat3<double> first_rotation = to_mat3(first.rotation);
    const auto difference = [&](std::size_t i) {
        const auto& bone = bone_at(i);
        const Mat3<double> rotation = to_mat3(bone.rigid.rotation) - first_rotation;
        return Affine<double>{rotation, rotation * origin + bone.rigid.translation - first.translation};
    };
    if (count == 2) {
        // With v the vector part of the rotation from one bone to the other, the matrix (R_a - R_b)^T (R_a - R_b)
        // is 4 |v|^2 times the projection perpendicular to v.
        const Vec3<double> v = vector_part(glm::conjugate(first.rotation) * bone_at(1).rigid.rotation);
        const double squared = glm::dot(v, v);
        if (squared < kSameRotation * kSameRotation) return origin;
        const Affine<double> second = difference(1);
        const Vec3<double> g = -(glm::transpose(second.linear) * second.translation);
        return origin + (1.0 / (4.0 * squared)) * (g - (glm::dot(v, g) / squared) * v);
    }
    Mat3<double> normal(0.0);
    Vec3<double> g(0.0);
    const auto add = [&](double weight, const Affine<double>& d) {
        const Mat3<double> by = glm::transpose(d.linear);
        normal += weight * (by * d.linear);
        g -= weight * (by * d.translation);
    };
    Affine<double> sum{Mat3<double>(0.0), Vec3<double>(0.0)};
    for (std::size_t i = 1; i < count; ++i) {
        const Affine<double> d = difference(i);
        add(1.0, d);
        sum.linear += d.linear;
        sum.translation += d.translation;
    }
    add(-1.0 / n, sum);
    return origin + solved(normal, g, n * kSameRotation * kSameRotation);
}

}  // namespace sinew
