// SPDX-License-Identifier: GPL-3.0-or-later
#include "arrays.h"

#include <cmath>

#include "sinew/deform/deformer.h"

namespace sinew::bindings {
namespace {

Affine<float> read_affine(const float* rows) {
    Affine<float> a;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) a.linear[column][row] = rows[4 * row + column];
        a.translation[row] = rows[4 * row + 3];
    }
    return a;
}

bool is_finite(const float* values, py::ssize_t count) {
    for (py::ssize_t i = 0; i < count; ++i) {
        if (!std::isfinite(values[i])) return false;
    }
    return true;
}

}  // namespace

void fail(const char* argument, const std::string& wanted, const std::string& got) {
    throw py::value_error(std::string(argument) + ": expected " + wanted + ", got " + got);
}

std::string describe(const py::handle& value) {
    if (!py::isinstance<py::array>(value)) {
        return py::str(py::type::of(value).attr("__name__")).cast<std::string>();
    }
    const auto array = py::reinterpret_borrow<py::array>(value);
    std::string text = py::str(array.dtype()).cast<std::string>() + " [";
    for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) {
        if (axis > 0) text += ", ";
        text += std::to_string(array.shape(axis));
    }
    return text + "]";
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

py::array_t<float> checked_points(const py::handle& value, const char* argument) {
    auto points = checked<float>(value, argument, 2, "float32 [n, 3]", kMaxVertices);
    if (points.shape(1) != 3) fail(argument, "float32 [n, 3]", describe(value));
    return points;
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
        if (!is_finite(rows, 12)) {
            fail(argument, "finite values", "NaN or infinity at index " + std::to_string(i));
        }
        affines.push_back(read_affine(rows));
    }
    return affines;
}

Affine<float> checked_affine(const py::handle& value, const char* argument) {
    const std::string wanted = "float32 [4, 4] or [3, 4]";
    const auto array = checked<float>(value, argument, 2, wanted);
    if (array.shape(1) != 4 || (array.shape(0) != 4 && array.shape(0) != 3)) {
        fail(argument, wanted, describe(value));
    }
    if (!is_finite(array.data(), 12)) fail(argument, "finite values", "NaN or infinity");
    return read_affine(array.data());
}

}  // namespace sinew::bindings
