// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <cstring>
#include <optional>
#include <stdexcept>

#include "arrays.h"
#include "gil.h"
#include "module.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif

namespace sinew::bindings {
namespace {

/// Calls `run` with options that report to `progress`, a callable or None. Releases the GIL except during these
/// calls, for which only this thread waits: the work is done by others.
template <class Run>
auto precompute(const py::object& progress, PrecomputeOptions options, const Run& run) {
    if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0) {
        fail("progress", "None or a callable", describe(progress));
    }
    PyThreadState* state = nullptr;
    if (!progress.is_none()) {
        options.progress = [&](double done) {
            take_gil_back(state);
            const auto give_away = [&state] { state = PyEval_SaveThread(); };
            try {
                // Anything but False continues the work, also None.
                const bool goes_on = !progress(done).is(py::bool_(false));
                give_away();
                return goes_on;
            } catch (...) {
                give_away();
                throw;
            }
        };
    }
    state = PyEval_SaveThread();
    try {
        auto result = run(options);
        take_gil_back(state);
        return result;
    } catch (...) {
        take_gil_back(state);
        throw;
    }
}

/// The mesh argument of a precomputation.
struct Mesh {
    py::array_t<float> points;
    py::array_t<std::int32_t> offsets;
    py::array_t<std::int32_t> bones;
    py::array_t<float> weights;
    py::array_t<std::int32_t> corners;

    Mesh(const py::object& rest_points, const py::object& influence_offsets,
         const py::object& influence_bones, const py::object& influence_weights, const py::object& triangles)
        : points(checked_points(rest_points, "rest_points")),
          offsets(checked<std::int32_t>(influence_offsets, "influence_offsets", 1, "int32 [vertices + 1]",
                                        kMaxVertices + 1)),
          bones(checked<std::int32_t>(influence_bones, "influence_bones", 1, "int32 [influences]",
                                      kMaxInfluences)),
          weights(checked<float>(influence_weights, "influence_weights", 1, "float32 [influences]",
                                 kMaxInfluences)),
          corners(checked<std::int32_t>(triangles, "triangles", 2, "int32 [triangles, 3]")) {
        if (corners.shape(1) != 3) fail("triangles", "int32 [triangles, 3]", describe(triangles));
    }

    [[nodiscard]] BindData data() const {
        return {as_points(points), as_span(offsets), as_span(bones), as_span(weights)};
    }
};

PrecomputeOptions options_of(bool exact, const py::object& threads) {
    PrecomputeOptions options;
    options.threads = checked_threads(threads);
    options.exact = exact;
    return options;
}

py::object centres(const py::object& rest_points, const py::object& influence_offsets,
                   const py::object& influence_bones, const py::object& influence_weights,
                   const py::object& triangles, bool exact, const py::object& threads,
                   const py::object& progress) {
    const Mesh mesh(rest_points, influence_offsets, influence_bones, influence_weights, triangles);
    const auto found = precompute(progress, options_of(exact, threads), [&](const PrecomputeOptions& with) {
        return centres_of_rotation(mesh.data(), as_span(mesh.corners), with);
    });
    if (!found) return py::none();
    py::array_t<float> result({mesh.points.shape(0), py::ssize_t{3}});
    if (!found->empty())
        std::memcpy(result.mutable_data(), found->data(), found->size() * sizeof(found->front()));
    return result;
}

py::object moments(const py::object& rest_points, const py::object& influence_offsets,
                   const py::object& influence_bones, const py::object& influence_weights,
                   const py::object& triangles, double radius, bool exact, const py::object& threads,
                   const py::object& progress) {
    const Mesh mesh(rest_points, influence_offsets, influence_bones, influence_weights, triangles);
#if SINEW_WITH_DDM
    const auto found = precompute(progress, options_of(exact, threads), [&](const PrecomputeOptions& with) {
        return direct_delta_mush(mesh.data(), as_span(mesh.corners), radius, with);
    });
    if (!found) return py::none();
    constexpr auto floats = static_cast<py::ssize_t>(kMomentFloats);
    py::array_t<float> result({static_cast<py::ssize_t>(found->size()) / floats, floats});
    if (!found->empty()) std::memcpy(result.mutable_data(), found->data(), found->size() * sizeof(float));
    return result;
#else
    static_cast<void>(radius);
    static_cast<void>(options_of(exact, threads));
    static_cast<void>(progress);
    throw std::runtime_error("direct_delta_mush: this build of Sinew is without the method ddm");
#endif
}

}  // namespace

void bind_precompute(py::module_& m) {
    m.def(
        "centres_of_rotation", &centres, py::arg("rest_points"), py::arg("influence_offsets"),
        py::arg("influence_bones"), py::arg("influence_weights"), py::arg("triangles"), py::kw_only(),
        py::arg("exact") = false, py::arg("threads") = py::none(), py::arg("progress") = py::none(),
        "The vertex data of the method \"cor\": the optimised centre of rotation of each vertex, float32\n"
        "[vertices, 3], model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these "
        "rest\n"
        "points.\n\n"
        "rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.\n"
        "triangles: int32 [triangles, 3], vertices.\n"
        "exact: compute by the definition itself, which is slow; otherwise triangles of similar weights are\n"
        "summed.\n"
        "threads: maximum number; None or 0: as many as useful. The result is the same bit for bit. They "
        "give\n    way to all other threads.\n"
        "progress: None, or a callable that is called on this thread with the completed share, 0 to 1. If "
        "it\n"
        "    returns False, the work is cancelled and the result is None. An exception that it raises is "
        "passed\n"
        "    on.\n\n"
        "Precomputations of other methods have the same `threads` and `progress`. Releases the GIL.");
    m.def(
        "direct_delta_mush", &moments, py::arg("rest_points"), py::arg("influence_offsets"),
        py::arg("influence_bones"), py::arg("influence_weights"), py::arg("triangles"), py::arg("radius"),
        py::kw_only(), py::arg("exact") = false, py::arg("threads") = py::none(),
        py::arg("progress") = py::none(),
        "The vertex data of the method \"ddm\": the moments of each bone's smoothed weights around each "
        "vertex\n"
        "(Le, Lewis 2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight,\n"
        "first moment (x, y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of "
        "the\n"
        "vertex's first moments). Rows are in ascending order of vertices and, for each vertex, of bones. "
        "They\n"
        "belong to these rest points and this radius.\n\n"
        "rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.\n"
        "triangles: int32 [triangles, 3], vertices.\n"
        "radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard "
        "deviation\n"
        "    along each axis.\n"
        "exact: include weights below 1e-6, which are otherwise left out.\n"
        "threads, progress: as for centres_of_rotation. Releases the GIL.\n\n"
        "Raises RuntimeError if Sinew was built without this method.");
}

}  // namespace sinew::bindings
