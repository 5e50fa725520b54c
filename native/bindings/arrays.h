// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cmath>
#include <limits>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gil.h"
#include "signatures.h"
#include "sinew/transform/affine.h"

namespace sinew::bindings {

namespace py = pybind11;

inline constexpr std::size_t kAnyLength = std::numeric_limits<std::size_t>::max();

/// Raises ValueError "`argument`: expected `wanted`, got `got`".
[[noreturn]] void fail(const char* argument, const std::string& wanted, const std::string& got);

using Shape = std::vector<py::ssize_t>;

/// ValueError if a number of the item at `index` is not finite.
template <class T>
void check_finite(const T* numbers, std::size_t count, const char* argument, py::ssize_t index) {
    for (std::size_t i = 0; i < count; ++i) {
        if (!std::isfinite(numbers[i])) {
            fail(argument, "finite values", "NaN or infinity at index " + std::to_string(index));
        }
    }
}

/// The shape as text, such as "[2, 3]".
std::string shape_text(const Shape& shape);

/// "one of a, b, c".
std::string one_of(std::span<const std::string_view> names);

/// Describes `value` for an error: "float64 [120, 4]" for an array, "list of float64 [120, 4]" for something that
/// numpy converts to an array of numbers, otherwise the type's name.
std::string describe(const py::handle& value);

/// `value` itself if it is an array, else numpy's conversion of it; null if numpy can not convert it. ValueError
/// for a masked array with masked values, since these would be read as numbers.
py::array as_array(const py::handle& value, const char* argument);

/// The text of a `str`. TypeError, naming `wanted`, for anything else.
std::string checked_name(const py::handle& value, const char* argument, const std::string& wanted);

/// The index of a name among these. ValueError for another name, TypeError if it is no str.
std::size_t checked_choice(const py::handle& value, const char* argument,
                           std::span<const std::string_view> names);

/// `value` as a C-contiguous, aligned array of element type T. Copies only if it is not one already.
template <class T>
py::array_t<T> in_order(const py::handle& value) {
    constexpr int kFlags =
        py::array::c_style | py::array::forcecast | py::detail::npy_api::NPY_ARRAY_ALIGNED_;
    auto array = py::array_t<T, kFlags>::ensure(value);
    // The copy would be too large.
    if (!array) throw std::bad_alloc();
    return py::reinterpret_steal<py::array_t<T>>(array.release());
}

template <class T>
bool has_type(const py::array& array) {
    return array.dtype().is(py::dtype::of<T>()) || array.dtype().equal(py::dtype::of<T>());
}

/// Whether the elements are real numbers of at most 64 bits.
bool is_numeric(const py::array& array);

/// The numbers of `array` as T (float, double or std::int32_t), C-contiguous and aligned; the array itself if it
/// is so already. Fractions are rounded to T. ValueError for numbers that T can not represent: fractions as
/// integers, and numbers beyond its range.
template <class T>
py::array_t<T> as_type(const py::array& array, const char* argument, const std::string& wanted);

/// `value`, an array or anything that numpy converts to one, as a C-contiguous array of T with `dimensions`
/// dimensions. Copies only if its layout or element type differs. ValueError, naming `wanted`, if it is no array
/// of numbers that T can represent, or if its first dimension is larger than `most`.
template <class T>
py::array_t<T> checked(const py::handle& value, const char* argument, py::ssize_t dimensions,
                       const std::string& wanted, std::size_t most = kAnyLength) {
    const py::array array = as_array(value, argument);
    if (!array || !is_numeric(array) || array.ndim() != dimensions) fail(argument, wanted, describe(value));
    // Checked before a copy is made.
    if (static_cast<std::size_t>(array.shape(0)) > most) {
        fail(argument, wanted + ", at most " + std::to_string(most), describe(value));
    }
    return has_type<T>(array) ? in_order<T>(array) : as_type<T>(array, argument, wanted);
}

/// checked() with two dimensions, the second of this length.
template <class T>
py::array_t<T> checked_rows(const py::handle& value, const char* argument, py::ssize_t columns,
                            const std::string& wanted, std::size_t most = kAnyLength) {
    auto rows = checked<T>(value, argument, 2, wanted, most);
    if (rows.shape(1) != columns) fail(argument, wanted, describe(value));
    return rows;
}

/// None, or an array of numbers, one for each of `count`: empty for None.
///
/// type  its name in messages, such as float32
template <class T>
py::array_t<T> one_for_each(const py::object& values, const char* argument, std::size_t count,
                            const char* type) {
    const std::string wanted = std::string("None or ") + type + " [" + std::to_string(count) + "]";
    if (values.is_none()) return {};
    auto array = checked<T>(values, argument, 1, wanted, std::max(count, std::size_t{1}));
    if (static_cast<std::size_t>(array.shape(0)) != count) fail(argument, wanted, describe(values));
    return array;
}

/// An array [n, 3], n at most kMaxVertices.
py::array_t<float> checked_points(const py::handle& value, const char* argument);

/// An array [n, 3], n = `count`.
py::array_t<float> checked_points(const py::handle& value, const char* argument, std::size_t count);

/// Raises what the status of a set_rest_points() says of its points [n, 3], of which there are to be `count`, and of
/// their space.
void check_rest_points(Status status, const py::array_t<float>& points, std::size_t count,
                       const Affine<float>& bones_from_model = {});

/// An array [n, 4, 4] or [n, 3, 4], row-major, finite. A fourth row is not read.
std::vector<Affine<float>> checked_affines(const py::handle& value, const char* argument);

/// An array [4, 4] or [3, 4], or None, which is the identity.
Affine<float> checked_affine(const py::handle& value, const char* argument);

static_assert(sizeof(Vec3<float>) == 3 * sizeof(float), "points are read and written in place");

/// The points in an array [n, 3].
inline std::span<const Vec3<float>> as_points(const py::array_t<float>& points) {
    return {reinterpret_cast<const Vec3<float>*>(points.data()), static_cast<std::size_t>(points.shape(0))};
}

inline std::span<Vec3<float>> as_points_to_write(py::array_t<float>& points) {
    return {reinterpret_cast<Vec3<float>*>(points.mutable_data()), static_cast<std::size_t>(points.shape(0))};
}

template <class T>
std::span<const T> as_span(const py::array_t<T>& array) {
    return {array.data(), static_cast<std::size_t>(array.size())};
}

template <class T>
py::array_t<T> array_of(std::span<const T> values) {
    return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// The points as an array [n, 3].
py::array_t<float> array_of(std::span<const Vec3<float>> points);

/// An array of points to write to; a new one if `out` is None.
py::array_t<float> checked_out(const py::object& out, std::size_t vertex_count);

/// ValueError if `out` shares memory with `points`.
void check_apart(const py::array_t<float>& out, const py::array_t<float>& points);

/// A number of Python or numpy, but no array. ValueError for anything else.
double checked_number(const py::handle& value, const char* argument, const std::string& wanted);

/// An integer from 0 to `most`, also one of numpy's.
std::size_t checked_integer(const py::handle& value, const char* argument, const std::string& wanted,
                            std::size_t most);

/// At most so many threads; None or 0: as many as useful.
std::size_t checked_threads(const py::object& threads);

/// The item `index` of a pickled state, which must have `size` items.
py::object part_of(const py::object& state, std::size_t size, std::size_t index);

/// make(the items of a pickled state), which must have `size` items.
template <std::size_t size, class Make>
auto from_state(const py::object& state, Make make) {
    return [&]<std::size_t... I>(std::index_sequence<I...>) { return make(part_of(state, size, I)...); }
    (std::make_index_sequence<size>{});
}

}  // namespace sinew::bindings
