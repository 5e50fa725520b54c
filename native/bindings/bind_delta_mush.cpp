// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "arrays.h"
#include "gil.h"
#include "module.h"
#include "sinew/delta_mush.h"
#include "sinew/stages/delta_mush/delta_mush.h"

namespace sinew::bindings {
namespace {

constexpr auto kMaxIterations = static_cast<std::size_t>(DeltaMushStage::kMaxIterations);

/// Settings, and the array that their weights refer to.
struct SettingArguments {
    DeltaMushSettings settings;
    py::array_t<float> weights;
};

float checked_float(const py::object& value, const char* argument) {
    // Accepts numpy's numbers, too, but not arrays of one number, which numpy would convert with a warning.
    if (py::isinstance<py::array>(value)) fail(argument, "a number", describe(value));
    const double number = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        fail(argument, "a number", describe(value));
    }
    return static_cast<float>(number);
}

SmoothType checked_type(const py::object& value) {
    std::string wanted = "one of";
    for (const std::string_view name : DeltaMushStage::kSmoothTypes) wanted += " " + std::string(name);
    const std::string name = checked_name(value, "smooth_type", wanted);
    const auto* const found = std::ranges::find(DeltaMushStage::kSmoothTypes, name);
    if (found == std::end(DeltaMushStage::kSmoothTypes)) fail("smooth_type", wanted, "'" + name + "'");
    return static_cast<SmoothType>(found - std::begin(DeltaMushStage::kSmoothTypes));
}

bool checked_bool(const py::object& value, const char* argument) {
    if (!py::isinstance<py::bool_>(value)) fail(argument, "True or False", describe(value));
    return value.cast<bool>();
}

SettingArguments checked_settings(const py::object& iterations, const py::object& radius,
                                  const py::object& factor, const py::object& smooth_type,
                                  const py::object& pin_boundary, const py::object& weights) {
    SettingArguments arguments;
    arguments.settings.iterations = checked_integer(
        iterations, "iterations", "an integer from 0 to " + std::to_string(kMaxIterations), kMaxIterations);
    arguments.settings.radius = checked_float(radius, "radius");
    arguments.settings.factor = checked_float(factor, "factor");
    arguments.settings.type = checked_type(smooth_type);
    arguments.settings.pin_boundary = checked_bool(pin_boundary, "pin_boundary");
    if (!weights.is_none()) {
        arguments.weights =
            checked<float>(weights, "weights", 1, "None or float32 [vertices]", kMaxMushVertices);
        arguments.settings.weights = as_span(arguments.weights);
    }
    return arguments;
}

Timed<DeltaMush> make(const py::object& rest_points, const py::object& face_offsets,
                      const py::object& corner_vertices, const py::object& edges,
                      const py::object& iterations, const py::object& radius, const py::object& factor,
                      const py::object& smooth_type, const py::object& pin_boundary,
                      const py::object& weights) {
    const auto points = checked_points(rest_points, "rest_points");
    const auto offsets = checked<std::int32_t>(face_offsets, "face_offsets", 1, "int32 [faces + 1]");
    const auto corners = checked<std::int32_t>(corner_vertices, "corner_vertices", 1, "int32 [corners]");
    const auto ends = checked<std::int32_t>(edges, "edges", 2, "int32 [edges, 2]");
    if (ends.shape(1) != 2) fail("edges", "int32 [edges, 2]", describe(edges));
    const SettingArguments with =
        checked_settings(iterations, radius, factor, smooth_type, pin_boundary, weights);
    return DeltaMush({as_span(offsets), as_span(corners), as_span(ends)}, as_points(points), with.settings);
}

void bind(Timed<DeltaMush>& mush, const py::object& rest_points, const py::object& iterations,
          const py::object& radius, const py::object& factor, const py::object& smooth_type,
          const py::object& pin_boundary, const py::object& weights) {
    const auto points = checked_points(rest_points, "rest_points");
    const SettingArguments with =
        checked_settings(iterations, radius, factor, smooth_type, pin_boundary, weights);
    // May have to wait for another thread that applies it.
    without_gil([&] { mush.bind(as_points(points), with.settings); });
}

py::array_t<float> apply(const Timed<DeltaMush>& mush, const py::object& points, const py::object& out,
                         const py::object& scale, const py::object& threads) {
    const std::size_t count = mush.vertex_count();
    const auto given = checked_points(points, "points");
    if (static_cast<std::size_t>(given.shape(0)) != count) {
        fail("points", "float32 [" + std::to_string(count) + ", 3]", describe(points));
    }
    const float details = checked_float(scale, "scale");
    const std::size_t most = checked_threads(threads);
    py::array_t<float> result = checked_out(out, count);
    float* const to = result.mutable_data();
    mush.call([&] {
        std::memmove(to, given.data(), static_cast<std::size_t>(given.nbytes()));
        static_cast<void>(mush.apply({reinterpret_cast<Vec3<float>*>(to), count}, details, most));
    });
    return result;
}

// --- Pickles: the constructor's arguments.

py::tuple state_of(const Timed<DeltaMush>& mush) {
    const auto [topology, rest_points, settings, of_vertices] = mush.parts();
    const auto edges = static_cast<py::ssize_t>(topology.edges.size() / 2);
    py::object weights = py::none();
    if (!of_vertices.empty()) weights = array_of(std::span(of_vertices));
    return py::make_tuple(
        array_of(std::span(rest_points)), array_of(topology.face_offsets), array_of(topology.corner_vertices),
        array_of(topology.edges).reshape({edges, py::ssize_t{2}}), settings.iterations, settings.radius,
        settings.factor, std::string(DeltaMushStage::kSmoothTypes[static_cast<std::size_t>(settings.type)]),
        settings.pin_boundary, weights);
}

Timed<DeltaMush> of_state(const py::object& state) {
    const auto part = [&](std::size_t index) { return part_of(state, 10, index); };
    return make(part(0), part(1), part(2), part(3), part(4), part(5), part(6), part(7), part(8), part(9));
}

std::string text_of(const Timed<DeltaMush>& mush) {
    return "<sinew.DeltaMush: " + std::to_string(mush.vertex_count()) + " vertices, " +
           std::to_string(mush.iterations()) + " iterations>";
}

}  // namespace

