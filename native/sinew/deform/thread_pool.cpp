// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <system_error>
#include <thread>

#ifndef _WIN32
#include <pthread.h>
#endif

namespace sinew {
namespace {

using Work = std::function<void(std::size_t, std::size_t)>;

class Pool {
public:
    void run(std::size_t count, std::size_t threads, const Work& work, std::size_t piece) {
        // A flag, not a mutex: a nested call asks on the thread that has the turn, which std::mutex forbids.
        if (busy_.exchange(true, std::memory_order_acquire)) {
            work(0, count);
            return;
        }
        const std::size_t helpers = start_workers(threads - 1);
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            work_ = &work;
            count_ = count;
            piece_ = piece;
            next_.store(0, std::memory_order_relaxed);
            seats_ = helpers;
            running_ = helpers;
            ++job_;
        }
        wake_.notify_all();
        take_pieces(work, count, piece);
        std::unique_lock<std::mutex> lock(mutex_);
        // Workers that have not woken yet would find no pieces left: give their seats back.
        running_ -= seats_;
        seats_ = 0;
        done_.wait(lock, [this] { return running_ == 0; });
        work_ = nullptr;
        lock.unlock();
        busy_.store(false, std::memory_order_release);
    }

private:
    // The number of workers that can help, at most `wanted`: fewer where the system refuses threads.
    std::size_t start_workers(std::size_t wanted) {
        while (worker_count_ < wanted) {
            try {
                std::thread([this] { serve(); }).detach();
            } catch (const std::system_error&) {
                break;
            }
            ++worker_count_;
        }
        return std::min(worker_count_, wanted);
    }

    void serve() {
        std::uint64_t seen = 0;
        std::unique_lock<std::mutex> lock(mutex_);
        for (;;) {
            wake_.wait(lock, [&] { return job_ != seen && seats_ > 0; });
            seen = job_;
            --seats_;
            const Work& work = *work_;
            const std::size_t count = count_;
            const std::size_t piece = piece_;
            lock.unlock();
            take_pieces(work, count, piece);
            lock.lock();
            if (--running_ == 0) done_.notify_one();
        }
    }

    void take_pieces(const Work& work, std::size_t count, std::size_t piece) {
        for (;;) {
            const std::size_t begin = next_.fetch_add(piece, std::memory_order_relaxed);
            if (begin >= count) return;
            work(begin, std::min(begin + piece, count));
        }
    }

    std::atomic<bool> busy_{false};
    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable done_;
    const Work* work_ = nullptr;
    std::size_t count_ = 0;
    std::size_t piece_ = 1;
    std::atomic<std::size_t> next_{0};
    std::size_t seats_ = 0;
    std::size_t running_ = 0;
    std::size_t worker_count_ = 0;
    std::uint64_t job_ = 0;
};

// Never destroyed: at the end of a process its workers may still wait on it, and joining them from a
// library's static destructor can hang.
Pool* pool = nullptr;

Pool& the_pool() {
    static const bool once = [] {
        pool = new Pool;
#ifndef _WIN32
        // A forked child has none of its parent's threads: it starts over with a pool of its own.
        pthread_atfork(nullptr, nullptr, [] { pool = new Pool; });
#endif
        return true;
    }();
    static_cast<void>(once);
    return *pool;
}

}  // namespace

std::size_t hardware_threads() noexcept {
    return std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

void parallel_for(std::size_t count, std::size_t threads, const Work& work, std::size_t piece) {
    const std::size_t useful = std::min(threads, (count + piece - 1) / piece);
    if (useful <= 1) {
        if (count > 0) work(0, count);
    } else {
        the_pool().run(count, useful, work, piece);
    }
}

}  // namespace sinew
