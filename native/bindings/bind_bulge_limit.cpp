// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <string>

#include "broadcast.h"
#include "deform_arguments.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "stages.h"

namespace sinew::bindings {
namespace {

Timed<BulgeLimit> make(const Binding& binding, const ArrayLike& heads, const ArrayLike& tails,
                       const OptionalArrayLike& bones_from_model, const OptionalArrayLike& weights) {
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
    const auto mask = one_for_each<float>(weights, "weights", binding.vertex_count(), "float32");
    return BulgeLimit(binding,
                      {segments, checked_affine(bones_from_model, "bones_from_model"), as_span(mask)});
}

py::array_t<float> apply(const Timed<BulgeLimit>& limit, const ArrayLike& points,
                         const ArrayLike& bone_transforms, const Out& out, const Number& strength,
                         const Typed<"typing.Literal['continuous', 'kim_han']">& form,
                         const Threads& threads) {
    const auto given = checked_points(points, "points", limit.vertex_count());
    const std::vector<Affine<float>> bones = checked_bones(bone_transforms, limit.bone_count());
    BulgeLimitOptions options;
    options.strength = static_cast<float>(checked_option<BulgeLimitDefinition>(strength, "strength"));
    options.form =
        static_cast<BulgeForm>(static_cast<int>(checked_option<BulgeLimitDefinition>(form, "form")));
    options.threads = checked_threads(threads);
    return applied(limit, given, out, [&](auto to) { return limit.apply(to, bones, options); });
}

}  // namespace

void bind_stage(py::module_& m, BulgeLimitDefinition) {
    auto type = stage_class<BulgeLimit>(
        m, "BulgeLimit",
        R"(The stage `bulge_limit` for one mesh: moves deformed points back towards their bones where blending took
them farther away than they are at rest (Kim, Han 2014, and a continuous form).)",
        "bones", [](const BulgeLimit& limit) { return limit.bone_count(); });
    def_bones(type);
    type.def(py::init(&make), "binding"_a, "heads"_a, "tails"_a, py::kw_only(),
             "bones_from_model"_a = py::none(), "weights"_a = py::none(),
             R"(binding: the mesh. Its memory is shared.
heads, tails: float32 [bones, 3], the ends of each bone at rest, in the space of the bone transforms.
bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same space.
weights: None, or float32 [vertices], how much each vertex is limited, 0 to 1; clamped.)")
        .def("apply", &apply, "points"_a, "bone_transforms"_a, "out"_a = py::none(), py::kw_only(),
             "strength"_a = 1.0, "form"_a = "continuous", "threads"_a = py::none(),
             R"(The limited points, float32 [vertices, 3], model space.

points: float32 [vertices, 3], deformed, model space.
bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for Deformer.deform().
out: may be `points`.
strength: how much of the bulge is removed, 0 to 1.
form: "continuous": distances to all bones of a vertex, weighted; "kim_han": only to the heaviest, which tears
    the surface where that changes.

Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit for bit. A scaled
bone allows a distance larger by the largest factor by which it stretches vectors perpendicular to it.)");
}

}  // namespace sinew::bindings
