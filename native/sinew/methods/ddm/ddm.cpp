// SPDX-License-Identifier: GPL-3.0-or-later
// Direct delta mush on lanes. Rows are those of CentreRows. The vertex data is BoneMoments.
#include "sinew/methods/ddm/ddm.h"

#include <algorithm>
#include <cstring>

#include "sinew/methods/ddm/bone_moments.h"

#define SINEW_THIS_FILE "sinew/methods/ddm/ddm.cpp"
#include "hwy/cache_control.h"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {
namespace {

// The nearest rotation is found if the two parts of a step, tangents of half angles, have at most this squared
// product.
inline constexpr float kLastStep = 1e-14f;

// Steps from the blended quaternion. Lanes that need more are far from it, and are solved one by one.
inline constexpr int kMaxSteps = 6;

// Below this, the determinant of a step's matrix relative to the cube of its trace shows no maximum to go to.
inline constexpr float kSingularStep = 1e-6f;

enum class Variant { nearest, quaternion, weights };

inline constexpr std::size_t kDdmNumbers = CentreRows::kNumbers;

// Rows of further bones are computed again for each vector.
inline constexpr std::size_t kMaxPrepared = kMaxResolved;

/// The bones of a range of blocks, at least one, with rows in the form in which they are added.
///
/// The last 12 numbers of a row apply to points in model space. Unless the sum of bones is absolute, these are
/// differences from the first bone for all but the first; if signs are resolved, so are the quaternions.
class MomentBones {
public:
    HWY_INLINE MomentBones(const Frame& frame, const std::int32_t* bones, std::size_t bone_count)
        : palette_(*frame.palette),
          bones_(bones),
          from_model_(frame.spaces.bones_from_model),
          count(bone_count) {
        // Palette::may_need_absolute_sum does not know the bones of moments.
        is_absolute = sinew::needs_absolute_sum(palette_, bones, count);
        // Within 45 degrees of the first, all are within 90 degrees of each other.
        is_resolved = !is_absolute && count <= kMaxPrepared &&
                      copy_aligned<CentreRows, true>(palette_, bones, count, rows_) > kCosine45;
        if (HWY_LIKELY(is_resolved)) {
            for (std::size_t k = 0; k < count; ++k) to_model(rows_ + kDdmNumbers * k);
            return;
        }
        const std::size_t prepared = std::min(count, kMaxPrepared);
        load(0, rows_);
        for (std::size_t k = 1; k < prepared; ++k) load(k, rows_ + kDdmNumbers * k);
        resolve_signs();
        for (std::size_t k = 1; k < prepared && !is_absolute; ++k) {
            subtract_first(rows_ + kDdmNumbers * k, is_resolved ? 0 : 4);
        }
    }

    /// kDdmNumbers for each bone, of up to kMaxPrepared.
    [[nodiscard]] HWY_INLINE const float* rows() const { return rows_; }

    /// The row [kDdmNumbers] of bone k.
    ///
    /// space  for a row that is not stored
    HWY_INLINE const float* row(std::size_t k, float* space) const {
        if (HWY_LIKELY(k < kMaxPrepared)) return rows_ + kDdmNumbers * k;
        load(k, space);
        if (!is_absolute) subtract_first(space, 4);
        return space;
    }

private:
    HWY_INLINE void load(std::size_t k, float* row) const {
        std::memcpy(row, row_of<kDdmNumbers>(palette_, bones_[k]), sizeof(float) * kDdmNumbers);
        to_model(row);
    }

    /// Converts a row, or a difference of rows, to model space.
    HWY_INLINE void to_model(float* row) const {
        if (from_model_ == nullptr) return;
        for (std::size_t i = 4; i < kDdmNumbers; i += 4) {
            const float* const r = row + i;
            float moved[4];
            for (std::size_t c = 0; c < 4; ++c) {
                moved[c] =
                    r[c] + (r[0] * from_model_[c] + (r[1] * from_model_[4 + c] + r[2] * from_model_[8 + c]));
            }
            std::memcpy(row + i, moved, sizeof(moved));
        }
    }

    HWY_INLINE void subtract_first(float* row, std::size_t begin) const {
        for (std::size_t i = begin; i < kDdmNumbers; ++i) row[i] -= rows_[i];
    }

