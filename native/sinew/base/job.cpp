// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/base/job.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sinew/base/fork_safe.h"
#include "sinew/base/thread_pool.h"

#if defined(_WIN32)
#include <windows.h>
#elif defined(__APPLE__)
#include <pthread/qos.h>
#elif defined(__linux__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace sinew {
namespace {

/// Lowers the priority of this thread. Where the system refuses, the job merely shares.
void give_way() noexcept {
#if defined(_WIN32)
    SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_BELOW_NORMAL);
#elif defined(__APPLE__)
    pthread_set_qos_class_self_np(QOS_CLASS_UTILITY, 0);
#elif defined(__linux__)
    // 0: this thread, which then gets 1/28 of another one's share. Not SCHED_IDLE: where frames leave no processor idle,
    // the work would never end. Relative to the main thread, as a thread inherits the value of the one that starts it.
    setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, static_cast<id_t>(getpid())) + 15);
#endif
}

/// Seconds of now(), since which this thread works without a rest.
thread_local double works_since = 0.0;

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Sleeps for as long as this thread has worked, where frames are deformed meanwhile: a thread of low priority still
/// delays those that Blender wakes many times a frame, and takes their share of memory and caches.
void make_room() {
    constexpr double kShortest = 0.001, kLongest = 0.05;
    const double worked = now() - works_since;
    if (worked < kShortest) return;
    if (is_in_use()) std::this_thread::sleep_for(std::chrono::duration<double>(std::min(worked, kLongest)));
    works_since = now();
}

/// Starts a thread. Returns false if the system refuses, or has no memory.
template <class Run>
bool start(std::thread& thread, bool low_priority, const Run& run) {
    try {
        thread = std::thread([low_priority, run] {
            if (low_priority) give_way();
            works_since = now();
            run();
        });
    } catch (const std::exception&) {
        return false;
    }
    return true;
}

}  // namespace

Job::Job(std::size_t threads, bool low_priority) noexcept
    : threads_(threads > 0 ? threads : hardware_threads()), low_priority_(low_priority) {}

bool Job::report_progress(double done) noexcept {
    double before = progress();
    while (before < done && !done_.compare_exchange_weak(before, done, std::memory_order_relaxed)) {
    }
    if (low_priority_) make_room();
    return !is_cancelled_.load(std::memory_order_relaxed);
}

void Job::for_each(std::size_t count, std::size_t chunk,
                   const std::function<void(std::size_t, std::size_t)>& work) {
    chunk = std::max<std::size_t>(chunk, 1);
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::exception_ptr error;
    // A thread that waits leaves its processor, and its share of caches, to Blender while frames are deformed.
    const auto take_chunks = [&](bool waits) {
        try {
            while (!is_cancelled_.load(std::memory_order_relaxed)) {
                if (waits && is_in_use() && next.load(std::memory_order_relaxed) < count) {
                    std::this_thread::sleep_for(std::chrono::milliseconds{20});
                    continue;
                }
                const std::size_t begin = next.fetch_add(chunk, std::memory_order_relaxed);
                if (begin >= count) return;
                work(begin, std::min(begin + chunk, count));
                if (low_priority_) make_room();
            }
        } catch (...) {
            next.store(count, std::memory_order_relaxed);
            const std::scoped_lock lock(mutex);
            if (!error) error = std::current_exception();
        }
    };
    std::vector<std::thread> helpers(std::min(threads_, (count + chunk - 1) / chunk));
    // This thread is one of them.
    for (std::size_t i = 1; i < helpers.size(); ++i) {
        const bool waits = low_priority_ && i >= (helpers.size() + 1) / 2;
        if (!start(helpers[i], low_priority_, [&take_chunks, waits] { take_chunks(waits); })) break;
    }
    take_chunks(false);
    for (std::thread& helper : helpers) {
        if (helper.joinable()) helper.join();
    }
    if (error) std::rethrow_exception(error);
}

struct BackgroundJob::State {
    Job job;
    std::function<void(Job&)> work;
    std::exception_ptr error;
    std::mutex mutex;
    std::condition_variable ended;
    std::atomic<bool> has_ended{false};
    std::thread thread;

    State(std::size_t threads, bool low_priority, std::function<void(Job&)> its_work)
        : job(threads, low_priority), work(std::move(its_work)) {}

    void run() noexcept {
        try {
            work(job);
        } catch (...) {
            error = std::current_exception();
        }
        const std::scoped_lock lock(mutex);
        has_ended.store(true, std::memory_order_release);
        ended.notify_all();
    }
};

BackgroundJob::BackgroundJob(std::size_t threads, bool low_priority, std::function<void(Job&)> work)
    : state_(std::make_unique<State>(threads, low_priority, std::move(work))), forks_(forks()) {
    const auto run = [state = state_.get()] { state->run(); };
    if (!start(state_->thread, low_priority, run)) run();
}

BackgroundJob::~BackgroundJob() {
    if (!is_of_this_process()) {
        // Its threads can not be joined, nor what they may have locked be destroyed.
        [[maybe_unused]] const State* const left = state_.release();
        return;
    }
    cancel();
    if (state_->thread.joinable()) state_->thread.join();
}

bool BackgroundJob::is_of_this_process() const noexcept { return forks_ == forks(); }

double BackgroundJob::progress() const noexcept { return state_->job.progress(); }

void BackgroundJob::cancel() noexcept { state_->job.cancel(); }

bool BackgroundJob::has_ended() const noexcept {
    return state_->has_ended.load(std::memory_order_acquire) || !is_of_this_process();
}

bool BackgroundJob::wait_for(std::chrono::milliseconds time) const {
    if (has_ended()) return true;
    std::unique_lock lock(state_->mutex);
    return state_->ended.wait_for(lock, time, [this] { return has_ended(); });
}

void BackgroundJob::rethrow() const {
    if (state_->has_ended.load(std::memory_order_acquire) && state_->error) {
        std::rethrow_exception(state_->error);
    }
}

}  // namespace sinew
