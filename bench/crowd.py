# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a frame of many characters, each with an armature of its own.

python bench/crowd.py [--characters N] [--vertices N] [--drawn]: one line of JSON with microseconds of a
character: a frame by the Armature modifier with Preserve Volume, one by Sinew, which alternate; and how long
Sinew holds Python's lock. Run it by `taskset -c 0` for one processor, and with the PYTHONPATH of another
build for that one.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from functools import partial

import common
import frames


class Locked:
    """How long the calls of Blender's evaluation into Sinew take, but for the library's arithmetic, in which
    the lock is free."""

    def __init__(self) -> None:
        from sinew_addon.deform import bound, in_depsgraph
        from sinew_addon.skinning.skin_stack import SkinStack

        self.seconds = 0.0
        self._add(in_depsgraph, "deform", 1)
        self._add(SkinStack, "deform", -1)
        self._add(bound.Bound, "write_normals", -1)

    def _add(self, owner: object, name: str, sign: int) -> None:
        function = getattr(owner, name)

        def timed(*arguments: object, **named: object) -> object:
            start = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                self.seconds += sign * (time.perf_counter() - start)

        setattr(owner, name, timed)


def measure(case: frames.Case, seconds: float) -> dict[str, float]:
    scene = frames.Scene(case, leave_small=False)
    choices: dict[str, Callable[[], None]] = {
        who: partial(scene.switch, on=who == "sinew") for who in ("modifier", "sinew")
    }
    spreads = frames.alternate(scene, choices, seconds)
    locked, each = Locked(), []
    for number in range(1, frames.FRAMES):
        locked.seconds = 0.0
        scene.frame(number)
        each.append(locked.seconds)
    times = {f"{who}, {kind}": of[kind] for who, of in spreads.items() for kind in ("least", "median")}
    times["under the lock"] = statistics.median(each)
    return {name: round(1e6 * of / case.characters, 1) for name, of in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--characters", type=int, default=10)
    parser.add_argument("--vertices", type=int, default=13_380)
    parser.add_argument("--drawn", action="store_true", help="read the normals of all corners, too")
    options = parser.parse_args()
    case = frames.Case(options.vertices, characters=options.characters, bones=52, normals=options.drawn)
    with common.registered(), frames.quiet_blender() as say:
        say(json.dumps(measure(case, 4.0)))


if __name__ == "__main__":
    main()
