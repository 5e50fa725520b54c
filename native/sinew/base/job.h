// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "sinew/export.h"

namespace sinew {

/// Work that takes longer than a frame: how far it is, whether it was cancelled, and the threads that share it. These
/// are not those of parallel_for(), which frames need meanwhile.
class SINEW_EXPORT Job {
public:
    /// threads       at most so many share the work; 0: as many as useful
    /// low_priority  whether threads that it starts have a lower priority, and work half of the time while frames are
    ///               deformed; on a busy machine the work then takes much longer
    explicit Job(std::size_t threads = 0, bool low_priority = false) noexcept;

    // For any thread.

    /// The completed share, 0 to 1.
    [[nodiscard]] double progress() const noexcept { return done_.load(std::memory_order_relaxed); }
    /// Returns at once; the work ends a moment later.
    void cancel() noexcept { is_cancelled_.store(true, std::memory_order_relaxed); }

    // For the work, on any of its threads.

    /// Reports the completed share, and rests where the job has a low priority. Returns false once the job was cancelled.
    bool report_progress(double done) noexcept;
    /// Calls work(begin, end) for chunks of at most `chunk` indices that cover [0, count), and returns when all are
    /// done, or when the job was cancelled. With a low priority, half of its threads wait while frames are deformed. The
    /// first exception is rethrown; some chunks may then have been skipped.
    void for_each(std::size_t count, std::size_t chunk,
                  const std::function<void(std::size_t, std::size_t)>& work);

private:
    std::size_t threads_;
    bool low_priority_;
    std::atomic<double> done_{0.0};
    std::atomic<bool> is_cancelled_{false};
};

/// A job on a thread of its own, from the constructor on; where none can be started, the constructor does the work. A
/// forked child finds it ended.
class SINEW_EXPORT BackgroundJob {
public:
    BackgroundJob(std::size_t threads, bool low_priority, std::function<void(Job&)> work);
    /// Cancels, and waits until the threads have ended.
    ~BackgroundJob();
    BackgroundJob(const BackgroundJob&) = delete;
    BackgroundJob& operator=(const BackgroundJob&) = delete;

    [[nodiscard]] double progress() const noexcept;
    void cancel() noexcept;
    [[nodiscard]] bool has_ended() const noexcept;
    /// Waits until the work has ended, and no longer than this. Returns whether it has.
    [[nodiscard]] bool wait_for(std::chrono::milliseconds time) const;
    /// Throws what the work threw. Only once it has ended.
    void rethrow() const;

private:
    struct State;
    [[nodiscard]] bool is_of_this_process() const noexcept;

    std::unique_ptr<State> state_;
    std::uint32_t forks_;
};

}  // namespace sinew
