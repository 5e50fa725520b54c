// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

namespace sinew {

/// How a precomputation runs. All precomputations take this.
struct PrecomputeOptions {
    /// At most; 0: as many as useful.
    std::size_t threads = 0;
    /// Called from time to time, only on the calling thread, with the completed share, 0 to 1. If it returns
    /// false, the precomputation is cancelled. An exception that it throws is passed on.
    std::function<bool(double)> progress;
    /// Compute by the definition itself, which is slower and keeps more. For tests.
    bool exact = false;
};

}  // namespace sinew