    HWY_INLINE void resolve_signs() {
        if (count > kMaxPrepared) return;
        float* const rows = rows_;
        for (std::size_t k = 1; k < count; ++k) {
            float* const q = rows + kDdmNumbers * k;
            if (dot(q, rows) < 0.0f) {
                for (std::size_t i = 0; i < 4; ++i) q[i] = -q[i];
            }
        }
        is_resolved = signs_agree(rows, kDdmNumbers, count);
    }

    const Palette& palette_;
    const std::int32_t* bones_;
    const float* from_model_;
    alignas(64) float rows_[kDdmNumbers * kMaxPrepared];

public:
    std::size_t count;
    bool is_absolute = false;
    bool is_resolved = false;
};

HWY_INLINE const BoneMoments& moments_of(const Frame& frame) {
    return static_cast<const BoneMoments&>(*frame.vertex_data);
}

/// The parts of a block's moments, from the current lanes on.
struct MomentRows {
    const float* first_weight;
    const float* weight;
    const float* first;
    const float* second;
};

HWY_INLINE MomentRows rows_of(const BoneMoments& moments, std::size_t b, std::size_t lane) {
    const auto& first_rows = moments.blocks[b].first_rows;
    const auto part = [&](MomentPart which) {
        const auto i = static_cast<std::size_t>(which);
        return moments.parts[i].data()[first_rows[i]].lane.data() + lane;
    };
    return {part(MomentPart::first_weight), part(MomentPart::weight), part(MomentPart::first),
            part(MomentPart::second)};
}

/// Prefetches the moments of block `b`, if it exists. The hardware prefetcher does not, because the rows of the
/// first bone are skipped: apart from sums over all bones they are not needed.
HWY_INLINE void prefetch_moments(const Frame& frame, std::size_t b) {
    const BoneMoments& moments = moments_of(frame);
    if (b >= moments.blocks.size()) return;
    const std::size_t bones = moments.blocks[b].bones;
    const MomentRows rows = rows_of(moments, b, 0);
    const auto fetch = [](const float* part, std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) hwy::Prefetch(part + kLanes * row);
    };
    fetch(rows.weight, 0, 2 + bones);
    fetch(rows.first, 3, 3 * bones);
    fetch(rows.second, 0, 6);
    fetch(rows.second, 12, 6 + 6 * bones);
}

/// One row of a part.
template <class D>
HWY_INLINE Vec<D> load_row(D d, const float* part, std::size_t row) {
    return hn::Load(d, part + kLanes * row);
}

/// The weights of bone k, `lane` lanes after the current ones.
template <class D>
HWY_INLINE Vec<D> load_weight(D d, const MomentRows& rows, std::size_t k, std::size_t lane = 0) {
    return hn::Load(d, (k == 0 ? rows.first_weight : rows.weight + kLanes * (2 + k)) + lane);
}

/// Three consecutive rows of a part.
template <class D>
HWY_INLINE Points<D> load_point(D d, const float* part, std::size_t row) {
    return {load_row(d, part, row), load_row(d, part, row + 1), load_row(d, part, row + 2)};
}

/// Adds to each of kVectors `sum` the image of the point `p` and its weight under a bone's `row`.
template <std::size_t kVectors, class D>
HWY_INLINE void add_moved(D d, const float* row, const Points<D>* p, const Vec<D>* weight, Points<D>* sum) {
    const auto along = [&](const float* r, Vec<D> Points<D>::*axis) HWY_ATTR {
        const Vec<D> x = hn::Set(d, r[0]);
        const Vec<D> y = hn::Set(d, r[1]);
        const Vec<D> z = hn::Set(d, r[2]);
        const Vec<D> translation = hn::Set(d, r[3]);
        for (std::size_t v = 0; v < kVectors; ++v) {
            Vec<D> to = hn::MulAdd(translation, weight[v], sum[v].*axis);
            to = hn::MulAdd(x, p[v].x, to);
            to = hn::MulAdd(y, p[v].y, to);
            sum[v].*axis = hn::MulAdd(z, p[v].z, to);
        }
    };
    along(row + 4, &Points<D>::x);
    along(row + 8, &Points<D>::y);
    along(row + 12, &Points<D>::z);
}

