// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <glm/gtx/dual_quaternion.hpp>

#include "sinew/interpolate/methods.h"
#include "sinew/methods/dq/dq.h"
#include "sinew/methods/lbs/lbs.h"
#include "sinew/methods/qv/qv.h"
#include "sinew/transform/make.h"

namespace experiments {

// A candidate is a representation from one library, with these operations:
//   make(rigid)                      from the same double-precision motion for all
//   compose(a, b), apply(a, point)   b first, then a; the image of a point
//   blend(transforms, weights)       of three transforms, with arbitrary signs of quaternions

using Rigid = sinew::QuatVec<double>;
using Weights = std::array<float, 3>;

/// Linear blends of matrices that libraries add and multiply by numbers.
template <class Matrix>
struct BySums {
    using Transform = Matrix;

    static Transform compose(const Transform& a, const Transform& b) { return a * b; }
    static Transform linear(const Transform& a, const Transform& b, float t) {
        return (1.0f - t) * a + t * b;
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        return weights[0] * transforms[0] + weights[1] * transforms[1] + weights[2] * transforms[2];
    }
};

/// "Standard matrix math on 4x4 matrices" (Smith 2013, section 3.4.3): all sixteen numbers, three loops.
struct Plain4x4 {
    struct Transform {
        float rows[4][4];
    };
    using Point = glm::vec3;

    static Transform make(const Rigid& rigid) {
        const sinew::Affine<double> a = sinew::to_affine(rigid);
        Transform m{};
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                m.rows[row][column] = static_cast<float>(a.linear[column][row]);
            }
            m.rows[row][3] = static_cast<float>(a.translation[row]);
        }
        m.rows[3][3] = 1.0f;
        return m;
    }
    static Transform compose(const Transform& a, const Transform& b) {
        Transform product;
        for (int row = 0; row < 4; ++row) {
            for (int column = 0; column < 4; ++column) {
                float sum = 0.0f;
                for (int k = 0; k < 4; ++k) sum += a.rows[row][k] * b.rows[k][column];
                product.rows[row][column] = sum;
            }
        }
        return product;
    }
    static Point apply(const Transform& a, const Point& point) {
        const float p[4] = {point.x, point.y, point.z, 1.0f};
        float moved[4];
        for (int row = 0; row < 4; ++row) {
            moved[row] = 0.0f;
            for (int k = 0; k < 4; ++k) moved[row] += a.rows[row][k] * p[k];
        }
        return {moved[0], moved[1], moved[2]};
    }
    static Transform linear(const Transform& a, const Transform& b, float t) {
        Transform between;
        for (int row = 0; row < 4; ++row) {
            for (int column = 0; column < 4; ++column) {
                between.rows[row][column] = (1.0f - t) * a.rows[row][column] + t * b.rows[row][column];
            }
        }
        return between;
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Transform sum{};
        for (std::size_t k = 0; k < weights.size(); ++k) {
            for (int row = 0; row < 4; ++row) {
                for (int column = 0; column < 4; ++column) {
                    sum.rows[row][column] += weights[k] * transforms[k].rows[row][column];
                }
            }
        }
        return sum;
    }
};

/// Four numbers in one register, with the vector extension of GCC and Clang.
using Lanes = float __attribute__((vector_size(16)));

/// A matrix in so many registers.
template <int kCount>
struct InRegisters {
    struct Transform {
        Lanes lanes[kCount];
    };
    using Point = glm::vec3;

    static Transform linear(const Transform& a, const Transform& b, float t) {
        Transform between;
        for (int i = 0; i < kCount; ++i) between.lanes[i] = (1.0f - t) * a.lanes[i] + t * b.lanes[i];
        return between;
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Transform sum;
        for (int i = 0; i < kCount; ++i) {
            sum.lanes[i] = weights[0] * transforms[0].lanes[i] + weights[1] * transforms[1].lanes[i] +
                           weights[2] * transforms[2].lanes[i];
        }
        return sum;
    }
};

/// A 4x4 matrix in four registers, one for each column: the loops of Plain4x4 vectorised by hand.
struct Lanes4x4 : InRegisters<4> {
    static Transform make(const Rigid& rigid) {
        const Plain4x4::Transform m = Plain4x4::make(rigid);
        Transform result;
        for (int column = 0; column < 4; ++column) {
            for (int row = 0; row < 4; ++row) result.lanes[column][row] = m.rows[row][column];
        }
        return result;
    }
    static Lanes times(const Transform& a, const Lanes& v) {
        return a.lanes[0] * v[0] + a.lanes[1] * v[1] + a.lanes[2] * v[2] + a.lanes[3] * v[3];
    }
    static Transform compose(const Transform& a, const Transform& b) {
        return {{times(a, b.lanes[0]), times(a, b.lanes[1]), times(a, b.lanes[2]), times(a, b.lanes[3])}};
    }
    static Point apply(const Transform& a, const Point& point) {
        const Lanes moved = a.lanes[0] * point.x + a.lanes[1] * point.y + a.lanes[2] * point.z + a.lanes[3];
        return {moved[0], moved[1], moved[2]};
    }
};

