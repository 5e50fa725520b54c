// SPDX-License-Identifier: GPL-3.0-or-later
// Log-matrix skinning on lanes. A row is the angular and the linear part of a bone's logarithm, each (x, y, z, 0).
#include "sinew/methods/log/log.h"

#define SINEW_THIS_FILE "sinew/methods/log/log.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/exponential-inl.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

struct LogKernel : TranslatedRows<kRow, 4, 1>, RigidFunctions<Log, LogKernel> {
    static constexpr std::size_t kSignedFloat4s = 0;

    /// The linear part depends linearly on the translation, and thus on what the scale adds to the translation.
    static void write_scale(const Quat<double>& rotation, const Affine<double>& scale, Float4* rows) {
        const auto added = [&rotation](const Vec3<double>& displacement) {
            return to_twist(QuatVec<double>{rotation, rotate(rotation, displacement)}).linear;
        };
        const Mat3<double> m = scale.linear - Mat3<double>(1.0);
        write_displacement(Mat3<double>(added(m[0]), added(m[1]), added(m[2])), added(scale.translation),
                           rows);
    }

    /// The exponential, as in transform/twist.h.
    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Points<D> angular{sum.value[0], sum.value[1], sum.value[2]};
        const Points<D> linear{sum.value[4], sum.value[5], sum.value[6]};
        const Vec<D> half = hn::Set(d, 0.5f);
        const Points<D> by_half = times<D>(half, angular);
        const ExponentialFactors<D> by(d, dot<D>(by_half, by_half));
        const Vec<D> sinc = by.sinc;
        const Vec<D> w = by.cosine;
        const Points<D> axis = times<D>(sinc, by_half);
        // Dividing by its squared length makes the quaternion a rotation even where rounding changed its length.
        const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), hn::MulAdd(w, w, dot<D>(axis, axis)));
        const Points<D> inner = add_scaled<D>(cross<D>(axis, p), w, p);
        const Points<D> rotated = add_scaled<D>(p, scale, cross<D>(axis, inner));
        // linear + (sinc^2 / 2) angular x linear + rest angular x (angular x linear).
        const Points<D> across = cross<D>(angular, linear);
        const Vec<D> first = hn::Mul(half, hn::Mul(sinc, sinc));
        const Points<D> terms = add_cross<D>(times<D>(first, across), angular, times<D>(by.third, across));
        return add<D>(rotated, add<D>(linear, terms));
    }

    /// The logarithm, as in transform/twist.h.
    static HWY_INLINE void write_row(const Quats& q, const BonePoints& translation, BoneVec* row) {
        const BoneTag d;
        const BoneVec one = hn::Set(d, 1.0);
        // The angle from the tangent of an eighth of it, which is at most sqrt(2) - 1: the first omitted term of
        // the arc tangent's series is below 1e-12. As w >= 0, no denominator is small.
        static constexpr double kArcTangent[] = {
            1.0,         -1.0 / 3.0, 1.0 / 5.0,   -1.0 / 7.0, 1.0 / 9.0,   -1.0 / 11.0, 1.0 / 13.0,
            -1.0 / 15.0, 1.0 / 17.0, -1.0 / 19.0, 1.0 / 21.0, -1.0 / 23.0, 1.0 / 25.0,  -1.0 / 27.0};
        const BoneVec sine_squared = dot<BoneTag>(q.v, q.v);
        const BoneVec more = hn::Add(one, q.w);
        const BoneVec quarter_squared = hn::Div(sine_squared, hn::Mul(more, more));
        const BoneVec root = hn::Add(one, hn::Sqrt(hn::Add(one, quarter_squared)));
        const BoneVec eighth_squared = hn::Div(quarter_squared, hn::Mul(root, root));
        // The angle over the sine of half the angle.
        const BoneVec factor = hn::Div(hn::Mul(hn::Set(d, 8.0), polynomial(d, eighth_squared, kArcTangent)),
                                       hn::Mul(more, root));
        const BonePoints angular = times<BoneTag>(factor, q.v);
        // (1 - x cot(x)) / 4 x^2 with x half the angle; the series where the difference would cancel.
        static constexpr double kSeries[] = {1.0 / 12.0, 1.0 / 720.0, 1.0 / 30240.0};
        const BoneVec angle_squared = dot<BoneTag>(angular, angular);
        const BoneVec cotangent = hn::Mul(hn::Set(d, 0.5), hn::Mul(factor, q.w));
        const BoneVec third =
            hn::IfThenElse(hn::Lt(angle_squared, hn::Set(d, 4e-4)), polynomial(d, angle_squared, kSeries),
                           hn::Div(hn::Sub(one, cotangent), angle_squared));
        const BonePoints across = cross<BoneTag>(angular, translation);
        const BonePoints linear =
            add_scaled<BoneTag>(add_scaled<BoneTag>(translation, hn::Set(d, -0.5), across), third,
                                cross<BoneTag>(angular, across));
        row[0] = angular.x;
        row[1] = angular.y;
        row[2] = angular.z;
        row[3] = hn::Zero(d);
        row[4] = linear.x;
        row[5] = linear.y;
        row[6] = linear.z;
        row[7] = hn::Zero(d);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Log, LogKernel)
