// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

#include "sinew/methods/method_info.h"

namespace sinew {

/// The parameter of methods that sum quaternions: which of its two quaternions stands for a rotation.
struct Signs {
    static constexpr std::string_view kChoices[] = {"blender", "hierarchy"};
    static constexpr Parameter kParameters[] = {
        {.id = "signs",
         .label = "Rotation Path",
         .description =
             "Which way a vertex turns between bones that are more than half a turn apart: the shorter "
             "one, as in Blender, or through the bones between them and as far as their own angles say, for "
             "chains that twist or coil",
         .unit = "",
         .kind = ParameterKind::choice,
         .choices = kChoices}};

    /// Whether quaternions are summed with the signs that they have: those of Pose::rotations. Else each
    /// has the sign that brings it nearer to the sum of those before it.
    ///
    /// values  of kParameters, or none
    [[nodiscard]] static constexpr bool are_kept(std::span<const double> values) noexcept {
        return !values.empty() && values[0] == 1.0;
    }

    /// values  of all parameters of `method`
    [[nodiscard]] static constexpr bool are_kept(const MethodInfo& method,
                                                 std::span<const double> values) noexcept {
        const auto found = std::ranges::find(method.parameters, kParameters[0].id, &Parameter::id);
        if (found == method.parameters.end()) return false;
        return values[static_cast<std::size_t>(found - method.parameters.begin())] == 1.0;
    }
};

}  // namespace sinew
