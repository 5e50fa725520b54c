// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "sinew/transform/affine.h"

namespace sinew::bindings {

namespace py = pybind11;

/// Raises ValueError "`argument`: expected `wanted`, got `got`".
[[noreturn]] void fail(const char* argument, const std::string& wanted, const std::string& got);

/// "float64 [120, 4]" for an array, the type's name for anything else.
std::string describe(const py::handle& value);

/// `value` as a C-contiguous array of T with `dimensions` dimensions; copied only where its layout is
/// another. ValueError where it is no array of exactly that element type, naming `wanted`.
template <class T>
py::array_t<T> checked(const py::handle& value, const char* argument, py::ssize_t dimensions,
                       const std::string& wanted) {
    if (!py::isinstance<py::array>(value)) fail(argument, wanted, describe(value));
    const auto array = py::reinterpret_borrow<py::array>(value);
    if (!array.dtype().is(py::dtype::of<T>()) && !array.dtype().equal(py::dtype::of<T>())) {
        fail(argument, wanted, describe(value));
    }
    if (array.ndim() != dimensions) fail(argument, wanted, describe(value));
    return py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
}

/// float32 [n, 3].
py::array_t<float> checked_points(const py::handle& value, const char* argument);

/// float32 [n, 4, 4] or [n, 3, 4], row-major, finite; a fourth row is not read.
std::vector<Affine<float>> checked_affines(const py::handle& value, const char* argument);

/// float32 [4, 4] or [3, 4].
Affine<float> checked_affine(const py::handle& value, const char* argument);

}  // namespace sinew::bindings
