# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures playback while a precomputation runs: python bench/beside.py [--name NAME]

Frames of bench/frames.py at 24 a second, or as they come where they take longer, as Blender plays them:
beside a computation for another mesh, and then as many alone, in one process.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable, Iterator

import common
import frames
import precompute
import sinew

CASES = (frames.Case(100_000, normals=True), frames.Case(characters=50, bones=50, normals=True))
PERIOD, MOST_SECONDS = 1 / 24, 10.0


def play(scene: frames.Scene, numbers: Iterator[int]) -> list[float]:
    """Seconds from a frame to the next one, of one frame."""
    began = time.perf_counter()
    scene.run([next(numbers)])
    time.sleep(max(0.0, PERIOD - (time.perf_counter() - began)))
    return [time.perf_counter() - began]


def measure(scene: frames.Scene, start: Callable[[], sinew.Precomputation], runs: int) -> dict:
    """Seconds from frame to frame beside it and alone, and the frame rate beside it over that alone."""
    times: dict[str, list[float]] = {"beside": [], "alone": []}
    numbers = itertools.cycle(range(1, frames.FRAMES + 1))
    for _ in range(frames.BEFORE):
        play(scene, numbers)
    for _run in range(runs):
        run, end = start(), time.perf_counter() + MOST_SECONDS
        while not run.has_ended and time.perf_counter() < end:
            times["beside"] += play(scene, numbers)
        del run
        while len(times["alone"]) < len(times["beside"]):
            times["alone"] += play(scene, numbers)
    rate = sum(times["alone"]) / sum(times["beside"])
    return {name: common.spread(of) for name, of in times.items()} | {"rate": rate}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--name", help="writes bench/results/NAME.json")
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    versions = {"bpy": common.version_of("bpy"), "sinew": common.version_of("sinew-skinning")}
    facts = common.begin("playback beside a precomputation", **versions)
    points, triangles = precompute.plate()
    mesh = points, *precompute.influences(points, 10), triangles
    starts = {
        "cor": lambda: sinew.centres_of_rotation(*mesh, gives_way=True),
        "ddm": lambda: sinew.direct_delta_mush(*mesh, 0.2, gives_way=True),
    }
    results = {}
    with frames.quiet_blender() as say:
        say(f"{'frame rate beside it / alone':30}{'rate':>6}{'milliseconds, medians':>28}")
        for case in CASES:
            scene = frames.Scene(case, leave_small=False)
            scene.switch(on=True)
            for method, start in starts.items():
                name = f"{case.name}, {method}"
                found = results[name] = measure(scene, start, arguments.runs)
                medians = " / ".join(f"{found[when]['median'] * 1e3:.2f}" for when in ("beside", "alone"))
                say(f"{name:30}{found['rate']:6.2f}{medians:>28}")
    if arguments.name:
        common.write(arguments.name, machine=facts, results=results)


if __name__ == "__main__":
    with common.registered():
        main()