/// A 3x4 matrix in three registers, one for each row.
struct Lanes3x4 : InRegisters<3> {
    static Transform make(const Rigid& rigid) {
        const Plain4x4::Transform m = Plain4x4::make(rigid);
        Transform result;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 4; ++column) result.lanes[row][column] = m.rows[row][column];
        }
        return result;
    }
    static Transform compose(const Transform& a, const Transform& b) {
        Transform product;
        for (int i = 0; i < 3; ++i) {
            const Lanes& row = a.lanes[i];
            const Lanes moved = {0.0f, 0.0f, 0.0f, row[3]};
            product.lanes[i] = row[0] * b.lanes[0] + row[1] * b.lanes[1] + row[2] * b.lanes[2] + moved;
        }
        return product;
    }
    static Point apply(const Transform& a, const Point& point) {
        const auto along = [&](const Lanes& row) {
            return row[0] * point.x + row[1] * point.y + row[2] * point.z + row[3];
        };
        return {along(a.lanes[0]), along(a.lanes[1]), along(a.lanes[2])};
    }
};

/// A representation of Sinew, with its operators.
template <template <class> class Representation>
struct Ours {
    using Transform = Representation<float>;
    using Point = glm::vec3;

    static Transform make(const Rigid& rigid) { return sinew::cast<float>(sinew::to<Representation>(rigid)); }
    static Transform compose(const Transform& a, const Transform& b) { return a * b; }
    static Point apply(const Transform& a, const Point& point) { return sinew::transform_point(a, point); }
};

struct Glm4x4 : BySums<glm::mat4> {
    using Point = glm::vec3;

    static Transform make(const Rigid& rigid) {
        const sinew::Affine<double> a = sinew::to_affine(rigid);
        Transform m(glm::mat3(a.linear));
        m[3] = glm::vec4(glm::vec3(a.translation), 1.0f);
        return m;
    }
    static Point apply(const Transform& a, const Point& point) {
        return glm::vec3(a * glm::vec4(point, 1.0f));
    }
};

struct GlmPair {
    struct Transform {
        glm::quat rotation;
        glm::vec3 translation;
    };
    using Point = glm::vec3;

    static Transform make(const Rigid& rigid) {
        return {glm::quat(rigid.rotation), glm::vec3(rigid.translation)};
    }
    static Transform compose(const Transform& a, const Transform& b) {
        return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
    }
    static Point apply(const Transform& a, const Point& point) { return a.rotation * point + a.translation; }
    static Transform nlerp(const Transform& a, const Transform& b, float t) {
        const float sign = glm::dot(a.rotation, b.rotation) < 0.0f ? -1.0f : 1.0f;
        return {glm::normalize(a.rotation * (1.0f - t) + b.rotation * (sign * t)),
                glm::mix(a.translation, b.translation, t)};
    }
    static Transform slerp(const Transform& a, const Transform& b, float t) {
        return {glm::slerp(a.rotation, b.rotation, t), glm::mix(a.translation, b.translation, t)};
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Transform sum{transforms[0].rotation * weights[0], transforms[0].translation * weights[0]};
        for (std::size_t k = 1; k < weights.size(); ++k) {
            const float sign = glm::dot(transforms[0].rotation, transforms[k].rotation) < 0.0f ? -1.0f : 1.0f;
            sum.rotation = sum.rotation + transforms[k].rotation * (sign * weights[k]);
            sum.translation += transforms[k].translation * weights[k];
        }
        return {glm::normalize(sum.rotation), sum.translation};
    }
};

struct GlmDualQuat {
    using Transform = glm::dualquat;
    using Point = glm::vec3;

