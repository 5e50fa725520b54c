// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

#include "sinew/export.h"

namespace sinew {

/// Threads that this machine runs at once; at least 1.
[[nodiscard]] SINEW_EXPORT std::size_t hardware_threads() noexcept;

/// Calls `work(begin, end)` on chunks of `chunk` indices or fewer that cover [0, count), on up to `threads`
/// threads, the caller one of them, and returns when all are done. One call at a time uses the pool; a second
/// one made meanwhile runs on its caller alone.
///
/// Where work throws, on whatever thread, the first exception is thrown here once no thread is at work any more;
/// some chunks may then not have been called.
///
/// The threads are Sinew's own, started at first use and kept: Blender's scheduler is not touched, so a
/// frame handler can wait here without keeping one of Blender's workers.
SINEW_EXPORT void parallel_for(std::size_t count, std::size_t threads,
                               const std::function<void(std::size_t, std::size_t)>& work,
                               std::size_t chunk = 4096);

/// Ends the threads of parallel_for() and returns when they are gone; the next call starts others. For a host that
/// unloads the library, which must call this first. Waits for calls that run. Not to be called by their work.
SINEW_EXPORT void end_threads() noexcept;

}  // namespace sinew
