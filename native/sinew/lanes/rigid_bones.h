// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "sinew/lanes/kernels.h"
#include "sinew/transform/convert.h"

namespace sinew {

/// Kernel::prepare for a rigid method: prepares all bones in lanes as if they were rigid, then those with scale
/// again, one by one, with Method::prepare.
///
/// write  stores one prepared bone: write(bone, row, scale)
template <class Method, auto write>
void prepare_rigid_method(const Kernel& kernel, const Bones& bones, Palette& palette) {
    const std::size_t posed = bones.used.size();
    for (const std::int32_t index : bones.stretched) {
        if (static_cast<std::size_t>(index) < posed) palette.scaled[palette.scaled_count++] = index;
    }
    kernel.target().prepare(bones.used, bones.posed_from_rest, palette);
    for (const std::int32_t index : std::span(palette.scaled, palette.scaled_count)) {
        const auto bone = static_cast<std::size_t>(index);
        const auto number = static_cast<std::size_t>(bones.used[bone]);
        const Affine<float> rest_bone = bones.rest_bones.empty() ? Affine<float>{} : bones.rest_bones[bone];
        const auto motion =
            Method::prepare(cast<double>(bones.posed_from_rest[number]), cast<double>(rest_bone));
        write(motion, palette.bones + kernel.rest_row.size() * bone,
              palette.scales + kDisplacementRows * bone);
        palette.sizes[bone] = size_of(to_quat_vec(motion.rigid).translation);
        if (!motion.has_scale) continue;
        if (!palette.any_scale) {
            std::fill_n(palette.has_scale, posed, std::uint8_t{0});
            palette.any_scale = true;
        }
        palette.has_scale[bone] = 1;
    }
}

}  // namespace sinew
