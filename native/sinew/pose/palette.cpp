// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/pose/palette.h"

#include <algorithm>
#include <limits>

namespace sinew {

// Computed in double, except for a single subtraction: bones are few, and their rounding affects every vertex.

void write_displacement(const Mat3<double>& m, const Vec3<double>& translation, Float4* rows) noexcept {
    rows[0] = float4(m[0].x, m[1].x, m[2].x, translation.x);
    rows[1] = float4(m[0].y, m[1].y, m[2].y, translation.y);
    rows[2] = float4(m[0].z, m[1].z, m[2].z, translation.z);
}

// Without the identity, a vertex far from the origin keeps its digits, and the rest pose is exact.
void write_displacement(const Affine<double>& a, Float4* rows) noexcept {
    write_displacement(a.linear - Mat3<double>(1.0), a.translation, rows);
}

void write_rotated_scale(const Quat<double>& rotation, const Affine<double>& scale, Float4* rows) noexcept {
    const Mat3<double> by = to_mat3(rotation);
    write_displacement(by * (scale.linear - Mat3<double>(1.0)), by * scale.translation, rows);
}

float size_of(const Vec3<double>& translation, double length_squared) noexcept {
    if (!(length_squared < kMaxStretchSquared)) return std::numeric_limits<float>::infinity();
    return std::max(static_cast<float>(glm::dot(translation, translation)), kMinSize * kMinSize);
}

bool is_identity(const Affine<float>& a) noexcept {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

bool is_away(const Bones& bones, std::size_t bone, const Quat<double>& rotation) noexcept {
    const auto number = static_cast<std::size_t>(bones.used[bone]);
    if (number >= bones.pose.rotations.size()) return rotation.w < 0.0;
    return glm::dot(Quat<double>(bones.pose.rotations[number]), rotation) < 0.0;
}

void take_signs(const Bones& bones, std::size_t row_float4s, std::size_t signed_float4s,
                const Palette& palette) noexcept {
    for (std::size_t bone = 0; bone < bones.used.size(); ++bone) {
        Float4* const row = palette.bones + row_float4s * bone;
        const auto& [w, x, y, z] = row->value;
        if (!is_away(bones, bone, Quat<double>(w, {x, y, z}))) continue;
        for (std::size_t k = 0; k < signed_float4s; ++k) {
            for (float& number : row[k].value) number = -number;
        }
    }
}

}  // namespace sinew
