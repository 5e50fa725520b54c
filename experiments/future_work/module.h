// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "signatures.h"

namespace sinew::bindings {

void bind_curves(py::module_& m);
void bind_fit(py::module_& m);
void bind_ik(py::module_& m);

}  // namespace sinew::bindings
