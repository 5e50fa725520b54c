// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>

#include "sinew/interpolate/spherical.h"
#include "sinew/transform/twist.h"

namespace sinew {

/// Between two transforms: the screw from one to the other at constant speed, along the shorter way (ScLERP;
/// Kavan et al. 2008, section 3.4; Smith 2013, section 2.2.3). Blend of n: DIB, dual quaternion iterative
/// blending, which equals ScLERP for n = 2 and does not depend on the order (Kavan et al. 2008, algorithm 3).
/// Neither depends on the origin: x a, x b gives x times the result, and a x, b x gives the result times x.
///
/// Not defined if two transforms are 180 degrees apart (the signs as given then decide), or if |t| exceeds 0.001
/// / epsilon. A blend of n is not defined where Dlb is not, if the iteration does not converge, or if a rotation
/// is 180 degrees from the result.
struct Sclerp {
    static constexpr std::string_view name = "sclerp";
    template <class T>
    using Transform = DualQuat<T>;

    template <class T>
    [[nodiscard]] static Blended<DualQuat<T>> between(const DualQuat<T>& a, const DualQuat<T>& b,
                                                      T t) noexcept {
        return finite_or<DualQuat<T>>(
            {normalized(a * power(inverse(a) * b, t)), has_shorter_way(a, b, t) && is_near(t)},
            T(1) - t < t ? b : a);
    }

    template <BlendSigns signs = BlendSigns::kToHeaviest, class T>
    [[nodiscard]] static Blended<DualQuat<T>> blend(std::span<const DualQuat<T>> transforms,
                                                    std::span<const T> weights) noexcept {
        using std::hypot;
        using std::max;
        const Shares<T> share = shares(weights);
        Blended<DualQuat<T>> mean = Dlb::blend<signs, T>(transforms, weights);
        if (!mean.is_defined) return mean;
        // Translations are precise only to within rounding of the longest.
        const T rounding = T(8) * std::numeric_limits<T>::epsilon();
        T longest = T(0);
        for (const DualQuat<T>& transform : transforms) {
            longest =
                max(longest, T(2) * hypot(safe_length(vector_part(transform.dual)), transform.dual.w, T(0)));
        }
        for (int step = 0; step < kBlendSteps; ++step) {
            Twist<T> correction;
            bool is_half_turn = false;
            for (std::size_t i = 0; i < transforms.size(); ++i) {
                if (weights[i] == T(0)) continue;
                is_half_turn = is_half_turn || is_half_turn_apart(mean.transform, transforms[i]);
                const DualQuat<T> difference = inverse(mean.transform) * transforms[i];
                correction = correction + share.of(weights[i]) * to_twist(difference);
            }
            mean.transform = normalized(mean.transform * to_dual_quat(correction));
            if (!is_finite(mean.transform)) return {transforms[share.heaviest], false};
            if (safe_length(correction.angular) <= rounding &&
                safe_length(correction.linear) <= rounding * longest) {
                mean.is_defined = !is_half_turn;
                return mean;
            }
        }
        mean.is_defined = false;
        return mean;
    }
};

/// Sclerp under the name of its blend of n.
struct Dib : Sclerp {
    static constexpr std::string_view name = "dib";
};

}  // namespace sinew
