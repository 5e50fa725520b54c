// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace sinew {

/// How often the process was forked on the way to this one since the library was loaded. A child has none of its
/// parent's threads, so what they were doing stays undone in it.
[[nodiscard]] std::uint32_t forks() noexcept;

}  // namespace sinew
