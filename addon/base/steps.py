# SPDX-License-Identifier: GPL-3.0-or-later
"""Generators that yield their progress, 0 to 1, and return a result."""

from collections.abc import Callable, Generator
from contextlib import closing
from typing import TypeVar

from . import interrupt

Result = TypeVar("Result")


def result_of(
    steps: Generator[float, None, Result], show: Callable[[float], object] = lambda _done: None
) -> Result:
    """Runs a generator to its end, and returns its result; an interrupt ends it.

    show  is called with the progress
    """
    with closing(steps):
        while True:
            try:
                show(next(steps))
            except StopIteration as end:
                return end.value
            interrupt.check()


def as_part(
    steps: Generator[float, None, Result], start: float, share: float
) -> Generator[float, None, Result]:
    """Runs a generator as part of another: scales the progress that it yields, and returns its result."""
    with closing(steps):
        while True:
            try:
                done = next(steps)
            except StopIteration as end:
                return end.value
            yield start + share * done