/// Adds a quaternion in the hemisphere of the sum before it.
template <class D>
HWY_INLINE void add_signed(D d, const float* q, Vec<D> weight, Vec<D>* sum) {
    const Vec<D> signed_weight = hn::IfThenElse(hn::Lt(dot(d, q, sum), hn::Zero(d)), hn::Neg(weight), weight);
    for (std::size_t i = 0; i < 4; ++i) sum[i] = hn::MulAdd(signed_weight, hn::Set(d, q[i]), sum[i]);
}

/// Blends the bones of kVectors neighbouring vectors by the moments: the quaternion, and the displacement of the
/// centroid.
///
/// kCount  the number of bones, or 0 for any number
template <bool kFirst, bool kResolved, std::size_t kCount, std::size_t kVectors, class D>
HWY_INLINE void blend_moments(D d, const MomentBones& bones, const MomentRows& rows,
                              const Points<D>* centroids, Motion<D>* motions) {
    alignas(64) float space[kDdmNumbers];
    const std::size_t step = hn::Lanes(d);
    const Vec<D> zero = hn::Zero(d);
    Points<D> moved[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v) {
        moved[v] = {zero, zero, zero};
        for (Vec<D>& number : motions[v].rotation) number = zero;
    }
    const bool is_absolute = !kResolved && bones.is_absolute;
    if (!is_absolute) {
        const float* const first = bones.row(0, space);
        Vec<D> one[kVectors];
        for (Vec<D>& weight : one) weight = hn::Set(d, 1.0f);
        add_moved<kVectors>(d, first, centroids, one, moved);
        for (std::size_t v = 0; v < kVectors; ++v) {
            if (kResolved) {
                for (std::size_t i = 0; i < 4; ++i) motions[v].rotation[i] = hn::Set(d, first[i]);
            } else {
                add_signed<D>(d, first, load_weight(d, rows, 0, v * step), motions[v].rotation);
            }
        }
    }
    const std::size_t count = kCount > 0 ? kCount : bones.count;
    for (std::size_t k = is_absolute ? 0 : 1; k < count; ++k) {
        const float* const row = bones.row(k, space);
        Vec<D> weight[kVectors];
        Points<D> first[kVectors];
        for (std::size_t v = 0; v < kVectors; ++v) {
            weight[v] = load_weight(d, rows, k, v * step);
            if constexpr (kFirst) {
                first[v] = load_point(d, rows.first + v * step, 3 * k);
            } else {
                first[v] = times<D>(weight[v], centroids[v]);
            }
        }
        add_moved<kVectors>(d, row, first, weight, moved);
        if (kResolved) {
            for (std::size_t i = 0; i < 4; ++i) {
                const Vec<D> number = hn::Set(d, row[i]);
                for (std::size_t v = 0; v < kVectors; ++v) {
                    motions[v].rotation[i] = hn::MulAdd(weight[v], number, motions[v].rotation[i]);
                }
            }
        } else {
            for (std::size_t v = 0; v < kVectors; ++v) {
                add_signed<D>(d, row, weight[v], motions[v].rotation);
            }
        }
    }
    for (std::size_t v = 0; v < kVectors; ++v) motions[v].displacement = moved[v];
}

/// A 3x3 matrix, by rows.
template <class D>
struct Rows3 {
    Points<D> x;
    Points<D> y;
    Points<D> z;
};

/// A symmetric 3x3 matrix.
template <class D>
struct Symmetric {
    Vec<D> xx, yy, zz, yz, xz, xy;
};

template <class D>
HWY_INLINE Symmetric<D> load_symmetric(D d, const float* part, std::size_t at) {
    return {load_row(d, part, at),     load_row(d, part, at + 1), load_row(d, part, at + 2),
            load_row(d, part, at + 3), load_row(d, part, at + 4), load_row(d, part, at + 5)};
}

/// Adds r m to `sum`, for a row r of three numbers.
template <class D>
HWY_INLINE Points<D> add_product(D d, const float* r, const Symmetric<D>& m, const Points<D>& sum) {
    const Vec<D> x = hn::Set(d, r[0]);
    const Vec<D> y = hn::Set(d, r[1]);
    const Vec<D> z = hn::Set(d, r[2]);
    return {hn::MulAdd(x, m.xx, hn::MulAdd(y, m.xy, hn::MulAdd(z, m.xz, sum.x))),
            hn::MulAdd(x, m.xy, hn::MulAdd(y, m.yy, hn::MulAdd(z, m.yz, sum.y))),
            hn::MulAdd(x, m.xz, hn::MulAdd(y, m.yz, hn::MulAdd(z, m.zz, sum.z)))};
}

