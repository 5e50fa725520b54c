// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "arrays.h"
#include "broadcast.h"
#include "deform_arguments.h"
#include "gil.h"
#include "parameters.h"
#include "sinew/deformer.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/methods/methods.h"
#include "sinew/pose/continued_rotations.h"
#include "sinew/stages/mix/mix.h"

namespace sinew::bindings {
MeshArguments::MeshArguments(const py::object& rest_points, const py::object& influence_offsets,
                             const py::object& influence_bones, const py::object& influence_weights)
    : points(checked_points(rest_points, "rest_points")),
      offsets(checked<std::int32_t>(influence_offsets, "influence_offsets", 1, "int32 [vertices + 1]",
                                    kMaxVertices + 1)),
      bones(
          checked<std::int32_t>(influence_bones, "influence_bones", 1, "int32 [influences]", kMaxInfluences)),
      weights(checked<float>(influence_weights, "influence_weights", 1, "float32 [influences]",
                             kMaxInfluences)) {}

MethodInfo checked_method(const py::object& method, const char* argument) {
    std::array<std::string_view, kMethodCount> names;
    std::ranges::transform(kMethods, names.begin(), &MethodInfo::name);
    return kMethods[checked_choice(method, argument, names)];
}

namespace {

/// All arguments of Binding, and the arrays that BindData refers to.
struct BindArguments : MeshArguments {
    std::vector<Affine<float>> rest_bones;
    std::vector<py::array_t<float>> vertex_arrays;
    std::vector<VertexData> vertex_data;

