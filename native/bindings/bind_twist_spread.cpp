// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <string>

#include "broadcast.h"
#include "deform_arguments.h"
#include "sinew/stages/twist_spread/twist_spread.h"
#include "stages.h"

namespace sinew::bindings {
namespace {

constexpr py::ssize_t kTwistColumns = 4;
constexpr py::ssize_t kChannelColumns = 7;

Timed<TwistSpread> make(const Binding& binding, const ArrayLike& twists, const ArrayLike& heads,
                        const ArrayLike& tails, const ArrayLike& rest_bones, const OptionalArrayLike& parents,
                        const OptionalArrayLike& bones_from_model, const OptionalArrayLike& weights,
                        const OptionalArrayLike& mix) {
    const auto rows =
        checked_rows<std::int32_t>(twists, "twists", kTwistColumns, "int32 [twists, 4]", kMaxBones);
    const auto count = static_cast<std::size_t>(rows.shape(0));
    const auto first = checked_points(heads, "heads", count);
    const auto last = checked_points(tails, "tails", count);
    std::vector<TwistBone> listed;
    for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t* const row = rows.data() + kTwistColumns * static_cast<py::ssize_t>(i);
        listed.push_back({row[0], row[1], row[2], row[3] != 0, as_points(first)[i], as_points(last)[i]});
    }
    const std::vector<Affine<float>> bones = checked_affines(rest_bones, "rest_bones");
    const auto numbers = one_for_each<std::int32_t>(parents, "parents", bones.size(), "int32");
    const auto mask = one_for_each<float>(weights, "weights", binding.vertex_count(), "float32");
    const auto mixed = one_for_each<float>(mix, "mix", binding.vertex_count(), "float32");
    return TwistSpread(binding,
                       {listed, bones, as_span(numbers), checked_affine(bones_from_model, "bones_from_model"),
                        as_span(mask), as_span(mixed)});
}

std::vector<TwistChannels<float>> checked_channels(const OptionalArrayLike& channels, std::size_t count) {
    std::vector<TwistChannels<float>> result;
    if (channels.is_none()) return result;
    const std::string wanted = "None or float32 [" + std::to_string(count) + ", 7]";
    const auto rows =
        checked_rows<float>(channels, "channels", kChannelColumns, wanted, std::max(count, std::size_t{1}));
    if (static_cast<std::size_t>(rows.shape(0)) != count) fail("channels", wanted, describe(channels));
    for (std::size_t i = 0; i < count; ++i) {
        const float* const row = rows.data() + kChannelColumns * static_cast<py::ssize_t>(i);
        check_finite(row, kChannelColumns, "channels", static_cast<py::ssize_t>(i));
        result.push_back(
            {Quat<float>(row[0], {row[1], row[2], row[3]}), Vec3<float>(row[4], row[5], row[6])});
    }
    return result;
}

TwistBlend checked_blend(const py::object& blend, const char* argument) {
    return static_cast<TwistBlend>(checked_choice(blend, argument, TwistSpreadDefinition::kBlends));
}

py::array_t<float> angles(const Timed<TwistSpread>& spread, const ArrayLike& bone_transforms,
                          const OptionalArrayLike& channels) {
    const std::vector<Affine<float>> bones = checked_affines(bone_transforms, "bone_transforms");
    const std::vector<float> found = spread.angles(bones, checked_channels(channels, spread.twist_count()));
    return array_of(std::span(found));
}

using Blend = Typed<"typing.Literal['linear', 'matrices', 'rotations', 'logarithms']">;

py::array_t<float> apply(const Timed<TwistSpread>& spread, const ArrayLike& points,
                         const ArrayLike& bone_transforms, const Out& out, const Number& amount,
                         const OptionalArrayLike& amounts, const OptionalArrayLike& curves,
                         const OptionalArrayLike& channels, const Blend& blend, const Blend& mix_blend,
                         const Threads& threads) {
    const auto given = checked_points(points, "points", spread.vertex_count());
    const std::vector<Affine<float>> bones = checked_bones(bone_transforms, spread.bone_count());
    const auto factors = one_for_each<float>(amounts, "amounts", spread.twist_count(), "float32");
    const auto curved = one_for_each<float>(curves, "curves", spread.twist_count(), "float32");
    const auto told = checked_channels(channels, spread.twist_count());
    TwistSpreadOptions options;
    options.amount = static_cast<float>(checked_option<TwistSpreadDefinition>(amount, "amount"));
    options.amounts = as_span(factors);
    options.curves = as_span(curved);
    options.channels = told;
    options.blend = checked_blend(blend, "blend");
    options.mix_blend = checked_blend(mix_blend, "mix_blend");
    options.threads = checked_threads(threads);
    return applied(spread, given, out, [&](auto to) { return spread.apply(to, bones, options); });
}

}  // namespace

