// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "module.h"
#include "sinew/interpolate/hermite.h"
#include "sinew/interpolate/spline.h"

namespace sinew::bindings {
namespace {

py::object between(const py::object& a, const py::object& b, const py::object& t, const py::object& method) {
    return with_method(method, [&]<class Method>(Method) {
        return map<Method::template Transform, Method::template Transform, Scalar>(
            {"a", "b", "t"}, {a, b, t}, [](const auto& from, const auto& onto, auto at) {
                const auto result = Method::between(from, onto, at);
                return std::tuple(result.transform, result.is_defined);
            });
    });
}

// Makes the last leading axis part of the item. Returns its length.
template <class T>
py::ssize_t take_last_axis(Input<T>& input, const std::string& wanted, const py::object& value) {
    if (input.lead.empty()) fail(input.argument, wanted, describe(value));
    const py::ssize_t count = input.lead.back();
    input.lead.pop_back();
    input.item_size *= count;
    return count;
}

// Calls f(std::integral_constant<Signs, ..>) for the choice with the name `signs`.
template <class F>
py::object with_signs(const py::object& signs, F f) {
    const std::string wanted = "one of heaviest, running_sum, as_given";
    const std::string name = checked_name(signs, "signs", wanted);
    if (name == "heaviest") return f(std::integral_constant<Signs, Signs::kToHeaviest>{});
    if (name == "running_sum") return f(std::integral_constant<Signs, Signs::kRunningSum>{});
    if (name == "as_given") return f(std::integral_constant<Signs, Signs::kAsGiven>{});
    fail("signs", wanted, "'" + name + "'");
}

template <class Method, Signs signs, class T>
py::object blend_items(const py::object& transforms, const py::object& weights) {
    using Transform = typename Method::template Transform<T>;
    std::array inputs{checked_input<T, Transform>(transforms, "transforms"),
                      checked_input<T, T>(weights, "weights")};
    const py::ssize_t step = inputs[0].item_size;
    const py::ssize_t terms = take_last_axis(inputs[0], "at least one transform", transforms);
    if (terms == 0) fail("transforms", "at least one transform", "none");
    const std::string wanted =
        element_name<T>() + "[.., " + std::to_string(terms) + "], one for each transform";
    if (take_last_axis(inputs[1], wanted, weights) != terms) fail("weights", wanted, describe(weights));
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    Output<std::tuple<Transform, bool>> output(common);
    const py::ssize_t count = count_of(common);
    without_gil([&] {
        std::vector<Transform> items(static_cast<std::size_t>(terms));
        for (py::ssize_t i = 0; i < count; ++i) {
            const T* from = inputs[0].at(i, common);
            for (Transform& item : items) {
                item = Item<Transform>::read(from);
                from += step;
            }
            const std::span<const T> shares(inputs[1].at(i, common), items.size());
            const auto result = Method::template blend<signs, T>(items, shares);
            output.write(i, {result.transform, result.is_defined});
        }
    });
    return output.take();
}

py::object blend(const py::object& any_transforms, const py::object& any_weights, const py::object& method,
                 const py::object& signs) {
    const auto [transforms, weights] = promoted<2>({"transforms", "weights"}, {any_transforms, any_weights});
    return with_method(method, [&]<class Method>(Method) {
        return with_signs(signs, [&]<Signs choice>(std::integral_constant<Signs, choice>) {
            return with_element(
                transforms, "transforms", Item<typename Method::template Transform<double>>::kShape,
                [&]<class T>(T) { return blend_items<Method, choice, T>(transforms, weights); });
        });
    });
}

// Calls combine(span, four keys) for each time in `at`.
template <class T, class Transform, class Combine>
py::object spline_items(const py::object& keys, const py::object& times, const py::object& at,
                        Combine combine) {
    const auto input = checked_input<T, Transform>(keys, "keys");
    if (input.lead.size() != 1 || input.lead[0] == 0) {
        fail("keys", "one axis of keys, at least one", describe(keys));
    }
    const std::vector<Transform> items = items_of<Transform>(input);
    const std::vector<T> key_times = checked_times<T>(times, input.lead[0]);
    const auto moments = checked_input<T, T>(at, "at");
    Output<std::tuple<Transform, bool>> output(moments.lead);
    const py::ssize_t count = count_of(moments.lead);
    without_gil([&] {
        for (py::ssize_t i = 0; i < count; ++i) {
            const SplineSpan<T> span = spline_span(std::span<const T>(key_times), moments.data[i]);
            const auto result = combine(span, keys_of(span, std::span<const Transform>(items)));
            output.write(i, {result.transform, result.is_defined});
        }
    });
    return output.take();
}

py::object spline(const py::object& any_keys, const py::object& any_times, const py::object& any_at,
                  const py::object& method) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    return with_method(method, [&]<class Method>(Method) {
        return with_element(
            keys, "keys", Item<typename Method::template Transform<double>>::kShape, [&]<class T>(T) {
                return spline_items<T, typename Method::template Transform<T>>(
                    keys, times, at,
                    [](const auto& span, const auto& four) { return spline_blend<Method>(span, four); });
            });
    });
}

// Whether the last axis of `keys` has length 3.
bool is_of_points(const py::object& keys) {
    if (!py::isinstance<py::array>(keys)) return false;
    const auto array = py::reinterpret_borrow<py::array>(keys);
    return array.ndim() > 0 && array.shape(array.ndim() - 1) == 3;
}

py::object spline_of_vectors(const py::object& any_keys, const py::object& any_times,
                             const py::object& any_at) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    if (is_of_points(keys)) {
        return with_element(keys, "keys", "", [&]<class T>(T) {
            return spline_items<T, Vec3<T>>(keys, times, at, [](const auto& span, const auto& four) {
                return spline_vector(span, four);
            });
        });
    }
    return with_representation(keys, "keys", "keys", [&]<class Row>(Row) {
        return with_element(keys, "keys", "", [&]<class T>(T) {
            return spline_items<T, typename Row::template Transform<T>>(
                keys, times, at,
                [](const auto& span, const auto& four) { return spline_vector(span, four); });
        });
    });
}

