// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "arrays.h"
#include "sinew/deformer.h"

namespace sinew::bindings {

/// The arguments for a mesh and its influences, and the arrays that BindData refers to.
struct MeshArguments {
    py::array_t<float> points;
    py::array_t<std::int32_t> offsets;
    py::array_t<std::int32_t> bones;
    py::array_t<float> weights;

    MeshArguments(const py::object& rest_points, const py::object& influence_offsets,
                  const py::object& influence_bones, const py::object& influence_weights);

    [[nodiscard]] BindData data() const {
        return {as_points(points), as_span(offsets), as_span(bones), as_span(weights)};
    }
};

/// The method with this name. ValueError that names `argument`; TypeError if it is no str.
MethodInfo checked_method(const py::object& method, const char* argument);

/// The argument `mix`, and the array that MixData refers to.
struct MixArguments {
    std::optional<MethodInfo> method;
    py::array_t<float> weights;

    [[nodiscard]] std::optional<MixData> data() const {
        if (!method) return std::nullopt;
        return MixData{*method, as_span(weights)};
    }
};

/// The argument None or (method, weights).
MixArguments checked_mix(const py::object& mix);

/// The values that DeformOptions::parameters and mix_parameters refer to.
struct Parameters {
    std::vector<double> of_method;
    std::vector<double> of_mix;
};

/// The pose and the options of a frame, and the data that they refer to.
struct DeformArguments {
    std::vector<Affine<float>> bones;
    Parameters values;
    std::vector<Quat<float>> rotations;  // empty without parents
    Pose pose;
    DeformOptions options;

    DeformArguments() = default;
    DeformArguments(DeformArguments&&) = default;  // pose and options refer to memory that does not move
    DeformArguments(const DeformArguments&) = delete;
};

/// The argument `bone_transforms`. ValueError for fewer bones.
std::vector<Affine<float>> checked_bones(const py::object& bone_transforms, std::size_t least);

/// The arguments of Deformer.deform, except for `out`.
DeformArguments checked_deform(const Deformer& deformer, const py::object& bone_transforms,
                               const py::object& threads, const py::object& bones_from_model,
                               const py::object& rest_inverses, const py::object& parameters,
                               const py::object& parents, const py::object& turns);

}  // namespace sinew::bindings
