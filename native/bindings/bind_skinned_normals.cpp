// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "arrays.h"
#include "deform_arguments.h"
#include "gil.h"
#include "module.h"
#include "sinew/skinned_normals.h"

namespace sinew::bindings {
namespace {

/// Vectors [n, 3]; none if `value` is None.
py::array_t<float> checked_vectors(const py::object& value, const char* argument) {
    if (value.is_none()) return checked_out(py::none(), 0);
    return checked_points(value, argument);
}

Timed<SkinnedNormals> make(const Binding& binding, const py::object& normals, const py::object& tangents,
                           const py::object& vertices, const py::object& method, const py::object& mix) {
    const auto rest_normals = checked_points(normals, "normals");
    const auto rest_tangents = checked_vectors(tangents, "tangents");
    py::array_t<std::int32_t> of_frames;
    if (!vertices.is_none()) of_frames = checked<std::int32_t>(vertices, "vertices", 1, "int32 [normals]");
    const MethodInfo first = checked_method(method, "method");
    const MixArguments second = checked_mix(mix);
    return SkinnedNormals(binding, first,
                          {as_points(rest_normals), as_points(rest_tangents), as_span(of_frames)},
                          second.data());
}

std::span<Vec3<float>> writable(py::array_t<float>& points) {
    return {reinterpret_cast<Vec3<float>*>(points.mutable_data()), static_cast<std::size_t>(points.shape(0))};
}

py::tuple deform(const Timed<SkinnedNormals>& skinned, const py::object& bone_transforms,
                 const py::object& threads, const py::object& bones_from_model,
                 const py::object& rest_inverses, const py::object& parameters) {
    const DeformArguments arguments = checked_deform(skinned.deformer(), bone_transforms, threads,
                                                     bones_from_model, rest_inverses, parameters);
    const std::size_t frames = skinned.frame_count();
    auto points = checked_out(py::none(), skinned.deformer().vertex_count());
    auto normals = checked_out(py::none(), frames);
    auto tangents = checked_out(py::none(), skinned.has_tangents() ? frames : 0);
    const auto to_points = writable(points), to_normals = writable(normals), to_tangents = writable(tangents);
    skinned.call([&] {
        static_cast<void>(
            skinned.deform(arguments.bones, arguments.options, to_points, to_normals, to_tangents));
    });
    if (!skinned.has_tangents()) return py::make_tuple(points, normals, py::none());
    return py::make_tuple(points, normals, tangents);
}

py::array_t<float> deform_normals(const Timed<SkinnedNormals>& skinned, const py::object& bone_transforms,
                                  const py::object& posed_points, const py::object& out,
                                  const py::object& threads, const py::object& bones_from_model,
                                  const py::object& rest_inverses, const py::object& parameters) {
    const DeformArguments arguments = checked_deform(skinned.deformer(), bone_transforms, threads,
                                                     bones_from_model, rest_inverses, parameters);
    const auto points = checked_points(posed_points, "points");
    const std::size_t vertices = skinned.deformer().vertex_count();
    if (static_cast<std::size_t>(points.shape(0)) != vertices) {
        fail("points", "float32 [" + std::to_string(vertices) + ", 3]", describe(posed_points));
    }
    auto normals = checked_out(out, skinned.frame_count());
    if (normals.size() > 0 && normals.data() < points.data() + points.size() &&
        points.data() < normals.data() + normals.size()) {
        fail("out", "another array than the points", "one that shares memory with them");
    }
    const auto from = as_points(points);
    const auto to = writable(normals);
    skinned.call(
        [&] { static_cast<void>(skinned.deform_normals(arguments.bones, arguments.options, from, to)); });
    return normals;
}

std::string text_of(const Timed<SkinnedNormals>& skinned) {
    return "<sinew.SkinnedNormals: " + std::to_string(skinned.frame_count()) + " of " +
           std::to_string(skinned.deformer().vertex_count()) + " vertices, method " +
           std::string(skinned.deformer().method().name) + ">";
}

}  // namespace

void bind_skinned_normals(py::module_& m) {
    py::class_<Timed<SkinnedNormals>>(
        m, "SkinnedNormals",
        "Normals and tangents that move with the skin, as in engines: each is "
        "transformed by the blend of its\n"
        "vertex, normals by the inverse transpose. The effect of weights that change "
        "from vertex to vertex is\n"
        "not included.")
        .def(py::init(&make), py::arg("binding"), py::arg("normals"), py::arg("tangents") = py::none(),
             py::arg("vertices") = py::none(), py::arg("method") = "lbs", py::arg("mix") = py::none(),
             "binding: a Binding; not copied.\n"
             "normals: float32 [frames, 3], at rest, of any length.\n"
             "tangents: None, or float32 [frames, 3].\n"
             "vertices: int32 [frames], the vertex of each, such as for the corners of faces; None: one "
             "frame for\n"
             "    each vertex.\n"
             "method, mix: as for Deformer.\n\n"
             "Raises ValueError that names the argument, what was expected and what was given.")
        .def_property_readonly("frame_count", &SkinnedNormals::frame_count, "Number of normals.")
        .def("__repr__", &text_of)
        .def(
            "deform", &deform, py::arg("bone_transforms"), py::arg("threads") = py::none(),
            py::arg("bones_from_model") = py::none(), py::arg("rest_inverses") = py::none(),
            py::arg("parameters") = py::none(),
            "(points, normals, tangents): the deformed points, float32 [vertices, 3]; unit vectors, float32\n"
            "[frames, 3]; the same for tangents, or None.\n\n"
            "Arguments are those of Deformer.deform. Where the blend mirrors, a normal points to the side "
            "given\n"
            "by the order of a face's vertices. Where the blend collapses the plane of a normal to a line, "
            "that\n"
            "normal is 0. Releases the GIL for large meshes. Raises ValueError that names the argument, what "
            "was\n"
            "expected and what was given.")
        .def("deform_normals", &deform_normals, py::arg("bone_transforms"), py::arg("points"),
             py::arg("out") = py::none(), py::arg("threads") = py::none(),
             py::arg("bones_from_model") = py::none(), py::arg("rest_inverses") = py::none(),
             py::arg("parameters") = py::none(),
             "Only the normals, if the points are known; saves a quarter of the time.\n\n"
             "points: float32 [vertices, 3], as computed by deform() or a Deformer for the same arguments.\n"
             "out: if given, written and returned: float32 [frames, 3], C-contiguous; None: a new array.\n\n"
             "All other arguments as for deform().");
}

}  // namespace sinew::bindings