    [[nodiscard]] BindData data(bool is_normalised = false) const {
        BindData data = MeshArguments::data();
        data.rest_bones = rest_bones;
        data.vertex_data = vertex_data;
        data.is_normalised = is_normalised;
        return data;
    }
};

/// Adds the arrays of a dict with names of methods as keys.
void add_vertex_data(const py::object& vertex_data, BindArguments& arrays) {
    if (!py::isinstance<py::dict>(vertex_data)) {
        fail("vertex_data", "None or a dict of arrays by names of methods", describe(vertex_data));
    }
    for (const auto& [name, values] : py::reinterpret_borrow<py::dict>(vertex_data)) {
        const MethodInfo method = checked_method(py::reinterpret_borrow<py::object>(name), "vertex_data");
        if (values.is_none()) {
            arrays.vertex_data.push_back({method, {}, true});
            continue;
        }
        const auto floats = static_cast<py::ssize_t>(method.vertex_floats);
        const std::string wanted = "of " + std::string(method.name) +
                                   (method.rows_by_bone ? " float32 [rows, " : " float32 [vertices, ") +
                                   std::to_string(floats) + "]";
        arrays.vertex_arrays.push_back(
            checked_rows<float>(values, "vertex_data", floats, wanted, kMaxVertices));
        arrays.vertex_data.push_back({method, as_span(arrays.vertex_arrays.back())});
    }
}

BindArguments checked_arrays(const py::object& rest_points, const py::object& influence_offsets,
                             const py::object& influence_bones, const py::object& influence_weights,
                             const py::object& rest_bones, const py::object& vertex_data) {
    BindArguments arrays{{rest_points, influence_offsets, influence_bones, influence_weights}, {}, {}, {}};
    if (!rest_bones.is_none()) arrays.rest_bones = checked_affines(rest_bones, "rest_bones");
    if (!vertex_data.is_none()) add_vertex_data(vertex_data, arrays);
    return arrays;
}

Binding make_binding(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
                     const ArrayLike& influence_bones, const ArrayLike& influence_weights,
                     const OptionalArrayLike& rest_bones, const VertexArrays& vertex_data) {
    return Binding(checked_arrays(rest_points, influence_offsets, influence_bones, influence_weights,
                                  rest_bones, vertex_data)
                       .data());
}

Timed<Deformer> make_deformer(const ArrayLike& rest_points, const ArrayLike& influence_offsets,
                              const ArrayLike& influence_bones, const ArrayLike& influence_weights,
                              const Name& method, const OptionalArrayLike& rest_bones,
                              const VertexArrays& vertex_data) {
    const MethodInfo row = checked_method(method, "method");
    return Deformer(checked_arrays(rest_points, influence_offsets, influence_bones, influence_weights,
                                   rest_bones, vertex_data)
                        .data(),
                    row);
}

}  // namespace

MixArguments checked_mix(const py::object& mix) {
    if (mix.is_none()) return {};
    const char* const wanted = "None or (method, weights)";
    if (!py::isinstance<py::tuple>(mix) && !py::isinstance<py::list>(mix)) fail("mix", wanted, describe(mix));
    const py::tuple pair(mix);
    if (pair.size() != 2)
        fail("mix", wanted,
             std::string(py::isinstance<py::tuple>(mix) ? "a tuple of " : "a list of ") +
                 std::to_string(pair.size()));
    const MethodInfo second = checked_method(pair[0], "mix");
    return {second, checked<float>(pair[1], "mix", 1, "weights float32 [vertices]", kMaxVertices)};
}

namespace {

Timed<Deformer> make_deformer_of(const Binding& binding, const Name& method, const Mix& mix) {
    const MethodInfo first = checked_method(method, "method");
    const MixArguments second = checked_mix(mix);
    return Deformer(binding, first, second.data());
}

// --- Pickles: the data that a Binding keeps, as arrays; for a Deformer also its method and mix.

py::tuple mesh_state(const BoundMesh& mesh) {
    py::object rest_bones = py::none();
    if (!mesh.rest_bones.empty()) {
        Output<Affine<float>> output({static_cast<py::ssize_t>(mesh.rest_bones.size())});
        for (std::size_t i = 0; i < mesh.rest_bones.size(); ++i) {
            output.write(static_cast<py::ssize_t>(i), mesh.rest_bones[i]);
        }
        rest_bones = output.take();
    }
    py::object vertex_data = py::none();
    if (!mesh.vertex_data.empty()) {
        py::dict by_method;
        for (const auto& [method, values, is_linear] : mesh.vertex_data) {
            const auto floats = static_cast<py::ssize_t>(method.vertex_floats);
            const auto rows = static_cast<py::ssize_t>(values.size()) / floats;
            by_method[py::str(std::string(method.name))] =
                is_linear ? py::object(py::none()) : array_of(std::span(values)).reshape({rows, floats});
        }
        vertex_data = by_method;
    }
    return py::make_tuple(array_of(std::span(mesh.rest_points)), array_of(std::span(mesh.influence_offsets)),
                          array_of(std::span(mesh.influence_bones)),
                          array_of(std::span(mesh.influence_weights)), rest_bones, vertex_data);
}

py::tuple state_of(const Deformer& deformer) {
    py::object mix = py::none();
    if (const MethodInfo* const mixed = deformer.mixed_method(); mixed != nullptr) {
        mix = py::make_tuple(std::string(mixed->name), array_of<float>(deformer.mix_weights()));
    }
    return py::make_tuple(mesh_state(deformer.unpack()), std::string(deformer.method().name), mix);
}

BindArguments arrays_of_state(const py::object& state) { return from_state<6>(state, &checked_arrays); }

Timed<Deformer> deformer_of_state(const py::object& state) {
    const BindArguments arrays = arrays_of_state(part_of(state, 3, 0));
    const MethodInfo method = checked_method(part_of(state, 3, 1), "method");
    const MixArguments mix = checked_mix(part_of(state, 3, 2));
    return Deformer(arrays.data(true), method, mix.data());
}

std::string counts_of(const auto& bound) {
    return std::to_string(bound.vertex_count()) + " vertices, " + std::to_string(bound.influence_count()) +
           " influences, " + std::to_string(bound.bone_count()) + " bones>";
}

std::string text_of_deformer(const Timed<Deformer>& deformer) {
    std::string text = "<sinew.Deformer " + std::string(deformer.method().name);
    if (const MethodInfo* const mixed = deformer.mixed_method(); mixed != nullptr) {
        text += " mixed with " + std::string(mixed->name);
    }
    return text + ": " + counts_of(deformer);
}

// Read in place, because posed bones come from Blender by columns in every frame. Multiplied in double, because a
// bone far from the origin would lose digits.
std::vector<Affine<float>> posed_from_rest(const py::object& bone_transforms,
                                           const py::object& rest_inverses) {
    const char* const wanted = "float32 [n, 4, 4] or [n, 3, 4]";
    const auto are_affines = [](const py::array& a) {
        return a.ndim() == 3 && a.shape(2) == 4 && (a.shape(1) == 4 || a.shape(1) == 3);
    };
    const bool in_place = py::isinstance<py::array_t<float>>(bone_transforms);
    auto posed = in_place ? py::reinterpret_borrow<py::array_t<float>>(bone_transforms)
                          : checked<float>(bone_transforms, "bone_transforms", 3, wanted);
    if (!are_affines(posed)) fail("bone_transforms", wanted, describe(bone_transforms));
    if ((posed.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) == 0) posed = in_order<float>(posed);
    const std::string as_many =
        "float64 [" + std::to_string(posed.shape(0)) + ", 4, 4], one for each of bone_transforms";
    const auto inverse = checked<double>(rest_inverses, "rest_inverses", 3, as_many);
    if (!are_affines(inverse) || inverse.shape(0) != posed.shape(0)) {
        fail("rest_inverses", as_many, describe(rest_inverses));
    }
    const auto p = posed.unchecked<3>();
    const auto r = inverse.unchecked<3>();
    std::vector<Affine<float>> bones(static_cast<std::size_t>(posed.shape(0)));
    for (py::ssize_t i = 0; i < posed.shape(0); ++i) {
        Affine<float>& bone = bones[static_cast<std::size_t>(i)];
        bool finite = true;
        for (py::ssize_t row = 0; row < 3; ++row) {
            for (py::ssize_t column = 0; column < 4; ++column) {
                double sum = column == 3 ? p(i, row, 3) : 0.0;
                for (py::ssize_t k = 0; k < 3; ++k) sum += p(i, row, k) * r(i, k, column);
                const auto value = static_cast<float>(sum);
                finite = finite && std::isfinite(value);
                (column == 3 ? bone.translation[static_cast<int>(row)]
                             : bone.linear[static_cast<int>(column)][static_cast<int>(row)]) = value;
            }
        }
        if (!finite) {
            fail("bone_transforms", "finite values", "NaN or infinity at index " + std::to_string(i));
        }
    }
    return bones;
}

/// The default values of the parameters of `method`, in its order.
std::vector<double> default_parameters(const MethodInfo& method) {
    std::vector<double> values;
    for (const Parameter& parameter : method.parameters) values.push_back(parameter.initial);
    return values;
}

/// A parameter of some method, as an index.
struct MethodParameter {
    MethodInfo method;
    std::size_t index;
};

MethodParameter checked_parameter_name(const py::handle& name) {
    const char* const wanted = "names of parameters of methods, METHOD.PARAMETER";
    const std::string text = checked_name(name, "parameters", wanted);
    const std::size_t dot = text.find('.');
    if (const std::optional<MethodInfo> method = find_method(text.substr(0, dot));
        method && dot != std::string::npos) {
        for (std::size_t i = 0; i < method->parameters.size(); ++i) {
            if (method->parameters[i].id == text.substr(dot + 1)) return {*method, i};
        }
    }
    fail("parameters", wanted, "'" + text + "'");
}

/// The values of a dict with full names of parameters as keys. Those of other methods are checked, but have no
/// effect.
Parameters checked_parameters(const Deformer& deformer, const py::object& parameters) {
    if (parameters.is_none()) return {};
    if (!py::isinstance<py::dict>(parameters)) {
        fail("parameters", "None or a dict of values by names such as METHOD.PARAMETER",
             describe(parameters));
    }
    const MethodInfo* const mixed = deformer.mixed_method();
    Parameters values{default_parameters(deformer.method()), {}};
    if (mixed != nullptr) values.of_mix = default_parameters(*mixed);
    for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(parameters)) {
        const auto [method, index] = checked_parameter_name(name);
        const double number =
            checked_parameter(value, method.parameters[index], "parameters", name.cast<std::string>());
        if (method == deformer.method()) values.of_method[index] = number;
        if (mixed != nullptr && method == *mixed) values.of_mix[index] = number;
    }
    return values;
}

void check_bone_count(std::span<const Affine<float>> bone_transforms, std::size_t least) {
    if (bone_transforms.size() >= least) return;
    fail("bone_transforms", "at least " + std::to_string(least) + " bones",
         std::to_string(bone_transforms.size()));
}

std::vector<Quat<float>> checked_turns(const py::object& turns) {
    std::vector<Quat<float>> result;
    if (turns.is_none()) return result;
    const auto rows = checked_rows<float>(turns, "turns", 4, "None or float32 [bones, 4]");
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        const float* const row = rows.data(i, 0);
        check_finite(row, 4, "turns", i);
        result.emplace_back(row[0], row[1], row[2], row[3]);
    }
    return result;
}

}  // namespace

