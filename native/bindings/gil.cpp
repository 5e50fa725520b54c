// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled without exceptions (CMakeLists.txt), and thus without gil.h, which includes pybind11.
// pthread_cleanup_push() is then the C version, to which the C library jumps before the unwinding of a thread
// reaches any C++ code. The C library unwinds with libgcc, which a module with another C++ standard library
// inside does not survive.
#include <Python.h>

#ifndef _WIN32
#include <pthread.h>
#include <unistd.h>
#endif

namespace sinew::bindings {

#ifdef _WIN32

// A thread that Python ends here is not unwound.
void take_gil_back(PyThreadState* state) noexcept { PyEval_RestoreThread(state); }

#else

namespace {

// Called instead of ending the thread. Python 3.14 and later let such a thread hang, too.
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
