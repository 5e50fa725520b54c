// SPDX-License-Identifier: GPL-3.0-or-later
// Motions of bones, with one bone in each lane, and their rows in a palette. Compiled once for each instruction set.
#if defined(SINEW_LANES_BONES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_BONES_INL_H_
#undef SINEW_LANES_BONES_INL_H_
#else
#define SINEW_LANES_BONES_INL_H_
#endif

#include <algorithm>
#include <bit>

#include "sinew/lanes/lanes-inl.h"
#include "sinew/transform/split_scale.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

/// Numbers in a bone's row, unless its method has more: two Float4.
inline constexpr std::size_t kRow = 8;

/// The largest number of them in any method.
inline constexpr std::size_t kMaxRow = 16;

/// A weighted sum of rows.
template <class D, std::size_t kNumbers = kRow>
struct Sum {
    Vec<D> value[kNumbers];
};

template <std::size_t kNumbers = kRow>
HWY_INLINE const float* row_of(const Palette& palette, std::int32_t bone) {
    return palette.bones[kNumbers / 4 * static_cast<std::size_t>(bone)].value.data();
}

/// Computes what the scale of `bone` adds to the vertex at `rest`: its displacement, rotated as the bone is. Returns
/// false if the bone has no scale.
template <class D>
HWY_INLINE bool scaled(D d, const Palette& palette, std::int32_t bone, const Points<D>& rest,
                       Points<D>& added) {
    const auto index = static_cast<std::size_t>(bone);
    if (!palette.any_scale || palette.has_scale[index] == 0) return false;
    added = displacement(d, palette.scales[kDisplacementRows * index].value.data(), rest);
    return true;
}

// In double, because digits that a bone loses are lost for each of its vertices.
using BoneTag = hn::CappedTag<double, 8>;
using BoneVec = Vec<BoneTag>;
using BonePoints = Points<BoneTag>;

/// Affine transforms, by columns.
struct Motions {
    BonePoints x;
    BonePoints y;
    BonePoints z;
    BonePoints translation;
};

/// The motions of the posed bones from `first` on, one in each lane. Further lanes repeat the last bone.
HWY_INLINE Motions load_motions(const Bones& bones, std::size_t first) {
    const BoneTag d;
    const std::span used = bones.used.subspan(first, bones.posed - first);
    const Affine<float>* const motions = bones.pose.posed_from_rest.data();
    alignas(64) double numbers[12][hn::MaxLanes(BoneTag())];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
        static_assert(sizeof(Affine<float>) == 12 * sizeof(float));
        const float* const from = &motions[used[std::min(lane, used.size() - 1)]].linear[0].x;
        for (std::size_t i = 0; i < 12; ++i) numbers[i][lane] = static_cast<double>(from[i]);
    }
    const auto column = [&](std::size_t i) HWY_ATTR {
        return BonePoints{hn::Load(d, numbers[3 * i]), hn::Load(d, numbers[3 * i + 1]),
                          hn::Load(d, numbers[3 * i + 2])};
    };
    return {column(0), column(1), column(2), column(3)};
}

HWY_INLINE hn::Mask<BoneTag> is_rotation(const Motions& m) {
    const BoneTag d;
    const BoneVec one = hn::Set(d, 1.0);
    const auto is_small = [d](BoneVec v) HWY_ATTR { return hn::Lt(hn::Abs(v), hn::Set(d, kOrthonormal)); };
    const auto unit = hn::And(is_small(hn::Sub(dot<BoneTag>(m.x, m.x), one)),
                              hn::And(is_small(hn::Sub(dot<BoneTag>(m.y, m.y), one)),
                                      is_small(hn::Sub(dot<BoneTag>(m.z, m.z), one))));
    const auto square = hn::And(is_small(dot<BoneTag>(m.x, m.y)),
                                hn::And(is_small(dot<BoneTag>(m.y, m.z)), is_small(dot<BoneTag>(m.z, m.x))));
    const auto unmirrored = hn::Ge(dot<BoneTag>(m.x, cross<BoneTag>(m.y, m.z)), hn::Zero(d));
    return hn::And(unmirrored, hn::And(unit, square));
}

struct Quats {
    BoneVec w;
    BonePoints v;
};

