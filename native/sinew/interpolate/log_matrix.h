// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/interpolate/linear.h"
#include "sinew/transform/twist.h"

namespace sinew {

/// The exponential of the weighted sum of logarithms in se(3) (Alexa 2002; Smith 2013, sections 2.3.1 and 3.5.2).
/// Rigid. Not the shortest path, since every logarithm is taken from the identity. Does not depend on the origin
/// or the axes: x a x^-1 and x b x^-1 give x times the result times x^-1. But x a and x b give another path than
/// x times the result. The speed is constant, as section 2.2.2 claims, only if both rotate about the same screw
/// axis, such as from or to the identity.
///
/// Not defined if a matrix is 180 degrees from the identity to within rounding: the axis of its logarithm then
/// has the sign that to_quat() gives it. Also not defined if a matrix scales, shears or mirrors (is_rigid()).
struct MatrixLog {
    static constexpr std::string_view name = "matrix_log";
    template <class T>
    using Transform = Affine<T>;

    template <class T>
    [[nodiscard]] static Blended<Affine<T>> between(const Affine<T>& a, const Affine<T>& b, T t) noexcept {
        const std::array<Affine<T>, 2> ends{a, b};
        const std::array<T, 2> weights{T(1) - t, t};
        return blend<BlendSigns::kAsGiven, T>(ends, weights);
    }

    template <BlendSigns signs = BlendSigns::kToHeaviest, class T>
    [[nodiscard]] static Blended<Affine<T>> blend(std::span<const Affine<T>> transforms,
                                                  std::span<const T> weights) noexcept {
        if (transforms.empty() || weights.size() != transforms.size()) return {{}, false};
        const Shares<T> share = shares(weights);
        if (!share.is_defined) return {transforms[share.heaviest], false};
        Twist<T> total;
        bool is_defined = true;
        for (std::size_t i = 0; i < transforms.size(); ++i) {
            if (weights[i] == T(0)) continue;
            if (!is_rigid(transforms[i])) is_defined = false;
            const QuatVec<T> rigid = to_quat_vec(transforms[i]);
            // Below this the sign of w, and thus that of the axis, is rounding.
            const bool is_half_turn = rigid.rotation.w < T(kDegenerateBlend);
            // A matrix of weight 1 is the result, whichever logarithm it has.
            const T weight = share.of(weights[i]);
            if (is_half_turn && weight != T(1)) is_defined = false;
            total = total + weight * to_twist(rigid);
        }
        return finite_or<Affine<T>>({to_affine(to_quat_vec(total)), is_defined}, transforms[share.heaviest]);
    }
};

}  // namespace sinew
