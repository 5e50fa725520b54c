// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "module.h"
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

// The last leading axis becomes part of the item; its length is returned.
template <class T>
py::ssize_t take_last_axis(Input<T>& input, const std::string& wanted, const py::object& value) {
    if (input.lead.empty()) fail(input.argument, wanted, describe(value));
    const py::ssize_t count = input.lead.back();
    input.lead.pop_back();
    input.item_size *= count;
    return count;
}

template <class Method, class T>
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
            const auto result = Method::template blend<Signs::kToHeaviest, T>(items, shares);
            output.write(i, {result.transform, result.is_defined});
        }
    });
    return output.take();
}

py::object blend(const py::object& any_transforms, const py::object& any_weights, const py::object& method) {
    const auto [transforms, weights] = promoted<2>({"transforms", "weights"}, {any_transforms, any_weights});
    return with_method(method, [&]<class Method>(Method) {
        return with_element(transforms, "transforms",
                            Item<typename Method::template Transform<double>>::kShape,
                            [&]<class T>(T) { return blend_items<Method, T>(transforms, weights); });
    });
}

// combine(span, four keys) at every time of `at`.
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

py::object spline_of_vectors(const py::object& any_keys, const py::object& any_times,
                             const py::object& any_at) {
    const auto [keys, times, at] = promoted<3>({"keys", "times", "at"}, {any_keys, any_times, any_at});
    return with_representation(keys, "keys", "keys", [&]<class Row>(Row) {
        return with_element(keys, "keys", "", [&]<class T>(T) {
            return spline_items<T, typename Row::template Transform<T>>(
                keys, times, at,
                [](const auto& span, const auto& four) { return spline_vector(span, four); });
        });
    });
}

}  // namespace

void bind_interpolate(py::module_& m) {
    auto interpolate = m.def_submodule("interpolate");
    py::list methods;
    std::apply([&](auto... row) { (methods.append(py::str(std::string(row.name))), ...); }, Interpolations{});
    interpolate.attr("METHODS") = py::tuple(methods);
    interpolate.def("between", &between, py::arg("a"), py::arg("b"), py::arg("t"), py::arg("method"));
    interpolate.def("blend", &blend, py::arg("transforms"), py::arg("weights"), py::arg("method"));
    auto splines = m.def_submodule("spline");
    splines.def("catmull_rom", &spline, py::arg("keys"), py::arg("times"), py::arg("at"), py::arg("method"));
    splines.def("catmull_rom_vector", &spline_of_vectors, py::arg("keys"), py::arg("times"), py::arg("at"));
}

}  // namespace sinew::bindings
