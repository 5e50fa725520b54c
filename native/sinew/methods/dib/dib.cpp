// SPDX-License-Identifier: GPL-3.0-or-later
// Dual quaternion iterative blending on lanes. Rows are those of CentreRows.
//
// All motions are taken about the vertex: as a rotation, and the point to which they move the vertex. A motion
// relative to the blend is then a quotient of rotations and a difference of points, and only the error of the
// point counts. Logarithms are those of motions that follow the blend; those of motions before it, as in
// methods/dib/dib.h, give the same blend.
#include "sinew/methods/dib/dib.h"

#include <numbers>

#define SINEW_THIS_FILE "sinew/methods/dib/dib.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/exponential-inl.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {
namespace {

/// By which share of lengths a point may be off.
inline constexpr float kSettled = 2e-7f;

/// Images of further bones are computed again for each step.
inline constexpr std::size_t kMaxStored = 8;

/// A rigid motion about a vertex: its rotation, of unit length, and the vertex's image.
template <class D>
struct Image {
    Vec<D> rotation[4];
    Points<D> point;
};

/// The product of quaternions.
template <class D>
HWY_INLINE void multiply(const Vec<D>* a, const Vec<D>* b, Vec<D>* product) {
    const Points<D> u{a[1], a[2], a[3]};
    const Points<D> v{b[1], b[2], b[3]};
    const Points<D> vector = add_cross<D>(add_scaled<D>(times<D>(a[0], v), b[0], u), u, v);
    product[0] = hn::MulSub(a[0], b[0], dot<D>(u, v));
    product[1] = vector.x;
    product[2] = vector.y;
    product[3] = vector.z;
}

/// a b*
template <class D>
HWY_INLINE void multiply_by_conjugate(const Vec<D>* a, const Vec<D>* b, Vec<D>* product) {
    const Points<D> u{a[1], a[2], a[3]};
    const Points<D> v{b[1], b[2], b[3]};
    const Points<D> vector = add_cross<D>(add_scaled<D>(times<D>(b[0], u), hn::Neg(a[0]), v), v, u);
    product[0] = hn::MulAdd(a[0], b[0], dot<D>(u, v));
    product[1] = vector.x;
    product[2] = vector.y;
    product[3] = vector.z;
}

/// The sine of half the angle of `q`, at least that of a thousandth of a degree.
template <class D>
HWY_INLINE Vec<D> sine_of(D d, const Vec<D>* q) {
    const Points<D> axis{q[1], q[2], q[3]};
    return hn::Max(hn::Sqrt(dot<D>(axis, axis)), hn::Set(d, 1e-5f));
}

/// The angular part of the logarithm of the rotation by `q`, along the shorter way, as in transform/twist.h; along
/// that of `q` itself where signs are kept.
///
/// These functions return points, not structures of them, which GCC would copy in parts of vectors. Such parts can
/// not be loaded as a whole vector at once.
template <bool kKeepsSigns, class D>
HWY_INLINE Points<D> angular_part(D d, const Vec<D>* q) {
    // angle / sin(angle / 2) as a polynomial in 1 - w of the quaternion with w >= 0, to 4e-8.
    static constexpr float kAngle[] = {2.0f,
                                       0.6666707396507263f,
                                       0.26653313636779785f,
                                       0.11595560610294342f,
                                       0.040326979011297226f,
                                       0.06011835113167763f,
                                       -0.06710599362850189f,
                                       0.10195151716470718f,
                                       -0.0651833787560463f,
                                       0.022325647994875908f};
    const Vec<D> u = hn::Sub(hn::Set(d, 1.0f), hn::Abs(q[0]));
    Vec<D> factor = hn::CopySignToAbs(polynomial(d, u, kAngle), q[0]);
    if constexpr (kKeepsSigns) {
        const Vec<D> round = hn::Div(hn::Set(d, 2.0f * std::numbers::pi_v<float>), sine_of(d, q));
        factor = hn::IfThenElse(hn::Lt(q[0], hn::Zero(d)), hn::Add(round, factor), factor);
    }
    return times<D>(factor, {q[1], q[2], q[3]});
}

/// The linear part, for the motion that rotates by `q`, then adds `translation`.
template <bool kKeepsSigns, class D>
HWY_INLINE Points<D> linear_part(D d, const Vec<D>* q, const Points<D>& angular,
                                 const Points<D>& translation) {
    // (1 - (angle / 2) cot(angle / 2)) / angle^2, in the same way.
    static constexpr float kThird[] = {0.083333320915699f,     0.011112410575151443f,   0.003941489849239588f,
                                       0.001828863169066608f,  -5.928325481363572e-05f, 0.001786231528967619f,
                                       -0.001323370961472392f, 0.0007015004521235824f};
    const Vec<D> u = hn::Sub(hn::Set(d, 1.0f), hn::Abs(q[0]));
    Vec<D> third = polynomial(d, u, kThird);
    if constexpr (kKeepsSigns) {
        const Vec<D> squared = dot<D>(angular, angular);
        const Vec<D> cotangent = hn::Div(q[0], sine_of(d, q));
        const Vec<D> longer =
            hn::Div(hn::NegMulAdd(hn::Mul(hn::Set(d, 0.5f), hn::Sqrt(squared)), cotangent, hn::Set(d, 1.0f)),
                    squared);
        third = hn::IfThenElse(hn::Lt(q[0], hn::Zero(d)), longer, third);
    }
    const Points<D> across = cross<D>(angular, translation);
    return add_scaled<D>(add_scaled<D>(translation, hn::Set(d, -0.5f), across), third,
                         cross<D>(angular, across));
}

/// Moves `image` by an exponential whose angle is at most 180 degrees, as in transform/twist.h. Its origin is the
/// point that the image has now.
template <class D>
HWY_INLINE void move_by(D d, const Points<D>& angular, const Points<D>& linear, hn::Mask<D> active,
                        Image<D>& image) {
    const ExponentialFactors<D> by(d, hn::Mul(hn::Set(d, 0.25f), dot<D>(angular, angular)));
    const Points<D> axis = times<D>(hn::Mul(hn::Set(d, 0.5f), by.sinc), angular);
    const Vec<D> rotation[4] = {by.cosine, axis.x, axis.y, axis.z};
    Vec<D> rotated[4];
    multiply<D>(rotation, image.rotation, rotated);
    for (std::size_t i = 0; i < 4; ++i) {
        image.rotation[i] = hn::IfThenElse(active, rotated[i], image.rotation[i]);
    }
    const Points<D> across = cross<D>(angular, linear);
    const Points<D> first =
        add_scaled<D>(linear, hn::Mul(hn::Set(d, 0.5f), hn::Mul(by.sinc, by.sinc)), across);
    const Points<D> translation = add_scaled<D>(first, by.third, cross<D>(angular, across));
    image.point.x = hn::Add(image.point.x, hn::IfThenElseZero(active, translation.x));
    image.point.y = hn::Add(image.point.y, hn::IfThenElseZero(active, translation.y));
    image.point.z = hn::Add(image.point.z, hn::IfThenElseZero(active, translation.z));
}

/// Bones that all lanes have in common.
template <class D>
struct SharedBones {
    const Palette& palette;
    const std::int32_t* bones;

