// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <cstring>
#include <limits>
#include <optional>

#include "arrays.h"
#include "gil.h"
#include "module.h"
#include "sinew/deform/centres_of_rotation.h"

namespace sinew::bindings {
namespace {

/// Calls `run` with options that report to `progress`, a callable or None. The lock is given away but for these calls.
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
                // Whatever else it returns, or nothing, goes on.
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

std::size_t thread_count(const py::object& threads) {
    if (threads.is_none()) return 0;
    if (!py::isinstance<py::int_>(threads)) fail("threads", "None or 1 or more", describe(threads));
    int overflow = 0;
    const long long count = PyLong_AsLongLongAndOverflow(threads.ptr(), &overflow);
    if (overflow < 0 || (overflow == 0 && count < 1)) {
        fail("threads", "None or 1 or more", py::str(threads).cast<std::string>());
    }
    return overflow > 0 ? std::numeric_limits<std::size_t>::max() : static_cast<std::size_t>(count);
}

py::object centres(const py::object& rest_points, const py::object& influence_offsets,
                   const py::object& influence_bones, const py::object& influence_weights,
                   const py::object& triangles, bool exact, const py::object& threads,
                   const py::object& progress) {
    const auto points = checked_points(rest_points, "rest_points");
    const auto offsets = checked<std::int32_t>(influence_offsets, "influence_offsets", 1,
                                               "int32 [vertices + 1]", kMaxVertices + 1);
    const auto bones =
        checked<std::int32_t>(influence_bones, "influence_bones", 1, "int32 [influences]", kMaxInfluences);
    const auto weights =
        checked<float>(influence_weights, "influence_weights", 1, "float32 [influences]", kMaxInfluences);
    const auto corners = checked<std::int32_t>(triangles, "triangles", 2, "int32 [triangles, 3]");
    if (corners.shape(1) != 3) fail("triangles", "int32 [triangles, 3]", describe(triangles));
    const BindData data{as_points(points), as_span(offsets), as_span(bones), as_span(weights)};
    PrecomputeOptions options;
    options.threads = thread_count(threads);
    options.exact = exact;
    const auto found = precompute(progress, options, [&](const PrecomputeOptions& with) {
        return centres_of_rotation(data, as_span(corners), with);
    });
    if (!found) return py::none();
    py::array_t<float> result({points.shape(0), py::ssize_t{3}});
    if (!found->empty())
        std::memcpy(result.mutable_data(), found->data(), found->size() * sizeof(found->front()));
    return result;
}

}  // namespace

void bind_precompute(py::module_& m) {
    m.def(
        "centres_of_rotation", &centres, py::arg("rest_points"), py::arg("influence_offsets"),
        py::arg("influence_bones"), py::arg("influence_weights"), py::arg("triangles"), py::kw_only(),
        py::arg("exact") = false, py::arg("threads") = py::none(), py::arg("progress") = py::none(),
        "What the method \"cor\" keeps of each vertex: its optimised centre of rotation, float32 [vertices, "
        "3],\n"
        "model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest points.\n\n"
        "rest_points, influence_offsets, influence_bones, influence_weights: as of Binding.\n"
        "triangles: int32 [triangles, 3], vertices.\n"
        "exact: by the definition itself, slowly; else triangles of like weights are added up.\n"
        "threads: how many at most; None: as many as help. The result is the same bit for bit.\n"
        "progress: None, or a callable that is called on this thread with the share that is done, 0 to 1.\n"
        "    Where it returns False the work ends, and the result is None. What it raises comes through.\n\n"
        "Precomputations of other methods take `threads` and `progress` alike. The GIL is released.");
}

}  // namespace sinew::bindings
