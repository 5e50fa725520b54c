// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

#include "sinew/export.h"

namespace sinew {

/// The number of threads that this machine runs at once; at least 1.
[[nodiscard]] SINEW_EXPORT std::size_t hardware_threads() noexcept;

/// `threads` as every function of the library takes it: at most this many; 0: as many as useful, which is one for
/// each `worth_a_thread` of `count`, and no more than the machine runs at once.
[[nodiscard]] inline std::size_t useful_threads(std::size_t threads, std::size_t count,
                                                std::size_t worth_a_thread) noexcept {
    return threads > 0 ? threads : std::min(hardware_threads(), 1 + count / worth_a_thread);
}

/// parallel_for(), for which this is compiled.
SINEW_EXPORT void run_chunks(std::size_t count, std::size_t threads,
                             const std::function<void(std::size_t, std::size_t)>& work, std::size_t chunk);

/// Calls work(begin, end) for chunks of at most `chunk` indices that cover [0, count), on at most `threads` threads
/// including the caller, and returns when all are done. 0 threads: one for each chunk, as far as the machine has
/// them. Only one call at a time uses the pool; a call made meanwhile runs on its caller's thread alone.
///
/// If work throws on any thread, the first exception is rethrown here once no thread is working any more; some
/// chunks may then have been skipped.
///
/// The threads are Sinew's own, started at first use and kept. Blender's scheduler is not involved, so a frame
/// handler can wait here without blocking one of Blender's workers.
template <class Work>
void parallel_for(std::size_t count, std::size_t threads, const Work& work, std::size_t chunk = 4096) {
    // Of a reference, so that it does not allocate.
    run_chunks(count, threads, std::cref(work), chunk);
}

/// Whether parallel_for() was called in the last tenth of a second, as it is while an animation plays.
[[nodiscard]] SINEW_EXPORT bool is_in_use() noexcept;

/// Ends the threads of parallel_for() and returns when they are gone. The next call of parallel_for() starts new
/// ones. A host that unloads the library must call this first. Waits for calls in progress. Must not be called
/// from their work.
SINEW_EXPORT void end_threads() noexcept;

}  // namespace sinew
