// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "arrays.h"
#include "gil.h"
#include "items.h"

namespace sinew::bindings {

/// An argument as an array of items that consist of adjacent numbers of type T. `lead` are the axes before those
/// of an item.
template <class T>
struct Input {
    const char* argument;
    py::array_t<T> array;
    const T* data;
    Shape lead;
    py::ssize_t item_size;
    Shape steps{};  ///< for each axis of the common shape, in numbers; 0 where the argument is repeated

    [[nodiscard]] const T* at(py::ssize_t index, const Shape& common) const {
        py::ssize_t offset = 0;
        for (std::size_t axis = common.size(); axis-- > 0;) {
            offset += (index % common[axis]) * steps[axis];
            index /= common[axis];
        }
        return data + offset;
    }
};

/// Whether `value`, a result of promoted(), is an array of float64 rather than float32. ValueError, naming
/// `wanted`, for anything else.
bool is_double(const py::handle& value, const char* argument, const std::string& wanted);

/// The arguments of one call with their arrays in one element type, float32 or float64, as numpy promotes them:
/// float64 if any is not float32 or smaller. Numbers, and anything that is no array of numbers, are not changed.
void promote(std::span<py::object> values, std::span<const char* const> arguments);

template <std::size_t N>
std::array<py::object, N> promoted(const std::array<const char*, N>& arguments,
                                   std::array<py::object, N> values) {
    promote(values, arguments);
    return values;
}

/// "float64 " or "float32 ".
template <class T>
std::string element_name() {
    return std::is_same_v<T, double> ? "float64 " : "float32 ";
}

/// `value`, a result of promoted(), as items of `Value`, finite, with element type T. A plain number is allowed
/// as a scalar.
template <class T, class Value>
Input<T> checked_input(const py::handle& value, const char* argument) {
    const std::string wanted = element_name<T>() + Item<Value>::kShape;
    if constexpr (std::is_same_v<Value, T>) {
        if (!py::isinstance<py::array>(value)) {
            py::array_t<T> number(Shape{});
            *number.mutable_data() = static_cast<T>(checked_number(value, argument, "a number or " + wanted));
            check_finite(number.data(), 1, argument, 0);
            return {argument, number, number.data(), {}, 1};
        }
    }
    const std::string any = std::string("float32 or float64 ") + Item<Value>::kShape;
    if (is_double(value, argument, any) != std::is_same_v<T, double>) fail(argument, wanted, describe(value));
    const auto array = in_order<T>(value);
    const auto axes = static_cast<py::ssize_t>(Item<Value>::kDimensions.size());
    bool fits = array.ndim() >= axes;
    py::ssize_t item_size = 1;
    for (py::ssize_t axis = 0; fits && axis < axes; ++axis) {
        const py::ssize_t length = array.shape(array.ndim() - axes + axis);
        const auto full = static_cast<py::ssize_t>(Item<Value>::kDimensions[static_cast<std::size_t>(axis)]);
        const bool may_lack_row = std::is_same_v<Value, Affine<T>> && axis == 0;
        fits = length == full || (may_lack_row && length == full - 1);
        item_size *= length;
    }
    if (!fits) fail(argument, wanted, describe(value));
    const Shape lead(array.shape(), array.shape() + (array.ndim() - axes));
    const py::ssize_t count = array.size() / item_size;
    for (py::ssize_t i = 0; i < count; ++i) {
        check_finite(array.data() + i * item_size, Item<Value>::kSize, argument, i);
    }
    return {argument, array, array.data(), lead, item_size};
}

/// The common shape of `inputs` by numpy's rules; sets each input's steps in it. ValueError that names the first
/// argument that does not fit those before it.
template <class T>
Shape broadcast(std::span<Input<T>> inputs) {
    Shape common;
    for (const Input<T>& input : inputs) {
        const Shape before = common;
        if (input.lead.size() > common.size()) {
            common.insert(common.begin(), input.lead.size() - common.size(), 1);
        }
        const std::size_t missing = common.size() - input.lead.size();
        for (std::size_t axis = 0; axis < input.lead.size(); ++axis) {
            const py::ssize_t length = input.lead[axis];
            py::ssize_t& shared = common[missing + axis];
            if (length != shared && length != 1 && shared != 1) {
                fail(input.argument, "leading axes that broadcast with " + shape_text(before),
                     shape_text(input.lead));
            }
            if (shared == 1) shared = length;
        }
    }
    for (Input<T>& input : inputs) {
        input.steps.assign(common.size(), 0);
        py::ssize_t step = input.item_size;
        for (std::size_t axis = input.lead.size(); axis-- > 0;) {
            if (input.lead[axis] != 1) input.steps[common.size() - input.lead.size() + axis] = step;
            step *= input.lead[axis];
        }
    }
    return common;
}

/// Makes the last leading axis, such as the points of a set, part of the item. Returns its length. ValueError, naming
/// `wanted`, if there is no such axis, or if `like` is not negative and not its length.
template <class T>
py::ssize_t take_last_axis(Input<T>& input, const py::handle& value, const std::string& wanted,
                           py::ssize_t like = -1) {
    if (input.lead.empty() || (like >= 0 && input.lead.back() != like)) {
        fail(input.argument, wanted, describe(value));
    }
    const py::ssize_t count = input.lead.back();
    input.lead.pop_back();
    input.item_size *= count;
    return count;
}

/// Reads the rows of one item after take_last_axis(). Does not copy the input, because that counts Python's references
/// and this runs without the GIL.
template <class Value, class T>
void read_rows(const Input<T>& input, py::ssize_t index, const Shape& common, std::vector<Value>& rows) {
    const T* from = input.at(index, common);
    const std::size_t size =
        static_cast<std::size_t>(input.item_size) / std::max(rows.size(), std::size_t{1});
    for (Value& row : rows) {
        row = Item<Value>::read(from);
        from += size;
    }
}

/// A result that is being written: an array of items, or a tuple of such arrays.
template <class Value>
struct Output {
    using Element = typename Item<Value>::Element;
    py::array_t<Element> array;
    Element* data;
    std::size_t item_size = 1;

