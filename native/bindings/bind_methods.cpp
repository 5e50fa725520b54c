// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "signatures.h"
#include "sinew/methods/methods.h"
#include "sinew/stages/stages.h"

namespace sinew::bindings {
namespace {

using Kind = Typed<"typing.Literal['float', 'int', 'bool', 'enum', 'vertex_group', 'method']">;

/// The default value; None for kinds that have none.
Typed<"float | int | bool | str | None"> initial_value(const Parameter& parameter) {
    switch (parameter.kind) {
        case ParameterKind::number: return py::float_(parameter.initial);
        case ParameterKind::integer: return py::int_(static_cast<long long>(parameter.initial));
        case ParameterKind::boolean: return py::bool_(parameter.initial != 0.0);
        case ParameterKind::choice:
            return py::cast(parameter.choices[static_cast<std::size_t>(parameter.initial)]);
        case ParameterKind::vertex_group:
        case ParameterKind::method: break;
    }
    return py::none();
}

Typed<"float | None"> bound_of(const Parameter& parameter, double bound) {
    if (!is_numeric(parameter.kind)) return py::none();
    return py::float_(bound);
}

using Texts = Typed<"tuple[str, ...]">;

template <class Row, class Range>
py::tuple tuple_of(const Range& range) {
    py::tuple rows(range.size());
    for (std::size_t i = 0; i < range.size(); ++i) rows[i] = py::cast(Row(range[i]));
    return rows;
}

Texts names_of(Needs needs) {
    py::list names;
    const auto add = [&](Needs flag, const char* name) {
        if (has(needs, flag)) names.append(name);
    };
    add(Needs::rest_bones, "rest_bones");
    add(Needs::vertex_data, "vertex_data");
    add(Needs::topology, "topology");
    add(Needs::precomputation, "precomputation");
    return py::tuple(names);
}

/// The properties that methods and stages have in common.
template <class Row>
void def_facts(py::class_<Row>& type, const char* name) {
    type.def_readonly("name", &Row::name, "The name in programs.");
    type.def_readonly("label", &Row::label, "The name in the interface.");
    type.def_readonly("description", &Row::description, "One sentence: when to use it.");
    type.def_readonly("source", &Row::source, "The papers.");
    type.def_property_readonly(
        "parameters", [](const Row& row) -> Typed<"tuple[sinew._native.Parameter, ...]"> {
            return tuple_of<Parameter>(row.parameters);
        },
        "Its settings.");
    type.def("__repr__", [name](const Row& row) {
        return "<sinew." + std::string(name) + " " + std::string(row.name) + ">";
    });
}

}  // namespace

void bind_methods(py::module_& m) {
    py::class_<Parameter> parameter(m, "Parameter", "A setting of a method or of a stage.");
    parameter.def_readonly("id", &Parameter::id, "The name in programs.")
        .def_readonly("label", &Parameter::label, "The name in the interface.")
        .def_readonly("description", &Parameter::description, "One sentence.")
        .def_readonly("unit", &Parameter::unit,
                      "One of \"length\", \"angle\" (radians) and \"factor\", or empty.")
        .def_property_readonly(
            "kind", [](const Parameter& row) -> Kind { return py::cast(name_of(row.kind)); },
            R"(A value of "enum" is one of `choices`, of "vertex_group" a weight for each vertex, of "method" a name.)")
        .def_property_readonly("default", &initial_value,
                               "The default; None for a vertex group and a method.")
        .def_property_readonly(
            "min", [](const Parameter& row) { return bound_of(row, row.minimum); },
            "The smallest value of a number, -inf if there is no limit; None for other kinds.")
        .def_property_readonly(
            "max", [](const Parameter& row) { return bound_of(row, row.maximum); },
            "The largest value of a number, inf if there is no limit; None for other kinds.")
        .def_property_readonly(
            "choices", [](const Parameter& row) -> Texts { return tuple_of<std::string>(row.choices); },
            "The values of an enum.")
        .def("__repr__",
             [](const Parameter& row) { return "<sinew.Parameter " + std::string(row.id) + ">"; });

    py::class_<MethodInfo> method(m, "Method", "The facts about a skinning method.");
    def_facts(method, "Method");
    method
        .def_readonly("number", &MethodInfo::number, "The number that .blend files store. It never changes.")
        .def_property_readonly(
            "group", [](const MethodInfo& row) { return label_of(row.group); },
            "The heading of its group in menus.")
        .def_property_readonly(
            "needs", [](const MethodInfo& row) { return names_of(row.needs); },
            R"(What it needs besides points, influences and bone transforms: "rest_bones", the bones' axes, where bones are
scaled; "vertex_data", numbers for each vertex, an argument of Binding; "topology", triangles from which these
are computed; "precomputation", a function that computes them.)")
        .def_readonly(
            "vertex_floats", &MethodInfo::vertex_floats,
            "How many numbers its vertex data has for each vertex, or in each row; 0 if it has none.")
        .def_readonly("rows_by_bone", &MethodInfo::rows_by_bone,
                      "Whether its vertex data is rows, any number for each vertex: see direct_delta_mush.");

    py::class_<StageInfo> stage(m, "Stage", "The facts about a stage. Stages run after a method.");
    def_facts(stage, "Stage");

    m.def(
        "methods",
        []() -> Typed<"tuple[sinew._native.Method, ...]"> { return tuple_of<MethodInfo>(kMethods); },
        "All skinning methods.");
    m.def(
        "stages", []() -> Typed<"tuple[sinew._native.Stage, ...]"> { return tuple_of<StageInfo>(kStages); },
        "All stages. `mix` is an argument of Deformer, each other a class: `bulge_limit` is BulgeLimit.");
}

}  // namespace sinew::bindings
