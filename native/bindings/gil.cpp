// SPDX-License-Identifier: GPL-3.0-or-later
#include "gil.h"

#include <chrono>
#include <thread>

namespace sinew::bindings {

void take_gil_back(PyThreadState* state) noexcept {
    try {
        PyEval_RestoreThread(state);
    } catch (...) {
        // The end of this thread, which would be that of the process as soon as this block is left. Python 3.14
        // and later let such a thread hang, too.
        for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
}

}  // namespace sinew::bindings