/// The correlation matrix of the posed neighbourhood, in the space of the bones, with the neighbourhood at rest,
/// in model space.
///
/// displacement  of the centroid
template <bool kResolved, std::size_t kCount, class D>
HWY_INLINE Rows3<D> correlation(D d, const MomentBones& bones, const MomentRows& rows,
                                const Points<D>& centroid, const Points<D>& displacement,
                                const float* from_model) {
    alignas(64) float space[kDdmNumbers];
    const Symmetric<D> total = load_symmetric(d, rows.second, 0);
    Rows3<D> sum{
        {total.xx, total.xy, total.xz}, {total.xy, total.yy, total.yz}, {total.xz, total.yz, total.zz}};
    const auto add_rows = [&](const float* x, const float* y, const float* z, const Symmetric<D>& m)
                              HWY_ATTR {
                                  sum.x = add_product(d, x, m, sum.x);
                                  sum.y = add_product(d, y, m, sum.y);
                                  sum.z = add_product(d, z, m, sum.z);
                              };
    if (from_model != nullptr) add_rows(from_model, from_model + 4, from_model + 8, total);
    const bool is_absolute = !kResolved && bones.is_absolute;
    if (!is_absolute) {
        const float* const first = bones.row(0, space);
        add_rows(first + 4, first + 8, first + 12, total);
    }
    const Vec<D> one = hn::Set(d, 1.0f);
    const Vec<D> zero = hn::Zero(d);
    const std::size_t count = kCount > 0 ? kCount : bones.count;
    for (std::size_t k = is_absolute ? 0 : 1; k < count; ++k) {
        const float* const row = bones.row(k, space);
        add_rows(row + 4, row + 8, row + 12, load_symmetric(d, rows.second, 6 + 6 * k));
        // The first moments about the centroid have sum 0, so only differences between bones count.
        Points<D> moved =
            is_absolute ? Points<D>{hn::Neg(displacement.x), hn::Neg(displacement.y), hn::Neg(displacement.z)}
                        : Points<D>{zero, zero, zero};
        add_moved<1>(d, row, &centroid, &one, &moved);
        const Vec<D> weight = load_weight(d, rows, k);
        const Points<D> about_centroid =
            add_scaled<D>(load_point(d, rows.first, 3 * k), hn::Neg(weight), centroid);
        sum.x = add_scaled<D>(sum.x, moved.x, about_centroid);
        sum.y = add_scaled<D>(sum.y, moved.y, about_centroid);
        sum.z = add_scaled<D>(sum.z, moved.z, about_centroid);
    }
    return sum;
}

template <class D>
HWY_INLINE Vec<D> largest(const Points<D>& r) {
    return hn::Max(hn::Abs(r.x), hn::Max(hn::Abs(r.y), hn::Abs(r.z)));
}

/// R(q)^T m.
template <class D>
HWY_INLINE Rows3<D> rotated_back(D d, const Vec<D>* q, const Rows3<D>& m) {
    const Vec<D> norm = squared_norm<D>(q);
    const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), norm);
    const Vec<D> x = hn::Mul(scale, q[1]);
    const Vec<D> y = hn::Mul(scale, q[2]);
    const Vec<D> z = hn::Mul(scale, q[3]);
    const Vec<D> wx = hn::Mul(x, q[0]);
    const Vec<D> wy = hn::Mul(y, q[0]);
    const Vec<D> wz = hn::Mul(z, q[0]);
    const Vec<D> xx = hn::Mul(x, q[1]);
    const Vec<D> xy = hn::Mul(x, q[2]);
    const Vec<D> xz = hn::Mul(x, q[3]);
    const Vec<D> yy = hn::Mul(y, q[2]);
    const Vec<D> yz = hn::Mul(y, q[3]);
    const Vec<D> zz = hn::Mul(z, q[3]);
    // Row i of the result is the rows of m weighted by column i of the rotation. The identity is added
    // separately.
    const auto combined = [&](const Points<D>& row, Vec<D> a, Vec<D> b, Vec<D> c) HWY_ATTR {
        return add_scaled<D>(add_scaled<D>(add_scaled<D>(row, a, m.x), b, m.y), c, m.z);
    };
    return {combined(m.x, hn::Neg(hn::Add(yy, zz)), hn::Add(xy, wz), hn::Sub(xz, wy)),
            combined(m.y, hn::Sub(xy, wz), hn::Neg(hn::Add(xx, zz)), hn::Add(yz, wx)),
            combined(m.z, hn::Add(xz, wy), hn::Sub(yz, wx), hn::Neg(hn::Add(xx, yy)))};
}

