// SPDX-License-Identifier: GPL-3.0-or-later
#include "module.h"

#include "broadcast.h"

namespace sinew::bindings {

py::object named_tuple(const char* name, const py::tuple& parts) {
    return py::module_::import("sinew._types").attr(name)(*parts);
}

}  // namespace sinew::bindings

PYBIND11_MODULE(_native, m) {
    m.doc() = "Sinew's C++ library. Use it through the package `sinew`.";
    m.attr("__version__") = SINEW_VERSION;
    sinew::bindings::bind_compiled_in(m);
    sinew::bindings::bind_methods(m);
    sinew::bindings::bind_skeleton(m);
    sinew::bindings::bind_transforms(m);
    sinew::bindings::bind_interpolate(m);
    sinew::bindings::bind_deformer(m);
    sinew::bindings::bind_twist_spread(m);
    sinew::bindings::bind_bulge_limit(m);
    sinew::bindings::bind_delta_mush(m);
    sinew::bindings::bind_normals(m);
    sinew::bindings::bind_skinned_normals(m);
    sinew::bindings::bind_precompute(m);
    sinew::bindings::bind_threads(m);
    sinew::bindings::bind_weights(m);
}