/// to_quat() without branches. The matrix gives four multiples of the quaternion, each by one of its components;
/// the multiple by the largest component is the most accurate.
HWY_INLINE Quats rotations(const Motions& m) {
    const BoneTag d;
    const BoneVec one = hn::Set(d, 1.0);
    const BonePoints difference{hn::Sub(m.y.z, m.z.y), hn::Sub(m.z.x, m.x.z), hn::Sub(m.x.y, m.y.x)};
    const BonePoints sum{hn::Add(m.y.z, m.z.y), hn::Add(m.z.x, m.x.z), hn::Add(m.x.y, m.y.x)};
    const BoneVec more = hn::Add(one, m.x.x);
    const BoneVec less = hn::Sub(one, m.x.x);
    const BoneVec yz = hn::Add(m.y.y, m.z.z);
    const BoneVec y_z = hn::Sub(m.y.y, m.z.z);
    const Quats multiples[4] = {{hn::Add(more, yz), difference},
                                {difference.x, {hn::Sub(more, yz), sum.z, sum.y}},
                                {difference.y, {sum.z, hn::Add(less, y_z), sum.x}},
                                {difference.z, {sum.y, sum.x, hn::Sub(less, y_z)}}};
    const BoneVec by[4] = {multiples[0].w, multiples[1].v.x, multiples[2].v.y, multiples[3].v.z};
    Quats q = multiples[0];
    BoneVec largest = by[0];
    for (int i = 1; i < 4; ++i) {
        const auto larger = hn::Gt(by[i], largest);
        largest = hn::Max(by[i], largest);
        q.w = hn::IfThenElse(larger, multiples[i].w, q.w);
        q.v.x = hn::IfThenElse(larger, multiples[i].v.x, q.v.x);
        q.v.y = hn::IfThenElse(larger, multiples[i].v.y, q.v.y);
        q.v.z = hn::IfThenElse(larger, multiples[i].v.z, q.v.z);
    }
    BoneVec scale = hn::Div(one, hn::Sqrt(hn::MulAdd(q.w, q.w, dot<BoneTag>(q.v, q.v))));
    scale = hn::IfThenElse(hn::Lt(q.w, hn::Zero(d)), hn::Neg(scale), scale);
    return {hn::Mul(scale, q.w), times<BoneTag>(scale, q.v)};
}

/// Sets Palette::may_need_absolute_sum from the sizes, once per frame for each pair of bones, so that the test runs for
/// few vertices.
inline void find_absolute_sums(const Bones& bones, Palette& palette) {
    const hn::CappedTag<float, kLanes> d;
    const hn::RebindToSigned<decltype(d)> indices;
    const auto ratio = hn::Set(d, kMaxSizeRatio * kMaxSizeRatio);
    std::fill_n(palette.may_need_absolute_sum, bones.used.size(), std::uint8_t{0});
    for (std::size_t i = 0; i < bones.pairs->first.size(); i += hn::Lanes(d)) {
        const std::int32_t* const first_bones = &bones.pairs->first[i];
        const auto first = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, first_bones));
        const auto later = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, &bones.pairs->later[i]));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::Not(hn::Lt(first, hn::Mul(ratio, later))), bits);
        for (auto pairs_left = static_cast<std::uint32_t>(bits[0] | bits[1] << 8); pairs_left != 0;
             pairs_left &= pairs_left - 1) {
            palette.may_need_absolute_sum[first_bones[std::countr_zero(pairs_left)]] = 1;
        }
    }
}

/// Writes the rows and sizes of all posed bones as if they were rigid, and adds the indices of those that are not to
/// palette.scaled, of which there are `scaled`. Returns how many there are then.
template <class Rows>
HWY_INLINE std::size_t write_rigid_rows(const Bones& bones, std::size_t scaled, Palette& palette) {
    const BoneTag d;
    constexpr std::size_t kMax = hn::MaxLanes(BoneTag());
    constexpr std::size_t kNumbers = Rows::kNumbers;
    for (std::size_t i = 0; i < bones.posed; i += kMax) {
        const Motions motions = load_motions(bones, i);
        BoneVec row[kNumbers];
        Rows::write_row(rotations(motions), motions.translation, row);
        alignas(64) double numbers[kNumbers][kMax];
        alignas(64) double rigid[kMax];
        for (std::size_t k = 0; k < kNumbers; ++k) hn::Store(row[k], d, numbers[k]);
        const BoneVec sizes =
            hn::Max(dot<BoneTag>(motions.translation, motions.translation), hn::Set(d, kMinSize * kMinSize));
        const hn::Rebind<float, BoneTag> floats;
        hn::StoreU(hn::DemoteTo(floats, sizes), floats, palette.sizes + i);
        hn::Store(hn::IfThenElseZero(is_rotation(motions), hn::Set(d, 1.0)), d, rigid);
        const std::size_t count = std::min(kMax, bones.posed - i);
        for (std::size_t lane = 0; lane < count; ++lane) {
            if (rigid[lane] == 0.0) palette.scaled[scaled++] = static_cast<std::int32_t>(i + lane);
            float* const to = palette.bones[kNumbers / 4 * (i + lane)].value.data();
            for (std::size_t k = 0; k < kNumbers; ++k) to[k] = static_cast<float>(numbers[k][lane]);
        }
    }
    return scaled;
}

