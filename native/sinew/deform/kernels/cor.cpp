// SPDX-License-Identifier: GPL-3.0-or-later
// Optimised centres of rotation on lanes. A row is the rotation (w, x, y, z), then the rows of what the motion adds to a
// point. A vertex has its centre: x, y, z.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/skinning/cor.h"

#include "sinew/deform/rigid_bones.h"
#include "sinew/deform/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/kernels/cor.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/bones-inl.h"
#include "sinew/deform/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct CorKernel {
    static constexpr std::size_t kNumbers = 16;
    static constexpr std::size_t kVertexFloats = 3;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// The translation that also moves by the rotated scale.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D, kNumbers>& sum) {
        Points<D> by;
        if (!scaled(d, palette, bone, rest, by)) return;
        const Points<D> rotated = rotated_by(d, row_of<kNumbers>(palette, bone), by);
        sum.value[7] = hn::MulAdd(weight, rotated.x, sum.value[7]);
        sum.value[11] = hn::MulAdd(weight, rotated.y, sum.value[11]);
        sum.value[15] = hn::MulAdd(weight, rotated.z, sum.value[15]);
    }

    /// centre  x, y and z, kLanes apart, in model space; null: that of each vertex is the vertex
    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D, kNumbers>& sum, const Points<D>& p,
                                       const float* centre, const float* bones_from_model) {
        Points<D> c = p;
        if (centre != nullptr) {
            c = {hn::Load(d, centre), hn::Load(d, centre + kLanes), hn::Load(d, centre + 2 * kLanes)};
            if (bones_from_model != nullptr) c = displaced(d, bones_from_model, c);
        }
        const Vec<D>* const q = sum.value;
        const Vec<D> squared_norm =
            hn::MulAdd(q[0], q[0], hn::MulAdd(q[1], q[1], hn::MulAdd(q[2], q[2], hn::Mul(q[3], q[3]))));
        const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), squared_norm);
        const auto moved = [&](std::size_t row) HWY_ATTR {
            const Vec<D>* const m = sum.value + row;
            return hn::MulAdd(m[0], c.x, hn::MulAdd(m[1], c.y, hn::MulAdd(m[2], c.z, m[3])));
        };
        const Points<D> from_centre{hn::Sub(p.x, c.x), hn::Sub(p.y, c.y), hn::Sub(p.z, c.z)};
        const Points<D> axis{q[1], q[2], q[3]};
        const Points<D> inner = add_scaled<D>(cross<D>(axis, from_centre), q[0], from_centre);
        const Points<D> displacement =
            add_scaled<D>({moved(4), moved(8), moved(12)}, scale, cross<D>(axis, inner));
        return add<D>(p, displacement);
    }

    static HWY_INLINE void write_row(const Quats& q, const BonePoints& translation, BoneVec* row) {
        const BoneTag d;
        const BoneVec two = hn::Set(d, 2.0);
        const BonePoints v{hn::Mul(two, q.v.x), hn::Mul(two, q.v.y), hn::Mul(two, q.v.z)};
        // 2 v v^T - 2 |v|^2 + 2 w [v]x: the rotation without the identity.
        const BoneVec xx = hn::Mul(v.x, q.v.x);
        const BoneVec yy = hn::Mul(v.y, q.v.y);
        const BoneVec zz = hn::Mul(v.z, q.v.z);
        row[0] = q.w;
        row[1] = q.v.x;
        row[2] = q.v.y;
        row[3] = q.v.z;
        row[4] = hn::Neg(hn::Add(yy, zz));
        row[5] = hn::MulSub(v.x, q.v.y, hn::Mul(v.z, q.w));
        row[6] = hn::MulAdd(v.x, q.v.z, hn::Mul(v.y, q.w));
        row[7] = translation.x;
        row[8] = hn::MulAdd(v.x, q.v.y, hn::Mul(v.z, q.w));
        row[9] = hn::Neg(hn::Add(xx, zz));
        row[10] = hn::MulSub(v.y, q.v.z, hn::Mul(v.x, q.w));
        row[11] = translation.y;
        row[12] = hn::MulSub(v.x, q.v.z, hn::Mul(v.y, q.w));
        row[13] = hn::MulAdd(v.y, q.v.z, hn::Mul(v.x, q.w));
        row[14] = hn::Neg(hn::Add(xx, yy));
        row[15] = translation.z;
    }

private:
    template <class D>
    static HWY_INLINE Points<D> rotated_by(D d, const float* q, const Points<D>& v) {
        const Points<D> axis{hn::Set(d, q[1]), hn::Set(d, q[2]), hn::Set(d, q[3])};
        const Points<D> inner = add_scaled<D>(cross<D>(axis, v), hn::Set(d, q[0]), v);
        return add_scaled<D>(v, hn::Set(d, 2.0f), cross<D>(axis, inner));
    }
};

void deform_cor(const Frame& frame, std::size_t begin, std::size_t end) {
    deform_rigid<CorKernel>(frame, begin, end);
}

void prepare_cor(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                 Palette& palette) {
    prepare_rigid<CorKernel>(used, posed_from_rest, palette);
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}, {{0, 0, 0, 0}}};

void write_bone(const Cor::Bone<double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.rotation);
    write_displacement(to_affine(bone.rigid), row + 1);
    write_displacement(bone.scale, scale);
}

constexpr Kernel kKernel{kRestRow, true, 0, prepare_rigid_method<Cor, write_bone>,
                         SINEW_TARGETS(deform_cor, prepare_cor)};

}  // namespace

const Kernel& Cor::kernel() noexcept { return kKernel; }

}  // namespace sinew

#endif
