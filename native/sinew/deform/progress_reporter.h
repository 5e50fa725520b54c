// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "sinew/deform/precompute_options.h"

namespace sinew {

/// Calls options.progress on the thread that constructed this object, and stores whether it cancelled.
class ProgressReporter {
public:
    explicit ProgressReporter(const PrecomputeOptions& options) : progress_(options.progress) {}

    /// Reports progress if called on the constructing thread. Returns false on any thread once the work was
    /// cancelled.
    bool go_on(double done) {
        if (progress_ && std::this_thread::get_id() == caller_ &&
            !cancelled_.load(std::memory_order_relaxed) && !progress_(done)) {
            cancelled_.store(true, std::memory_order_relaxed);
        }
        return !cancelled_.load(std::memory_order_relaxed);
    }

private:
    const std::function<bool(double)>& progress_;
    std::thread::id caller_ = std::this_thread::get_id();
    std::atomic<bool> cancelled_{false};
};

}  // namespace sinew
