// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/palette.h"

#include "sinew/deform/kernels.h"
#include "sinew/skinning/dq.h"
#include "sinew/skinning/lbs.h"
#include "sinew/skinning/qv.h"

namespace sinew {
namespace {

// In double, but for a single subtraction: a few hundred bones, against the rounding of every vertex.

template <class T>
Quad quad(T a, T b, T c, T d) {
    return {{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), static_cast<float>(d)}};
}

// Without the identity a vertex far from the origin keeps its digits, and the rest pose every bit.
void write_displacement(const Affine<double>& a, Quad* quads) {
    const Mat3<double>& m = a.linear;
    const Vec3<double>& shift = a.translation;
    quads[0] = quad(m[0].x - 1.0, m[1].x, m[2].x, shift.x);
    quads[1] = quad(m[0].y, m[1].y - 1.0, m[2].y, shift.y);
    quads[2] = quad(m[0].z, m[1].z, m[2].z - 1.0, shift.z);
}

template <class T>
void write_columns(const Affine<T>& a, Quad* quads) {
    const Mat3<T>& m = a.linear;
    quads[0] = quad(m[0].x - T(1), m[0].y, m[0].z, T(0));
    quads[1] = quad(m[1].x, m[1].y - T(1), m[1].z, T(0));
    quads[2] = quad(m[2].x, m[2].y, m[2].z - T(1), T(0));
    quads[3] = quad(a.translation.x, a.translation.y, a.translation.z, T(0));
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

/// The bones in `palette.scaled`, as skinning/ says.
template <class Method>
void prepare_scaled(std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
                    Palette& palette) {
    for (const std::int32_t index : palette.scaled) {
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
        Quad* const quads = &palette.bones[kLbsQuads * bone];
        if (same_space) {
            write_columns(posed_from_rest[bone], quads);
        } else {
            write_columns(back * cast<double>(posed_from_rest[bone]) * there, quads);
        }
    }
}

}  // namespace

void prepare(MethodId method, std::span<const std::int32_t> used, std::span<const std::int32_t> stretched,
             std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
             const Affine<float>& bones_from_model, Palette& palette) {
    palette.has_scale.clear();
    if (palette.bones.size() < bone_quads(method) * posed_from_rest.size()) {
        palette.bones.resize(bone_quads(method) * posed_from_rest.size());
    }
    if (method == MethodId::lbs) return prepare_lbs(used, posed_from_rest, bones_from_model, palette);
    palette.scaled.assign(stretched.begin(), stretched.end());
    prepare_rigid(method, used, posed_from_rest, palette);
    if (method == MethodId::dq) {
        prepare_scaled<Dq>(posed_from_rest, rest_bones, palette);
    } else {
        prepare_scaled<Qv>(posed_from_rest, rest_bones, palette);
    }
}

bool is_identity(const Affine<float>& a) noexcept {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

std::array<Quad, kDisplacementQuads> displacement_quads(const Affine<double>& a) noexcept {
    std::array<Quad, kDisplacementQuads> quads;
    write_displacement(a, quads.data());
    return quads;
}

}  // namespace sinew