/// Writes the row and the size of one bone.
template <class Rows>
void write_row(std::size_t bone, QuatVec<double> motion, Palette& palette) {
    Quat<double>& q = motion.rotation;
    // Without a sign, as rotations() gives it.
    if (Rows::kSignedFloat4s == 0 && q.w < 0.0) q = -q;
    const BoneTag d;
    const auto vector = [d](const auto& v) HWY_ATTR {
        return BonePoints{hn::Set(d, v.x), hn::Set(d, v.y), hn::Set(d, v.z)};
    };
    BoneVec row[Rows::kNumbers];
    Rows::write_row({hn::Set(d, q.w), vector(q)}, vector(motion.translation), row);
    float* const to = palette.bones[Rows::kNumbers / 4 * bone].value.data();
    for (std::size_t k = 0; k < Rows::kNumbers; ++k) to[k] = static_cast<float>(hn::GetLane(row[k]));
    palette.sizes[bone] = size_of(motion.translation);
}

/// Writes the row and the scale of a bone by Method::prepare().
template <class Method, class Rows>
void write_scaled_row(const Bones& bones, std::size_t bone, Palette& palette) {
    const auto motion = Method::prepare(cast<double>(bones.motion(bone)), bones.rest_bone(bone));
    const QuatVec<double> rigid = to_quat_vec(motion.rigid);
    write_row<Rows>(bone, rigid, palette);
    if (!motion.has_scale) return;
    if (!palette.any_scale) std::fill_n(palette.has_scale, bones.used.size(), std::uint8_t{0});
    palette.any_scale = true;
    palette.has_scale[bone] = 1;
    Rows::write_scale(rigid.rotation, motion.scale, palette.scales + kDisplacementRows * bone);
}

/// Kernel::fill_palette for a method that blends rotations.
template <class Method, class Rows>
void fill_rigid(const Bones& bones, bool keeps_signs, Palette& palette) {
    palette.any_scale = false;
    palette.keeps_signs = keeps_signs;
    std::size_t scaled = 0;
    for (const std::int32_t bone : bones.stretched) {
        if (static_cast<std::size_t>(bone) < bones.posed) palette.scaled[scaled++] = bone;
    }
    scaled = write_rigid_rows<Rows>(bones, scaled, palette);
    for (std::size_t bone = bones.posed; bone < bones.used.size(); ++bone) write_row<Rows>(bone, {}, palette);
    for (const std::int32_t bone : std::span(palette.scaled, scaled)) {
        write_scaled_row<Method, Rows>(bones, static_cast<std::size_t>(bone), palette);
    }
    if (keeps_signs) take_signs(bones, Rows::kNumbers / 4, Rows::kSignedFloat4s, palette);
    find_absolute_sums(bones, palette);
}

/// Rows with a translation among their numbers: kFirst, and two more, each kStep behind the one before.
template <std::size_t kSize, std::size_t kFirst, std::size_t kStep>
struct TranslatedRows {
    static constexpr std::size_t kNumbers = kSize;
    static constexpr RowLayout kRows{kNumbers / 4};

    /// Adds what the bone's scale adds to the translation.
    template <class D>
    static HWY_INLINE void add_scale(D d, const Palette& palette, std::int32_t bone, Vec<D> weight, Vec<D>,
                                     const Points<D>& rest, Sum<D, kSize>& sum) {
        Points<D> added;
        if (!scaled(d, palette, bone, rest, added)) return;
        Vec<D>* const translation = sum.value + kFirst;
        translation[0] = hn::MulAdd(weight, added.x, translation[0]);
        translation[kStep] = hn::MulAdd(weight, added.y, translation[kStep]);
        translation[2 * kStep] = hn::MulAdd(weight, added.z, translation[2 * kStep]);
    }

    static void write_scale(const Quat<double>& rotation, const Affine<double>& scale, Float4* rows) {
        write_rotated_scale(rotation, scale, rows);
    }
};

/// What methods have in common that rotate a vertex about a point which the bones move. A row is the rotation
/// (w, x, y, z), then the displacement rows of the motion.
struct CentreRows : TranslatedRows<16, 7, 4> {
    static constexpr std::size_t kSignedFloat4s = 1;

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

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
