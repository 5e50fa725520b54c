// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdint>

#include "sinew/export.h"

namespace sinew {

/// How many forks lie between the process that loaded the library and this one. A forked child has none of its
/// parent's threads, so their unfinished work stays unfinished in the child.
[[nodiscard]] SINEW_EXPORT std::uint32_t forks() noexcept;

/// kBits bits that threads share and wait for. A forked child finds them all 0: it has none of the threads that
/// could clear what they had set, and would otherwise wait for them forever.
template <unsigned kBits>
class ForkSafeBits {
public:
    static constexpr std::uint32_t kAll = (std::uint32_t{1} << kBits) - 1;

    /// Replaces the bits by next(bits), and waits while both are equal. Returns the bits before.
    template <class Next>
    std::uint32_t change(const Next& next) noexcept {
        for (std::uint32_t stored = state_.load(std::memory_order_relaxed);;) {
            const std::uint32_t forked = forks() << kBits;
            const std::uint32_t bits = (stored & ~kAll) == forked ? stored & kAll : 0;
            if (const std::uint32_t after = next(bits); after == bits) {
                state_.wait(stored, std::memory_order_relaxed);
                stored = state_.load(std::memory_order_relaxed);
            } else if (state_.compare_exchange_weak(stored, forked | after, std::memory_order_acq_rel,
                                                    std::memory_order_relaxed)) {
                return bits;
            }
        }
    }

    void clear(std::uint32_t bits) noexcept {
        state_.fetch_and(~bits, std::memory_order_release);
        state_.notify_all();
    }

    /// Returns once none of `bits` is set. Only for a thread that has set another bit: before, the bits may be
    /// those of the parent process.
    void wait_until_clear(std::uint32_t bits) const noexcept {
        for (;;) {
            const std::uint32_t state = state_.load(std::memory_order_acquire);
            if ((state & bits) == 0) return;
            state_.wait(state, std::memory_order_relaxed);
        }
    }

private:
    std::atomic<std::uint32_t> state_{0};  // the bits, and above them forks()
};

/// A mutex for scratch that every call writes anew: a child that is forked during a call finds it unlocked.
class ForkSafeMutex {
public:
    void lock() noexcept {
        bits_.change([](std::uint32_t) { return std::uint32_t{1}; });
    }
    void unlock() noexcept { bits_.clear(1); }

private:
    ForkSafeBits<1> bits_;
};

}  // namespace sinew