/// Takes one step from `q`, of any length, towards the rotation nearest to `matrix`: q times (1, v). Lanes whose
/// matrix has no maximum to go to take no step; of all rotations only the nearest one is a maximum. Returns
/// whether it is found.
///
/// With S = R(q)^T matrix, a the axial vector of S - S^T and H = trace(S) - (S + S^T) / 2, Newton's step is v =
/// H^-1 a / 2. After it, a is exactly -(a.v) v / (1 + v.v), so the same H gives a second part of the step. The
/// remaining error is of the fourth order: about the product of both parts.
template <class D>
HWY_INLINE hn::Mask<D> step_to_nearest(D d, const Rows3<D>& matrix, Vec<D>* q) {
    const Rows3<D> s = rotated_back(d, q, matrix);
    const Points<D> slope{hn::Sub(s.z.y, s.y.z), hn::Sub(s.x.z, s.z.x), hn::Sub(s.y.x, s.x.y)};
    const Vec<D> half = hn::Set(d, -0.5f);
    const Vec<D> xx = hn::Add(s.y.y, s.z.z);
    const Vec<D> yy = hn::Add(s.x.x, s.z.z);
    const Vec<D> zz = hn::Add(s.x.x, s.y.y);
    const Vec<D> yz = hn::Mul(half, hn::Add(s.y.z, s.z.y));
    const Vec<D> xz = hn::Mul(half, hn::Add(s.x.z, s.z.x));
    const Vec<D> xy = hn::Mul(half, hn::Add(s.x.y, s.y.x));
    const Points<D> first{hn::MulSub(yy, zz, hn::Mul(yz, yz)), hn::MulSub(yz, xz, hn::Mul(xy, zz)),
                          hn::MulSub(xy, yz, hn::Mul(yy, xz))};
    const Vec<D> second_y = hn::MulSub(xx, zz, hn::Mul(xz, xz));
    const Vec<D> second_z = hn::MulSub(xy, xz, hn::Mul(xx, yz));
    const Vec<D> minor = hn::MulSub(xx, yy, hn::Mul(xy, xy));
    const Vec<D> determinant = hn::MulAdd(xx, first.x, hn::MulAdd(xy, first.y, hn::Mul(xz, first.z)));
    const Vec<D> trace = hn::Add(s.x.x, xx);
    const Vec<D> least = hn::Mul(hn::Mul(hn::Set(d, kSingularStep), trace), hn::Mul(trace, trace));
    const Vec<D> zero = hn::Zero(d);
    const auto has_maximum = hn::And(hn::And(hn::Gt(xx, zero), hn::Gt(minor, zero)),
                                     hn::And(hn::Gt(determinant, least), hn::Gt(trace, zero)));
    const Vec<D> scale = hn::IfThenElseZero(
        has_maximum, hn::Div(hn::Set(d, 0.5f), hn::IfThenElse(has_maximum, determinant, hn::Set(d, 1.0f))));
    const auto solved = [&](const Points<D>& v, Vec<D> factor) HWY_ATTR {
        const auto along = [&](Vec<D> a, Vec<D> b, Vec<D> c) HWY_ATTR {
            return hn::Mul(factor, hn::MulAdd(a, v.x, hn::MulAdd(b, v.y, hn::Mul(c, v.z))));
        };
        return Points<D>{along(first.x, first.y, first.z), along(first.y, second_y, second_z),
                         along(first.z, second_z, minor)};
    };
    const Points<D> newton = solved(slope, scale);
    const Points<D> second = solved(newton, hn::Mul(hn::Neg(scale), dot<D>(slope, newton)));
    const Vec<D> square = dot<D>(newton, newton);
    const Vec<D> second_square = dot<D>(second, second);
    // Far from the nearest rotation the second part may lead away from it.
    const auto is_near = hn::Lt(second_square, hn::Mul(hn::Set(d, 0.25f), square));
    const Points<D> v = add_scaled<D>(newton, hn::IfThenElseZero(is_near, hn::Set(d, 1.0f)), second);
    const Vec<D> w = hn::NegMulAdd(q[1], v.x, hn::NegMulAdd(q[2], v.y, hn::NegMulAdd(q[3], v.z, q[0])));
    const Vec<D> i = hn::MulAdd(q[0], v.x, hn::MulAdd(q[2], v.z, hn::NegMulAdd(q[3], v.y, q[1])));
    const Vec<D> j = hn::MulAdd(q[0], v.y, hn::MulAdd(q[3], v.x, hn::NegMulAdd(q[1], v.z, q[2])));
    const Vec<D> k = hn::MulAdd(q[0], v.z, hn::MulAdd(q[1], v.y, hn::NegMulAdd(q[2], v.x, q[3])));
    q[0] = w;
    q[1] = i;
    q[2] = j;
    q[3] = k;
    const Vec<D> left = hn::Mul(square, second_square);
    return hn::And(has_maximum, hn::Lt(left, hn::Set(d, kLastStep)));
}