std::vector<Affine<float>> checked_bones(const py::object& bone_transforms, std::size_t least) {
    std::vector<Affine<float>> bones = checked_affines(bone_transforms, "bone_transforms");
    check_bone_count(bones, least);
    return bones;
}

DeformArguments checked_deform(const Deformer& deformer, const py::object& bone_transforms,
                               const py::object& threads, const py::object& bones_from_model,
                               const py::object& rest_inverses, const py::object& parameters,
                               const py::object& parents, const py::object& turns) {
    DeformArguments arguments;
    arguments.bones = rest_inverses.is_none() ? checked_affines(bone_transforms, "bone_transforms")
                                              : posed_from_rest(bone_transforms, rest_inverses);
    check_bone_count(arguments.bones, deformer.bone_count());
    DeformOptions& options = arguments.options;
    options.threads = checked_threads(threads);
    arguments.values = checked_parameters(deformer, parameters);
    options.parameters = arguments.values.of_method;
    options.mix_parameters = arguments.values.of_mix;
    if (!parents.is_none()) {
        const auto of_bones = checked<std::int32_t>(parents, "parents", 1, "int32 [bones]");
        arguments.rotations = continued_rotations(as_span(of_bones), arguments.bones, checked_turns(turns));
        arguments.pose.rotations = arguments.rotations;
    }
    arguments.pose.posed_from_rest = arguments.bones;
    arguments.pose.bones_from_model = checked_affine(bones_from_model, "bones_from_model");
    check_space(arguments.pose.bones_from_model);
    return arguments;
}

