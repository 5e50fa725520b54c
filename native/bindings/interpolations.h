// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "broadcast.h"
#include "sinew/interpolate/methods.h"

namespace sinew::bindings {

/// The names of a list of types.
template <class... Rows>
constexpr std::array<std::string_view, sizeof...(Rows)> names_of(const std::tuple<Rows...>& /*rows*/) {
    return {Rows::name...};
}

/// Calls f(Method{}) for the interpolation that is called `method`. ValueError for another name, TypeError if it is no
/// str.
template <class F>
py::object with_method(const py::object& method, F f) {
    const std::size_t found = checked_choice(method, "method", names_of(Interpolations{}));
    py::object result;
    std::size_t index = 0;
    const auto try_row = [&](auto row) {
        if (index++ == found) result = f(row);
    };
    std::apply([&](auto... row) { (try_row(row), ...); }, Interpolations{});
    return result;
}

/// Calls f(T{}) with the element type of `value`.
template <class F>
py::object with_element(const py::object& value, const char* argument, const char* shape, F f) {
    if (is_double(value, argument, std::string("float32 or float64 ") + shape)) return f(double{});
    return f(float{});
}

/// Calls f.operator()<Method, T>() for an interpolation and the element type of `value`, which is in its layout.
template <class F>
py::object with_method(const py::object& method, const py::object& value, const char* argument, F f) {
    return with_method(method, [&]<class Method>(Method) {
        const char* const shape = Item<typename Method::template Transform<double>>::kShape;
        return with_element(value, argument, shape,
                            [&]<class T>(T) { return f.template operator()<Method, T>(); });
    });
}

/// Calls f.operator()<Transform, T>() for the layout whose items end with the last axis of `value`, 4, 7 or 8, and
/// its element type.
template <class F>
py::object with_layout(const py::object& value, const char* argument, const std::string& axes, F f) {
    const std::string wanted = "float32 or float64 [" + axes + ", 4, 4], [" + axes + ", 3, 4], [" + axes +
                               ", 7] or [" + axes + ", 8]";
    const bool is_of_double = is_double(value, argument, wanted);
    const auto call = [&]<class T>(T) -> py::object {
        const auto array = py::reinterpret_borrow<py::array>(value);
        const py::ssize_t last = array.ndim() > 0 ? array.shape(array.ndim() - 1) : 0;
        if (last == 4) return f.template operator()<Affine<T>, T>();
        if (last == 7) return f.template operator()<QuatVec<T>, T>();
        if (last == 8) return f.template operator()<DualQuat<T>, T>();
        fail(argument, wanted, describe(value));
    };
    return is_of_double ? call(double{}) : call(float{});
}

/// Copies the items of an input, all of whose axes belong to the list.
template <class Value, class T>
std::vector<Value> items_of(const Input<T>& input) {
    std::vector<Value> items;
    const py::ssize_t count = count_of(input.lead);
    items.reserve(static_cast<std::size_t>(count));
    for (py::ssize_t i = 0; i < count; ++i)
        items.push_back(Item<Value>::read(input.data + i * input.item_size));
    return items;
}

/// The times [keys], one for each of `keys`, non-decreasing.
template <class T>
std::vector<T> checked_times(const py::object& value, py::ssize_t keys) {
    const auto input = checked_input<T, T>(value, "times");
    const std::string wanted = element_name<T>() + shape_text({keys}) + ", one for each key";
    if (input.lead.size() != 1 || input.lead[0] != keys) fail("times", wanted, describe(value));
    for (py::ssize_t i = 1; i < keys; ++i) {
        if (input.data[i] < input.data[i - 1]) {
            fail("times", "times that do not decrease", "a smaller one at index " + std::to_string(i));
        }
    }
    return items_of<T>(input);
}

/// What the library returns, for an Output.
template <class Transform>
using Blend = Named<"Blended", Transform, bool>;

/// Calls evaluate(keys, times, time) for each time in `at`.
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

/// Whether the last axis of `keys` has length 3.
inline bool is_of_points(const py::object& keys) {
    if (!py::isinstance<py::array>(keys)) return false;
    const auto array = py::reinterpret_borrow<py::array>(keys);
    return array.ndim() > 0 && array.shape(array.ndim() - 1) == 3;
}

}  // namespace sinew::bindings
