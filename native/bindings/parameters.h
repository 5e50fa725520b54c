// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "sinew/methods/method_info.h"

namespace sinew::bindings {

/// `value` as a number for `parameter`, a number or a choice, as described at sinew.Parameter. ValueError, naming
/// `argument` and the parameter's full name, for a value of another type or beyond the limits.
double checked_parameter(const pybind11::handle& value, const Parameter& parameter, const char* argument,
                         const std::string& full_name);

}  // namespace sinew::bindings