    HWY_INLINE void find(D d, std::size_t k, const Points<D>& rest, Image<D>& image) const {
        const float* const row = row_of<CentreRows::kNumbers>(palette, bones[k]);
        for (std::size_t i = 0; i < 4; ++i) image.rotation[i] = hn::Set(d, row[i]);
        image.point = displaced(d, row + 4, rest);
        Points<D> added;
        if (scaled(d, palette, bones[k], rest, added)) image.point = add<D>(image.point, added);
    }
};

/// Each lane has its own bones, none of which has scale.
///
/// bones  of the first lane; those of the next lane are `influences` after them
template <class D>
struct OwnBones {
    const Palette& palette;
    const std::int32_t* bones;
    std::size_t influences;

    HWY_INLINE void find(D d, std::size_t k, const Points<D>& rest, Image<D>& image) const {
        constexpr std::size_t kFloat4s = kRowFloat4s<CentreRows>;
        alignas(64) float numbers[kFloat4s][4 * kLanes];
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
            const float* const row = row_of<CentreRows::kNumbers>(palette, bones[influences * lane + k]);
            for (std::size_t i = 0; i < kFloat4s; ++i) {
                std::memcpy(numbers[i] + 4 * lane, row + 4 * i, sizeof(Float4));
            }
        }
        load_float4s(d, numbers[0], image.rotation);
        const auto along = [&](const float* from) HWY_ATTR {
            Vec<D> r[4];
            load_float4s(d, from, r);
            return hn::MulAdd(r[0], rest.x, hn::MulAdd(r[1], rest.y, hn::MulAdd(r[2], rest.z, r[3])));
        };
        image.point = add<D>(rest, {along(numbers[1]), along(numbers[2]), along(numbers[3])});
    }

    static HWY_INLINE void load_float4s(D d, const float* from, Vec<D>* to) {
        hn::LoadInterleaved4(d, from, to[0], to[1], to[2], to[3]);
    }
};

