// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

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

}  // namespace sinew::bindings
