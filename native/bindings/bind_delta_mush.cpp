// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <cmath>
#include <string>

#include "arrays.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "stages.h"

namespace sinew::bindings {
namespace {

constexpr auto kMaxIterations = static_cast<std::size_t>(DeltaMushDefinition::kMaxIterations);

/// Settings, and the array that their weights refer to.
struct SettingArguments {
    DeltaMushSettings settings;
    py::array_t<float> weights;
};

float checked_float(const py::object& value, const char* argument) {
    return static_cast<float>(checked_number(value, argument, "a number"));
}

using SmoothTypeName = Typed<"typing.Literal['simple', 'length_weighted']">;

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
    arguments.settings.type = static_cast<SmoothType>(
        checked_choice(smooth_type, "smooth_type", DeltaMushDefinition::kSmoothTypes));
    arguments.settings.pin_boundary = checked_bool(pin_boundary, "pin_boundary");
    if (!weights.is_none()) {
        arguments.weights =
            checked<float>(weights, "weights", 1, "None or float32 [vertices]", kMaxMushVertices);
        arguments.settings.weights = as_span(arguments.weights);
    }
    return arguments;
}

Timed<DeltaMush> make(const ArrayLike& rest_points, const ArrayLike& face_offsets,
                      const ArrayLike& corner_vertices, const ArrayLike& edges, const Index& iterations,
                      const Number& radius, const Number& factor, const SmoothTypeName& smooth_type,
                      const Flag& pin_boundary, const OptionalArrayLike& weights) {
    const auto points = checked_points(rest_points, "rest_points");
    const auto offsets = checked<std::int32_t>(face_offsets, "face_offsets", 1, "int32 [faces + 1]");
    const auto corners = checked<std::int32_t>(corner_vertices, "corner_vertices", 1, "int32 [corners]");
    const auto ends = checked_rows<std::int32_t>(edges, "edges", 2, "int32 [edges, 2]");
    const SettingArguments arguments =
        checked_settings(iterations, radius, factor, smooth_type, pin_boundary, weights);
    return DeltaMush({as_span(offsets), as_span(corners), as_span(ends)}, as_points(points),
                     arguments.settings);
}

void bind(Timed<DeltaMush>& mush, const ArrayLike& rest_points, const Index& iterations, const Number& radius,
          const Number& factor, const SmoothTypeName& smooth_type, const Flag& pin_boundary,
          const OptionalArrayLike& weights) {
    const auto points = checked_points(rest_points, "rest_points");
    const SettingArguments arguments =
        checked_settings(iterations, radius, factor, smooth_type, pin_boundary, weights);
    // May have to wait for another thread that applies it.
    without_gil([&] { mush.bind(as_points(points), arguments.settings); });
}

py::array_t<float> apply(const Timed<DeltaMush>& mush, const ArrayLike& points, const Out& out,
                         const Number& scale, const Threads& threads) {
    const auto given = checked_points(points, "points", mush.vertex_count());
    const float details = checked_float(scale, "scale");
    if (!std::isfinite(details)) fail("scale", "a finite number", describe(scale));
    const std::size_t most = checked_threads(threads);
    return applied(mush, given, out, [&](auto to) { return mush.apply(to, details, most); });
}

}  // namespace

void bind_stage(py::module_& m, DeltaMushDefinition) {
    const DeltaMushSettings initial;
    const char* const type = DeltaMushDefinition::kSmoothTypes[0].data();
    stage_class<DeltaMush>(
        m, "DeltaMush",
        R"(The stage `delta_mush` for one mesh: smooths deformed points and adds the details of the rest points back
(Mancewicz et al. 2014), as Blender's Corrective Smooth does.)",
        "iterations", [](const DeltaMush& mush) { return mush.iterations(); })
        .def(py::init(&make), "rest_points"_a, "face_offsets"_a, "corner_vertices"_a, "edges"_a,
             py::kw_only(), "iterations"_a = initial.iterations, "radius"_a = initial.radius,
             "factor"_a = initial.factor, "smooth_type"_a = type, "pin_boundary"_a = initial.pin_boundary,
             "weights"_a = py::none(),
             R"(rest_points: float32 [vertices, 3], without shape keys; at most 2^29 - 1 vertices.
face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
corner_vertices: int32 [corners], the vertex of each corner.
edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces.
iterations: number of smoothing iterations, 0 to 1,000; not used with a radius.
radius: how far the smoothing reaches, in units of the points, as the width of a Gaussian, independently of
    the density of the mesh; 0: use `iterations`. The shortest tenth of edges is smoothed less far, and so are
    all where this would take more than 1,000 iterations.
factor: how far one iteration moves a vertex, 0 to 1.
smooth_type: "simple", or "length_weighted": neighbours are weighted by the length of their edges.
pin_boundary: whether vertices on edges with a single face are not moved.
weights: None, or float32 [vertices], how much each vertex is smoothed, 0 to 1; clamped.)")
        .def_property_readonly("iterations", &DeltaMush::iterations,
                               "Number of smoothing iterations, also if a radius determines it.")
        .def(
            "bind", &bind, "rest_points"_a, py::kw_only(), "iterations"_a = initial.iterations,
            "radius"_a = initial.radius, "factor"_a = initial.factor, "smooth_type"_a = type,
            "pin_boundary"_a = initial.pin_boundary, "weights"_a = py::none(),
            R"(Sets other rest points and settings for the same faces and edges, which takes about as long as apply().

The arguments and errors are those of the constructor; after an error the object is unchanged.)")
        .def("apply", &apply, "points"_a, "out"_a = py::none(), "scale"_a = 1.0f, "threads"_a = py::none(),
             R"(The smoothed points, float32 [vertices, 3].

points: float32 [vertices, 3], deformed, in the space of the rest points.
out: may be `points`.
scale: how much of the details is added back; 1: all.

A vertex without faces is smoothed and has no details.)");
}

}  // namespace sinew::bindings
