// SPDX-License-Identifier: GPL-3.0-or-later
// Protects jobs: every index once, exceptions, cancelling at any moment, forks.
#include "sinew/base/job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "sinew/base/thread_pool.h"

#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace sinew {
namespace {

constexpr std::chrono::seconds kPatience{60};

/// Works until it is cancelled.
void work_on(Job& job) {
    while (job.report_progress(0.5)) std::this_thread::yield();
}

TEST(Job, covers_every_index_exactly_once) {
    for (const std::size_t count : {0, 1, 63, 64, 65, 10000}) {
        for (const std::size_t threads : {0, 1, 3}) {
            std::vector<int> visits(count, 0);
            Job job(threads);
            job.for_each(count, 64, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) ++visits[i];
            });
            EXPECT_TRUE(std::ranges::all_of(visits, [](int n) { return n == 1; }))
                << count << " on " << threads;
        }
    }
}

TEST(Job, progress_never_falls) {
    Job job;
    for (const double done : {0.2, 0.6, 0.4}) EXPECT_TRUE(job.report_progress(done));
    EXPECT_EQ(job.progress(), 0.6);
    job.cancel();
    EXPECT_FALSE(job.report_progress(0.7));
}

TEST(Job, takes_no_chunk_once_it_was_cancelled) {
    Job job(3);
    std::atomic<int> chunks{0};
    job.for_each(100000, 1, [&](std::size_t, std::size_t) {
        job.cancel();
        ++chunks;
    });
    EXPECT_LE(chunks, 3);
}

TEST(Job, throws_what_a_chunk_threw) {
    Job job(3);
    const auto work = [](std::size_t begin, std::size_t) {
        if (begin == 500) throw std::runtime_error("enough");
    };
    EXPECT_THROW(job.for_each(1000, 1, work), std::runtime_error);
}

TEST(Job, rests_as_long_as_it_works_where_frames_are_deformed) {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kChunk{5};
    constexpr int kChunks = 10;
    Job job(1, true);
    const auto began = Clock::now();
    job.for_each(kChunks, 1, [&](std::size_t, std::size_t) {
        parallel_for(1, 1, [](std::size_t, std::size_t) {});
        std::this_thread::sleep_for(kChunk);
    });
    EXPECT_GE(Clock::now() - began, 2 * kChunks * kChunk);
}

TEST(BackgroundJob, says_when_it_has_ended) {
    std::atomic<bool> may_end{false};
    std::thread::id thread;
    const BackgroundJob background(2, true, [&](Job& job) {
        thread = std::this_thread::get_id();
        job.report_progress(0.25);
        while (!may_end) std::this_thread::yield();
    });
    EXPECT_FALSE(background.wait_for(std::chrono::milliseconds(1)));
    EXPECT_FALSE(background.has_ended());
    may_end = true;
    ASSERT_TRUE(background.wait_for(kPatience));
    EXPECT_TRUE(background.has_ended());
    EXPECT_EQ(background.progress(), 0.25);
    EXPECT_NE(thread, std::this_thread::get_id());
    background.rethrow();
}

TEST(BackgroundJob, leaves_the_threads_of_parallel_for_to_frames) {
    std::atomic<bool> works{false};
    const BackgroundJob background(2, true, [&](Job& job) {
        job.for_each(1u << 30, 1, [&](std::size_t, std::size_t) { works = true; });
    });
    while (!works) std::this_thread::yield();
    std::atomic<int> inside{0};
    parallel_for(2 * 4096, 2, [&](std::size_t, std::size_t) {
        ++inside;
        // Waits for ever if no other thread comes.
        while (inside < 2) std::this_thread::yield();
    });
    EXPECT_EQ(inside, 2);
}

TEST(BackgroundJob, keeps_what_its_work_threw) {
    const BackgroundJob background(1, true, [](Job&) { throw std::runtime_error("enough"); });
    ASSERT_TRUE(background.wait_for(kPatience));
    EXPECT_THROW(background.rethrow(), std::runtime_error);
    EXPECT_THROW(background.rethrow(), std::runtime_error);
}

TEST(BackgroundJob, ends_when_it_is_cancelled_and_when_it_goes) {
    BackgroundJob cancelled(1, true, work_on);
    cancelled.cancel();
    EXPECT_TRUE(cancelled.wait_for(kPatience));
    std::atomic<bool> has_ended{false};
    {
        const BackgroundJob gone(1, true, [&](Job& job) {
            work_on(job);
            has_ended = true;
        });
    }
    EXPECT_TRUE(has_ended);
}

TEST(BackgroundJob, any_number_are_cancelled_by_any_thread) {
    for (int round = 0; round < 50; ++round) {
        std::array<std::optional<BackgroundJob>, 4> all;
        for (auto& each : all) {
            each.emplace(2, true,
                         [](Job& job) { job.for_each(1u << 30, 1, [](std::size_t, std::size_t) {}); });
        }
        std::thread other([&] {
            for (auto& each : all) each->cancel();
        });
        for (const auto& each : all) ASSERT_TRUE(each->wait_for(kPatience));
        other.join();
    }
}

#ifndef _WIN32
TEST(BackgroundJob, has_ended_in_a_forked_child) {
    std::optional<BackgroundJob> background;
    background.emplace(1, true, work_on);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        alarm(60);
        bool is_right = background->has_ended() && background->wait_for(kPatience);
        background->rethrow();
        background.reset();
// The thread sanitizer takes the next thread for the parent's, whose memory it reuses.
#ifndef __SANITIZE_THREAD__
        bool has_worked = false;
        background.emplace(1, true, [&](Job&) { has_worked = true; });
        is_right = is_right && background->wait_for(kPatience) && has_worked;
        background.reset();
#endif
        _exit(is_right ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
    EXPECT_FALSE(background->has_ended());
}
#endif

}  // namespace
}  // namespace sinew
