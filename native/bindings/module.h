// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace sinew::bindings {

void bind_compiled_in(pybind11::module_& m);
void bind_methods(pybind11::module_& m);
void bind_skeleton(pybind11::module_& m);
void bind_threads(pybind11::module_& m);
void bind_twist_spread(pybind11::module_& m);
void bind_transforms(pybind11::module_& m);
void bind_interpolate(pybind11::module_& m);
void bind_deformer(pybind11::module_& m);
void bind_bulge_limit(pybind11::module_& m);
void bind_delta_mush(pybind11::module_& m);
void bind_normals(pybind11::module_& m);
void bind_skinned_normals(pybind11::module_& m);
void bind_precompute(pybind11::module_& m);
void bind_weights(pybind11::module_& m);

}  // namespace sinew::bindings
