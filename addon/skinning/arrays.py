# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares arrays and records of them; reads arrays from Blender's collections."""

import ctypes
import functools
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np


def are_equal(a: Any, b: Any) -> bool:
    """Whether both are None, or both have the same shape and numbers: arrays, records and tuples of them."""
    if a is b or a is None or b is None:
        return a is b
    if isinstance(a, np.ndarray):
        # As np.array_equal(), in less time.
        return a.shape == b.shape and bool((a == b).all())
    if isinstance(a, OfArrays):
        return a.equals(b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(are_equal, a, b))
    return bool(a == b)


@dataclass(frozen=True)
class OfArrays:
    """A record whose fields are arrays, tuples or other such records; or None. Fields that are not compared
    are made of something else."""

    def equals(self, other: Self) -> bool:
        names = _compared.get(type(self))
        if names is None:
            names = _compared[type(self)] = [each.name for each in fields(self) if each.compare]
        for name in () if self is other else names:
            if not are_equal(getattr(self, name), getattr(other, name)):
                return False
        return True


# The fields of each class, as finding them takes longer than comparing them.
_compared: dict[type, list[str]] = {}


def read(elements: Any, name: str, width: int = 1, kind: type = np.float32) -> np.ndarray:
    """Returns a property of all elements of one of Blender's collections, a copy: [elements], or
    [elements, width] for a property of several numbers.

    kind  that of Blender's own array, or reading takes many times as long
    """
    values: np.ndarray = np.empty((len(elements), width), kind)
    elements.foreach_get(name, values.ravel())
    return values if width > 1 else values[:, 0]


def memory_of(elements: Any, width: int = 1, kind: type = np.float32) -> np.ndarray | None:
    """Returns Blender's own array of an attribute's elements, in the shape of read(), without a copy. Valid
    until the mesh is evaluated again or changed. None without elements, or where they are not contiguous."""
    count = len(elements)
    if count == 0:
        return None
    first, last = elements[0].as_pointer(), elements[count - 1].as_pointer()
    if last - first != (count - 1) * width * np.dtype(kind).itemsize:
        return None
    return _array_at(first, (count, width) if width > 1 else (count,), kind)


@functools.lru_cache(maxsize=256)
def _array_at(address: int, shape: tuple[int, ...], kind: type) -> np.ndarray:
    """Cached, as Blender reuses the same memory for mesh after mesh, and the cache takes a tenth of the time
    of making the array."""
    memory = (ctypes.c_byte * (int(np.prod(shape)) * np.dtype(kind).itemsize)).from_address(address)
    return np.frombuffer(memoryview(memory), np.dtype(kind)).reshape(shape)
