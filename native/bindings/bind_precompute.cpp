// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <optional>
#include <stdexcept>

#include "deform_arguments.h"
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

/// The mesh of a precomputation.
struct Mesh : MeshArguments {
    py::array_t<std::int32_t> corners;

    Mesh(const MeshArguments& mesh, const py::object& triangles)
        : MeshArguments(mesh),
          corners(checked<std::int32_t>(triangles, "triangles", 2, "int32 [triangles, 3]")) {
        if (corners.shape(1) != 3) fail("triangles", "int32 [triangles, 3]", describe(triangles));
    }
};

PrecomputeOptions options_of(bool exact, const py::object& threads) {
    PrecomputeOptions options;
    options.threads = checked_threads(threads);
    options.exact = exact;
    return options;
}

using Progress = Typed<"collections.abc.Callable[[float], object] | None">;
using Rows = Typed<"numpy.typing.NDArray[numpy.float32] | None">;

Rows centres(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
             const ArrayLike& influence_bones, const ArrayLike& influence_weights, const ArrayLike& triangles,
             bool exact, const Threads& threads, const Progress& progress) {
    const Mesh mesh({rest_points, influence_offsets, influence_bones, influence_weights}, triangles);
    const auto found = precompute(progress, options_of(exact, threads), [&](const PrecomputeOptions& with) {
        return centres_of_rotation(mesh.data(), as_span(mesh.corners), with);
    });
    if (!found) return py::none();
    return array_of(std::span<const Vec3<float>>(*found));
}

Rows moments(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
             const ArrayLike& influence_bones, const ArrayLike& influence_weights, const ArrayLike& triangles,
             double radius, bool exact, const Threads& threads, const Progress& progress) {
    const Mesh mesh({rest_points, influence_offsets, influence_bones, influence_weights}, triangles);
#if SINEW_WITH_DDM
    const auto found = precompute(progress, options_of(exact, threads), [&](const PrecomputeOptions& with) {
        return direct_delta_mush(mesh.data(), as_span(mesh.corners), radius, with);
    });
    if (!found) return py::none();
    constexpr auto floats = static_cast<py::ssize_t>(kMomentFloats);
    return array_of(std::span(*found)).reshape({static_cast<py::ssize_t>(found->size()) / floats, floats});
#else
    static_cast<void>(radius);
    static_cast<void>(options_of(exact, threads));
    static_cast<void>(progress);
    throw std::runtime_error("direct_delta_mush: this build of Sinew is without the method ddm");
#endif
}

}  // namespace

void bind_precompute(py::module_& m) {
    m.def("centres_of_rotation", &centres, "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
          "influence_weights"_a, "triangles"_a, py::kw_only(), "exact"_a = false, "threads"_a = py::none(),
          "progress"_a = py::none(),
          R"(The vertex data of the method "cor": the optimised centre of rotation of each vertex, float32
[vertices, 3], model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest points.

rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
triangles: int32 [triangles, 3], vertices.
exact: compute by the definition itself, which is slow; otherwise triangles of similar weights are summed.
threads: at most so many; None or 0: as many as useful. They give way to all other threads.
progress: None, or a callable that is called on this thread with the completed share, 0 to 1. If it returns
    False, the work is cancelled and the result is None. An exception that it raises is passed on.)");
    m.def(
        "direct_delta_mush", &moments, "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
        "influence_weights"_a, "triangles"_a, "radius"_a, py::kw_only(), "exact"_a = false,
        "threads"_a = py::none(), "progress"_a = py::none(),
        R"(The vertex data of the method "ddm": the moments of each bone's smoothed weights around each vertex (Le,
Lewis 2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight, first moment (x,
y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of the vertex's first moments).
Rows are in ascending order of vertices and, for each vertex, of bones. They belong to these rest points and
this radius.

rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
triangles: int32 [triangles, 3], vertices.
radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard deviation along
    each axis.
exact: include weights below 1e-6, which are otherwise left out.
threads, progress: as for centres_of_rotation().

RuntimeError if Sinew was built without this method.)");
}

}  // namespace sinew::bindings
