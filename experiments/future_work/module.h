// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace sinew::bindings {

void bind_fit(pybind11::module_& m);
void bind_ik(pybind11::module_& m);

}  // namespace sinew::bindings
