// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/base/thread_pool.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <new>
#include <thread>
#include <type_traits>

#ifdef _WIN32
#include <process.h>
#include <windows.h>
#else
#include <pthread.h>
#endif
#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

#include "sinew/base/fork_safe.h"

// Without a futex, as under mingw, this libstdc++'s std::atomic::wait compares the value before it locks the
// mutex that it sleeps under, and can miss a wake-up (docs/install.md).
#if defined(_GLIBCXX_RELEASE) && _GLIBCXX_RELEASE <= 12 && !defined(_GLIBCXX_HAVE_LINUX_FUTEX)
#error "std::atomic::wait of this libstdc++ can hang: use one of LLVM's libc++, such as zig's, or MSVC."
#endif

namespace sinew {
namespace {

using Work = std::function<void(std::size_t, std::size_t)>;

// With more threads, the memory is the bottleneck.
constexpr std::size_t kMaxThreads = 64;

// How long a thread spins for its next job before it sleeps. Waking a thread takes 5 to 50 us; the objects of a
// frame follow each other faster than that, and Blender's own threads lose next to nothing.
constexpr std::chrono::microseconds kSpin{50};

void pause() {
#if defined(__x86_64__) || defined(__i386__)
    _mm_pause();
#elif defined(__aarch64__) && defined(__GNUC__)
    asm volatile("yield");
#endif
}

/// Spins until `ready()` or until spinning longer is not worthwhile. Returns whether `ready()` became true.
template <class Ready>
bool spin_until(const Ready& ready) {
    const auto end = std::chrono::steady_clock::now() + kSpin;
    do {
        for (int i = 0; i < 32; ++i) {
            if (ready()) return true;
            pause();
        }
    } while (std::chrono::steady_clock::now() < end);
    return ready();
}

/// The chunks one after the other.
void run_alone(std::size_t count, const Work& work, std::size_t chunk) {
    for (std::size_t begin = 0; begin < count; begin += chunk) work(begin, std::min(begin + chunk, count));
}

/// A thread of the operating system. Not std::thread, because that allocates, and because its destructor would
/// terminate the process, as nobody joins the threads of the pool.
class SystemThread {
public:
    using Main = void (*)(std::size_t);

    /// Returns false if the system refuses to start a thread.
    bool start(Main main, std::size_t argument) noexcept {
        main_ = main;
        argument_ = argument;
#ifdef _WIN32
        handle_ = reinterpret_cast<HANDLE>(_beginthreadex(nullptr, 0, &run, this, 0, nullptr));
        return handle_ != nullptr;
#else
        return pthread_create(&handle_, nullptr, &run, this) == 0;
#endif
    }

    void join() noexcept {
#ifdef _WIN32
        WaitForSingleObject(handle_, INFINITE);
        CloseHandle(handle_);
#else
        pthread_join(handle_, nullptr);
#endif
    }

private:
#ifdef _WIN32
    static unsigned __stdcall run(void* self) {
        const auto* const thread = static_cast<const SystemThread*>(self);
        thread->main_(thread->argument_);
        return 0;
    }
    HANDLE handle_ = nullptr;
#else
    static void* run(void* self) {
        const auto* const thread = static_cast<const SystemThread*>(self);
        thread->main_(thread->argument_);
        return nullptr;
    }
    pthread_t handle_{};
#endif
    Main main_ = nullptr;
    std::size_t argument_ = 0;
};

class Pool {
public:
    void run(std::size_t count, std::size_t threads, const Work& work, std::size_t chunk) {
        // A flag instead of a mutex: in a nested call the same thread tries to lock again, which std::mutex
        // forbids.
        if (busy_.exchange(true, std::memory_order_acquire)) return run_alone(count, work, chunk);
        const auto helpers = static_cast<std::uint32_t>(start_workers(threads - 1));
        std::exception_ptr error;
        error_ = &error;
        failed_.store(false, std::memory_order_relaxed);
        work_ = &work;
        count_ = count;
        chunk_ = chunk;
        shares_ = helpers + 1;
        for (std::size_t share = 0; share < shares_; ++share) {
            next_[share].index.store(share_begin(share), std::memory_order_relaxed);
        }
        done_.store(0, std::memory_order_relaxed);
        const std::uint64_t job = (job_of(gate_.load(std::memory_order_relaxed)) + 1) << 32;
        gate_.store(job | helpers, std::memory_order_release);
        ring();

        take_chunks(0);
        // Workers that have not joined yet would find no chunks: withdraw their slots.
        const std::uint64_t unused = gate_.exchange(job, std::memory_order_acq_rel) & kSlots;
        const auto came = static_cast<std::uint32_t>(helpers - unused);
        const auto all_done = [this, came] { return done_.load(std::memory_order_acquire) == came; };
        if (!spin_until(all_done)) {
            for (std::uint32_t done = done_.load(std::memory_order_acquire); done != came;
                 done = done_.load(std::memory_order_acquire)) {
                done_.wait(done, std::memory_order_acquire);
            }
        }
        busy_.store(false, std::memory_order_release);
        if (error) std::rethrow_exception(error);
    }

