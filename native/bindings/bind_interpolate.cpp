// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "sinew/interpolate/spline.h"

namespace sinew::bindings {
namespace {

using Method = Typed<"sinew.interpolate.Method">;
using Blended = NamedTuple<"Blended">;

Blended between(const ArrayLike& a, const ArrayLike& b, const ArrayLike& t, const Method& method) {
    return with_method(method, [&]<class Method>(Method) {
        return map<Method::template Transform, Method::template Transform, Scalar>(
            {"a", "b", "t"}, {a, b, t}, [](const auto& from, const auto& onto, auto at) {
                const auto result = Method::between(from, onto, at);
                return named<"Blended">(result.transform, result.is_defined);
            });
    });
}

// Calls f(std::integral_constant<BlendSigns, ..>) for the choice with the name `signs`.
template <class F>
py::object with_signs(const py::object& signs, F f) {
    constexpr std::array<std::string_view, 3> kNames{"heaviest", "running_sum", "as_given"};
    switch (checked_choice(signs, "signs", kNames)) {
        case 0: return f(std::integral_constant<BlendSigns, BlendSigns::kToHeaviest>{});
        case 1: return f(std::integral_constant<BlendSigns, BlendSigns::kRunningSum>{});
        default: return f(std::integral_constant<BlendSigns, BlendSigns::kAsGiven>{});
    }
}

template <class Method, BlendSigns signs, class T>
py::object blend_items(const py::object& transforms, const py::object& weights) {
    using Transform = typename Method::template Transform<T>;
    std::array inputs{checked_input<T, Transform>(transforms, "transforms"),
                      checked_input<T, T>(weights, "weights")};
    const py::ssize_t terms = take_last_axis(inputs[0], transforms, "at least one transform");
    if (terms == 0) fail("transforms", "at least one transform", "none");
    take_last_axis(inputs[1], weights,
                   element_name<T>() + "[.., " + std::to_string(terms) + "], one for each transform", terms);
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    std::vector<Transform> items(static_cast<std::size_t>(terms));
    return each_of<Blend<Transform>>(common, [&](py::ssize_t i) -> Blend<Transform> {
        read_rows(inputs[0], i, common, items);
        const std::span<const T> shares(inputs[1].at(i, common), items.size());
        const auto result = Method::template blend<signs, T>(items, shares);
        return {result.transform, result.is_defined};
    });
}

Blended blend(const ArrayLike& any_transforms, const ArrayLike& any_weights, const Method& method,
              const Typed<"sinew.interpolate.Signs">& signs) {
    const auto [transforms, weights] = promoted<2>({"transforms", "weights"}, {any_transforms, any_weights});
    return with_method(method, transforms, "transforms", [&]<class Method, class T>() {
        return with_signs(signs, [&]<BlendSigns choice>(std::integral_constant<BlendSigns, choice>) {
            return blend_items<Method, choice, T>(transforms, weights);
        });
    });
}

Blended spline(const ArrayLike& any_keys, const ArrayLike& any_times, const ArrayLike& any_at,
               const Method& method) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    return with_method(method, keys, "keys", [&]<class Method, class T>() {
        return along_keys<T, typename Method::template Transform<T>>(
            keys, times, at, [](const auto&... along) { return catmull_rom<Method, T>(along...); });
    });
}

Blended spline_of_vectors(const ArrayLike& any_keys, const ArrayLike& any_times, const ArrayLike& any_at) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    const auto evaluate = [](const auto&... along) { return catmull_rom_vector(along...); };
    if (is_of_points(keys)) {
        return with_element(keys, "keys", "",
                            [&]<class T>(T) { return along_keys<T, Vec3<T>>(keys, times, at, evaluate); });
    }
    return with_layout(keys, "keys", "keys", [&]<class Transform, class T>() {
        return along_keys<T, Transform>(keys, times, at, evaluate);
    });
}

}  // namespace

void bind_interpolate(py::module_& m) {
    auto interpolate = m.def_submodule("interpolate");
    interpolate.attr("METHODS") =
        std::apply([](auto... rows) { return py::make_tuple(std::string(rows.name)...); }, Interpolations{});
    interpolate.def("between", &between, "a"_a, "b"_a, "t"_a, "method"_a = "dlb",
                    R"(Interpolates from `a` at t = 0 to `b` at t = 1; other t extrapolate.

a, b: in the layout of the method, with rotations of unit length.
t: [..] or a number.)");
    interpolate.def(
        "blend", &blend, "transforms"_a, "weights"_a, "method"_a = "dlb", "signs"_a = "heaviest",
        R"(The blend of the n transforms along the last leading axis; the axes before it broadcast.

transforms: [.., n, 7] and so on, in the layout of the method, n >= 1, with rotations of unit length.
weights: [.., n], of any sign, normalised to sum 1. Of two equal ones the first counts as the heavier.
signs: how the free signs of quaternions are chosen.

heaviest     each in the hemisphere of the heaviest: the order does not matter except for ties
running_sum  each in the hemisphere of the sum of those before it, as Blender's Preserve Volume and
             sinew.Deformer do, for the same shapes; the order matters. Not defined if one is
             perpendicular to that sum
as_given     unchanged: for transforms that are aligned already, such as along a spline)");
    auto splines = m.def_submodule("spline");
    splines.def(
        "catmull_rom", &spline, "keys"_a, "times"_a, "at"_a, "method"_a = "dlb",
        R"(Blend form: the keys blended by `method` with the weights of the spline (Smith 2013, section 3.2.2).

Rigid for every method except matrix_linear. The keys are in the layout of the method.

If keys are more than about 100 degrees apart, the negative weights may keep the iterations of qv_slerp and dib
from converging: the result is then not defined, finite, and may jump.)");
    splines.def(
        "catmull_rom_vector", &spline_of_vectors, "keys"_a, "times"_a, "at"_a,
        R"(Vector form: the components as a vector of 12, 7, 8 or, for points, 3 numbers (Smith 2013, algorithm
3).

Rigid only at the keys; the layout's normalized() makes it rigid everywhere.)");
}

}  // namespace sinew::bindings
