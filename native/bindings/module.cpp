// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"
#include "sinew/stages/stages.h"

namespace sinew::bindings {

// The only list of what is bound besides the stages, each in bind_NAME.cpp: types before the functions that take or
// return them.
#define SINEW_BINDINGS(bind)                                                                        \
    bind(compiled_in) bind(methods) bind(transforms) bind(interpolate) bind(deformer) bind(normals) \
        bind(skinned_normals) bind(precompute) bind(threads) bind(weights) bind(crossings)

#define SINEW_DECLARE(name) void bind_##name(py::module_& m);
SINEW_BINDINGS(SINEW_DECLARE)
#define SINEW_DECLARE_STAGE(Stage) void bind_stage(py::module_& m, sinew::Stage);
SINEW_STAGES(SINEW_DECLARE_STAGE)

py::object named_tuple(const char* name, const py::tuple& parts) {
    return py::module_::import("sinew._types").attr(name)(*parts);
}

}  // namespace sinew::bindings

PYBIND11_MODULE(_native, m) {
    m.doc() = "Sinew's C++ library. Use it through the package `sinew`.";
    m.attr("__version__") = SINEW_VERSION;
#define SINEW_BIND(name) sinew::bindings::bind_##name(m);
    SINEW_BINDINGS(SINEW_BIND)
#define SINEW_BIND_STAGE(Stage) sinew::bindings::bind_stage(m, sinew::Stage{});
    SINEW_STAGES(SINEW_BIND_STAGE)
    // What `sinew` takes from here by a star: its own modules go before those of the same names.
    pybind11::list names;
    for (const auto& [name, value] : m.attr("__dict__").cast<pybind11::dict>()) {
        const bool is_private = pybind11::str(name).attr("startswith")("_").cast<bool>();
        if (!is_private && !pybind11::isinstance<pybind11::module_>(value)) names.append(name);
    }
    m.attr("__all__") = names;
}
