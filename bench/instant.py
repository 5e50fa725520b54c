# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what an artist waits for who compares methods: flips, edits, undo, opening a file.

python bench/instant.py [--vertices N] [--without]: one line of JSON with least times in milliseconds, until
Blender and Sinew have evaluated it, of a tube with 52 bones; --without: the same without Sinew, a flip being
one of Preserve Volume.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import common
import frames

METHODS = ("lbs", "dq", "qv", "cor")
ROUNDS = 12
Step = Callable[[int], None]


def least(step: Step, rounds: int = ROUNDS, before: Callable[[], None] | None = None) -> float:
    """before: what is done before each step, and not timed"""
    times = []
    for number in range(rounds):
        if before is not None:
            before()
            bpy.context.view_layer.update()
        start = time.perf_counter()
        step(number)
        bpy.context.view_layer.update()
        times.append(time.perf_counter() - start)
    return round(1000.0 * min(times), 2)


def undo_and_redo() -> Step:
    bpy.ops.ed.undo_push(message="before")
    bpy.context.scene.render.fps += 1
    bpy.ops.ed.undo_push(message="unrelated")
    return lambda number: (bpy.ops.ed.redo if number % 2 else bpy.ops.ed.undo)()


def edits(obj: bpy.types.Object) -> dict[str, Step]:
    """The same without and with Sinew, by their names."""
    mesh, groups = obj.data, obj.vertex_groups
    some = list(range(0, len(mesh.vertices), max(1, len(mesh.vertices) // 100)))[:100]

    def move_vertex(number: int) -> None:
        mesh.vertices[0].co.x = 0.01 * number
        mesh.update()

    return {
        "a vertex moved": move_vertex,
        "100 weights changed": lambda number: groups[1].add(some, 0.1 + 0.01 * number, "REPLACE"),
    }


def measure(vertices: int, with_sinew: bool) -> dict[str, float]:
    obj = frames.make_tube(frames.Case(vertices, bones=52), 0)
    scene, name = bpy.context.scene, obj.name
    found: dict[str, float] = {}
    if with_sinew:
        from sinew_addon.attach import attach
        from sinew_addon.deform import session, small_meshes
        from sinew_addon.skinning.precompute import precomputations

        small_meshes.is_used = False
        precomputations.blocks = True

        def add(_number: int) -> None:
            attach.add(obj, "dq")
            session.refresh(bpy.context)

        start = time.perf_counter()
        add(0)
        found["Add"] = round(1000.0 * (time.perf_counter() - start), 2)
        for method in METHODS:
            # What they need computed is there.
            obj.sinew.method = method
            scene.frame_set(scene.frame_current)
        each = {
            method: least(
                lambda _number, m=method: setattr(obj.sinew, "method", m),
                before=lambda m=method: setattr(obj.sinew, "method", "lbs" if m != "lbs" else "dq"),
            )
            for method in METHODS
        }
        found["flip"] = round(sum(each.values()) / len(each), 2)
        found["flip to cor"] = each["cor"]
        obj.sinew.method = "dq"
        found["Off, On"] = least(lambda number: setattr(obj.sinew, "enabled", number % 2 == 1))
    else:
        modifier = obj.modifiers["Armature"]
        found["flip"] = least(lambda n: setattr(modifier, "use_deform_preserve_volume", n % 2 == 0))
    scene.frame_set(2)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "scene.blend")
        found["undo of an unrelated step"] = least(undo_and_redo())
        for step, function in edits(bpy.data.objects[name]).items():
            found[step] = least(function)
        bpy.ops.wm.save_as_mainfile(filepath=path)

        def open_file(_number: int) -> None:
            bpy.ops.wm.open_mainfile(filepath=path)
            bpy.context.scene.frame_set(3)

        found["file opened and shown"] = least(open_file, 5)
    if with_sinew:
        obj = bpy.data.objects[name]
        start = time.perf_counter()
        attach.remove(obj)
        session.refresh(bpy.context)
        found["Remove"] = round(1000.0 * (time.perf_counter() - start), 2)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vertices", type=int, default=13_380)
    parser.add_argument("--without", action="store_true")
    options = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with contextlib.nullcontext() if options.without else common.registered():
        print(json.dumps(measure(options.vertices, not options.without)))


if __name__ == "__main__":
    main()
