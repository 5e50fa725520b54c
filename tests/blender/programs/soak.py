# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs many frames in one Blender and checks what grows with them.

    python tests/blender/programs/soak.py [--frames 20000] [--threads 500]

Three characters play: one deformed within Blender's evaluation, one with an upstream modifier, one with
keyed shape keys. From time to time their methods change, heat maps and comparisons come and go, and Sinew is
removed and attached again. Finally many short-lived threads evaluate the scene one after the other, as
Blender's renders do. Prints memory, handlers, data-blocks, thread states that Python keeps, and the time of
a frame. Exit status 1 if one of them keeps growing.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import psutil
from sinew_addon.attach import attach
from sinew_addon.deform import session
from sinew_addon.features.compare import comparison

sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
import routes
import scenes
from python_threads import in_foreign_threads, thread_states

LENGTH = 24
SAMPLES = 20
# Allowed fluctuation of memory: MiB in all, and bytes per frame (a list of 20,000 floats is 8 per frame).
SLACK_MIB, SLACK_BYTES = 6.0, 160.0
# For what exists once per core, and for a few threads of a library.
SLACK_STATES = 16
# Times were measured on a machine that also ran other programs.
SLOWER = 2.0
FRAMES_FOR_TIMES = 5000


@dataclass
class Sample:
    """Counts after this many frames; milliseconds is the median of a frame since the previous sample."""

    frames: int
    mebibytes: float
    handlers: int
    data: int
    states: int
    milliseconds: float


def handler_count() -> int:
    lists = (getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers))
    return sum(len(each) for each in lists if isinstance(each, list))


def data_count() -> int:
    kinds = (prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION")
    # 5.0 lists all of them twice.
    return sum(len(getattr(bpy.data, kind)) for kind in kinds if kind != "all_ids")


def mebibytes() -> float:
    return psutil.Process().memory_info().rss / 2**20


def make_scene() -> list[bpy.types.Object]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    objects = [scenes.make_arm(name=name, bones=4, rings=60, sides=16)[0] for name in ("A", "B", "C")]
    objects[1].modifiers.new("Cast", "CAST").factor = 0.2
    objects[1].modifiers.move(1, 0)
    scenes.key_shape(objects[2])
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LENGTH
    for obj in objects:
        scenes.add_sinew(obj, "dq")
    return objects


def disturb(objects: list[bpy.types.Object], number: int) -> None:
    """Things that an artist does between playbacks, and undoes."""
    what, obj = number % 5, objects[number % len(objects)]
    if what == 0:
        for method in ("lbs", "qv", "dq"):
            obj.sinew.method = method
    elif what == 1:
        obj.sinew.heat = True
        bpy.context.scene.frame_set(3)
        obj.sinew.heat = False
    elif what == 2:
        comparison.start(bpy.context, [obj], ["lbs", "qv"], np.array((1.0, 0.0, 0.0)))
        bpy.context.scene.frame_set(5)
        comparison.end(bpy.context)
    elif what == 3:
        attach.remove(obj)
        session.forget()
        bpy.context.scene.frame_set(7)
        scenes.add_sinew(obj, "dq")
    else:
        obj.sinew.enabled = False
        bpy.context.scene.frame_set(9)
        obj.sinew.enabled = True


def play(objects: list[bpy.types.Object], frames: int, say: Callable[[str], None]) -> list[Sample]:
    scene, samples, times = bpy.context.scene, [], []
    every = max(1, frames // SAMPLES)
    for number in range(1, frames + 1):
        started = time.perf_counter()
        scene.frame_set(1 + number % LENGTH)
        times.append(time.perf_counter() - started)
        # Not before the first sample: what is created once then exists already.
        if number % max(1, every // 5) == 0:
            disturb(objects, number // max(1, every // 5))
        if number % every == 0:
            milliseconds = 1000.0 * statistics.median(times)
            sample = Sample(number, mebibytes(), handler_count(), data_count(), thread_states(), milliseconds)
            samples.append(sample)
            times.clear()
            say(line(sample))
    return samples


def line(sample: Sample) -> str:
    return (
        f"{sample.frames:8} {sample.mebibytes:9.1f} {sample.handlers:9} {sample.data:7} {sample.states:7} "
        f"{sample.milliseconds:9.3f}"
    )


HEADING = f"{'frames':>8} {'MiB':>9} {'handlers':>9} {'data':>7} {'states':>7} {'ms/frame':>9}"


def run_in_threads(count: int) -> int:
    """Evaluates the scene in `count` threads that Python did not start, one after the other. Returns how
    many more thread states Python keeps than before."""
    rigs = [obj for obj in bpy.data.objects if obj.type == "ARMATURE"]
    failures: list[str] = []

    def evaluate() -> None:
        try:
            for rig in rigs:
                bone = rig.pose.bones[-1]
                bone.location.x = 0.1 if bone.location.x == 0.0 else 0.0
            bpy.context.view_layer.update()
        except Exception as error:
            failures.append(repr(error))

    before = thread_states()
    in_foreign_threads(evaluate, count)
    if failures:
        raise RuntimeError(f"{len(failures)} threads failed: {failures[0]}")
    return thread_states() - before


def growing(samples: list[Sample]) -> list[str]:
    """A sentence for each count that grows between a quarter of the frames and the end."""
    first, last = samples[len(samples) // 4], samples[-1]
    frames = last.frames - first.frames
    found = []
    memory = last.mebibytes - first.mebibytes
    if memory > SLACK_MIB + frames * SLACK_BYTES / 2**20:
        found.append(f"memory: {memory:.1f} MiB more after {frames} frames")
    for name, slack in (("handlers", 0), ("data", 0), ("states", SLACK_STATES)):
        more = getattr(last, name) - getattr(first, name)
        if more > slack:
            found.append(f"{name}: {more} more after {frames} frames")
    half = len(samples) // 4
    early = statistics.median(s.milliseconds for s in samples[1 : half + 1])
    late = statistics.median(s.milliseconds for s in samples[-half:])
    if last.frames >= FRAMES_FOR_TIMES and late > SLOWER * early:
        found.append(f"time: {late:.2f} ms a frame at the end, {early:.2f} ms at the start")
    return found


def run(frames: int, threads: int, say: Callable[[str], None] = print) -> list[str]:
    """A sentence for each count that grows."""
    routes.force(routes.EVALUATION)
    try:
        objects = make_scene()
        say(HEADING)
        found = growing(play(objects, frames, say))
        kept = run_in_threads(threads)
        say(f"{threads} short threads: {kept} states of threads kept, {mebibytes():.1f} MiB")
        if kept > SLACK_STATES:
            found.append(f"states: {kept} kept after {threads} short threads")
    finally:
        routes.release()
    return found


def main() -> int:
    import sinew_addon

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=20000)
    parser.add_argument("--threads", type=int, default=500)
    args = parser.parse_args()
    if args.frames < SAMPLES:
        parser.error(f"--frames: at least {SAMPLES}")
    sinew_addon.register()
    try:
        found = run(args.frames, args.threads, lambda text: print(text, flush=True))
    finally:
        sinew_addon.unregister()
    for sentence in found:
        print(f"grows: {sentence}")
    print(f"Blender {bpy.app.version_string}: {'nothing grows' if not found else 'fails'}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
