// SPDX-License-Identifier: GPL-3.0-or-later
#include "future_work/module.h"

#include "broadcast.h"

namespace sinew::bindings {

py::object named_tuple(const char* name, const py::tuple& parts) {
    return py::module_::import("future_work.types").attr(name)(*parts);
}

}  // namespace sinew::bindings

PYBIND11_MODULE(future_work_native, m) {
    m.doc() = "Curves, fits and inverse kinematics. Use it through the package `future_work`.";
    sinew::bindings::bind_curves(m);
    sinew::bindings::bind_fit(m);
    sinew::bindings::bind_ik(m);
}
