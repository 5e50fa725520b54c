// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled without exceptions (CMakeLists.txt), and so without gil.h, which has pybind11: then pthread_cleanup_push() is
// C's, to which the C library jumps before the unwinding of a thread reaches any C++. It unwinds by libgcc, which a
// module that has another C++ library within does not survive.
#include <Python.h>

#ifndef _WIN32
#include <pthread.h>
#include <unistd.h>
#endif

namespace sinew::bindings {

#ifdef _WIN32

// A thread that Python ends there is not unwound.
void take_gil_back(PyThreadState* state) noexcept { PyEval_RestoreThread(state); }

#else

namespace {

// In place of the end of this thread. Python 3.14 and later let such a thread hang, too.
void hang(void* /*unused*/) {
    for (;;) pause();
}

}  // namespace

void take_gil_back(PyThreadState* state) noexcept {
    pthread_cleanup_push(hang, nullptr);
    PyEval_RestoreThread(state);
    pthread_cleanup_pop(0);
}

#endif

}  // namespace sinew::bindings
