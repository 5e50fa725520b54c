// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <span>
#include <string>
#include <string_view>

#include "sinew/methods/method_info.h"

namespace sinew::bindings {

/// `value` as a number for `parameter`, a number or a choice, as described at sinew.Parameter. ValueError, naming
/// `argument` and the parameter's full name, for a value of another type or beyond the limits.
double checked_parameter(const pybind11::handle& value, const Parameter& parameter, const char* argument,
                         const std::string& full_name);

/// The parameter with this id, which must be one of these.
const Parameter& parameter_of(std::span<const Parameter> parameters, std::string_view id);

}  // namespace sinew::bindings