    explicit Output(Shape shape) {
        for (const std::size_t length : Item<Value>::kDimensions) {
            shape.push_back(static_cast<py::ssize_t>(length));
            item_size *= length;
        }
        array = py::array_t<Element>(shape);
        data = array.mutable_data();
    }
    void write(py::ssize_t index, const Value& value) {
        Item<Value>::write(value, data + static_cast<std::size_t>(index) * item_size);
    }
    /// Returns an array without axes as a number.
    py::object take() { return array.ndim() > 0 ? py::object(array) : array[py::tuple()]; }
};

template <class... Values>
struct Output<std::tuple<Values...>> {
    std::tuple<Output<Values>...> parts;

    explicit Output(const Shape& shape) : parts(Output<Values>(shape)...) {}
    void write(py::ssize_t index, const std::tuple<Values...>& values) {
        [&]<std::size_t... I>(std::index_sequence<I...>) {
            (std::get<I>(parts).write(index, std::get<I>(values)), ...);
        }
        (std::index_sequence_for<Values...>{});
    }
    py::object take() {
        return std::apply([](auto&... part) -> py::object { return py::make_tuple(part.take()...); }, parts);
    }
};

/// The named tuple `name` of sinew._types.
py::object named_tuple(const char* name, const py::tuple& parts);

/// Values that Python gets as the named tuple `name` of sinew._types.
template <Text name, class... Values>
struct Named : std::tuple<Values...> {
    using std::tuple<Values...>::tuple;
};

template <Text name, class... Values>
Named<name, Values...> named(const Values&... values) {
    return {values...};
}

template <Text name, class... Values>
struct Output<Named<name, Values...>> : Output<std::tuple<Values...>> {
    using Output<std::tuple<Values...>>::Output;
    py::object take() { return named_tuple(name.characters, Output<std::tuple<Values...>>::take()); }
};

/// What signatures call a result that an Output<Value> makes.
template <class Value>
struct SignatureOf {
    using type = Array;
};
template <Text name, class... Values>
struct SignatureOf<Named<name, Values...>> {
    using type = NamedTuple<name>;
};

inline py::ssize_t count_of(const Shape& shape) {
    py::ssize_t count = 1;
    for (const py::ssize_t length : shape) count *= length;
    return count;
}

/// The results of make(i), which runs without the GIL, for each item of an Output<Value> of this shape.
template <class Value, class Make>
py::object each_of(const Shape& shape, const Make& make) {
    Output<Value> output(shape);
    const py::ssize_t count = count_of(shape);
    without_gil([&] {
        for (py::ssize_t i = 0; i < count; ++i) output.write(i, make(i));
    });
    return output.take();
}

/// Calls `f` for each item of the arguments, broadcast together.
template <class T, template <class> class... In, class F, std::size_t... I>
py::object map_items(const std::array<const char*, sizeof...(In)>& arguments,
                     const std::array<py::object, sizeof...(In)>& values, F f, std::index_sequence<I...>) {
    std::array<Input<T>, sizeof...(In)> inputs{checked_input<T, In<T>>(values[I], arguments[I])...};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    using Result = decltype(f(std::declval<const In<T>&>()...));
    return each_of<Result>(
        common, [&](py::ssize_t i) -> Result { return f(Item<In<T>>::read(inputs[I].at(i, common))...); });
}

/// map_items() with the element type that all arguments have after promoted(). The first argument must not be a
/// scalar.
template <template <class> class... In, class F>
py::object map(const std::array<const char*, sizeof...(In)>& arguments,
               const std::array<py::object, sizeof...(In)>& given, F f) {
    const auto values = promoted(arguments, given);
    const std::array<const char*, sizeof...(In)> shapes{Item<In<double>>::kShape...};
    const std::string wanted = std::string("float32 or float64 ") + shapes[0];
    constexpr std::index_sequence_for<Item<In<double>>...> kIndices;
    if (is_double(values[0], arguments[0], wanted)) {
        return map_items<double, In...>(arguments, values, f, kIndices);
    }
    return map_items<float, In...>(arguments, values, f, kIndices);
}

template <template <class> class>
using ArrayFor = const ArrayLike&;

/// Defines a function of the module whose arguments are arrays of the items `In`.
template <template <class> class... In, class F>
void def(py::module_& m, const char* name, const std::array<const char*, sizeof...(In)>& arguments, F f,
         const char* doc) {
    using Result = decltype(f(std::declval<const In<double>&>()...));
    const auto function = [arguments, f](ArrayFor<In>... values) ->
        typename SignatureOf<Result>::type { return map<In...>(arguments, {values...}, f); };
    std::apply([&](auto... argument) { m.def(name, function, py::arg(argument)..., doc); }, arguments);
}

}  // namespace sinew::bindings