/// Finds the nearest rotations of lanes where `is_found` is false, one by one; the blended quaternion if there is
/// none.
///
/// matrix  its largest entry must be 1
template <class D>
HWY_NOINLINE void find_others(D d, const Rows3<D>& matrix, hn::Mask<D> is_found, const Vec<D>* blended,
                              Vec<D>* q) {
    constexpr std::size_t kMax = hn::MaxLanes(D());
    alignas(64) float numbers[9][kMax];
    alignas(64) float rotations[4][kMax];
    alignas(64) float found[kMax];
    const Points<D>* const rows[] = {&matrix.x, &matrix.y, &matrix.z};
    for (std::size_t i = 0; i < 3; ++i) {
        hn::Store(rows[i]->x, d, numbers[3 * i]);
        hn::Store(rows[i]->y, d, numbers[3 * i + 1]);
        hn::Store(rows[i]->z, d, numbers[3 * i + 2]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
        hn::Store(hn::IfThenElse(is_found, q[i], blended[i]), d, rotations[i]);
    }
    hn::Store(hn::IfThenElseZero(is_found, hn::Set(d, 1.0f)), d, found);
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
        if (found[lane] != 0.0f) continue;
        Mat3<double> own;
        for (int i = 0; i < 9; ++i) {
            own[i % 3][i / 3] = static_cast<double>(numbers[static_cast<std::size_t>(i)][lane]);
        }
        const NearestRotation<double> nearest = nearest_rotation(own);
        if (!(nearest.gap > kLeastGap)) continue;
        rotations[0][lane] = static_cast<float>(nearest.rotation.w);
        rotations[1][lane] = static_cast<float>(nearest.rotation.x);
        rotations[2][lane] = static_cast<float>(nearest.rotation.y);
        rotations[3][lane] = static_cast<float>(nearest.rotation.z);
    }
    for (std::size_t i = 0; i < 4; ++i) q[i] = hn::Load(d, rotations[i]);
}

/// Replaces the blended quaternion `q` by the rotation nearest to `matrix`.
///
/// is_point  lanes that keep their quaternion
template <class D>
HWY_INLINE void to_nearest(D d, Rows3<D> matrix, hn::Mask<D> is_point, const float* from_model, Vec<D>* q) {
    if (from_model != nullptr) {
        matrix = {displaced_vector(d, from_model, matrix.x), displaced_vector(d, from_model, matrix.y),
                  displaced_vector(d, from_model, matrix.z)};
    }
    // Scaled, so that the cubes of its entries fit into floats.
    const Vec<D> size = hn::Max(largest(matrix.x), hn::Max(largest(matrix.y), largest(matrix.z)));
    const Vec<D> scale = hn::Div(hn::Set(d, 1.0f), hn::Max(size, hn::Set(d, 1e-37f)));
    matrix = {times<D>(scale, matrix.x), times<D>(scale, matrix.y), times<D>(scale, matrix.z)};
    const Vec<D> blended[4] = {q[0], q[1], q[2], q[3]};
    hn::Mask<D> is_found = is_point;
    for (int step = 1; step <= kMaxSteps; ++step) {
        is_found = hn::Or(is_point, step_to_nearest(d, matrix, q));
        if (hn::AllTrue(d, is_found)) break;
    }
    for (std::size_t i = 0; i < 4; ++i) q[i] = hn::IfThenElse(is_point, blended[i], q[i]);
    if (HWY_UNLIKELY(!hn::AllTrue(d, is_found))) find_others(d, matrix, is_found, blended, q);
}

