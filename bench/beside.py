# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures playback while a precomputation runs: python bench/beside.py [--name NAME]

Frames of bench/frames.py at 24 and 60 a second, and as fast as they come: for some seconds alone, then beside
a computation for another mesh, and so on, in one process.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator

import common
import frames
import precompute
import sinew

CASES = (frames.Case(100_000, normals=True), frames.Case(characters=50, bones=50, normals=True))
RATES = {"24/s": 1 / 24, "60/s": 1 / 60, "free": 0.0}
SECONDS = 3.0


def play(scene: frames.Scene, numbers: Iterator[int], period: float) -> list[float]:
    """Seconds from a frame to the next one, of one frame."""
    began = time.perf_counter()
    scene.run([next(numbers)])
    time.sleep(max(0.0, period - (time.perf_counter() - began)))
    return [time.perf_counter() - began]


def measure(scene: frames.Scene, start: Callable[[], sinew.Precomputation], runs: int, period: float) -> dict:
    """Seconds from frame to frame beside it and alone, and the frame rate beside it over that alone: of each
    run the one beside it over that before and after, and of these the median."""
    numbers = itertools.cycle(range(1, frames.FRAMES + 1))

    def block(run: sinew.Precomputation | None = None) -> list[float]:
        times, end = [], time.perf_counter() + SECONDS
        while time.perf_counter() < end and not (run is not None and run.has_ended):
            times += play(scene, numbers, period)
        return times

    block()
    alone, beside = [block()], []
    for _run in range(runs):
        beside.append(block(start()))
        alone.append(block())
    rates = [
        statistics.fmean(before + after) / statistics.fmean(between)
        for before, between, after in zip(alone, beside, alone[1:], strict=False)
    ]
    times = {
        name: common.spread([*itertools.chain(*blocks)])
        for name, blocks in (("beside", beside), ("alone", alone))
    }
    return times | {"rate": statistics.median(rates)}


def main() -> None:
    parser = common.options(__doc__, "")
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
        say(f"{'frame rate beside it / alone':38}{'rate':>6}{'milliseconds, medians':>28}")
        for case in CASES:
            scene = frames.Scene(case, leave_small=False)
            scene.switch(on=True)
            for (method, start), (rate, period) in itertools.product(starts.items(), RATES.items()):
                name = f"{case.name}, {method}, {rate}"
                found = results[name] = measure(scene, start, arguments.runs, period)
                medians = " / ".join(f"{found[when]['median'] * 1e3:.2f}" for when in ("beside", "alone"))
                say(f"{name:38}{found['rate']:6.2f}{medians:>28}")
    if arguments.name:
        common.write(arguments.name, machine=facts, results=results)


if __name__ == "__main__":
    with common.registered():
        main()
