# SPDX-License-Identifier: GPL-3.0-or-later
"""A small soak test; `./dev soak` runs more frames."""

from __future__ import annotations

import ctypes

import bpy
import soak
from soak import Sample


def test_nothing_grows():
    assert soak.run(frames=300, threads=60) == []


def test_what_grows_is_named():
    def samples(**grown: float) -> list[Sample]:
        start = {"mebibytes": 300.0, "handlers": 20, "data": 90, "states": 3, "milliseconds": 1.0}
        return [
            Sample(
                1000 * number, **{name: value + number * grown.get(name, 0) for name, value in start.items()}
            )
            for number in range(1, 21)
        ]

    assert soak.growing(samples()) == []
    for name, each in (
        ("mebibytes", 1.0),
        ("handlers", 1),
        ("data", 1),
        ("states", 10),
        ("milliseconds", 0.5),
    ):
        (sentence,) = soak.growing(samples(**{name: each}))
        assert sentence.startswith({"mebibytes": "memory", "milliseconds": "time"}.get(name, name))


def test_states_of_threads_are_counted():
    """A state that is never released remains, like those that Sinew once kept for Blender's threads."""
    kind = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
    callback = kind(lambda _argument: ctypes.pythonapi.PyGILState_Ensure() and None)
    library, before = ctypes.CDLL(None), soak.thread_states()
    for _number in range(3):
        thread = ctypes.c_ulong()
        library.pthread_create(ctypes.byref(thread), None, callback, None)
        library.pthread_join(thread, None)
    assert soak.thread_states() == before + 3


def test_data_and_handlers_are_counted():
    data, handlers = soak.data_count(), soak.handler_count()
    bpy.data.meshes.new("one")
    bpy.app.handlers.save_pre.append(print)
    try:
        assert (soak.data_count(), soak.handler_count()) == (data + 1, handlers + 1)
    finally:
        bpy.app.handlers.save_pre.remove(print)
