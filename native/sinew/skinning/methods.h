// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace sinew {

enum class MethodId { lbs, qv, dq };

/// A row of the table of methods.
struct Method {
    MethodId id;
    int number;                    // stored in .blend files: never changed, never used again
    std::string_view name;         // what programs say
    std::string_view label;        // what people read
    std::string_view description;  // one sentence: when to use it
    std::string_view needs;        // what it takes besides points, influences and bone transforms
};

/// THE table of methods: panel, command line, tests, bench and documentation read it here.
inline constexpr std::array kMethods{
    Method{MethodId::lbs, 1, "lbs", "Linear Blend",
           "Fast, smooth and what every engine plays; twisted and strongly bent joints lose volume",
           "nothing more"},
    Method{MethodId::qv, 2, "qv", "Quaternion-Vector",
           "Keeps twisted limbs round near the armature's origin; joints far from it drift off their bones",
           "nothing more; rest bones where bones are scaled"},
    Method{MethodId::dq, 3, "dq", "Dual Quaternion",
           "Keeps the volume of twisted joints anywhere on the body; strong bends bulge outwards",
           "nothing more; rest bones where bones are scaled"},
};

/// The row called `name`, or nothing.
[[nodiscard]] constexpr std::optional<Method> find_method(std::string_view name) noexcept {
    for (const Method& method : kMethods) {
        if (method.name == name) return method;
    }
    return std::nullopt;
}

}  // namespace sinew
