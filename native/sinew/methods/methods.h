// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <tuple>

#include "sinew/methods/cor/cor.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/ddm.h"
#endif
#include "sinew/methods/dib/dib.h"
#include "sinew/methods/dq/dq.h"
#include "sinew/methods/lbs/lbs.h"
#include "sinew/methods/log/log.h"
#include "sinew/methods/qv/qv.h"
#include "sinew/methods/sbs/sbs.h"
#include "sinew/methods/sdef/sdef.h"

namespace sinew {

/// The only list of methods, group by group, in the order of menus. Dispatch, bindings, tests, benchmarks,
/// command line and panel are generated from it.
///
/// deform_vertex() of each method gives the deformed vertex:
///
/// bones       one for each index in `influences`; the signs of their quaternions are free
/// influences  at least one; weights >= 0 with sum 1
///
/// If rotations cancel (sum below kDegenerateBlend), the heaviest influence alone moves the vertex, unless the
/// method says otherwise.
#if SINEW_WITH_DDM
using Methods = std::tuple<Lbs, Dq, Cor, Ddm, Sdef, Qv, Sbs, Log, IterativeDq>;
#else
using Methods = std::tuple<Lbs, Dq, Cor, Sdef, Qv, Sbs, Log, IterativeDq>;
#endif

inline constexpr std::size_t kMethodCount = std::tuple_size_v<Methods>;

/// Calls call(Method{}) for each method.
template <class Call>
constexpr void for_each_method(const Call& call) {
    std::apply([&call](const auto&... methods) { (call(methods), ...); }, Methods{});
}

/// The facts about each method, in the order of Methods.
inline constexpr std::array<MethodInfo, kMethodCount> kMethods =
    std::apply([](const auto&... methods) { return std::array{methods.info...}; }, Methods{});

static_assert(std::ranges::is_sorted(kMethods, {}, &MethodInfo::group),
              "methods of a group are one behind the other");

/// The largest number of parameters of any method.
inline constexpr std::size_t kMaxMethodParameters =
    std::ranges::max(kMethods, {}, [](const MethodInfo& method) {
        return method.parameters.size();
    }).parameters.size();

/// The index of `method` in the list; kMethodCount if it is not there.
[[nodiscard]] constexpr std::size_t index_of(const MethodInfo& method) noexcept {
    std::size_t index = 0;
    while (index < kMethodCount && !(kMethods[index] == method)) ++index;
    return index;
}

/// The method with this name, or nullopt.
[[nodiscard]] constexpr std::optional<MethodInfo> find_method(std::string_view name) noexcept {
    for (const MethodInfo& method : kMethods) {
        if (method.name == name) return method;
    }
    return std::nullopt;
}

}  // namespace sinew
