// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace sinew::bindings {

/// Takes back the GIL that PyEval_SaveThread() gave away. Never returns where Python ends meanwhile: it then ends
/// threads that ask for the GIL, before 3.14 by unwinding their stack, which no destructor on the way takes.
void take_gil_back(PyThreadState* state) noexcept;

/// work() without the GIL. It may throw, and must not touch what is Python's.
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
