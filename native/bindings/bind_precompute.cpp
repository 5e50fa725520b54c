// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <memory>
#include <stdexcept>
#include <unordered_set>

#include "deform_arguments.h"
#include "gil.h"
#include "sinew/base/job.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif

namespace sinew::bindings {
namespace {

/// A copy of the mesh of a precomputation, which its thread reads without the GIL.
struct Mesh {
    std::vector<Vec3<float>> points;
    std::vector<std::int32_t> offsets;
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
    std::vector<std::int32_t> corners;

    Mesh(const MeshArguments& mesh, const py::object& triangles)
        : points(copied(as_points(mesh.points))),
          offsets(copied(as_span(mesh.offsets))),
          bones(copied(as_span(mesh.bones))),
          weights(copied(as_span(mesh.weights))) {
        corners =
            copied(as_span(checked_rows<std::int32_t>(triangles, "triangles", 3, "int32 [triangles, 3]")));
    }

    [[nodiscard]] BindData data() const { return {points, offsets, bones, weights}; }

private:
    template <class T>
    static std::vector<T> copied(std::span<const T> values) {
        return {values.begin(), values.end()};
    }
};

/// Vertex data in the making. All members but `numbers_`, until the work has ended, belong to whoever has the GIL.
class Precomputation {
    using Numbers = std::shared_ptr<std::vector<float>>;

public:
    /// make(mesh, job) returns rows of `width` floats.
    template <class Make>
    Precomputation(std::size_t threads, bool gives_way, Mesh mesh, std::size_t width, Make make)
        : width_(static_cast<py::ssize_t>(width)),
          job_(threads, gives_way, [this, mesh = std::move(mesh), make](Job& job) {
              numbers_ = std::make_shared<std::vector<float>>(make(mesh, job));
          }) {
        all().insert(this);
    }
    ~Precomputation() {
        all().erase(this);
        job_.cancel();
        join();
    }
    Precomputation(const Precomputation&) = delete;
    Precomputation& operator=(const Precomputation&) = delete;

    [[nodiscard]] double progress() const { return job_.progress(); }
    [[nodiscard]] bool has_ended() const { return is_cancelled_ || job_.has_ended(); }

    void cancel() {
        is_cancelled_ = !job_.has_ended() || is_cancelled_;
        job_.cancel();
    }

    /// Returns whether it has ended. Python handles signals meanwhile.
    bool wait(const Typed<"float | None">& seconds) const {
        constexpr std::chrono::milliseconds kBetweenSignals{20};
        using Clock = std::chrono::steady_clock;
        const bool has_limit = !seconds.is_none();
        const std::chrono::duration<double> limit{has_limit ? double(py::float_(seconds)) : 0.0};
        const auto start = Clock::now();
        while (!has_ended()) {
            auto time = kBetweenSignals;
            if (has_limit) {
                const auto left = limit - (Clock::now() - start);
                if (left <= left.zero()) return false;
                if (left < time) time = std::chrono::ceil<std::chrono::milliseconds>(left);
            }
            without_gil([&] { static_cast<void>(job_.wait_for(time)); });
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        }
        return true;
    }

    py::object result() {
        wait(py::none());
        if (result_) return result_;
        if (!is_cancelled_) job_.rethrow();
        if (is_cancelled_ || !numbers_) return py::none();
        // Not copied: numpy lets other threads run meanwhile, which may want the result, too.
        const py::capsule owner(new Numbers(numbers_),
                                [](void* numbers) { delete static_cast<Numbers*>(numbers); });
        const auto rows = static_cast<py::ssize_t>(numbers_->size()) / width_;
        const py::array_t<float> made({rows, width_}, numbers_->data(), owner);
        if (!result_) result_ = made;
        return result_;
    }

    /// Returns when all have ended.
    static void end_all() {
        for (Precomputation* each : all()) each->cancel();
        for (Precomputation* each : all()) each->join();
    }

private:
    /// Never destroyed: what Python destroys last still removes itself.
    static std::unordered_set<Precomputation*>& all() {
        static auto* const all = new std::unordered_set<Precomputation*>;
        return *all;
    }

    /// Keeps the GIL, which the job does not need.
    void join() const {
        while (!job_.wait_for(std::chrono::seconds(1))) {
        }
    }

