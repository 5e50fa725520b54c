// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"

namespace sinew::bindings {

// The only list of what is bound, each in bind_NAME.cpp: types before the functions that take or return them.
#define SINEW_BINDINGS(bind)                                                                         \
    bind(compiled_in) bind(methods) bind(skeleton) bind(transforms) bind(interpolate) bind(deformer) \
        bind(twist_spread) bind(bulge_limit) bind(delta_mush) bind(normals) bind(skinned_normals)    \
            bind(precompute) bind(threads) bind(weights)

#define SINEW_DECLARE(name) void bind_##name(py::module_& m);
SINEW_BINDINGS(SINEW_DECLARE)

py::object named_tuple(const char* name, const py::tuple& parts) {
    return py::module_::import("sinew._types").attr(name)(*parts);
}

}  // namespace sinew::bindings

PYBIND11_MODULE(_native, m) {
    m.doc() = "Sinew's C++ library. Use it through the package `sinew`.";
    m.attr("__version__") = SINEW_VERSION;
#define SINEW_BIND(name) sinew::bindings::bind_##name(m);
    SINEW_BINDINGS(SINEW_BIND)
}
