// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/base/job.h"

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "sinew/base/thread_pool.h"

#if defined(_WIN32)
#include <windows.h>
#elif defined(__APPLE__)
#include <pthread/qos.h>
#elif defined(__linux__)
#include <sys/resource.h>
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
    // On Linux of this thread alone, which then gets half of another thread's share. No less: on a busy machine a
    // batch waits for it.
    setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + 3);
#endif
}

/// Starts a thread. Returns false if the system refuses.
template <class Run>
bool start(std::thread& thread, const Run& run) {
    try {
        thread = std::thread([run] {
            give_way();
            run();
        });
    } catch (const std::system_error&) {
        return false;
    }
    return true;
}

}  // namespace

Job::Job(std::size_t threads, Work work)
    : threads_(threads > 0 ? threads : hardware_threads()), work_(std::move(work)) {
    if (!start(thread_, [this] { run(); })) run();
}

Job::~Job() {
    cancel();
    if (thread_.joinable()) thread_.join();
}

void Job::run() noexcept {
    try {
        work_(*this);
    } catch (...) {
        error_ = std::current_exception();
    }
    const std::scoped_lock lock(mutex_);
    has_ended_ = true;
    ended_.notify_all();
}

bool Job::wait_for(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    if (!ended_.wait_for(lock, time, [this] { return has_ended_; })) return false;
    if (error_) std::rethrow_exception(error_);
    return true;
}

bool Job::go_on(double done) noexcept {
    double before = progress();
    while (before < done && !done_.compare_exchange_weak(before, done, std::memory_order_relaxed)) {
    }
    return !is_cancelled_.load(std::memory_order_relaxed);
}

void Job::for_each(std::size_t count, std::size_t chunk,
                   const std::function<void(std::size_t, std::size_t)>& work) {
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::exception_ptr error;
    const auto take_chunks = [&] {
        try {
            while (!is_cancelled_.load(std::memory_order_relaxed)) {
                const std::size_t begin = next.fetch_add(chunk, std::memory_order_relaxed);
                if (begin >= count) return;
                work(begin, std::min(begin + chunk, count));
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
        if (!start(helpers[i], take_chunks)) break;
    }
    take_chunks();
    for (std::thread& helper : helpers) {
        if (helper.joinable()) helper.join();
    }
    if (error) std::rethrow_exception(error);
}

}  // namespace sinew
