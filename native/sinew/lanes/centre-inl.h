// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of bones for methods that rotate a vertex about a point that the bones move. Compiled once for each
// instruction set.
#if defined(SINEW_LANES_CENTRE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_CENTRE_INL_H_
#undef SINEW_LANES_CENTRE_INL_H_
#else
#define SINEW_LANES_CENTRE_INL_H_
#endif

#include "sinew/lanes/bones-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// The common part of these kernels. A row is the rotation (w, x, y, z), then the displacement rows of the motion.
struct CentreRows {
    static constexpr std::size_t kNumbers = 16;

    /// Adds the displacement by the bone's scale, rotated, to the translation.
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

    static HWY_INLINE void write_row(const Quats& q, const BonePoints& translation, BoneVec* row) {
        const BoneTag d;
        const BoneVec two = hn::Set(d, 2.0);
        const BonePoints v = times<BoneTag>(two, q.v);
        // The rotation minus the identity: 2 v v^T - 2 |v|^2 + 2 w [v]x.
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
};

/// A blend of rows at a point: the quaternion, of any length, and the displacement of the point.
template <class D>
struct Motion {
    Vec<D> rotation[4];
    Points<D> displacement;
};

/// The displacement of `p` along one axis, by that axis' row of a displacement.
template <class D>
HWY_INLINE Vec<D> moved_along(const Vec<D>* row, const Points<D>& p) {
    return hn::MulAdd(row[0], p.x, hn::MulAdd(row[1], p.y, hn::MulAdd(row[2], p.z, row[3])));
}

/// The motion of `p` by a sum of rows.
template <class D>
HWY_INLINE Motion<D> motion_at(const Sum<D, CentreRows::kNumbers>& sum, const Points<D>& p) {
    const Vec<D>* const row = sum.value;
    return {{row[0], row[1], row[2], row[3]},
            {moved_along(row + 4, p), moved_along(row + 8, p), moved_along(row + 12, p)}};
}

/// Linear blending, for vertices without data of the method.
struct LinearRows : CentreRows {
    static constexpr std::size_t kSignedFloat4s = 0;

    template <class D>
    static HWY_INLINE Points<D> centre(D, const MeshPointers&, const Spaces&, std::size_t, std::size_t,
                                       const Points<D>& p) {
        return p;
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D, const Motion<D>& motion, const Points<D>&, const Points<D>& p) {
        return add<D>(p, motion.displacement);
    }
};

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
