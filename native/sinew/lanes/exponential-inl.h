// SPDX-License-Identifier: GPL-3.0-or-later
// The functions that exponentials of rigid motions need, on lanes. Compiled once for each instruction set.
#if defined(SINEW_LANES_EXPONENTIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_EXPONENTIAL_INL_H_
#undef SINEW_LANES_EXPONENTIAL_INL_H_
#else
#define SINEW_LANES_EXPONENTIAL_INL_H_
#endif

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

/// c[0] + c[1] x + c[2] x^2 + ...
template <class D, class Number, std::size_t kCount>
HWY_INLINE Vec<D> polynomial(D d, Vec<D> x, const Number (&c)[kCount]) {
    Vec<D> sum = hn::Set(d, c[kCount - 1]);
    for (std::size_t i = kCount - 1; i-- > 0;) sum = hn::MulAdd(sum, x, hn::Set(d, c[i]));
    return sum;
}

/// Functions of y, the square of half an angle of at most 180 degrees. Three polynomials with an absolute error
/// of at most 6e-8, which need no branch and no division by the angle.
template <class D>
struct ExponentialFactors {
    Vec<D> sinc;    // of half the angle
    Vec<D> cosine;  // of half the angle
    Vec<D> third;   // (x - sin(x)) / x^3 of the angle x

    HWY_INLINE ExponentialFactors(D d, Vec<D> y) {
        // sin(sqrt(y)) / sqrt(y), cos(sqrt(y)) and (x - sin(x)) / x^3 with x = 2 sqrt(y),
        // for y from 0 to (pi / 2)^2.
        static constexpr float kSinc[] = {1.0f, -0.16666658222675323f, 0.008333049714565277f,
                                          -0.0001980901142815128f, 2.6050929591292515e-06f};
        static constexpr float kCos[] = {1.0f,
                                         -0.5f,
                                         0.0416666679084301f,
                                         -0.0013888884568586946f,
                                         2.4801040126476437e-05f,
                                         -2.7524663437361596e-07f,
                                         1.990741571589183e-09f};
        static constexpr float kRest[] = {0.1666666716337204f,    -0.033333323895931244f,
                                          0.0031745603773742914f, -0.00017629233479965478f,
                                          6.35449077890371e-06f,  -1.4276758975029225e-07f};
        sinc = polynomial(d, y, kSinc);
        cosine = polynomial(d, y, kCos);
        third = polynomial(d, y, kRest);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
