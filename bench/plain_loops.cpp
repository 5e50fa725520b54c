// SPDX-License-Identifier: GPL-3.0-or-later
// Straightforward loops with GLM, one vertex after the other: the baseline for the kernels.
#define GLM_ENABLE_EXPERIMENTAL
#include "plain_loops.h"

namespace plain {

void lbs(const Mesh& mesh, const std::vector<glm::mat4>& palette, glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        const glm::u16vec4 bones = mesh.bones[v];
        const glm::vec4 weights = mesh.weights[v];
        const glm::mat4 blend = weights.x * palette[bones.x] + weights.y * palette[bones.y] +
                                weights.z * palette[bones.z] + weights.w * palette[bones.w];
        points[v] = glm::vec3(blend * glm::vec4(mesh.rest_points[v], 1.0f));
    }
}

void dq(const Mesh& mesh, const std::vector<glm::dualquat>& palette, glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        const glm::u16vec4 bones = mesh.bones[v];
        const glm::vec4 weights = mesh.weights[v];
        glm::dualquat blend = palette[bones.x] * weights.x;
        for (int k = 1; k < 4; ++k) {
            const glm::dualquat& bone = palette[bones[k]];
            const float sign = glm::dot(palette[bones.x].real, bone.real) < 0.0f ? -1.0f : 1.0f;
            blend = blend + bone * (sign * weights[k]);
        }
        points[v] = glm::normalize(blend) * mesh.rest_points[v];
    }
}

void qv(const Mesh& mesh, const std::vector<glm::quat>& rotations, const std::vector<glm::vec3>& translations,
        glm::vec3* points) {
    for (std::size_t v = 0; v < mesh.rest_points.size(); ++v) {
        const glm::u16vec4 bones = mesh.bones[v];
        const glm::vec4 weights = mesh.weights[v];
        glm::quat rotation = rotations[bones.x] * weights.x;
        glm::vec3 translation = translations[bones.x] * weights.x;
        for (int k = 1; k < 4; ++k) {
            const glm::quat& bone = rotations[bones[k]];
            const float sign = glm::dot(rotations[bones.x], bone) < 0.0f ? -1.0f : 1.0f;
            rotation = rotation + bone * (sign * weights[k]);
            translation += translations[bones[k]] * weights[k];
        }
        points[v] = glm::normalize(rotation) * mesh.rest_points[v] + translation;
    }
}

}  // namespace plain
