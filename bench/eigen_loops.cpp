// SPDX-License-Identifier: GPL-3.0-or-later
// The plain loops written with Eigen, on the same data.
#define GLM_ENABLE_EXPERIMENTAL
#include <Eigen/Geometry>
#include <glm/gtc/type_ptr.hpp>

#include "plain_loops.h"

namespace plain::eigen {
namespace {

using Eigen::Map;
using Eigen::Matrix4f;
using Eigen::Quaternionf;
using Eigen::Vector3f;
using Eigen::Vector4f;

Map<const Vector3f> point_of(const glm::vec3& v) { return Map<const Vector3f>(glm::value_ptr(v)); }
// Both store x, y, z, w.
Map<const Vector4f> coefficients_of(const glm::quat& q) { return Map<const Vector4f>(glm::value_ptr(q)); }
void write(const Vector3f& p, glm::vec3& to) { Map<Vector3f>(glm::value_ptr(to)) = p; }

}  // namespace

void lbs(const Mesh& mesh, const std::vector<glm::mat4>& palette, glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        Matrix4f blend = Matrix4f::Zero();
        for (int k = 0; k < 4; ++k) {
            blend += mesh.weights[v][k] * Map<const Matrix4f>(glm::value_ptr(palette[mesh.bones[v][k]]));
        }
        write((blend * point_of(mesh.rest_points[v]).homogeneous()).head<3>(), points[v]);
    }
}

void dq(const Mesh& mesh, const std::vector<glm::dualquat>& palette, glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        const Vector4f first = coefficients_of(palette[mesh.bones[v].x].real);
        Vector4f real = Vector4f::Zero();
        Vector4f dual = Vector4f::Zero();
        for (int k = 0; k < 4; ++k) {
            const glm::dualquat& bone = palette[mesh.bones[v][k]];
            const float sign = first.dot(coefficients_of(bone.real)) < 0.0f ? -1.0f : 1.0f;
            real += sign * mesh.weights[v][k] * coefficients_of(bone.real);
            dual += sign * mesh.weights[v][k] * coefficients_of(bone.dual);
        }
        const float norm = real.norm();
        const Quaternionf q(Vector4f(real / norm));
        const Quaternionf translation = Quaternionf(Vector4f(dual / norm)) * q.conjugate();
        write(q * point_of(mesh.rest_points[v]) + 2.0f * translation.vec(), points[v]);
    }
}

void qv(const Mesh& mesh, const std::vector<glm::quat>& rotations, const std::vector<glm::vec3>& translations,
        glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        const Vector4f first = coefficients_of(rotations[mesh.bones[v].x]);
        Vector4f rotation = Vector4f::Zero();
        Vector3f translation = Vector3f::Zero();
        for (int k = 0; k < 4; ++k) {
            const Map<const Vector4f> bone = coefficients_of(rotations[mesh.bones[v][k]]);
            const float sign = first.dot(bone) < 0.0f ? -1.0f : 1.0f;
            rotation += sign * mesh.weights[v][k] * bone;
            translation += mesh.weights[v][k] * point_of(translations[mesh.bones[v][k]]);
        }
        const Quaternionf q(rotation.normalized());
        write(q * point_of(mesh.rest_points[v]) + translation, points[v]);
    }
}

}  // namespace plain::eigen
