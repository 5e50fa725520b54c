// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "sinew/interpolate/hermite.h"
#include "sinew/interpolate/spline.h"

namespace sinew::bindings {
namespace {

using Method = Typed<"sinew.interpolate.Method">;
using Blended = NamedTuple<"Blended">;

/// What the library returns, for an Output.
template <class Transform>
using Blend = Named<"Blended", Transform, bool>;

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

// Calls evaluate(keys, times, time) for each time in `at`.
template <class T, class Key, class Evaluate>
py::object along_keys(const py::object& keys, const py::object& times, const py::object& at,
                      Evaluate evaluate) {
    const auto input = checked_input<T, Key>(keys, "keys");
    if (input.lead.size() != 1 || input.lead[0] == 0) {
        fail("keys", "one axis of keys, at least one", describe(keys));
    }
    const std::vector<Key> items = items_of<Key>(input);
    const std::vector<T> key_times = checked_times<T>(times, input.lead[0]);
    const auto moments = checked_input<T, T>(at, "at");
    return each_of<Blend<Key>>(moments.lead, [&](py::ssize_t i) -> Blend<Key> {
        const auto result =
            evaluate(std::span<const Key>(items), std::span<const T>(key_times), moments.data[i]);
        return {result.transform, result.is_defined};
    });
}

Blended spline(const ArrayLike& any_keys, const ArrayLike& any_times, const ArrayLike& any_at,
               const Method& method) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    return with_method(method, keys, "keys", [&]<class Method, class T>() {
        return along_keys<T, typename Method::template Transform<T>>(
            keys, times, at, [](const auto&... of) { return catmull_rom<Method, T>(of...); });
    });
}

// Whether the last axis of `keys` has length 3.
bool is_of_points(const py::object& keys) {
    if (!py::isinstance<py::array>(keys)) return false;
    const auto array = py::reinterpret_borrow<py::array>(keys);
    return array.ndim() > 0 && array.shape(array.ndim() - 1) == 3;
}

Blended spline_of_vectors(const ArrayLike& any_keys, const ArrayLike& any_times, const ArrayLike& any_at) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    const auto evaluate = [](const auto&... of) { return catmull_rom_vector(of...); };
    if (is_of_points(keys)) {
        return with_element(keys, "keys", "",
                            [&]<class T>(T) { return along_keys<T, Vec3<T>>(keys, times, at, evaluate); });
    }
    return with_layout(keys, "keys", "keys", [&]<class Transform, class T>() {
        return along_keys<T, Transform>(keys, times, at, evaluate);
    });
}

template <class T, class Key, class Tangent>
py::object hermite_items(const std::array<py::object, 4>& values) {
    const auto keys = checked_input<T, Key>(values[0], "keys");
    const auto input = checked_input<T, Tangent>(values[1], "tangents");
    const std::vector<Tangent> tangents = items_of<Tangent>(input);
    if (keys.lead.size() == 1 && input.lead != keys.lead) {
        fail("tangents", shape_text({keys.lead[0]}) + " of them, one for each key", describe(values[1]));
    }
    return along_keys<T, Key>(values[0], values[2], values[3], [&](auto of, auto times, T time) {
        const auto found = hermite<T>(of, std::span<const Tangent>(tangents), times, time);
        if constexpr (std::is_same_v<Key, Vec3<T>>) {
            return sinew::Blended<Key>{found, is_finite(found)};
        } else {
            return found;
        }
    });
}

Blended hermite_spline(const ArrayLike& keys, const ArrayLike& tangents, const ArrayLike& times,
                       const ArrayLike& at) {
    const auto values = promoted<4>({"keys", "tangents", "times", "at"}, {keys, tangents, times, at});
    const bool has_points = is_of_points(values[0]);
    return with_element(values[0], "keys", "[n, 3] or [n, 8]", [&]<class T>(T) {
        return has_points ? hermite_items<T, Vec3<T>, Vec3<T>>(values)
                          : hermite_items<T, DualQuat<T>, Twist<T>>(values);
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
    splines.def("hermite", &hermite_spline, "keys"_a, "tangents"_a, "times"_a, "at"_a,
                R"(The cubic Hermite spline through keys with arbitrary tangents (Smith 2013, section 2.3.2).

keys: [n, 3], points, or [n, 8], rigid transforms.
tangents: for a unit of time. Of points [n, 3]. Of transforms [n, 6], twists in each key's own axes: after a
    short time h the curve is compose(key, from_twist(h * tangent)).

For transforms it is a Bezier curve whose chords are screws (Shoemake 1985, for quaternions): rigid throughout.
Not defined where "sclerp" is not defined between two of its control poses.)");
}

}  // namespace sinew::bindings
