// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"

namespace sinew::bindings {

bool is_double(const py::handle& value, const char* argument, const std::string& wanted) {
    if (py::isinstance<py::array>(value)) {
        const auto dtype = py::reinterpret_borrow<py::array>(value).dtype();
        if (dtype.equal(py::dtype::of<double>())) return true;
        if (dtype.equal(py::dtype::of<float>())) return false;
    }
    fail(argument, wanted, describe(value));
}

void promote(std::span<py::object> values, std::span<const char* const> arguments) {
    std::vector<bool> is_array(values.size(), false);
    bool any_double = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (PyFloat_Check(values[i].ptr()) || PyLong_Check(values[i].ptr())) continue;
        const py::array array = as_array(values[i], arguments[i]);
        const bool is_number = array && array.ndim() == 0 && !py::isinstance<py::array>(values[i]);
        if (!array || is_number || !is_numeric(array)) continue;
        // Types that float32 represents exactly: float32 itself, float16, and integers of up to 16 bits.
        const py::ssize_t held = array.dtype().kind() == 'f' ? 4 : 2;
        any_double = any_double || array.itemsize() > held;
        values[i] = array;
        is_array[i] = true;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (!is_array[i]) continue;
        const auto array = py::reinterpret_borrow<py::array>(values[i]);
        if (any_double) {
            if (!has_type<double>(array)) values[i] = in_order<double>(array);
        } else if (!has_type<float>(array)) {
            values[i] = in_order<float>(array);
        }
    }
}

}  // namespace sinew::bindings