void bind_delta_mush(py::module_& m) {
    const DeltaMushSettings initial;
    const char* const type = DeltaMushStage::kSmoothTypes[0].data();
    py::class_<Timed<DeltaMush>>(
        m, "DeltaMush",
        "The stage `delta_mush` for one mesh: smooths deformed points and adds the details of the rest "
        "points\n"
        "back (Mancewicz et al. 2014), as Blender's Corrective Smooth does. Can be pickled.")
        .def(
            py::init(&make), py::arg("rest_points"), py::arg("face_offsets"), py::arg("corner_vertices"),
            py::arg("edges"), py::kw_only(), py::arg("iterations") = initial.iterations,
            py::arg("radius") = initial.radius, py::arg("factor") = initial.factor,
            py::arg("smooth_type") = type, py::arg("pin_boundary") = initial.pin_boundary,
            py::arg("weights") = py::none(),
            "rest_points: float32 [vertices, 3], without shape keys.\n"
            "face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.\n"
            "corner_vertices: int32 [corners], the vertex of each corner.\n"
            "edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces.\n"
            "    At most 2^29 - 1 vertices.\n"
            "iterations: number of smoothing iterations, 0 to 1,000; not used with a radius.\n"
            "radius: how far the smoothing reaches, in units of the points, as the width of a Gaussian,\n"
            "    independently of the density of the mesh; 0: use `iterations`. The shortest tenth of edges "
            "is\n"
            "    smoothed less far, and so are all where this would take more than 1,000 iterations.\n"
            "factor: how far one iteration moves a vertex, 0 to 1.\n"
            "smooth_type: \"simple\", or \"length_weighted\": neighbours are weighted by the length of their "
            "edges.\n"
            "pin_boundary: whether vertices on edges with a single face are left as they are.\n"
            "weights: None, or float32 [vertices], how much each vertex is smoothed, 0 to 1; clamped.\n\n"
            "All input is copied. Raises ValueError that names the argument, what was expected and what was\n"
            "given.")
        .def_property_readonly("vertex_count", &DeltaMush::vertex_count, "Number of vertices.")
        .def_property_readonly("iterations", &DeltaMush::iterations,
                               "Number of smoothing iterations, also if a radius determines it.")
        .def("__repr__", &text_of)
        .def(py::pickle(&state_of, &of_state))
        .def(
            "bind", &bind, py::arg("rest_points"), py::kw_only(), py::arg("iterations") = initial.iterations,
            py::arg("radius") = initial.radius, py::arg("factor") = initial.factor,
            py::arg("smooth_type") = type, py::arg("pin_boundary") = initial.pin_boundary,
            py::arg("weights") = py::none(),
            "Sets other rest points and settings for the same faces and edges, which takes about as long as\n"
            "apply().\n\n"
            "Takes the arguments of the constructor and raises ValueError as it does; the object is then\n"
            "unchanged.")
        .def("apply", &apply, py::arg("points"), py::arg("out") = py::none(), py::arg("scale") = 1.0f,
             py::arg("threads") = py::none(),
             "The smoothed points, float32 [vertices, 3].\n\n"
             "points: float32 [vertices, 3], deformed, in the space of the rest points.\n"
             "out: if given, written and returned: float32 [vertices, 3], C-contiguous, aligned; never "
             "converted.\n"
             "    May be `points`.\n"
             "scale: how much of the details is added back; 1: all.\n"
             "threads: maximum number; None or 0: as many as useful. The\n"
             "    result is the same bit for bit.\n\n"
             "A vertex without faces is smoothed and has no details. Releases the GIL for large meshes. "
             "Raises\n"
             "ValueError that names the argument, what was expected and what was given.");
}

}  // namespace sinew::bindings
