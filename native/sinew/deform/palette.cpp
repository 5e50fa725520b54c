// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/palette.h"

#include <algorithm>
#include <limits>

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

float size_of(const Vec3<double>& translation, double length_squared = 0.0) {
    if (!(length_squared < kLong)) return std::numeric_limits<float>::infinity();
    return std::max(static_cast<float>(glm::dot(translation, translation)), kLeastSize * kLeastSize);
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
void prepare_scaled(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                    std::span<const Affine<float>> rest_bones, Palette& palette) {
    for (const std::int32_t index : std::span(palette.scaled, palette.scaled_count)) {
        const auto bone = static_cast<std::size_t>(index);
        const auto posed = static_cast<std::size_t>(used[bone]);
        const Affine<float> rest_bone = rest_bones.empty() ? Affine<float>{} : rest_bones[bone];
        const auto motion = Method::prepare(cast<double>(posed_from_rest[posed]), cast<double>(rest_bone));
        write(motion.rigid, &palette.bones[2 * bone]);
        palette.sizes[bone] = size_of(to_quat_vec(motion.rigid).translation);
        if (!motion.has_scale) continue;
        if (!palette.any_scale) {
            std::fill_n(palette.has_scale, used.size(), std::uint8_t{0});
            palette.any_scale = true;
        }
        palette.has_scale[bone] = 1;
        write_displacement(motion.scale, &palette.scales[kDisplacementQuads * bone]);
    }
}

/// lbs where the bones are in another space than the points.
void prepare_between_spaces(std::span<const std::int32_t> used,
                            std::span<const Affine<float>> posed_from_rest,
                            const Affine<float>& bones_from_model, Palette& palette) {
    const auto there = cast<double>(bones_from_model);
    const Affine<double> back = inverse(there);
    for (std::size_t i = 0; i < used.size(); ++i) {
        const Affine<float>& posed = posed_from_rest[static_cast<std::size_t>(used[i])];
        const Affine<double> motion = back * cast<double>(posed) * there;
        const Mat3<double> m = motion.linear - Mat3<double>(1.0);
        Quad* const quads = &palette.bones[kLbsQuads * i];
        for (int c = 0; c < 3; ++c) quads[c] = quad(m[c].x, m[c].y, m[c].z, 0.0);
        const Vec3<double>& shift = motion.translation;
        quads[3] = quad(shift.x, shift.y, shift.z, 0.0);
        palette.sizes[i] = size_of(shift, glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
    }
}

}  // namespace

void prepare(MethodId method, std::span<const std::int32_t> used, std::span<const std::int32_t> stretched,
             std::span<const Affine<float>> posed_from_rest, std::span<const Affine<float>> rest_bones,
             const Affine<float>& bones_from_model, Palette& palette) noexcept {
    palette.scaled_count = 0;
    palette.any_scale = false;
    // All but always all of them.
    std::size_t posed = used.size();
    while (posed > 0 && static_cast<std::size_t>(used[posed - 1]) >= posed_from_rest.size()) --posed;
    if (method == MethodId::lbs) {
        if (is_identity(bones_from_model)) {
            prepare_bones(method, used.first(posed), posed_from_rest, palette);
        } else {
            prepare_between_spaces(used.first(posed), posed_from_rest, bones_from_model, palette);
        }
    } else {
        for (const std::int32_t index : stretched) {
            if (static_cast<std::size_t>(index) < posed) palette.scaled[palette.scaled_count++] = index;
        }
        prepare_bones(method, used.first(posed), posed_from_rest, palette);
        if (method == MethodId::dq) {
            prepare_scaled<Dq>(used, posed_from_rest, rest_bones, palette);
        } else {
            prepare_scaled<Qv>(used, posed_from_rest, rest_bones, palette);
        }
    }
    for (std::size_t i = posed; i < used.size(); ++i) {
        Quad* const row = &palette.bones[bone_quads(method) * i];
        std::fill_n(row, bone_quads(method), Quad{});
        if (method != MethodId::lbs) row[0] = quad(Quat<double>(1.0, 0.0, 0.0, 0.0));
        palette.sizes[i] = kLeastSize * kLeastSize;
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
