// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

namespace sinew {

/// How a precomputation runs. All of them take this.
struct PrecomputeOptions {
    /// 0: as many as help.
    std::size_t threads = 0;
    /// Called now and then, on the calling thread alone, with the share that is done, 0 to 1. False cancels; what it
    /// throws comes through.
    std::function<bool(double)> progress;
    /// By the definition itself, slowly and with more to keep: for tests.
    bool exact = false;
};

}  // namespace sinew
