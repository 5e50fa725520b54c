// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/palette.h"

#include "sinew/skinning/dq.h"
#include "sinew/skinning/lbs.h"
#include "sinew/skinning/qv.h"

namespace sinew {
namespace {

// All in double: a few hundred bones, against the rounding of every vertex.

Quad quad(double a, double b, double c, double d) {
    return {{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), static_cast<float>(d)}};
}

Quad quad(const Quat<double>& q) { return quad(q.w, q.x, q.y, q.z); }

void write(const DualQuat<double>& a, Quad* quads) {
    quads[0] = quad(a.real);
    quads[1] = quad(a.dual);
}

void write(const QuatVec<double>& a, Quad* quads) {
    quads[0] = quad(a.rotation);
    quads[1] = quad(a.translation.x, a.translation.y, a.translation.z, 0.0);
}

template <class Method>
void prepare_rigid(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                   std::span<const Affine<float>> rest_bones, Palette& palette) {
    for (const std::int32_t index : used) {
        const auto bone = static_cast<std::size_t>(index);
        const auto motion =
            Method::prepare(cast<double>(posed_from_rest[bone]), cast<double>(rest_bones[bone]));
        write(motion.rigid, &palette.bones[2 * bone]);
        if (!motion.has_scale) continue;
        if (palette.has_scale.empty()) {
            palette.has_scale.assign(posed_from_rest.size(), 0);
            palette.scales.resize(kDisplacementQuads * posed_from_rest.size());
        }
        palette.has_scale[bone] = 1;
        write_displacement(motion.scale, &palette.scales[kDisplacementQuads * bone]);
    }
}

void prepare_lbs(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                 const Affine<float>& bones_from_model, Palette& palette) {
    const bool same_space = is_identity(bones_from_model);
    const auto there = cast<double>(bones_from_model);
    const Affine<double> back = inverse(there);
    for (const std::int32_t index : used) {
        const auto bone = static_cast<std::size_t>(index);
        const auto motion = cast<double>(posed_from_rest[bone]);
        write_displacement(same_space ? motion : back * motion * there,
                           &palette.bones[kDisplacementQuads * bone]);
    }
}

}  // namespace

void prepare(MethodId method, std::span<const std::int32_t> used,
             std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
             const Affine<float>& bones_from_model, Palette& palette) {
    palette.has_scale.clear();
    if (palette.bones.size() < bone_quads(method) * posed_from_rest.size()) {
        palette.bones.resize(bone_quads(method) * posed_from_rest.size());
    }
    switch (method) {
        case MethodId::lbs: return prepare_lbs(used, posed_from_rest, bones_from_model, palette);
        case MethodId::qv: return prepare_rigid<Qv>(used, posed_from_rest, rest_bones, palette);
        case MethodId::dq: return prepare_rigid<Dq>(used, posed_from_rest, rest_bones, palette);
    }
}

void write_displacement(const Affine<double>& a, Quad* quads) noexcept {
    // Without the identity a vertex far from the origin keeps its digits, and the rest pose every bit.
    for (int row = 0; row < 3; ++row) {
        quads[row] =
            quad(a.linear[0][row] - (row == 0 ? 1.0 : 0.0), a.linear[1][row] - (row == 1 ? 1.0 : 0.0),
                 a.linear[2][row] - (row == 2 ? 1.0 : 0.0), a.translation[row]);
    }
}

bool is_identity(const Affine<float>& a) noexcept {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

}  // namespace sinew
