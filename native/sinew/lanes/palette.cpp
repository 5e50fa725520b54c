// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/lanes/palette.h"

#include <algorithm>
#include <limits>

#include "sinew/lanes/kernel.h"

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
    if (!(length_squared < kMaxStretchSquared)) return std::numeric_limits<float>::infinity();
    return std::max(static_cast<float>(glm::dot(translation, translation)), kMinSize * kMinSize);
}

bool is_identity(const Affine<float>& a) noexcept {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

namespace {

/// Whether `rotation`, of the bone with this number, has the other sign than bones.pose.rotations.
bool is_away(const Bones& bones, std::size_t number, const Quat<double>& rotation) noexcept {
    if (number >= bones.pose.rotations.size()) return rotation.w < 0.0;
    return glm::dot(Quat<double>(bones.pose.rotations[number]), rotation) < 0.0;
}

/// Gives rows the signs of bones.pose.rotations.
void take_signs(const Kernel& kernel, const Bones& bones, const Palette& palette) noexcept {
    for (std::size_t i = 0; i < bones.used.size(); ++i) {
        Float4* const row = palette.bones + kernel.rest_row.size() * i;
        const auto& [w, x, y, z] = row->value;
        if (!is_away(bones, static_cast<std::size_t>(bones.used[i]), Quat<double>(w, {x, y, z}))) continue;
        for (std::size_t k = 0; k < kernel.signed_float4s; ++k) {
            for (float& number : row[k].value) number = -number;
        }
    }
}

/// Prepares all bones one by one, for rows of sets.
void prepare_posed(const Bones& bones, Palette& palette) noexcept {
    for (std::size_t bone = 0; bone < bones.used.size(); ++bone) {
        const auto number = static_cast<std::size_t>(bones.used[bone]);
        palette.posed[bone] = {};
        if (number >= bones.pose.posed_from_rest.size()) continue;
        palette.posed[bone] =
            scaled_rigid(cast<double>(bones.pose.posed_from_rest[number]), bones.rest_bone(bone));
        palette.any_scale = palette.any_scale || palette.posed[bone].has_scale;
        Quat<double>& rotation = palette.posed[bone].rigid.rotation;
        if (palette.keeps_signs && is_away(bones, number, rotation)) rotation = -rotation;
    }
    if (palette.any_scale) std::fill_n(palette.has_scale, bones.sets->bones.size(), std::uint8_t{0});
}

}  // namespace

void fill_palette(const Kernel& kernel, const BonePairs& pairs, const Bones& bones, bool keeps_signs,
                  Palette& palette) noexcept {
    palette.scaled_count = 0;
    palette.any_scale = false;
    palette.keeps_signs = keeps_signs && kernel.signed_float4s > 0;
    if (kernel.set_rows != nullptr) {
        prepare_posed(bones, palette);
        kernel.set_rows(bones, palette);
        // Pairs are pairs of bones, but these rows belong to sets, so each set has to be tested.
        std::fill_n(palette.may_need_absolute_sum, bones.sets->bones.size(), std::uint8_t{1});
        return;
    }
    // Nearly always all of them are posed.
    std::size_t posed = bones.used.size();
    while (posed > 0 &&
           static_cast<std::size_t>(bones.used[posed - 1]) >= bones.pose.posed_from_rest.size()) {
        --posed;
    }
    Bones of_pose = bones;
    of_pose.used = bones.used.first(posed);
    if (kernel.scaled_bone_rows != nullptr) {
        for (const std::int32_t index : bones.stretched) {
            if (static_cast<std::size_t>(index) < posed) palette.scaled[palette.scaled_count++] = index;
        }
    }
    kernel.bone_rows[target_in_use()](of_pose, palette);
    if (kernel.scaled_bone_rows != nullptr) kernel.scaled_bone_rows(of_pose, palette);
    if (palette.keeps_signs) take_signs(kernel, of_pose, palette);
    const std::size_t size = kernel.rest_row.size();
    for (std::size_t i = posed; i < bones.used.size(); ++i) {
        std::ranges::copy(kernel.rest_row, palette.bones + size * i);
        if (palette.any_scale) palette.has_scale[i] = 0;
        palette.sizes[i] = kMinSize * kMinSize;
    }
    find_absolute_sums(pairs, bones.used.size(), palette);
}

}  // namespace sinew
