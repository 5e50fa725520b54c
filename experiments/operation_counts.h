// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "experiments/counted.h"
#include "sinew/interpolate/methods.h"
#include "sinew/methods/dq/dq.h"
#include "sinew/methods/lbs/lbs.h"
#include "sinew/methods/qv/qv.h"
#include "sinew/transform/make.h"

namespace experiments {

/// table  the table of Smith 2013 with this operation
/// name   the candidate
struct OperationCount {
    std::string_view table;
    std::string_view name;
    Operations operations;
};

namespace detail {

using Vec = sinew::Vec3<Counted>;
using Mat4 = glm::mat<4, 4, Counted, glm::defaultp>;

inline Vec input(double x, double y, double z) {
    return {Counted::input(x), Counted::input(y), Counted::input(z)};
}

/// `constants` as numbers that are not known in advance.
inline sinew::Quat<Counted> input(const sinew::Quat<double>& q) {
    return {Counted::input(q.w), Counted::input(q.x), Counted::input(q.y), Counted::input(q.z)};
}
inline sinew::QuatVec<Counted> input(const sinew::QuatVec<double>& a) {
    return {input(a.rotation), input(a.translation.x, a.translation.y, a.translation.z)};
}
inline sinew::DualQuat<Counted> input(const sinew::DualQuat<double>& a) {
    return {input(a.real), input(a.dual)};
}
inline sinew::Affine<Counted> input(const sinew::Affine<double>& a) {
    sinew::Affine<Counted> result;
    for (int column = 0; column < 3; ++column) {
        const auto& axis = a.linear[column];
        result.linear[column] = input(axis.x, axis.y, axis.z);
    }
    result.translation = input(a.translation.x, a.translation.y, a.translation.z);
    return result;
}

/// Three motions without special angles or axes, all within 90 degrees of each other.
template <template <class> class Transform>
std::array<Transform<Counted>, 3> inputs() {
    const auto motion = [](double angle, double x, double y, double z) {
        sinew::QuatVec<double> pair =
            sinew::from_axis_angle<sinew::QuatVec>(sinew::Vec3<double>(x, y, z), angle);
        pair.translation = {x - 0.5, 2.0 * y, z + 0.25};
        return input(sinew::to<Transform>(pair));
    };
    return {motion(0.7, 0.3, -0.6, 0.9), motion(1.1, -0.2, -0.5, 1.3), motion(0.4, 0.8, -0.1, 0.7)};
}

template <class Task>
Operations counted(Task task) {
    Operations operations;
    const Counted::CountIn counting(operations);
    task();
    return operations;
}

}  // namespace detail

/// The image of the point `p` by the report's own formula: the dual part of d (1 + e p) times the combined
/// conjugate of d (Smith 2013, section 2.2.3).
template <class T>
[[nodiscard]] sinew::Vec3<T> transform_point_by_products(const sinew::DualQuat<T>& d,
                                                         const sinew::Vec3<T>& p) {
    const sinew::Quat<T> one(T(1), T(0), T(0), T(0));
    return sinew::vector_part(
        (d * sinew::DualQuat<T>{one, sinew::pure(p)} * sinew::combined_conjugate(d)).dual);
}

/// The operations of Sinew's own templates, counted by running them.
[[nodiscard]] inline std::vector<OperationCount> operation_counts() {
    using detail::counted;
    using sinew::Affine;
    using sinew::DualQuat;
    using sinew::QuatVec;
    const auto affine = detail::inputs<Affine>();
    const auto pair = detail::inputs<QuatVec>();
    const auto dual = detail::inputs<DualQuat>();
    const detail::Vec point = detail::input(0.3, -1.2, 0.8);
    const Counted t = Counted::input(0.3);
    std::vector<OperationCount> counts;
    const auto count = [&](std::string_view table, std::string_view name, auto task) {
        counts.push_back({table, name, counted([&] { static_cast<void>(task()); })});
    };

    detail::Mat4 matrix;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) matrix[column][row] = Counted::input(column + 0.5 * row);
    }
    const glm::vec<4, Counted, glm::defaultp> point4(point, Counted::input(1.0));

    count("3.2", "matrix_4x4", [&] { return matrix * point4; });
    count("3.2", "affine", [&] { return transform_point(affine[0], point); });
    count("3.2", "quat_vec", [&] { return transform_point(pair[0], point); });
    count("3.2", "dual_quat", [&] { return transform_point(dual[0], point); });
    count("3.2", "dual_quat_by_products", [&] { return transform_point_by_products(dual[0], point); });

    count("3.3", "matrix_4x4", [&] { return matrix * matrix; });
    count("3.3", "affine", [&] { return affine[0] * affine[1]; });
    count("3.3", "quat_vec", [&] { return pair[0] * pair[1]; });
    count("3.3", "dual_quat", [&] { return dual[0] * dual[1]; });

    count("3.9", "matrix_linear", [&] { return sinew::MatrixLinear::between(affine[0], affine[1], t); });
    count("3.9", "matrix_log", [&] { return sinew::MatrixLog::between(affine[0], affine[1], t); });
    count("3.9", "qv_nlerp", [&] { return sinew::QvNlerp::between(pair[0], pair[1], t); });
    count("3.9", "qv_slerp", [&] { return sinew::QvSlerp::between(pair[0], pair[1], t); });
    count("3.9", "dlb", [&] { return sinew::Dlb::between(dual[0], dual[1], t); });
    count("3.9", "sclerp", [&] { return sinew::Sclerp::between(dual[0], dual[1], t); });

    using Influences = std::array<sinew::Influence<Counted>, 3>;
    const Influences influences{
        {{0, Counted::input(0.5)}, {1, Counted::input(0.3)}, {2, Counted::input(0.2)}}};
    const auto skin = [&]<class Method>(Method, const auto& transforms) {
        using Bone = typename Method::template Bone<Counted>;
        std::array<Bone, 3> bones;
        for (std::size_t i = 0; i < 3; ++i) {
            if constexpr (requires { bones[i].rigid; }) {
                bones[i] = {transforms[i], {}, false};
            } else {
                bones[i] = transforms[i];
            }
        }
        return Method::template deform_vertex<Counted>(bones, influences, point);
    };
    count("3.10", "lbs", [&] { return skin(sinew::Lbs{}, affine); });
    count("3.10", "qv", [&] { return skin(sinew::Qv{}, pair); });
    count("3.10", "dq", [&] { return skin(sinew::Dq{}, dual); });
    return counts;
}

}  // namespace experiments