/// What the bones of a vector do to its vertices.
template <class D, class BonesOf>
class Images {
public:
    HWY_INLINE Images(D d, const BonesOf& bones, std::size_t count, const Points<D>& rest)
        : bones_(bones), rest_(rest) {
        for (std::size_t k = 0; k < std::min(count, kMaxStored); ++k) bones.find(d, k, rest, stored_[k]);
    }

    /// space  for an image that is not stored
    HWY_INLINE const Image<D>& at(D d, std::size_t k, Image<D>& space) const {
        if (HWY_LIKELY(k < kMaxStored)) return stored_[k];
        bones_.find(d, k, rest_, space);
        return space;
    }

private:
    const BonesOf& bones_;
    const Points<D>& rest_;
    Image<D> stored_[kMaxStored];
};

/// The blend of dual quaternions, which take the vertex as their origin.
template <bool kKeepsSigns, class D, class BonesOf, class WeightOf>
HWY_INLINE void blend_dual_quaternions(D d, const Images<D, BonesOf>& images, std::size_t count,
                                       const WeightOf& weight_of, const Points<D>& rest, Image<D>& blend) {
    const Vec<D> zero = hn::Zero(d);
    Vec<D> real[4] = {zero, zero, zero, zero};
    // Twice the dual part, (0, translation) times the real part.
    Vec<D> scalar = zero;
    Points<D> vector{zero, zero, zero};
    Image<D> space;
    for (std::size_t k = 0; k < count; ++k) {
        const Image<D>& m = images.at(d, k, space);
        const Vec<D>* const q = m.rotation;
        const Vec<D> along = hn::Add(hn::Add(hn::Mul(q[0], real[0]), hn::Mul(q[2], real[2])),
                                     hn::Add(hn::Mul(q[1], real[1]), hn::Mul(q[3], real[3])));
        const Vec<D> weight = weight_of(k);
        const auto is_away = hn::Lt(kKeepsSigns ? zero : along, zero);
        const Vec<D> signed_weight = hn::IfThenElse(is_away, hn::Neg(weight), weight);
        for (std::size_t i = 0; i < 4; ++i) real[i] = hn::MulAdd(signed_weight, q[i], real[i]);
        const Points<D> translation = times<D>(signed_weight, subtract<D>(m.point, rest));
        const Points<D> axis{q[1], q[2], q[3]};
        scalar = hn::Sub(scalar, dot<D>(translation, axis));
        vector = add_cross<D>(add_scaled<D>(vector, q[0], translation), translation, axis);
    }
    const Vec<D> scale = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared_length(d, real)));
    for (std::size_t i = 0; i < 4; ++i) blend.rotation[i] = hn::Mul(scale, real[i]);
    const Points<D> axis{blend.rotation[1], blend.rotation[2], blend.rotation[3]};
    const Points<D> translation =
        add_cross<D>(add_scaled<D>(times<D>(blend.rotation[0], vector), hn::Neg(scalar), axis), axis, vector);
    blend.point = add_scaled<D>(rest, scale, translation);
}

/// Whether the corrections after this one could move the point by more than kSettled: each leaves at most the
/// share (angle / 180 degrees)^2 of the one before, for the largest angle, and what the error of the rotation
/// adds. In 300,000 random blends up to 2.5 radians apart, the error was at most 0.77 of this bound.
///
/// widest, longest  squares of the largest angle and of the longest linear part
template <class D>
HWY_INLINE hn::Mask<D> has_more_to_do(D d, const Points<D>& angular, const Points<D>& linear, Vec<D> widest,
                                      Vec<D> longest, const Points<D>& point) {
    const Vec<D> share = hn::Min(hn::Mul(hn::Set(d, 0.101321184f), widest), hn::Set(d, 0.99f));
    const Vec<D> settled = hn::Mul(hn::Set(d, kSettled), hn::Sub(hn::Set(d, 1.0f), share));
    const Vec<D> length = hn::Sqrt(longest);
    const Vec<D> angle = hn::Sqrt(hn::Mul(widest, dot<D>(angular, angular)));
    const Vec<D> more = hn::MulAdd(share, hn::Sqrt(dot<D>(linear, linear)),
                                   hn::Mul(hn::Set(d, 0.2f), hn::Mul(angle, length)));
    return hn::Gt(more, hn::Mul(settled, hn::Add(length, hn::Sqrt(dot<D>(point, point)))));
}

