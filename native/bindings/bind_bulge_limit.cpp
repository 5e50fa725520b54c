// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <cstring>
#include <string>

#include "arrays.h"
#include "gil.h"
#include "module.h"
#include "parameters.h"
#include "sinew/bulge_limit.h"

namespace sinew::bindings {
namespace {

const Parameter& parameter_of(std::string_view id) {
    for (const Parameter& parameter : BulgeLimitStage::kParameters) {
        if (parameter.id == id) return parameter;
    }
    throw std::logic_error("BulgeLimitStage has no such parameter");
}

Affine<float> checked_space(const py::object& bones_from_model) {
    return bones_from_model.is_none() ? Affine<float>{}
                                      : checked_affine(bones_from_model, "bones_from_model");
}

Timed<BulgeLimit> make(const py::object& rest_points, const py::object& influence_offsets,
                       const py::object& influence_bones, const py::object& influence_weights,
                       const py::object& heads, const py::object& tails, const py::object& bones_from_model,
                       const py::object& weights, bool is_normalised) {
    const auto points = checked_points(rest_points, "rest_points");
    const auto offsets = checked<std::int32_t>(influence_offsets, "influence_offsets", 1,
                                               "int32 [vertices + 1]", kMaxVertices + 1);
    const auto bones =
        checked<std::int32_t>(influence_bones, "influence_bones", 1, "int32 [influences]", kMaxInfluences);
    const auto shares =
        checked<float>(influence_weights, "influence_weights", 1, "float32 [influences]", kMaxInfluences);
    const auto first = checked_points(heads, "heads");
    const auto last = checked_points(tails, "tails");
    if (first.shape(0) != last.shape(0)) {
        fail("tails", "float32 [" + std::to_string(first.shape(0)) + ", 3], one for each of heads",
             describe(tails));
    }
    std::vector<BoneSegment<float>> segments;
    for (std::size_t bone = 0; bone < as_points(first).size(); ++bone) {
        segments.push_back({as_points(first)[bone], as_points(last)[bone]});
    }
    BulgeLimitData data{{as_points(points), as_span(offsets), as_span(bones), as_span(shares)},
                        segments,
                        checked_space(bones_from_model)};
    data.mesh.is_normalised = is_normalised;
    py::array_t<float> mask;
    if (!weights.is_none()) {
        mask = checked<float>(weights, "weights", 1, "None or float32 [vertices]", kMaxVertices);
        if (mask.shape(0) != points.shape(0)) {
            fail("weights", "None or float32 [" + std::to_string(points.shape(0)) + "]", describe(weights));
        }
        data.weights = as_span(mask);
    }
    return BulgeLimit(data);
}

Timed<BulgeLimit> make_from_weights(const py::object& rest_points, const py::object& influence_offsets,
                                    const py::object& influence_bones, const py::object& influence_weights,
                                    const py::object& heads, const py::object& tails,
                                    const py::object& bones_from_model, const py::object& weights) {
    return make(rest_points, influence_offsets, influence_bones, influence_weights, heads, tails,
                bones_from_model, weights, false);
}

void set_rest_points(Timed<BulgeLimit>& limit, const py::object& rest_points,
                     const py::object& bones_from_model) {
    const auto points = checked_points(rest_points, "rest_points");
    const Affine<float> space = checked_space(bones_from_model);
    // May have to wait for another thread that applies it.
    without_gil([&] { limit.set_rest_points(as_points(points), space); });
}

py::array_t<float> apply(const Timed<BulgeLimit>& limit, const py::object& points,
                         const py::object& bone_transforms, const py::object& out, const py::object& strength,
                         const py::object& form, const py::object& threads) {
    const std::size_t count = limit.vertex_count();
    const auto given = checked_points(points, "points");
    if (static_cast<std::size_t>(given.shape(0)) != count) {
        fail("points", "float32 [" + std::to_string(count) + ", 3]", describe(points));
    }
    const std::vector<Affine<float>> bones = checked_affines(bone_transforms, "bone_transforms");
    if (bones.size() < limit.bone_count()) {
        fail("bone_transforms", "at least " + std::to_string(limit.bone_count()) + " bones",
             std::to_string(bones.size()));
    }
    BulgeLimitOptions options;
    options.strength = static_cast<float>(
        checked_parameter(strength, parameter_of("strength"), "strength", "bulge_limit.strength"));
    options.form = static_cast<BulgeForm>(
        static_cast<int>(checked_parameter(form, parameter_of("form"), "form", "bulge_limit.form")));
    options.threads = checked_threads(threads);
    py::array_t<float> result = checked_out(out, count);
    float* const to = result.mutable_data();
    limit.call([&] {
        std::memmove(to, given.data(), static_cast<std::size_t>(given.nbytes()));
        static_cast<void>(limit.apply({reinterpret_cast<Vec3<float>*>(to), count}, bones, options));
    });
    return result;
}

// --- Pickles: the constructor's arguments, with normalised weights.

py::tuple state_of(const Timed<BulgeLimit>& limit) {
    const BulgeLimit::Parts parts = limit.parts();
    std::vector<Vec3<float>> heads;
    std::vector<Vec3<float>> tails;
    for (const BoneSegment<float>& segment : parts.segments) {
        heads.push_back(segment.head);
        tails.push_back(segment.tail);
    }
    py::array_t<float> space({4, 4});
    auto rows = space.mutable_unchecked<2>();
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            rows(row, column) = row == 3      ? (column == 3 ? 1.0f : 0.0f)
                                : column == 3 ? parts.bones_from_model.translation[row]
                                              : parts.bones_from_model.linear[column][row];
        }
    }
    py::object weights = py::none();
    if (!parts.weights.empty()) weights = array_of(std::span(parts.weights));
    return py::make_tuple(
        array_of(std::span<const Vec3<float>>(parts.mesh.rest_points)),
        array_of(std::span(parts.mesh.influence_offsets)), array_of(std::span(parts.mesh.influence_bones)),
        array_of(std::span(parts.mesh.influence_weights)), array_of(std::span<const Vec3<float>>(heads)),
        array_of(std::span<const Vec3<float>>(tails)), space, weights);
}