    /// Joins the workers; the next call starts others.
    void end() noexcept {
        while (busy_.exchange(true, std::memory_order_acquire)) std::this_thread::yield();
        ending_.store(true, std::memory_order_relaxed);
        ring();
        for (std::size_t worker = 0; worker < worker_count_; ++worker) workers_[worker].join();
        worker_count_ = 0;
        ending_.store(false, std::memory_order_relaxed);
        busy_.store(false, std::memory_order_release);
    }

private:
    static constexpr std::uint64_t kSlots = 0xFFFFFFFF;

    static std::uint64_t job_of(std::uint64_t gate) { return gate >> 32; }

    void ring() {
        bell_.fetch_add(1, std::memory_order_release);
        bell_.notify_all();
    }

    // Starts workers. Returns how many can help, at most `wanted`: fewer if the system refuses threads.
    std::size_t start_workers(std::size_t wanted) noexcept;

    void serve(std::size_t self) {
        std::uint64_t last_job = 0;
        for (;;) {
            const std::uint32_t seen = bell_.load(std::memory_order_acquire);
            if (take_slot(last_job)) {
                take_chunks(self);
                // The caller may return as soon as this is visible, but the pool always exists.
                done_.fetch_add(1, std::memory_order_release);
                done_.notify_one();
            }
            if (ending_.load(std::memory_order_relaxed)) return;
            const auto rung = [this, seen] { return bell_.load(std::memory_order_acquire) != seen; };
            if (!spin_until(rung)) bell_.wait(seen, std::memory_order_acquire);
        }
    }

    /// Joins the job at the gate, at most once. The job's number in the gate ensures that no slot of a job that
    /// has ended is taken; while one is taken, the caller waits.
    bool take_slot(std::uint64_t& last_job) {
        std::uint64_t gate = gate_.load(std::memory_order_acquire);
        while ((gate & kSlots) > 0 && job_of(gate) != last_job) {
            if (gate_.compare_exchange_weak(gate, gate - 1, std::memory_order_acq_rel,
                                            std::memory_order_acquire)) {
                last_job = job_of(gate);
                return true;
            }
        }
        return false;
    }

    /// The first index of share `share` of the chunks.
    [[nodiscard]] std::size_t share_begin(std::size_t share) const {
        const std::size_t chunks = (count_ - 1) / chunk_ + 1;
        return std::min(chunks * share / shares_ * chunk_, count_);
    }

