// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "module.h"
#include "sinew/skinning/methods.h"

namespace sinew::bindings {

namespace py = pybind11;

void bind_methods(py::module_& m) {
    py::class_<Method>(m, "Method", "A row of the table of skinning methods.")
        .def_property_readonly(
            "number", [](const Method& row) { return row.number; },
            "Number that .blend files store; never changes.")
        .def_property_readonly(
            "name", [](const Method& row) { return std::string(row.name); },
            "What programs say: the `method` of a Deformer.")
        .def_property_readonly(
            "label", [](const Method& row) { return std::string(row.label); }, "What people read.")
        .def_property_readonly(
            "description", [](const Method& row) { return std::string(row.description); },
            "One sentence: when to use it.")
        .def_property_readonly(
            "needs", [](const Method& row) { return std::string(row.needs); },
            "What it takes besides points, influences and bone transforms.")
        .def("__repr__", [](const Method& row) { return "<sinew.Method " + std::string(row.name) + ">"; });
    m.def(
        "methods",
        [] {
            py::tuple rows(kMethods.size());
            for (std::size_t i = 0; i < kMethods.size(); ++i) rows[i] = py::cast(kMethods[i]);
            return rows;
        },
        "Every skinning method, one Method each.");
}

}  // namespace sinew::bindings
