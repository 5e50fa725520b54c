// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace sinew {

/// Work that takes longer than a frame. It runs on threads of its own that give way to all others, so that neither
/// the pool of parallel_for() nor a processor is missing where a frame is deformed meanwhile.
class Job {
public:
    using Work = std::function<void(Job&)>;

    /// Starts `work`, which at most `threads` threads share; 0: as many as useful.
    Job(std::size_t threads, Work work);
    /// Cancels, and waits until the threads have ended.
    ~Job();
    Job(const Job&) = delete;
    Job& operator=(const Job&) = delete;

    // For the thread that started it.

    /// The completed share, 0 to 1.
    [[nodiscard]] double progress() const noexcept { return done_.load(std::memory_order_relaxed); }
    /// Returns at once; the work ends a moment later.
    void cancel() noexcept { is_cancelled_.store(true, std::memory_order_relaxed); }
    /// Waits until the work has ended, and no longer than this. Returns whether it has. Throws what it threw.
    bool wait_for(std::chrono::milliseconds time);

    // For the work, on any of its threads.

    /// Reports the completed share. Returns false once the job was cancelled.
    bool go_on(double done) noexcept;
    /// Calls work(begin, end) for chunks of at most `chunk` indices that cover [0, count), and returns when all are
    /// done, or when the job was cancelled. The first exception is rethrown; some chunks may then have been skipped.
    void for_each(std::size_t count, std::size_t chunk,
                  const std::function<void(std::size_t, std::size_t)>& work);

private:
    void run() noexcept;

    std::size_t threads_;
    Work work_;
    std::atomic<double> done_{0.0};
    std::atomic<bool> is_cancelled_{false};
    std::mutex mutex_;
    std::condition_variable ended_;
    bool has_ended_ = false;
    std::exception_ptr error_;
    std::thread thread_;
};

}  // namespace sinew