    static Transform make(const Rigid& rigid) {
        const sinew::DualQuat<double> d = sinew::to_dual_quat(rigid);
        return {glm::quat(d.real), glm::quat(d.dual)};
    }
    static Transform compose(const Transform& a, const Transform& b) { return a * b; }
    static Point apply(const Transform& a, const Point& point) { return a * point; }
    static Transform dlb(const Transform& a, const Transform& b, float t) {
        return glm::normalize(glm::lerp(a, b, t));
    }
    /// Screw linear interpolation by Kenwright 2012 ("A beginners guide to dual-quaternions", section 7), which
    /// the report used (section 3.1): the angle by acos, and no special case for rotations that are equal or 180
    /// degrees apart.
    static Transform sclerp(const Transform& a, const Transform& b, float t) {
        const Transform onto = glm::dot(a.real, b.real) < 0.0f ? b * -1.0f : b;
        const Transform step = Transform(glm::conjugate(a.real), glm::conjugate(a.dual)) * onto;
        const glm::vec3 axial(step.real.x, step.real.y, step.real.z);
        const float shorten = 1.0f / std::sqrt(glm::dot(axial, axial));
        const glm::vec3 axis = axial * shorten;
        const float angle = 2.0f * std::acos(step.real.w);
        const float shift = -2.0f * step.dual.w * shorten;
        const glm::vec3 moment =
            (glm::vec3(step.dual.x, step.dual.y, step.dual.z) - axis * (0.5f * shift * step.real.w)) *
            shorten;
        const float sine = std::sin(0.5f * t * angle);
        const float cosine = std::cos(0.5f * t * angle);
        const float along = 0.5f * t * shift;
        const glm::vec3 dual = sine * moment + (along * cosine) * axis;
        return a * Transform(glm::quat(cosine, sine * axis.x, sine * axis.y, sine * axis.z),
                             glm::quat(-along * sine, dual.x, dual.y, dual.z));
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Transform sum = transforms[0] * weights[0];
        for (std::size_t k = 1; k < weights.size(); ++k) {
            const float sign = glm::dot(transforms[0].real, transforms[k].real) < 0.0f ? -1.0f : 1.0f;
            sum = sum + transforms[k] * (sign * weights[k]);
        }
        return glm::normalize(sum);
    }
};

struct Eigen4x4 : BySums<Eigen::Matrix4f> {
    using Point = Eigen::Vector3f;

    static Transform make(const Rigid& rigid) {
        const Plain4x4::Transform m = Plain4x4::make(rigid);
        return Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(&m.rows[0][0]);
    }
    static Point apply(const Transform& a, const Point& point) {
        const Eigen::Vector4f moved = a * point.homogeneous();
        return moved.head<3>();
    }
};

/// 3x4 matrices, as in Eigen for rigid motions.
struct Eigen3x4 {
    using Transform = Eigen::AffineCompact3f;
    using Point = Eigen::Vector3f;

    static Transform make(const Rigid& rigid) {
        Transform m;
        m.matrix() = Eigen4x4::make(rigid).topRows<3>();
        return m;
    }
    static Transform compose(const Transform& a, const Transform& b) { return a * b; }
    static Point apply(const Transform& a, const Point& point) { return a * point; }
    static Transform linear(const Transform& a, const Transform& b, float t) {
        Transform between;
        between.matrix() = (1.0f - t) * a.matrix() + t * b.matrix();
        return between;
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Transform sum;
        sum.matrix() = weights[0] * transforms[0].matrix() + weights[1] * transforms[1].matrix() +
                       weights[2] * transforms[2].matrix();
        return sum;
    }
};

struct EigenPair {
    struct Transform {
        Eigen::Quaternionf rotation;
        Eigen::Vector3f translation;
    };
    using Point = Eigen::Vector3f;

    static Transform make(const Rigid& rigid) {
        const auto& q = rigid.rotation;
        const auto& v = rigid.translation;
        return {Eigen::Quaterniond(q.w, q.x, q.y, q.z).cast<float>(),
                Eigen::Vector3d(v.x, v.y, v.z).cast<float>()};
    }
    static Transform compose(const Transform& a, const Transform& b) {
        return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
    }
    static Point apply(const Transform& a, const Point& point) { return a.rotation * point + a.translation; }
    static Transform nlerp(const Transform& a, const Transform& b, float t) {
        const float sign = a.rotation.dot(b.rotation) < 0.0f ? -1.0f : 1.0f;
        Transform between{Eigen::Quaternionf(), (1.0f - t) * a.translation + t * b.translation};
        between.rotation.coeffs() =
            ((1.0f - t) * a.rotation.coeffs() + (sign * t) * b.rotation.coeffs()).normalized();
        return between;
    }
    static Transform slerp(const Transform& a, const Transform& b, float t) {
        return {a.rotation.slerp(t, b.rotation), (1.0f - t) * a.translation + t * b.translation};
    }
    static Transform blend(const Transform* transforms, const Weights& weights) {
        Eigen::Vector4f rotation = weights[0] * transforms[0].rotation.coeffs();
        Eigen::Vector3f translation = weights[0] * transforms[0].translation;
        for (std::size_t k = 1; k < weights.size(); ++k) {
            const float sign = transforms[0].rotation.dot(transforms[k].rotation) < 0.0f ? -1.0f : 1.0f;
            rotation += (sign * weights[k]) * transforms[k].rotation.coeffs();
            translation += weights[k] * transforms[k].translation;
        }
        return {Eigen::Quaternionf(rotation.normalized()), translation};
    }
};

}  // namespace experiments
