// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the thread pool: every index once, exceptions, nested and concurrent calls, forks, the end of threads.
#include "sinew/base/thread_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#endif

#ifdef __SANITIZE_THREAD__
// The thread sanitizer ends a forked child that starts threads, unless this option says that it is intended.
extern "C" __attribute__((visibility("default"))) const char* __tsan_default_options() {
    return "die_after_fork=0";
}
#endif

namespace sinew {
namespace {

/// Whether parallel_for calls every index of [0, count) exactly once. Visits are plain integers: if two threads
/// get the same index, the thread sanitizer reports a race.
bool covers_once(std::size_t count, std::size_t threads) {
    std::vector<int> visits(count, 0);
    std::atomic<bool> inside{true};
    parallel_for(count, threads, [&](std::size_t begin, std::size_t end) {
        if (begin > end || end > count) {
            inside = false;
            return;
        }
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    return inside && std::all_of(visits.begin(), visits.end(), [](int n) { return n == 1; });
}

/// Returns once two threads have been inside one call at the same time; waits forever if no helper comes.
bool meets_a_helper() {
    std::atomic<int> inside{0};
    parallel_for(2 * 4096, 2, [&](std::size_t, std::size_t) {
        ++inside;
        while (inside < 2) std::this_thread::yield();
    });
    return inside == 2;
}

TEST(ParallelFor, covers_every_index_exactly_once) {
    for (const std::size_t count : {0, 1, 4095, 4096, 4097, 8191, 8192, 8193, 12288, 100000}) {
        for (const std::size_t threads : {0, 1, 2, 3, 8, 64}) {
            EXPECT_TRUE(covers_once(count, threads)) << count << " on " << threads;
        }
    }
}

TEST(ParallelFor, covers_again_and_again) {
    for (int round = 0; round < 300; ++round) {
        ASSERT_TRUE(covers_once(20000, static_cast<std::size_t>(2 + round % 5))) << round;
    }
}

TEST(ParallelFor, one_thread_is_the_caller) {
    const std::thread::id caller = std::this_thread::get_id();
    bool elsewhere = false;
    parallel_for(50000, 1, [&](std::size_t, std::size_t) {
        elsewhere = elsewhere || std::this_thread::get_id() != caller;
    });
    EXPECT_FALSE(elsewhere);
}

TEST(ParallelFor, uses_no_more_threads_than_told) {
    parallel_for(200000, 8, [](std::size_t, std::size_t) {});
    std::atomic<int> now{0};
    std::atomic<int> most{0};
    parallel_for(200000, 2, [&](std::size_t, std::size_t) {
        const int here = ++now;
        int seen = most;
        while (here > seen && !most.compare_exchange_weak(seen, here)) {
        }
        --now;
    });
    EXPECT_LE(most, 2);
}

TEST(ParallelFor, may_be_nested) {
    constexpr std::size_t kOuter = 5 * 4096;
    std::vector<int> visits(kOuter, 0);
    std::atomic<int> failures{0};
    parallel_for(kOuter, 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
        if (!covers_once(20000, 4)) ++failures;
    });
    EXPECT_EQ(failures, 0);
    EXPECT_TRUE(std::all_of(visits.begin(), visits.end(), [](int n) { return n == 1; }));
}

TEST(ParallelFor, may_be_called_from_many_threads_at_once) {
    std::atomic<int> failures{0};
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 6; ++caller) {
        callers.emplace_back([&failures] {
            for (int round = 0; round < 50; ++round) {
                if (!covers_once(20000, 3)) ++failures;
            }
        });
    }
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(failures, 0);
}

// Any thread may throw, caller or helper, and any number of them.
TEST(ParallelFor, hands_an_exception_to_its_caller_and_goes_on_working) {
    for (int round = 0; round < 50; ++round) {
        for (const std::size_t threads : {1, 2, 5}) {
            for (const std::size_t bad : {0, 10, 19}) {
                std::atomic<int> calls{0};
                const auto work = [&](std::size_t begin, std::size_t) {
                    ++calls;
                    if (begin == 4096 * bad || round % 2 == 1) throw std::out_of_range("chunk");
                };
                EXPECT_THROW(parallel_for(20 * 4096, threads, work), std::out_of_range)
                    << threads << " " << bad;
                EXPECT_LE(calls, 20);
            }
        }
        ASSERT_TRUE(covers_once(50000, 4));
    }
    EXPECT_TRUE(meets_a_helper());
}

// However many threads there are, and where another call has them.
TEST(ParallelFor, takes_chunks_of_any_size) {
    for (const std::size_t piece : {std::size_t{0}, std::size_t{1}, std::size_t{7}, ~std::size_t{0}}) {
        for (const std::size_t threads : {1, 3}) {
            std::atomic<std::size_t> largest{0};
            const auto covers = [&] {
                std::vector<int> visits(100, 0);
                parallel_for(
                    100, threads,
                    [&](std::size_t begin, std::size_t end) {
                        for (std::size_t i = begin; i < end; ++i) ++visits[i];
                        if (end - begin > largest) largest = end - begin;
                    },
                    piece);
                return std::all_of(visits.begin(), visits.end(), [](int n) { return n == 1; });
            };
            EXPECT_TRUE(covers()) << piece;
            std::atomic<bool> is_covered{true};
            parallel_for(2 * 4096, 2, [&](std::size_t, std::size_t) { is_covered = covers() && is_covered; });
            EXPECT_TRUE(is_covered) << piece;
            EXPECT_LE(largest, std::clamp<std::size_t>(piece, 1, 100));
        }
    }
}

TEST(EndThreads, is_followed_by_others) {
    for (int round = 0; round < 20; ++round) {
        end_threads();
        EXPECT_TRUE(meets_a_helper());
        EXPECT_TRUE(covers_once(50000, 5));
    }
    end_threads();
    end_threads();
}

TEST(EndThreads, waits_for_those_who_use_them) {
    std::atomic<bool> done{false};
    std::atomic<int> failures{0};
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 3; ++caller) {
        callers.emplace_back([&] {
            while (!done) {
                if (!covers_once(20000, 3)) ++failures;
            }
        });
    }
    for (int round = 0; round < 50; ++round) end_threads();
    done = true;
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(failures, 0);
}

#ifndef _WIN32
TEST(ParallelFor, works_in_a_forked_child) {
    ASSERT_TRUE(covers_once(50000, 4));
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        alarm(60);  // a child that waits for its parent's threads must fail instead of hanging
        _exit(covers_once(50000, 4) && meets_a_helper() && covers_once(50000, 4) ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
    EXPECT_TRUE(covers_once(50000, 4));
}
#endif

}  // namespace
}  // namespace sinew
