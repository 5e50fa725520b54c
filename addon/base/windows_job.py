# SPDX-License-Identifier: GPL-3.0-or-later
"""Has Windows end child processes with this one, even if it is killed; on Linux the child asks for that
itself.

A job object ends the processes assigned to it when its last handle is closed, which the system does for a
process that ends (Microsoft: JOBOBJECT_BASIC_LIMIT_INFORMATION, JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE).

A process can only be assigned once it exists. If this process is killed before that, the new one stays, even
suspended if CreateProcess was still making its first thread. A process that starts from a process in a job is
in the job from the beginning. So a batch puts itself into its job. A Blender with a window does not: what its
user opens from it, such as a web browser, must stay.
"""

import subprocess
import sys

if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes
    from functools import cache
    from typing import ClassVar

    _KILL_ON_JOB_CLOSE = 0x2000
    _EXTENDED_LIMIT_INFORMATION = 9

    class _BasicLimits(ctypes.Structure):
        _fields_: ClassVar = [
            ("per_process_user_time", ctypes.c_int64),
            ("per_job_user_time", ctypes.c_int64),
            ("flags", wintypes.DWORD),
            ("minimum_working_set", ctypes.c_size_t),
            ("maximum_working_set", ctypes.c_size_t),
            ("active_processes", wintypes.DWORD),
            ("affinity", ctypes.c_size_t),
            ("priority_class", wintypes.DWORD),
            ("scheduling_class", wintypes.DWORD),
        ]

    class _ExtendedLimits(ctypes.Structure):
        _fields_: ClassVar = [
            ("basic", _BasicLimits),
            ("io_counters", ctypes.c_uint64 * 6),
            ("memory_limits_and_peaks", ctypes.c_size_t * 4),
        ]

    @cache
    def _job() -> int | None:
        """Returns the job of this process's children, which is never closed; None where there can be none."""
        kernel = ctypes.WinDLL("kernel32", use_last_error=True)
        kernel.CreateJobObjectW.restype = wintypes.HANDLE
        kernel.CreateJobObjectW.argtypes = [wintypes.LPVOID, wintypes.LPCWSTR]
        kernel.SetInformationJobObject.argtypes = [
            *(wintypes.HANDLE, ctypes.c_int, wintypes.LPVOID, wintypes.DWORD)
        ]
        job = kernel.CreateJobObjectW(None, None)
        limits = _ExtendedLimits(basic=_BasicLimits(flags=_KILL_ON_JOB_CLOSE))
        if not job or not kernel.SetInformationJobObject(
            job, _EXTENDED_LIMIT_INFORMATION, ctypes.byref(limits), ctypes.sizeof(limits)
        ):
            return None
        return job

    def _assign(process: int) -> None:
        """process: a handle"""
        job = _job()
        if job is not None:
            kernel = ctypes.WinDLL("kernel32", use_last_error=True)
            kernel.AssignProcessToJobObject.argtypes = [wintypes.HANDLE, wintypes.HANDLE]
            kernel.AssignProcessToJobObject(job, process)

    def end_with_this_process(process: subprocess.Popen) -> None:
        _assign(int(process._handle))  # type: ignore[attr-defined]

    @cache
    def end_all_with_this_process() -> None:
        kernel = ctypes.WinDLL("kernel32", use_last_error=True)
        kernel.GetCurrentProcess.restype = wintypes.HANDLE
        _assign(kernel.GetCurrentProcess())

else:

    def end_with_this_process(process: subprocess.Popen) -> None:
        """Does nothing: on other systems the child asks for it, where it can (worker.py)."""

    def end_all_with_this_process() -> None:
        """Does nothing either."""