template <class T, class Key, class Tangent>
py::object hermite_items(const std::array<py::object, 4>& values) {
    const auto keys = checked_input<T, Key>(values[0], "keys");
    const auto tangents = checked_input<T, Tangent>(values[1], "tangents");
    if (keys.lead.size() != 1 || keys.lead[0] == 0) {
        fail("keys", "one axis of keys, at least one", describe(values[0]));
    }
    if (tangents.lead != keys.lead) {
        fail("tangents", text_of({keys.lead[0]}) + " of them, one for each key", describe(values[1]));
    }
    const std::vector<Key> of = items_of<Key>(keys);
    const std::vector<Tangent> leaving = items_of<Tangent>(tangents);
    const std::vector<T> times = checked_times<T>(values[2], keys.lead[0]);
    const auto moments = checked_input<T, T>(values[3], "at");
    Output<std::tuple<Key, bool>> output(moments.lead);
    const py::ssize_t count = count_of(moments.lead);
    without_gil([&] {
        for (py::ssize_t i = 0; i < count; ++i) {
            const auto found = hermite<T>(std::span<const Key>(of), std::span<const Tangent>(leaving),
                                          std::span<const T>(times), moments.data[i]);
            if constexpr (std::is_same_v<Key, Vec3<T>>) {
                output.write(i, {found, is_finite(found)});
            } else {
                output.write(i, {found.transform, found.is_defined});
            }
        }
    });
    return output.take();
}

py::object hermite_spline(const py::object& keys, const py::object& tangents, const py::object& times,
                          const py::object& at) {
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
    py::list methods;
    std::apply([&](auto... row) { (methods.append(py::str(std::string(row.name))), ...); }, Interpolations{});
    interpolate.attr("METHODS") = py::tuple(methods);
    interpolate.def("between", &between, py::arg("a"), py::arg("b"), py::arg("t"), py::arg("method"));
    interpolate.def("blend", &blend, py::arg("transforms"), py::arg("weights"), py::arg("method"),
                    py::arg("signs"));
    auto splines = m.def_submodule("spline");
    splines.def("catmull_rom", &spline, py::arg("keys"), py::arg("times"), py::arg("at"), py::arg("method"));
    splines.def("hermite", &hermite_spline, py::arg("keys"), py::arg("tangents"), py::arg("times"),
                py::arg("at"));
    splines.def("catmull_rom_vector", &spline_of_vectors, py::arg("keys"), py::arg("times"), py::arg("at"));
}

}  // namespace sinew::bindings
