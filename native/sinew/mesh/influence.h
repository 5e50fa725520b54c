// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace sinew {

/// The weight of one bone at one vertex.
template <class T>
struct Influence {
    std::int32_t bone;
    T weight;
};

/// The influence with the largest weight (the first, if several are equal). Requires at least one influence.
template <class T>
[[nodiscard]] const Influence<T>& heaviest(std::span<const Influence<T>> influences) noexcept {
    return *std::max_element(influences.begin(), influences.end(),
                             [](const auto& a, const auto& b) { return a.weight < b.weight; });
}

}  // namespace sinew
