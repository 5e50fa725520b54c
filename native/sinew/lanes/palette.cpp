// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/lanes/palette.h"

#include <algorithm>
#include <limits>

#include "sinew/lanes/kernels.h"

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

float size_of(const Vec3<double>& translation, double length_squared) noexcept {
    if (!(length_squared < kLong)) return std::numeric_limits<float>::infinity();
    return std::max(static_cast<float>(glm::dot(translation, translation)), kMinSize * kMinSize);
}

bool is_identity(const Affine<float>& a) noexcept {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

void prepare(const Kernel& kernel, const Bones& bones, Palette& palette) noexcept {
    palette.scaled_count = 0;
    palette.any_scale = false;
    if (kernel.set_bone_size > 0) return kernel.prepare(kernel, bones, palette);
    // Nearly always all of them are posed.
    std::size_t posed = bones.used.size();
    while (posed > 0 && static_cast<std::size_t>(bones.used[posed - 1]) >= bones.posed_from_rest.size()) {
        --posed;
    }
    Bones of_pose = bones;
    of_pose.used = bones.used.first(posed);
    kernel.prepare(kernel, of_pose, palette);
    const std::size_t size = kernel.rest_row.size();
    for (std::size_t i = posed; i < bones.used.size(); ++i) {
        std::ranges::copy(kernel.rest_row, palette.bones + size * i);
        if (palette.any_scale) palette.has_scale[i] = 0;
        palette.sizes[i] = kMinSize * kMinSize;
    }
}

}  // namespace sinew