    /// Works first on the same share in every job, since what it reads and writes is still in this core's cache
    /// (with chunks assigned at random, two threads took 0.74 of the time of one, not 0.5), then on chunks that
    /// others have not taken. The first exception of all threads is kept for the caller, and ends the job.
    void take_chunks(std::size_t self) noexcept {
        try {
            for (std::size_t step = 0; step < shares_; ++step) {
                const std::size_t share = (self + step) % shares_;
                const std::size_t end = share_begin(share + 1);
                std::atomic<std::size_t>& next = next_[share].index;
                while (next.load(std::memory_order_relaxed) < end) {
                    const std::size_t begin = next.fetch_add(chunk_, std::memory_order_relaxed);
                    if (begin >= end) break;
                    if (failed_.load(std::memory_order_relaxed)) return;
                    (*work_)(begin, std::min(begin + chunk_, end));
                }
            }
        } catch (...) {
            if (!failed_.exchange(true, std::memory_order_relaxed)) *error_ = std::current_exception();
        }
    }

    struct alignas(64) Next {
        std::atomic<std::size_t> index{0};
    };

    std::atomic<bool> busy_{false};
    std::atomic<bool> ending_{false};
    const Work* work_ = nullptr;
    std::exception_ptr* error_ = nullptr;  // set by the first thread that failed
    std::atomic<bool> failed_{false};
    std::size_t count_ = 0;
    std::size_t chunk_ = 1;
    std::size_t shares_ = 1;
    std::size_t worker_count_ = 0;
    // On cache lines of their own, as all threads write them while they read the members above.
    alignas(64) std::atomic<std::uint64_t> gate_{0};  // number of the job, and its free slots
    std::atomic<std::uint32_t> bell_{0};              // changes with every job; workers sleep on it
    std::array<Next, kMaxThreads> next_{};            // first chunk of each share that no thread has taken
    alignas(64) std::atomic<std::uint32_t> done_{0};  // workers that have finished the job
    std::array<SystemThread, kMaxThreads> workers_{};
};

// Not allocated, and never destroyed: when a process ends, its workers may still wait on it, and joining them in
// a library's static destructor can hang.
constinit Pool pool;
static_assert(std::is_trivially_destructible_v<Pool>);

using Clock = std::chrono::steady_clock;

// When parallel_for() was called last, by any thread: ticks since the clock's epoch.
constinit std::atomic<Clock::rep> last_use{0};

std::size_t Pool::start_workers(std::size_t wanted) noexcept {
    while (worker_count_ < wanted) {
        const auto serve = [](std::size_t self) { pool.serve(self); };
        if (!workers_[worker_count_].start(serve, worker_count_ + 1)) break;
        ++worker_count_;
    }
    return std::min(worker_count_, wanted);
}

std::atomic<std::uint32_t> fork_count{0};

#ifndef _WIN32
// A forked child has none of its parent's threads: start over.
[[maybe_unused]] const int at_fork = pthread_atfork(nullptr, nullptr, [] {
    new (&pool) Pool;
    fork_count.fetch_add(1, std::memory_order_relaxed);
});
#endif

}  // namespace

std::uint32_t forks() noexcept { return fork_count.load(std::memory_order_relaxed); }

std::size_t hardware_threads() noexcept {
    // Querying the system takes 10 us, as long as deforming 5,000 vertices.
    static const std::size_t threads =
        std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMaxThreads);
    return threads;
}

void run_chunks(std::size_t count, std::size_t threads, const Work& work, std::size_t chunk) {
    last_use.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
    if (count == 0) return;
    chunk = std::clamp<std::size_t>(chunk, 1, count);
    const std::size_t useful =
        std::min({useful_threads(threads, count - 1, chunk), (count - 1) / chunk + 1, kMaxThreads});
    if (useful <= 1) return run_alone(count, work, chunk);
    pool.run(count, useful, work, chunk);
}

bool is_in_use() noexcept {
    constexpr std::chrono::milliseconds kFramesAreApart{100};
    const Clock::time_point last{Clock::duration(last_use.load(std::memory_order_relaxed))};
    return Clock::now() - last < kFramesAreApart;
}

void end_threads() noexcept { pool.end(); }

}  // namespace sinew
