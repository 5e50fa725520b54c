// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <utility>

#include "sinew/base/status.h"

namespace sinew::bindings {

/// Acquires the GIL that PyEval_SaveThread() released. Never returns if Python ends meanwhile: Python then ends
/// threads that request the GIL, before 3.14 by unwinding their stack, which no destructor on the way tolerates.
void take_gil_back(PyThreadState* state) noexcept;

/// Calls work() without the GIL. It may throw, but must not touch Python's objects.
template <class Work>
void without_gil(const Work& work) {
    PyThreadState* const state = PyEval_SaveThread();
    try {
        work();
    } catch (...) {
        take_gil_back(state);
        throw;
    }
    take_gil_back(state);
}

/// MemoryError without memory. Else ValueError: arguments are checked before a call, with better sentences, so this is
/// for what the checks do not know.
void raise_unless_ok(Status status);

/// An object whose calls release the GIL only if they take long enough: with many threads waiting for it, acquiring
/// it again takes longer than a short call. What a call takes depends on the method, the mesh, its settings and the
/// machine, so the call before tells.
template <class Object>
struct Timed : Object {
    Timed(Object&& object) noexcept
        : Object(std::move(object)) {}  // implicit, so that functions return either
    Timed(Timed&& other) noexcept : Object(std::move(other)) {}

    /// Calls work(), which returns a Status, and must neither throw nor touch Python's objects. Raises what the
    /// status says.
    template <class Work>
    void call(const Work& work) const {
        constexpr std::chrono::nanoseconds kLongestUnderLock{30'000};
        const auto timed = [&] {
            const auto start = std::chrono::steady_clock::now();
            raise_unless_ok(work());
            last_.store(std::chrono::steady_clock::now() - start, std::memory_order_relaxed);
        };
        last_.load(std::memory_order_relaxed) > kLongestUnderLock ? without_gil(timed) : timed();
    }

private:
    mutable std::atomic<std::chrono::nanoseconds> last_{std::chrono::nanoseconds::max()};
};

}  // namespace sinew::bindings