namespace {

py::array_t<float> deform(const Timed<Deformer>& deformer, const ArrayLike& bone_transforms, const Out& out,
                          const Threads& threads, const OptionalArrayLike& bones_from_model,
                          const OptionalArrayLike& rest_inverses, const ParameterValues& parameters,
                          const OptionalArrayLike& parents, const OptionalArrayLike& turns) {
    const DeformArguments arguments = checked_deform(deformer, bone_transforms, threads, bones_from_model,
                                                     rest_inverses, parameters, parents, turns);
    py::array_t<float> points = checked_out(out, deformer.vertex_count());
    const auto to = as_points_to_write(points);
    deformer.call([&] { return deformer.deform(arguments.pose, arguments.options, to); });
    return points;
}

void set_rest_points(Timed<Deformer>& deformer, const ArrayLike& rest_points) {
    const auto points = checked_points(rest_points, "rest_points");
    // May have to wait for another thread's deformation.
    Status status{};
    without_gil([&] { status = deformer.set_rest_points(as_points(points)); });
    check_rest_points(status, points, deformer.vertex_count());
}

}  // namespace

/// An argument of Deformer.
void bind_stage(py::module_& /*m*/, sinew::Mix) {}

void bind_deformer(py::module_& m) {
    py::class_<Binding>(m, "Binding",
                        R"(A mesh bound to bones. Immutable; the deformers made from it share its memory.

Can be pickled: the bound mesh, with normalised weights.)")
        .def(py::init(&make_binding), "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
             "influence_weights"_a, "rest_bones"_a = py::none(), "vertex_data"_a = py::none(),
             R"(rest_points: float32 [vertices, 3], model space.
influence_offsets: int32 [vertices + 1], the first influence of each vertex, then the end.
influence_bones: int32 [influences].
influence_weights: float32 [influences], >= 0, any sum (they are normalised).
rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], orthonormal, Y along the bone, in the space of the bone
    transforms. Read by sbs, and by other rigid methods where a bone is scaled. None: identity.
vertex_data: a dict of the vertex data of methods, float32 [vertices, Method.vertex_floats] by the method's
    name: {"cor": sinew.centres_of_rotation(...)}. A Deformer of such a method needs it. None in its place asks
    for linear blending: {"cor": None}.

At most 2^31 - 1 vertices and influences, 65,536 influences for a vertex, 1,048,576 bones.)")
        .def_property_readonly("vertex_count", &Binding::vertex_count, kVertexCount)
        .def_property_readonly("influence_count", &Binding::influence_count, kInfluenceCount)
        .def_property_readonly("bone_count", &Binding::bone_count, kBoneCount)
        .def("__repr__", [](const Binding& binding) { return "<sinew.Binding: " + counts_of(binding); })
        .def(py::pickle([](const Binding& binding) { return mesh_state(binding.unpack()); },
                        [](const py::object& state) { return Binding(arrays_of_state(state).data(true)); }));

    py::class_<Timed<Deformer>>(m, "Deformer",
                                R"(A binding and a method, ready to deform any pose.

Can be pickled, with its current rest points and its own binding.)")
        .def(py::init(&make_deformer_of), "binding"_a, "method"_a = "lbs", "mix"_a = py::none(),
             R"(binding: a Binding; not copied.
method: the name of one of sinew.methods().
mix: None, or (name of another method, weights): weights float32 [vertices] are the share of the other method
    at each vertex, from 0 (none) to 1 (all); clamped. This is the stage `mix`.)")
        .def(py::init(&make_deformer), "rest_points"_a, "influence_offsets"_a, "influence_bones"_a,
             "influence_weights"_a, "method"_a = "lbs", "rest_bones"_a = py::none(),
             "vertex_data"_a = py::none(), "Constructs its own binding, from the arguments of Binding.")
        .def_property_readonly(
            "method", [](const Timed<Deformer>& deformer) { return std::string(deformer.method().name); },
            "The name of the method.")
        .def_property_readonly(
            "mixed_method",
            [](const Timed<Deformer>& deformer) -> std::optional<std::string> {
                const MethodInfo* const method = deformer.mixed_method();
                if (method == nullptr) return std::nullopt;
                return std::string(method->name);
            },
            "The name of the method that `mix` adds, or None.")
        .def_property_readonly("vertex_count", &Deformer::vertex_count, kVertexCount)
        .def_property_readonly("influence_count", &Deformer::influence_count, kInfluenceCount)
        .def_property_readonly("bone_count", &Deformer::bone_count, kBoneCount)
        .def("__repr__", &text_of_deformer)
        .def(py::pickle([](const Timed<Deformer>& deformer) { return state_of(deformer); },
                        &deformer_of_state))
        .def(
            "set_rest_points", &set_rest_points, "rest_points"_a,
            R"(Sets the rest points of this deformer alone, float32 [vertices, 3], such as when shape keys change.
Other threads may deform meanwhile: each of their results has either the old points or the new ones.)")
        .def("deform", &deform, "bone_transforms"_a, "out"_a = py::none(), "threads"_a = py::none(),
             "bones_from_model"_a = py::none(), "rest_inverses"_a = py::none(), "parameters"_a = py::none(),
             "parents"_a = py::none(), "turns"_a = py::none(),
             R"(The deformed points, float32 [vertices, 3], model space.

bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest; a fourth row is not read.
bones_from_model: float32 [4, 4] or [3, 4], maps model space to the space of the bone transforms, in which the
    bones are blended; the result is mapped back. None: the same space.
rest_inverses: float64 [bones, 4, 4] or [bones, 3, 4]. If given, bone_transforms are the posed bones, and each
    is multiplied by the inverse of its rest transform, in double.
parameters: a dict of values of methods' parameters by their full names, METHOD.PARAMETER, as described by
    Parameter; missing ones have their defaults. Parameters of methods that the deformer does not use have no
    effect.
parents: int32 [bones], the parent of each bone, which precedes it, -1 for none: where the parameter `signs` is
    "hierarchy", rotations add up along chains, beyond half a turn. None: each bone turns the shorter way.
turns: float32 [bones, 4] or fewer bones, the rotation of each against its parent in the space of the bones, as
    its channels give it: a unit quaternion (w, x, y, z) whose sign says whether the bone went the longer way. 0:
    unknown. One that is over 5 degrees from the bone has no effect, nor has any without `parents`.

A vertex without influences is not moved.)");
}

}  // namespace sinew::bindings
