// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/pose/continued_rotations.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sinew/base/fail.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

Quat<double> rotation_of(const Mat3<double>& linear) {
    Mat3<double> axes = linear;
    for (int i = 0; i < 3; ++i) {
        const double length = glm::length(axes[i]);
        axes[i] *= length > 0.0 ? 1.0 / length : 0.0;
    }
    return quat_of_columns(axes);
}

/// Whether `rotation` is against `before` in the other hemisphere, or, where `turn` is known, in that of -turn.
bool is_away(const Quat<double>& rotation, const Quat<double>& before, const Quat<double>& turn) {
    const double length = glm::length(turn);
    if (length > 0.0) {
        const double along = glm::dot(before * turn, rotation) / length;
        if (std::abs(along) > std::cos(0.5 * kTurnsAgree)) return along < 0.0;
    }
    return glm::dot(rotation, before) < 0.0;
}

}  // namespace

std::vector<Quat<float>> continued_rotations(std::span<const std::int32_t> parents,
                                             std::span<const Affine<float>> posed_from_rest,
                                             std::span<const Quat<float>> turns) {
    for (std::size_t bone = 0; bone < parents.size(); ++bone) {
        if (parents[bone] >= -1 && parents[bone] < static_cast<std::int32_t>(bone)) continue;
        fail("parents", "-1 or the index of an earlier bone",
             std::to_string(parents[bone]) + " for bone " + std::to_string(bone));
    }
    const std::size_t count = std::min(parents.size(), posed_from_rest.size());
    std::vector<Quat<double>> rotations;
    std::vector<Quat<float>> result;
    for (std::size_t bone = 0; bone < count; ++bone) {
        const std::int32_t parent = parents[bone];
        const Quat<double> before =
            parent < 0 ? Quat<double>(1.0, Vec3<double>(0.0)) : rotations[static_cast<std::size_t>(parent)];
        const Mat3<double> linear(posed_from_rest[bone].linear);
        const Quat<double> rotation = glm::determinant(linear) < 0.0 ? before : rotation_of(linear);
        const Quat<double> turn(bone < turns.size() ? turns[bone] : Quat<float>(0.0f, Vec3<float>(0.0f)));
        rotations.push_back(is_away(rotation, before, turn) ? -rotation : rotation);
        result.emplace_back(rotations.back());
    }
    return result;
}

}  // namespace sinew