void bind_stage(py::module_& m, TwistSpreadDefinition) {
    auto type = stage_class<TwistSpread>(
        m, "TwistSpread",
        R"(The stage `twist_spread` for one mesh: spreads the twist of a bone against the next along the bone, as twist
bones do. Applied after Deformer.deform() and before all other stages.)",
        "twists", [](const TwistSpread& spread) { return spread.twist_count(); });
    def_bones(type);
    type.def(py::init(&make), "binding"_a, "twists"_a, "heads"_a, "tails"_a, "rest_bones"_a, py::kw_only(),
             "parents"_a = py::none(), "bones_from_model"_a = py::none(), "weights"_a = py::none(),
             "mix"_a = py::none(),
             R"(binding: the mesh. Its memory is shared.
twists: int32 [twists, 4], a bone before those that it carries. The first bone's vertices share, about the line from
    its head to its tail, the twist of the third bone relative to the second. The fourth number is 0 where it is
    added towards the tail (the hand's twist to the forearm), 1 where it is taken back towards the head (an upper
    arm's own).
heads, tails: float32 [twists, 3], between which the share of the twist grows from 0 to 1, at rest, in the space of
    the bone transforms. Where both are the same, the line is along the bone's Y axis.
rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], each bone at rest in that space, Y along it.
parents: None, or int32 [bones], -1 for none. Only twists beyond half a turn need them.
bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same space.
weights: None, or float32 [vertices], how much each vertex takes part, 0 to 1; clamped.
mix: None, or float32 [vertices], the weights of Deformer's `mix`.)")
        .def_property_readonly("twist_count", &TwistSpread::twist_count, "Number of twists.")
        .def(
            "angles", &angles, "bone_transforms"_a, "channels"_a = py::none(),
            R"(The twists in a pose, float32 [twists], radians, as apply() spreads them by an amount of 1: faded from 150
degrees to 180, where a matrix does not tell them.

bone_transforms, channels: as for apply().)")
        .def("apply", &apply, "points"_a, "bone_transforms"_a, "out"_a = py::none(), py::kw_only(),
             "amount"_a = 1.0, "amounts"_a = py::none(), "curves"_a = py::none(), "channels"_a = py::none(),
             "blend"_a = "linear", "mix_blend"_a = "linear", "threads"_a = py::none(),
             R"(The twisted points, float32 [vertices, 3], model space.

points: float32 [vertices, 3], deformed, model space.
bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for Deformer.deform().
out: may be `points`.
amount: how much of each twist is spread, 0 to 1.
amounts: None, or float32 [twists], the same for each bone.
curves: None, or float32 [twists], -1 to 1: below 0 more of the twist is near the tail, above 0 near the head.
channels: None, or float32 [twists, 7], the rotation channels of each tip: its rotation from rest on its own rest
    axes, (w, x, y, z), and Euler angles or the product of angle and unit axis, radians. They say how far beyond half
    a turn it went, up to two turns, unless something else rotates the bone as well. All 0: unknown.
blend: how the method of the points blends rotations: "linear" (lbs), "matrices" (ddm), "rotations" (all others), or
    "logarithms" (log, dib). With "linear" the bone's matrix M of each vertex becomes M R; otherwise the vertex is
    rotated about the posed axis by its weight times its share of the twist.
mix_blend: the same for the second method, where `mix` is above 0.

Where no bone is twisted, no bit changes.)");
}

}  // namespace sinew::bindings
