// SPDX-License-Identifier: GPL-3.0-or-later
#include "arrays.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "items.h"
#include "sinew/deformer.h"
#include "sinew/mesh/check_arrays.h"

namespace sinew::bindings {
namespace {

/// str(value), for any content.
std::string printed(const py::handle& value) {
    const py::str text(value);
    return py::reinterpret_steal<py::bytes>(
        PyUnicode_AsEncodedString(text.ptr(), "utf-8", "backslashreplace"));
}

/// `wide` as T, whose name is `type`. ValueError for a finite number that T can not represent.
template <class T, class Wide>
py::array_t<T> narrowed(const py::array_t<Wide>& wide, const char* argument, const char* type) {
    py::array_t<T> narrow(std::vector<py::ssize_t>(wide.shape(), wide.shape() + wide.ndim()));
    const Wide* const from = wide.data();
    T* const to = narrow.mutable_data();
    for (py::ssize_t i = 0; i < wide.size(); ++i) {
        bool fits = true;
        if constexpr (std::is_floating_point_v<Wide>) {
            to[i] = static_cast<T>(from[i]);
            fits = std::isfinite(to[i]) || !std::isfinite(from[i]);
        } else {
            fits = std::in_range<T>(from[i]);
            to[i] = static_cast<T>(from[i]);
        }
        if (!fits) {
            fail(argument, std::string("numbers that ") + type + " holds", printed(py::cast(from[i])));
        }
    }
    return narrow;
}

}  // namespace

void fail(const char* argument, const std::string& wanted, const std::string& got) {
    throw py::value_error(std::string(argument) + ": expected " + wanted + ", got " + got);
}

std::string shape_text(const Shape& shape) {
    std::string text = "[";
    for (const py::ssize_t length : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(length);
    return text + "]";
}

std::string one_of(std::span<const std::string_view> names) {
    std::string text = "one of ";
    for (const std::string_view name : names) text += (name == names[0] ? "" : ", ") + std::string(name);
    return text;
}

py::array as_array(const py::handle& value, const char* argument) {
    if (py::isinstance<py::array>(value)) {
        if (Py_TYPE(value.ptr()) != py::detail::npy_api::get().PyArray_Type_ && py::hasattr(value, "mask") &&
            value.attr("mask").attr("any")().cast<bool>()) {
            fail(argument, "an array without masked values", "one with them");
        }
        return py::reinterpret_borrow<py::array>(value);
    }
    try {
        return py::array(py::module_::import("numpy").attr("asarray")(value));
    } catch (py::error_already_set& error) {
        // Whatever error numpy or the value raises, it is no array; except for errors that end a program.
        if (error.matches(PyExc_MemoryError) || !error.matches(PyExc_Exception)) throw;
        return py::reinterpret_steal<py::array>(py::handle());
    }
}

bool is_numeric(const py::array& array) {
    const char kind = array.dtype().kind();
    return kind == 'b' || kind == 'i' || kind == 'u' || (kind == 'f' && array.itemsize() <= 8);
}

template <>
py::array_t<double> as_type(const py::array& array, const char* argument, const std::string& wanted) {
    if (!is_numeric(array)) fail(argument, wanted, describe(array));
    return in_order<double>(array);
}

template <>
py::array_t<float> as_type(const py::array& array, const char* argument, const std::string& wanted) {
    if (!is_numeric(array)) fail(argument, wanted, describe(array));
    if (array.dtype().kind() != 'f' || array.itemsize() < 8) return in_order<float>(array);
    return narrowed<float>(in_order<double>(array), argument, "float32");
}

template <>
py::array_t<std::int32_t> as_type(const py::array& array, const char* argument, const std::string& wanted) {
    const char kind = array.dtype().kind();
    // The array that numpy makes of an empty list has a floating-point type, but no fractions.
    const bool is_empty = array.size() == 0 && is_numeric(array);
    if (kind != 'b' && kind != 'i' && kind != 'u' && !is_empty) fail(argument, wanted, describe(array));
    if (kind == 'u') return narrowed<std::int32_t>(in_order<std::uint64_t>(array), argument, "int32");
    return narrowed<std::int32_t>(in_order<std::int64_t>(array), argument, "int32");
}

std::string describe(const py::handle& value) {
    const auto name_of_type = [&] { return printed(py::type::of(value).attr("__name__")); };
    py::array array;
    if (py::isinstance<py::array>(value)) {
        array = py::reinterpret_borrow<py::array>(value);
    } else {
        array = as_array(value, "");
        if (!array || array.ndim() == 0 || !is_numeric(array)) return name_of_type();
    }
    const std::string text = py::isinstance<py::array>(value) ? "" : name_of_type() + " of ";
    return text + printed(array.dtype()) + " " +
           shape_text(Shape(array.shape(), array.shape() + array.ndim()));
}

std::string checked_name(const py::handle& value, const char* argument, const std::string& wanted) {
    if (!py::isinstance<py::str>(value)) {
        throw py::type_error(std::string(argument) + ": expected " + wanted + ", got " + describe(value));
    }
    Py_ssize_t length = 0;
    const char* const text = PyUnicode_AsUTF8AndSize(value.ptr(), &length);
    if (text == nullptr) {
        // Half of a surrogate pair.
        PyErr_Clear();
        fail(argument, wanted, py::repr(value).cast<std::string>());
    }
    return {text, static_cast<std::size_t>(length)};
}

std::size_t checked_choice(const py::handle& value, const char* argument,
                           std::span<const std::string_view> names) {
    for (std::size_t i = 0; i < names.size() && PyUnicode_Check(value.ptr()); ++i) {
        // Names end with 0, as literals do.
        if (PyUnicode_CompareWithASCIIString(value.ptr(), names[i].data()) == 0) return i;
    }
    const std::string wanted = one_of(names);
    fail(argument, wanted, "'" + checked_name(value, argument, wanted) + "'");
}

py::array_t<float> checked_points(const py::handle& value, const char* argument) {
    return checked_rows<float>(value, argument, 3, "float32 [n, 3]", kMaxVertices);
}

py::array_t<float> checked_points(const py::handle& value, const char* argument, std::size_t count) {
    auto points = checked_points(value, argument);
    if (static_cast<std::size_t>(points.shape(0)) != count) {
        fail(argument, "float32 [" + std::to_string(count) + ", 3]", describe(value));
    }
    return points;
}

void raise_unless_ok(Status status) {
    switch (status) {
        case Status::ok: return;
        case Status::memory: throw std::bad_alloc();
        case Status::size: throw py::value_error("expected arrays of sizes that match, got others");
        case Status::not_finite: throw py::value_error("expected finite values, got NaN or infinity");
    }
}

void check_rest_points(Status status, const py::array_t<float>& points, std::size_t count,
                       const Affine<float>& bones_from_model) {
    if (status == Status::ok) return;
    check_points(as_points(points), count);
    check_space(bones_from_model);
    raise_unless_ok(status);
}

std::vector<Affine<float>> checked_affines(const py::handle& value, const char* argument) {
    const std::string wanted = "float32 [n, 4, 4] or [n, 3, 4]";
    const auto array = checked<float>(value, argument, 3, wanted);
    if (array.shape(2) != 4 || (array.shape(1) != 4 && array.shape(1) != 3)) {
        fail(argument, wanted, describe(value));
    }
    std::vector<Affine<float>> affines;
    affines.reserve(static_cast<std::size_t>(array.shape(0)));
    for (py::ssize_t i = 0; i < array.shape(0); ++i) {
        const float* rows = array.data(i, 0, 0);
        check_finite(rows, 12, argument, i);
        affines.push_back(Item<Affine<float>>::read(rows));
    }
    return affines;
}

Affine<float> checked_affine(const py::handle& value, const char* argument) {
    if (value.is_none()) return {};
    const std::string wanted = "float32 [4, 4] or [3, 4]";
    const auto array = checked<float>(value, argument, 2, wanted);
    if (array.shape(1) != 4 || (array.shape(0) != 4 && array.shape(0) != 3)) {
        fail(argument, wanted, describe(value));
    }
    const auto affine = Item<Affine<float>>::read(array.data());
    if (!is_finite(affine)) fail(argument, "finite values", "NaN or infinity");
    return affine;
}

py::array_t<float> array_of(std::span<const Vec3<float>> points) {
    py::array_t<float> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
    const auto* const first = reinterpret_cast<const float*>(points.data());
    std::copy(first, first + array.size(), array.mutable_data());
    return array;
}

// Never makes a copy silently: the caller's array would then keep its old points.
py::array_t<float> checked_out(const py::object& out, std::size_t vertex_count) {
    const auto rows = static_cast<py::ssize_t>(vertex_count);
    if (out.is_none()) return py::array_t<float>({rows, py::ssize_t{3}});
    const std::string wanted = "writable C-contiguous float32 [" + std::to_string(vertex_count) + ", 3]";
    if (!py::isinstance<py::array_t<float>>(out)) fail("out", wanted, describe(out));
    auto array = py::reinterpret_borrow<py::array_t<float>>(out);
    if (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != 3)
        fail("out", wanted, describe(out));
    if ((array.flags() & py::array::c_style) == 0) fail("out", wanted, "one that is not C-contiguous");
    if ((array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) == 0) {
        fail("out", wanted, "one that is not aligned");
    }
    if (!array.writeable()) fail("out", wanted, "a read-only array");
    return array;
}

void check_apart(const py::array_t<float>& out, const py::array_t<float>& points) {
    if (out.size() > 0 && out.data() < points.data() + points.size() &&
        points.data() < out.data() + out.size()) {
        fail("out", "another array than the points", "one that shares memory with them");
    }
}

double checked_number(const py::handle& value, const char* argument, const std::string& wanted) {
    if (!PyFloat_Check(value.ptr()) && !PyLong_Check(value.ptr())) {
        // float() would take arrays of one number, and drop an imaginary part, with only a warning.
        const py::array array = as_array(value, argument);
        const bool is_complex = array && array.dtype().kind() == 'c';
        if (is_complex || py::isinstance<py::array>(value)) fail(argument, wanted, describe(value));
    }
    const double number = PyFloat_AsDouble(value.ptr());
    if (number == -1.0 && PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        fail(argument, wanted, describe(value));
    }
    return number;
}

std::size_t checked_integer(const py::handle& value, const char* argument, const std::string& wanted,
                            std::size_t most) {
    const auto number = py::reinterpret_steal<py::int_>(PyNumber_Index(value.ptr()));
    if (!number) {
        PyErr_Clear();
        fail(argument, wanted, describe(value));
    }
    int overflow = 0;
    const long long count = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
    // No integer is too many threads.
    if (overflow > 0 && most == kAnyLength) return most;
    // Python refuses to convert the longest integers to text.
    if (overflow != 0) fail(argument, wanted, overflow < 0 ? "a negative one" : "one far beyond");
    if (count < 0 || static_cast<unsigned long long>(count) > most) {
        fail(argument, wanted, std::to_string(count));
    }
    return static_cast<std::size_t>(count);
}

std::size_t checked_threads(const py::object& threads) {
    if (threads.is_none()) return 0;
    return checked_integer(threads, "threads", "None or an integer, 0 or more", kAnyLength);
}

py::object part_of(const py::object& state, std::size_t size, std::size_t index) {
    const std::string wanted = "a tuple of " + std::to_string(size) + ", as pickling makes it";
    if (!py::isinstance<py::tuple>(state)) fail("state", wanted, describe(state));
    const auto parts = py::reinterpret_borrow<py::tuple>(state);
    if (parts.size() != size) fail("state", wanted, "a tuple of " + std::to_string(parts.size()));
    return parts[index];
}

}  // namespace sinew::bindings