Timed<BulgeLimit> of_state(const py::object& state) {
    const auto part = [&](std::size_t index) { return part_of(state, 8, index); };
    return make(part(0), part(1), part(2), part(3), part(4), part(5), part(6), part(7), true);
}

}  // namespace

void bind_bulge_limit(py::module_& m) {
    py::class_<Timed<BulgeLimit>>(
        m, "BulgeLimit",
        "The stage `bulge_limit` for one mesh: moves deformed points back towards their "
        "bones where blending\n"
        "took them farther away than they are at rest (Kim, Han 2014, and a continuous "
        "form). Can be pickled.")
        .def(
            py::init(&make_from_weights), py::arg("rest_points"), py::arg("influence_offsets"),
            py::arg("influence_bones"), py::arg("influence_weights"), py::arg("heads"), py::arg("tails"),
            py::kw_only(), py::arg("bones_from_model") = py::none(), py::arg("weights") = py::none(),
            "rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.\n"
            "heads, tails: float32 [bones, 3], the ends of each bone at rest, in the space of the bone\n"
            "transforms.\n"
            "bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same "
            "space.\n"
            "weights: None, or float32 [vertices], how much each vertex is limited, 0 to 1; clamped.\n\n"
            "All input is copied. Raises ValueError that names the argument, what was expected and what was\n"
            "given.")
        .def_property_readonly("vertex_count", &BulgeLimit::vertex_count, "Number of vertices.")
        .def_property_readonly("bone_count", &BulgeLimit::bone_count,
                               "One more than the highest bone index in the influences.")
        .def("__repr__",
             [](const Timed<BulgeLimit>& limit) {
                 return "<sinew.BulgeLimit: " + std::to_string(limit.vertex_count()) + " vertices, " +
                        std::to_string(limit.bone_count()) + " bones>";
             })
        .def(py::pickle(&state_of, &of_state))
        .def("set_rest_points", &set_rest_points, py::arg("rest_points"),
             py::arg("bones_from_model") = py::none(),
             "Sets other rest points, float32 [vertices, 3], or another space of the bones: measures\n"
             "distances at rest again, which takes about as long as apply().")
        .def("apply", &apply, py::arg("points"), py::arg("bone_transforms"), py::arg("out") = py::none(),
             py::kw_only(), py::arg("strength") = 1.0, py::arg("form") = "continuous",
             py::arg("threads") = py::none(),
             "The limited points, float32 [vertices, 3], model space.\n\n"
             "points: float32 [vertices, 3], deformed, model space.\n"
             "bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for "
             "Deformer.deform().\n"
             "out: if given, written and returned: float32 [vertices, 3], C-contiguous, aligned; never "
             "converted.\n"
             "    May be `points`.\n"
             "strength: how much of the bulge is removed, 0 to 1.\n"
             "form: \"continuous\": distances to all bones of a vertex, weighted; \"kim_han\": only to the "
             "heaviest,\n"
             "    which tears the surface where that changes.\n"
             "threads: maximum number; None or 0: as many as useful. The\n"
             "    result is the same bit for bit.\n\n"
             "Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit "
             "for\n"
             "bit. A scaled bone allows a distance larger by the largest factor by which it stretches "
             "vectors\n"
             "perpendicular to it. Releases the GIL for large meshes. Raises ValueError that names the "
             "argument,\n"
             "what was expected and what was given.");
}

}  // namespace sinew::bindings