/// Whether the neighbourhood counts as a point, see Ddm.
///
/// second  the part with second moments
template <class D>
HWY_INLINE hn::Mask<D> is_point_at(D d, const float* second, const Points<D>& centroid) {
    const Points<D> diagonal = load_point(d, second, 0);
    const Vec<D> extent = hn::Add(diagonal.x, hn::Add(diagonal.y, diagonal.z));
    const Vec<D> least = hn::Mul(hn::Set(d, static_cast<float>(kLeastExtent)), dot<D>(centroid, centroid));
    return hn::Not(hn::Gt(extent, least));
}

/// Adds to `sum` the displacements by the bones' scales, with the weights of lane `lane` in block `b`.
template <class D>
HWY_INLINE Points<D> add_scales(D d, const Frame& frame, std::size_t b, std::size_t lane,
                                const Points<D>& rest, const Points<D>& sum) {
    Points<D> total = sum;
    const Block& block = frame.mesh->blocks[b];
    // Vertices with own bones are processed one by one.
    const std::int32_t* const bones =
        frame.bones + block.first_bone + (block.own_bones ? block.influences * lane : 0);
    const float* weights = weights_of(pointers_of(frame), b) + lane;
    for (std::size_t k = 0; k < block.influences; ++k) {
        const float* const of_bone = block.own_bones ? weights + kLanes * k
                                     : k == 0        ? first_weights_of(frame, b) + lane
                                                     : weights + kLanes * (k - 1);
        Points<D> added;
        if (!scaled(d, *frame.palette, bones[k], rest, added)) continue;
        total = add_scaled<D>(total, hn::Load(d, of_bone), added);
    }
    return total;
}

/// Deforms lanes [lane, lane + kVectors * N) of a block.
template <Variant kVariant, bool kResolved, std::size_t kCount = 0, std::size_t kVectors = 1, class D>
HWY_INLINE void deform_lanes(D d, const Frame& frame, const MeshPointers& pointers, const Spaces& spaces,
                             const MomentBones& bones, std::size_t b, std::size_t lane) {
    const MomentRows rows = rows_of(moments_of(frame), b, lane);
    const std::size_t step = hn::Lanes(d);
    Points<D> centroids[kVectors];
    Motion<D> motions[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v) centroids[v] = load_point(d, rows.weight + v * step, 0);
    if constexpr (kVariant == Variant::weights && kResolved) {
        blend_motions<kVectors, kCount>(d, bones.rows(), bones.count, rows.weight + 3 * kLanes, centroids,
                                        motions);
    } else {
        blend_moments<kVariant != Variant::weights, kResolved, kCount, kVectors>(d, bones, rows, centroids,
                                                                                 motions);
    }
    if constexpr (kVariant == Variant::nearest) {
        const Rows3<D> matrix = correlation<kResolved, kCount>(
            d, bones, rows, centroids[0], motions[0].displacement, spaces.bones_from_model);
        to_nearest(d, matrix, is_point_at(d, rows.second, centroids[0]), spaces.bones_from_model,
                   motions[0].rotation);
    }
    for (std::size_t v = 0; v < kVectors; ++v, lane += step) {
        const Points<D> rest = load_rest(d, pointers, spaces, b, lane);
        Points<D> displacement = motions[v].displacement;
        if (frame.palette->any_scale) displacement = add_scales(d, frame, b, lane, rest, displacement);
        const Points<D> from_centroid = subtract<D>(rest, to_bones(d, spaces, centroids[v]));
        store_in_model(d, pointers, spaces, b, lane,
                       add<D>(rest, add_rotation<D>(d, displacement, motions[v].rotation, from_centroid)));
    }
}

