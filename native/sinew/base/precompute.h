// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "sinew/base/job.h"
#include "sinew/base/precompute_options.h"

namespace sinew {

/// Runs make(job) as a Job, and reports its progress to options.progress on this thread. Returns what it returned;
/// nullopt if the job was cancelled.
template <class Result, class Make>
std::optional<Result> precompute(const PrecomputeOptions& options, const Make& make) {
    constexpr std::chrono::milliseconds kBetweenReports{10};
    const auto goes_on = [&](double done) { return !options.progress || options.progress(done); };
    if (!goes_on(0.0)) return std::nullopt;
    std::optional<Result> result;
    Job job(options.threads, [&](Job& of) { result = make(of); });
    double told = 0.0;
    while (!job.wait_for(kBetweenReports)) {
        if (const double done = job.progress(); done > told) {
            told = done;
            if (!goes_on(done)) return std::nullopt;
        }
    }
    return goes_on(1.0) ? std::move(result) : std::nullopt;
}

}  // namespace sinew
