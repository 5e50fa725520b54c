// SPDX-License-Identifier: GPL-3.0-or-later
#include "parameters.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "arrays.h"

namespace sinew::bindings {
namespace {

std::string wanted_of(const Parameter& parameter) {
    if (parameter.kind == ParameterKind::choice) return one_of(parameter.choices);
    if (parameter.kind == ParameterKind::boolean) return "True or False";
    std::ostringstream text;
    text << (parameter.kind == ParameterKind::integer ? "a whole number" : "a finite number");
    if (std::isfinite(parameter.minimum)) text << " from " << parameter.minimum;
    if (std::isfinite(parameter.maximum)) text << " to " << parameter.maximum;
    return text.str();
}

/// The value as a number, or NaN if it is none.
double value_of(const py::handle& value, const Parameter& parameter) {
    const double none = std::nan("");
    if (parameter.kind == ParameterKind::choice) {
        if (!py::isinstance<py::str>(value)) return none;
        for (std::size_t i = 0; i < parameter.choices.size(); ++i) {
            if (value.equal(py::str(std::string(parameter.choices[i])))) return static_cast<double>(i);
        }
        return none;
    }
    // Accepts numpy's numbers, too, but no text and no arrays of one number.
    if (py::isinstance<py::array>(value) && py::reinterpret_borrow<py::array>(value).ndim() > 0) return none;
    const bool is_whole = PyIndex_Check(value.ptr()) != 0;
    const bool is_bool = py::isinstance<py::bool_>(value);
    if (!is_whole && !is_bool && PyNumber_Check(value.ptr()) == 0) return none;
    const double number = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        return none;
    }
    if (parameter.kind == ParameterKind::boolean) return number == 0.0 || number == 1.0 ? number : none;
    if (parameter.kind == ParameterKind::integer && std::trunc(number) != number) return none;
    const bool is_valid = std::isfinite(number) && parameter.minimum <= number && number <= parameter.maximum;
    return is_valid ? number : none;
}

std::string text_of(const py::handle& value) {
    if (py::isinstance<py::str>(value) || PyLong_Check(value.ptr()) || PyFloat_Check(value.ptr())) {
        std::string text = py::repr(value).cast<std::string>();
        constexpr std::size_t kMaxText = 60;
        return text.size() > kMaxText ? text.substr(0, kMaxText) + "..." : text;
    }
    return describe(value);
}

}  // namespace

double checked_parameter(const py::handle& value, const Parameter& parameter, const char* argument,
                         const std::string& full_name) {
    const double number = value_of(value, parameter);
    if (std::isnan(number)) fail(argument, "of " + full_name + " " + wanted_of(parameter), text_of(value));
    return number;
}

const Parameter& parameter_of(std::span<const Parameter> parameters, std::string_view id) {
    for (const Parameter& parameter : parameters) {
        if (parameter.id == id) return parameter;
    }
    throw std::logic_error("no parameter has this id");
}

}  // namespace sinew::bindings