/// Deforms blocks [begin, end) with the same bones.
///
/// kCount  the number of bones, or 0 for any number
template <Variant kVariant, bool kResolved, std::size_t kCount = 0>
void deform_blocks(const Frame& frame, const MomentBones& bones, std::size_t begin, std::size_t end) {
    const Full d;
    // The matrices of variant 0 leave no registers for a second vector.
    constexpr std::size_t kVectors = kResolved && kVariant != Variant::nearest ? kVectorsAtOnce : 1;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    for (std::size_t b = begin; b < end; ++b) {
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        if (kVariant == Variant::nearest) prefetch_moments(frame, b + 1);
        for (std::size_t lane = 0; lane < lanes; lane += kVectors * hn::Lanes(d)) {
            if (kVectors > 1 && lane + hn::Lanes(d) >= lanes) {
                deform_lanes<kVariant, kResolved, kCount>(d, frame, pointers, spaces, bones, b, lane);
            } else {
                deform_lanes<kVariant, kResolved, kCount, kVectors>(d, frame, pointers, spaces, bones, b,
                                                                    lane);
            }
        }
    }
}

template <Variant kVariant>
void deform_set_of(const Frame& frame, std::size_t begin, std::size_t end) {
    const MomentBlock& block = moments_of(frame).blocks[begin];
    const MomentBones bones(frame, &moments_of(frame).bones[block.first_bone], block.bones);
    if (bones.is_absolute || !bones.is_resolved)
        return deform_blocks<kVariant, false>(frame, bones, begin, end);
    switch (bones.count) {
        case 1: return deform_blocks<kVariant, true, 1>(frame, bones, begin, end);
        case 2: return deform_blocks<kVariant, true, 2>(frame, bones, begin, end);
        case 3: return deform_blocks<kVariant, true, 3>(frame, bones, begin, end);
        case 4: return deform_blocks<kVariant, true, 4>(frame, bones, begin, end);
        default: return deform_blocks<kVariant, true>(frame, bones, begin, end);
    }
}

/// Deforms a block lane by lane, where lanes have their own bones: those of the moments, or those with scale.
template <Variant kVariant>
void deform_lane_by_lane(const Frame& frame, std::size_t b) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const MomentBlock& block = moments_of(frame).blocks[b];
    for (std::size_t lane = 0; lane < pointers.blocks[b].vertices; ++lane) {
        const std::size_t first = block.first_bone + (block.own_bones ? block.bones * lane : 0);
        const MomentBones bones(frame, &moments_of(frame).bones[first], block.bones);
        if (bones.is_resolved && !bones.is_absolute) {
            deform_lanes<kVariant, true>(d, frame, pointers, spaces, bones, b, lane);
        } else {
            deform_lanes<kVariant, false>(d, frame, pointers, spaces, bones, b, lane);
        }
    }
}

template <Variant kVariant>
void deform_by(const Frame& frame, std::size_t begin, std::size_t end) {
    const std::vector<MomentBlock>& blocks = moments_of(frame).blocks;
    const auto is_alone = [&](std::size_t b) {
        return blocks[b].own_bones || (frame.palette->any_scale && frame.mesh->blocks[b].own_bones);
    };
    for (std::size_t b = begin; b < end;) {
        std::size_t after = b + 1;
        if (frame.mesh->blocks[b].influences == 0) {
            keep_blocks(frame, b, after);
        } else if (is_alone(b)) {
            deform_lane_by_lane<kVariant>(frame, b);
        } else {
            while (after < end && !is_alone(after) && frame.mesh->blocks[after].influences > 0 &&
                   blocks[after].first_bone == blocks[b].first_bone) {
                ++after;
            }
            deform_set_of<kVariant>(frame, b, after);
        }
        b = after;
    }
}

}  // namespace

struct DdmKernel : LinearRows, RigidFunctions<Ddm, LinearRows> {
    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        if (frame.vertex_data == nullptr) return deform_rigid<LinearRows>(frame, begin, end);
        switch (static_cast<int>(frame.parameters[0])) {
            case 1: return deform_by<Variant::quaternion>(frame, begin, end);
            case 2: return deform_by<Variant::weights>(frame, begin, end);
            default: return deform_by<Variant::nearest>(frame, begin, end);
        }
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Ddm, DdmKernel, .pack_vertex_data = pack_moments)