    py::ssize_t width_;
    bool is_cancelled_ = false;
    py::object result_;
    Numbers numbers_;
    BackgroundJob job_;
};

using Running = std::unique_ptr<Precomputation>;

Running centres(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
                const ArrayLike& influence_bones, const ArrayLike& influence_weights,
                const ArrayLike& triangles, bool exact, const Threads& threads, bool gives_way) {
    Mesh mesh({rest_points, influence_offsets, influence_bones, influence_weights}, triangles);
    const auto make = [exact](const Mesh& bound, Job& job) {
        const auto found = centres_of_rotation(bound.data(), bound.corners, job, exact);
        const auto* const numbers = reinterpret_cast<const float*>(found.data());
        return std::vector<float>(numbers, numbers + 3 * found.size());
    };
    return std::make_unique<Precomputation>(checked_threads(threads), gives_way, std::move(mesh), 3, make);
}

Running moments(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
                const ArrayLike& influence_bones, const ArrayLike& influence_weights,
                const ArrayLike& triangles, [[maybe_unused]] double radius, [[maybe_unused]] bool exact,
                const Threads& threads, [[maybe_unused]] bool gives_way) {
    Mesh mesh({rest_points, influence_offsets, influence_bones, influence_weights}, triangles);
    [[maybe_unused]] const std::size_t most = checked_threads(threads);
#if SINEW_WITH_DDM
    const auto make = [radius, exact](const Mesh& bound, Job& job) {
        return direct_delta_mush(bound.data(), bound.corners, radius, job, exact);
    };
    return std::make_unique<Precomputation>(most, gives_way, std::move(mesh), kMomentFloats, make);
#else
    throw std::runtime_error("direct_delta_mush: this build of Sinew is without the method ddm");
#endif
}

}  // namespace

void bind_precompute(py::module_& m) {
    py::class_<Precomputation>(
        m, "Precomputation",
        R"(A computation of a method's vertex data. It runs on threads of its own, and on copies of its arguments. It is
cancelled when nobody refers to it any more, and when Python ends.)")
        .def_property_readonly("progress", &Precomputation::progress, "The completed share, 0 to 1.")
        .def_property_readonly("has_ended", &Precomputation::has_ended,
                               "Whether it is done, has failed or was cancelled.")
        .def("cancel", &Precomputation::cancel,
             "Returns at once. The result is then None, unless there already was one.")
        .def("wait", &Precomputation::wait, "seconds"_a = py::none(),
             "Waits until it has ended, at most this long. Returns whether it has. Ctrl-C raises "
             "KeyboardInterrupt.")
        .def(
            "result",
            [](Precomputation& running) {
                return Typed<"numpy.typing.NDArray[numpy.float32] | None">(running.result());
            },
            R"(Waits until it has ended, and returns the array, the same one each time; None if it was cancelled, or if
this is a process that was forked meanwhile. Raises what the work raised: ValueError for data that Binding
refuses, too.)");
    // Before Python and the system destroy what the threads use.
    py::module_::import("atexit").attr("register")(py::cpp_function(&Precomputation::end_all));
    m.def(
        "centres_of_rotation", &centres, "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
        "influence_weights"_a, "triangles"_a, py::kw_only(), "exact"_a = false, "threads"_a = py::none(),
        "gives_way"_a = false,
        R"(Starts to compute the vertex data of the method "cor": the optimised centre of rotation of each vertex,
float32 [vertices, 3], model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest
points.

rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
triangles: int32 [triangles, 3], vertices.
exact: compute by the definition itself, which is slow; otherwise triangles of similar weights are summed.
gives_way: at a low priority, so that frames which are deformed meanwhile lose little; on a busy machine it then
    takes much longer.)");
    m.def(
        "direct_delta_mush", &moments, "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
        "influence_weights"_a, "triangles"_a, "radius"_a, py::kw_only(), "exact"_a = false,
        "threads"_a = py::none(), "gives_way"_a = false,
        R"(Starts to compute the vertex data of the method "ddm": the moments of each bone's smoothed weights around
each vertex (Le, Lewis 2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight,
first moment (x, y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of the
vertex's first moments). Rows are in ascending order of vertices and, for each vertex, of bones. They belong to
these rest points and this radius.

rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
triangles: int32 [triangles, 3], vertices.
radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard deviation along
    each axis.
exact: include weights below 1e-6, which are otherwise left out.
gives_way: as for centres_of_rotation().

RuntimeError if Sinew was built without this method.)");
}

}  // namespace sinew::bindings
