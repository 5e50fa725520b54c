// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtx/dual_quaternion.hpp>
#include <vector>

namespace plain {

/// Four influences for each vertex, as in most tutorials.
struct Mesh {
    std::vector<glm::vec3> rest_points;
    std::vector<glm::u16vec4> bones;
    std::vector<glm::vec4> weights;
};

void lbs(const Mesh& mesh, const std::vector<glm::mat4>& palette, glm::vec3* points);
void dq(const Mesh& mesh, const std::vector<glm::dualquat>& palette, glm::vec3* points);
void qv(const Mesh& mesh, const std::vector<glm::quat>& rotations, const std::vector<glm::vec3>& translations,
        glm::vec3* points);

namespace eigen {

void lbs(const Mesh& mesh, const std::vector<glm::mat4>& palette, glm::vec3* points);
void dq(const Mesh& mesh, const std::vector<glm::dualquat>& palette, glm::vec3* points);
void qv(const Mesh& mesh, const std::vector<glm::quat>& rotations, const std::vector<glm::vec3>& translations,
        glm::vec3* points);

}  // namespace eigen

}  // namespace plain
