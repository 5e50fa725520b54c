// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

#include "sinew/interpolate/blended.h"

namespace sinew {

// Each method is a type with a name, the representation that it works with, and
//   between(a, b, t)             from `a` at t = 0 to `b` at t = 1; other t extrapolate
//   blend(transforms, weights)   for n >= 1 transforms and as many weights of any sign, normalised to sum 1; for
//                                other numbers not defined: the identity
// All rotations must have unit length; otherwise the result is not defined (has_unit_rotation()). If the sum of
// the weights is not positive, or if the result overflows, the result is not defined and is the heaviest
// transform. Of equal weights the first counts as the heaviest; if another order would then give another blend
// (order_decides()), the result is not defined.

/// The methods that compute their result from a weighted sum, with
///   finished(total, heaviest)    `total` has weights of sum 1, and is defined where its signs are
template <class Method, template <class> class Of>
struct Linear {
    template <class T>
    using Transform = Of<T>;

    /// blend() of `a` and `b`, with `b` in the hemisphere of `a`. Has no loops, and takes a quarter of the time.
    template <class T>
    [[nodiscard]] static Blended<Of<T>> between(const Of<T>& a, const Of<T>& b, T t) noexcept {
        const T s = T(1) - t;
        const Of<T> onto = aligned(b, a);
        const Of<T>& heaviest = s < t ? onto : a;
        // Weights that nearly cancel, as in shares().
        if (!(T(1) > T(kDegenerateBlend) * (s < t ? t : s))) return {heaviest, false};
        const Blended<Of<T>> total{sum(scaled(s, a), scaled(t, onto)), has_shorter_way(a, b, t)};
        return finite_or(Method::finished(total, heaviest), heaviest);
    }

    template <BlendSigns signs = BlendSigns::kToHeaviest, class T>
    [[nodiscard]] static Blended<Of<T>> blend(std::span<const Of<T>> transforms,
                                              std::span<const T> weights) noexcept {
        if (transforms.empty() || weights.size() != transforms.size()) return {{}, false};
        const Shares<T> share = shares(weights);
        const Of<T>& heaviest = transforms[share.heaviest];
        if (!share.is_defined) return {heaviest, false};
        return finite_or(Method::finished(weighted_sum<signs>(transforms, weights, share), heaviest),
                         heaviest);
    }
};

/// The componentwise sum of the matrices. Not rigid between different rotations, and flat between opposite ones
/// (Smith 2013, section 3.5.2). Matrices have no sign, so there is no shortest path to choose; always defined.
struct MatrixLinear : Linear<MatrixLinear, Affine> {
    static constexpr std::string_view name = "matrix_linear";

    template <class T>
    [[nodiscard]] static Blended<Affine<T>> finished(const Blended<Affine<T>>& total,
                                                     const Affine<T>& /*heaviest*/) noexcept {
        return total;
    }
};

/// MatrixLinear made rigid: the rotation nearest to the sum (polar decomposition; Shoemake and Duff 1992).
/// Between two transforms it takes the shorter way, but not at constant speed: the closer to 180 degrees they
/// are, the more of the motion happens around t = 1/2. Depends on the origin.
///
/// Not defined if several rotations are equally near (180 degrees at equal weights): the linear part is then that
/// of the heaviest transform.
struct MatrixPolar : Linear<MatrixPolar, Affine> {
    static constexpr std::string_view name = "matrix_polar";

    template <class T>
    [[nodiscard]] static Blended<Affine<T>> finished(const Blended<Affine<T>>& total,
                                                     const Affine<T>& heaviest) noexcept {
        const Vec3<T>& translation = total.transform.translation;
        const NearestRotation<T> nearest = nearest_rotation(total.transform.linear);
        if (nearest.gap < T(kDegenerateBlend)) return {{heaviest.linear, translation}, false};
        return {{to_mat3(nearest.rotation), translation}, true};
    }
};

/// Rotations by normalised sum, translations by mean (Smith 2013, sections 2.2.1 and 2.3.1, direct quaternion
/// blending). Between two transforms it takes the shorter way, not at constant speed. Depends on the origin.
///
/// Not defined if a rotation is 180 degrees from the heaviest (its sign as given then decides), or if the sum
/// cancels: the rotation is then that of the heaviest.
struct QvNlerp : Linear<QvNlerp, QuatVec> {
    static constexpr std::string_view name = "qv_nlerp";

    template <class T>
    [[nodiscard]] static Blended<QuatVec<T>> finished(const Blended<QuatVec<T>>& total,
                                                      const QuatVec<T>& heaviest) noexcept {
        const auto& [rotation, translation] = total.transform;
        const T length = glm::length(rotation);
        if (length < T(kDegenerateBlend)) return {{heaviest.rotation, translation}, false};
        return {{rotation * (T(1) / length), translation}, total.is_defined};
    }
};

/// The normalised weighted sum of unit dual quaternions (DLB; Kavan et al. 2008, eq. 4; Smith 2013, sections
/// 2.2.3 and 3.5.2). Between two transforms it moves about the axis of Sclerp's screw, but rotation and
/// translation are not at constant speed, and deviate from Sclerp's by up to 8.15 degrees and 15 % of the
/// translation. Does not depend on the origin.
///
/// Not defined if a rotation is 180 degrees from the heaviest (its sign as given then decides), or if the sum of
/// the real parts cancels: the result is then the heaviest.
struct Dlb : Linear<Dlb, DualQuat> {
    static constexpr std::string_view name = "dlb";

    template <class T>
    [[nodiscard]] static Blended<DualQuat<T>> finished(const Blended<DualQuat<T>>& total,
                                                       const DualQuat<T>& heaviest) noexcept {
        if (glm::length(total.transform.real) < T(kDegenerateBlend)) return {heaviest, false};
        return {normalized(total.transform), total.is_defined};
    }
};

}  // namespace sinew
