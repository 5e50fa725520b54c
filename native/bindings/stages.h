// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstring>
#include <string>

#include "arrays.h"
#include "gil.h"
#include "parameters.h"
#include "sinew/stages/stage.h"

namespace sinew::bindings {

/// Calls apply(points) for a copy of `given` in `out`, or in a new array if that is None, and returns the array.
template <class Stage, class Apply>
py::array_t<float> applied(const Timed<Stage>& stage, const py::array_t<float>& given, const py::object& out,
                           const Apply& apply) {
    py::array_t<float> result = checked_out(out, stage.vertex_count());
    const auto to = as_points_to_write(result);
    stage.call([&] {
        const auto from = as_points(given);
        if (from.data() != to.data()) std::memmove(to.data(), from.data(), from.size_bytes());
        return apply(to);
    });
    return result;
}

/// The value of a stage's parameter, which is also the argument's name.
template <class Definition>
double checked_option(const py::object& value, const char* id) {
    return checked_parameter(value, parameter_of(Definition::kParameters, id), id,
                             std::string(Definition::info.name) + "." + id);
}

/// Binds a stage, and what all stages have.
///
/// counted  what its text says besides the number of vertices, such as "bones", and their number
template <class Stage>
py::class_<Timed<Stage>> stage_class(py::module_& m, const char* name, const char* doc, const char* counted,
                                     std::size_t (*count)(const Stage&)) {
    py::class_<Timed<Stage>> type(m, name, doc);
    type.def_property_readonly("vertex_count", &Stage::vertex_count, kVertexCount);
    type.def("__repr__", [name, counted, count](const Timed<Stage>& stage) {
        return "<sinew." + std::string(name) + ": " + std::to_string(stage.vertex_count()) + " vertices, " +
               std::to_string(count(stage)) + " " + counted + ">";
    });
    return type;
}

template <class Stage>
void set_rest_points(Timed<Stage>& stage, const ArrayLike& rest_points,
                     const OptionalArrayLike& bones_from_model) {
    const auto points = checked_points(rest_points, "rest_points");
    const Affine<float> space = checked_affine(bones_from_model, "bones_from_model");
    // May have to wait for another thread that applies it.
    Status status{};
    without_gil([&] { status = stage.set_rest_points(as_points(points), space); });
    check_rest_points(status, points, stage.vertex_count(), space);
}

/// Binds what the stages have that read bones.
template <class Stage>
void def_bones(py::class_<Timed<Stage>>& type) {
    type.def_property_readonly("bone_count", &Stage::bone_count, "How many bones a pose must have.")
        .def(
            "set_rest_points", &set_rest_points<Stage>, "rest_points"_a, "bones_from_model"_a = py::none(),
            R"(Sets other rest points, float32 [vertices, 3], and the space of the bones: None is the identity, whatever
was set before.)");
}

}  // namespace sinew::bindings