/// Blends the lanes of one vector. Each lane gets as many corrections as it needs, so its result does not depend
/// on other lanes.
///
/// first_weight  of the first influence; those of the others are at `weights`, kLanes apart
template <bool kKeepsSigns, class D, class BonesOf>
HWY_INLINE Points<D> blend_iteratively(D d, const BonesOf& bones, std::size_t count,
                                       const float* first_weight, const float* weights,
                                       const Points<D>& rest) {
    const auto weight_of = [&](std::size_t k) HWY_ATTR {
        return hn::Load(d, k == 0 ? first_weight : weights + kLanes * (k - 1));
    };
    const Images<D, BonesOf> images(d, bones, count, rest);
    Image<D> blend;
    blend_dual_quaternions<kKeepsSigns>(d, images, count, weight_of, rest, blend);
    hn::Mask<D> active = hn::Eq(rest.x, rest.x);
    Image<D> space;
    for (int step = 0; step < IterativeDq::kSteps && !hn::AllFalse(d, active); ++step) {
        const Vec<D> zero = hn::Zero(d);
        Points<D> angular{zero, zero, zero};
        Points<D> linear{zero, zero, zero};
        Vec<D> widest = zero;
        Vec<D> longest = zero;
        for (std::size_t k = 0; k < count; ++k) {
            const Image<D>& image = images.at(d, k, space);
            Vec<D> rotation[4];
            multiply_by_conjugate<D>(image.rotation, blend.rotation, rotation);
            const Points<D> own_angular = angular_part<kKeepsSigns>(d, rotation);
            const Points<D> own_linear =
                linear_part<kKeepsSigns>(d, rotation, own_angular, subtract<D>(image.point, blend.point));
            const Vec<D> weight = weight_of(k);
            angular = add_scaled<D>(angular, weight, own_angular);
            linear = add_scaled<D>(linear, weight, own_linear);
            widest = hn::Max(widest, dot<D>(own_angular, own_angular));
            longest = hn::Max(longest, dot<D>(own_linear, own_linear));
        }
        move_by(d, angular, linear, active, blend);
        active = hn::And(active, has_more_to_do(d, angular, linear, widest, longest, blend.point));
    }
    return blend.point;
}

template <bool kKeepsSigns, class D, class BonesOf>
HWY_INLINE void deform_lanes(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                             std::size_t lane, const BonesOf& bones, std::size_t count,
                             const float* first_weight, const float* weights) {
    const Points<D> rest = load_rest(d, pointers, spaces, b, lane);
    store_in_model(d, pointers, spaces, b, lane,
                   blend_iteratively<kKeepsSigns>(d, bones, count, first_weight, weights, rest));
}

/// Deforms blocks [begin, end) with the same bones.
template <bool kKeepsSigns>
void deform_shared(const Frame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const std::size_t influences = pointers.blocks[begin].influences;
    const SharedBones<Full> bones{*frame.palette, frame.bones + pointers.blocks[begin].first_bone};
    for (std::size_t b = begin; b < end; ++b) {
        const float* const weights = weights_of(pointers, b);
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            deform_lanes<kKeepsSigns>(d, pointers, spaces, b, lane, bones, influences,
                                      first_weights_of(frame, b) + lane, weights + lane);
        }
    }
}

/// Deforms a block whose vertices have own bones.
template <bool kKeepsSigns>
void deform_own(const Frame& frame, std::size_t b) {
    const Full d;
    const One one;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const Block& block = pointers.blocks[b];
    const float* const weights = weights_of(pointers, b);
    const std::int32_t* const bones = frame.bones + block.first_bone;
    if (frame.palette->any_scale) {
        for (std::size_t lane = 0; lane < block.vertices; ++lane) {
            const SharedBones<One> of_vertex{*frame.palette, bones + block.influences * lane};
            deform_lanes<kKeepsSigns>(one, pointers, spaces, b, lane, of_vertex, block.influences,
                                      weights + lane, weights + kLanes + lane);
        }
        return;
    }
    const std::size_t lanes = lanes_end(d, block);
    for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
        const OwnBones<Full> of_lanes{*frame.palette, bones + block.influences * lane, block.influences};
        deform_lanes<kKeepsSigns>(d, pointers, spaces, b, lane, of_lanes, block.influences, weights + lane,
                                  weights + kLanes + lane);
    }
}

template <bool kKeepsSigns>
void deform_blocks(const Frame& frame, std::size_t begin, std::size_t end) {
    for_each_set(
        frame, begin, end,
        [&](std::size_t b, std::size_t after) HWY_ATTR { deform_shared<kKeepsSigns>(frame, b, after); },
        [&](std::size_t b) HWY_ATTR { deform_own<kKeepsSigns>(frame, b); });
}

}  // namespace

struct DibKernel : CentreRows, RigidFunctions<IterativeDq, CentreRows> {
    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        const auto of_blocks = frame.palette->keeps_signs ? &deform_blocks<true> : &deform_blocks<false>;
        of_blocks(frame, begin, end);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(IterativeDq, DibKernel)
