// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace sinew {

/// What a call of a frame returns. Unless it is `ok`, the call has written and changed nothing.
enum class [[nodiscard]] Status : std::uint8_t{
    ok,
    size,        // an argument has another number of elements than its object has vertices, normals or twists
    not_finite,  // a point is NaN or infinite, or a transform has no finite inverse
    memory,      // the system has no memory; only from calls whose header says that they allocate
};

}  // namespace sinew
