// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "arrays.h"
#include "deform_arguments.h"
#include "gil.h"
#include "sinew/skinned_normals.h"

namespace sinew::bindings {
namespace {

/// Vectors [n, 3]; none if `value` is None.
py::array_t<float> checked_vectors(const py::object& value, const char* argument) {
    if (value.is_none()) return checked_out(py::none(), 0);
    return checked_points(value, argument);
}

Timed<SkinnedNormals> make(const Binding& binding, const ArrayLike& normals,
                           const OptionalArrayLike& tangents, const OptionalArrayLike& vertices,
                           const Name& method, const Mix& mix) {
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

using Deformed = Typed<
    "tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32], "
    "numpy.typing.NDArray[numpy.float32] | None]">;

Deformed deform(const Timed<SkinnedNormals>& skinned, const ArrayLike& bone_transforms,
                const Threads& threads, const OptionalArrayLike& bones_from_model,
                const OptionalArrayLike& rest_inverses, const ParameterValues& parameters,
                const OptionalArrayLike& parents, const OptionalArrayLike& turns) {
    const DeformArguments arguments =
        checked_deform(skinned.deformer(), bone_transforms, threads, bones_from_model, rest_inverses,
                       parameters, parents, turns);
    const std::size_t frames = skinned.frame_count();
    auto points = checked_out(py::none(), skinned.deformer().vertex_count());
    auto normals = checked_out(py::none(), frames);
    auto tangents = checked_out(py::none(), skinned.has_tangents() ? frames : 0);
    const auto to_points = as_points_to_write(points), to_normals = as_points_to_write(normals),
               to_tangents = as_points_to_write(tangents);
    skinned.call([&] {
        return skinned.deform(arguments.pose, arguments.options, to_points, to_normals, to_tangents);
    });
    if (!skinned.has_tangents()) return py::make_tuple(points, normals, py::none());
    return py::make_tuple(points, normals, tangents);
}

py::array_t<float> deform_normals(const Timed<SkinnedNormals>& skinned, const ArrayLike& bone_transforms,
                                  const ArrayLike& posed_points, const Out& out, const Threads& threads,
                                  const OptionalArrayLike& bones_from_model,
                                  const OptionalArrayLike& rest_inverses, const ParameterValues& parameters,
                                  const OptionalArrayLike& parents, const OptionalArrayLike& turns) {
    const DeformArguments arguments =
        checked_deform(skinned.deformer(), bone_transforms, threads, bones_from_model, rest_inverses,
                       parameters, parents, turns);
    const auto points = checked_points(posed_points, "points", skinned.deformer().vertex_count());
    auto normals = checked_out(out, skinned.frame_count());
    check_apart(normals, points);
    const auto to = as_points_to_write(normals);
    skinned.call(
        [&] { return skinned.deform_normals(arguments.pose, arguments.options, as_points(points), to); });
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
        R"(Normals and tangents that move with the skin, as in engines: each is transformed by the blend of its
vertex, normals by the inverse transpose. The effect of weights that change from vertex to vertex is not
included. A frame is a normal and, if there are tangents, its tangent.)")
        .def(py::init(&make), "binding"_a, "normals"_a, "tangents"_a = py::none(), "vertices"_a = py::none(),
             "method"_a = "lbs", "mix"_a = py::none(),
             R"(binding: a Binding; not copied.
normals: float32 [frames, 3], at rest, of any length.
tangents: None, or float32 [frames, 3], at rest, of any length.
vertices: int32 [frames], the vertex of each, such as for the corners of faces; None: one frame for each
    vertex.
method, mix: as for Deformer.)")
        .def_property_readonly("frame_count", &SkinnedNormals::frame_count,
                               "Number of frames: as many as normals at rest.")
        .def("__repr__", &text_of)
        .def(
            "deform", &deform, "bone_transforms"_a, "threads"_a = py::none(),
            "bones_from_model"_a = py::none(), "rest_inverses"_a = py::none(), "parameters"_a = py::none(),
            "parents"_a = py::none(), "turns"_a = py::none(),
            R"((points, normals, tangents): the deformed points, float32 [vertices, 3]; normals of unit length, float32
[frames, 3]; the same for tangents, or None.

The arguments are those of Deformer.deform(). Where the blend mirrors, a normal points to the side given by the
order of a face's vertices. Where the blend collapses the plane of a normal to a line, that normal is 0.)")
        .def(
            "deform_normals", &deform_normals, "bone_transforms"_a, "points"_a, "out"_a = py::none(),
            "threads"_a = py::none(), "bones_from_model"_a = py::none(), "rest_inverses"_a = py::none(),
            "parameters"_a = py::none(), "parents"_a = py::none(), "turns"_a = py::none(),
            R"(The normals alone, float32 [frames, 3], where the points are known; saves a quarter of the time.

points: float32 [vertices, 3], as computed by deform() or a Deformer for the same arguments.
out: must not overlap the points.

The other arguments are those of deform().)");
}

}  // namespace sinew::bindings
