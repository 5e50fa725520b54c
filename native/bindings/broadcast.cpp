// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"

namespace sinew::bindings {

std::string text_of(const Shape& shape) {
    std::string text = "[";
    for (std::size_t axis = 0; axis < shape.size(); ++axis) {
        text += (axis > 0 ? ", " : "") + std::to_string(shape[axis]);
    }
    return text + "]";
}

bool is_double(const py::handle& value, const char* argument, const std::string& wanted) {
    if (py::isinstance<py::array>(value)) {
        const auto dtype = py::reinterpret_borrow<py::array>(value).dtype();
        if (dtype.equal(py::dtype::of<double>())) return true;
        if (dtype.equal(py::dtype::of<float>())) return false;
    }
    fail(argument, wanted, describe(value));
}

double checked_number(const py::handle& value, const char* argument, const std::string& wanted) {
    const double number = PyFloat_AsDouble(value.ptr());
    if (number == -1.0 && PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        fail(argument, wanted, describe(value));
    }
    return number;
}

}  // namespace sinew::bindings
