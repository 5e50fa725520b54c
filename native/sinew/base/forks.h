// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "sinew/export.h"

namespace sinew {

/// How many forks lie between the process that loaded the library and this one. A forked child has none of its
/// parent's threads, so their unfinished work stays unfinished in the child.
[[nodiscard]] SINEW_EXPORT std::uint32_t forks() noexcept;

}  // namespace sinew
