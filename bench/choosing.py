# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what an artist waits for who chooses: Suggest over 30 frames, and the contact sheet.

python bench/choosing.py: one line of JSON, of human.blend (SINEW_RIGS): seconds until the recommendation
and until all methods are measured, and of a sheet of six variants; beside each the seconds of processor,
which other programs change less. The least of three. Runs with the extension of an older checkout, too,
without what that lacks.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Iterable
from pathlib import Path

import bpy
import common

ROUNDS, FRAMES, SIZE = 3, 30, 240
VARIANTS = "blender, dq, cor, dq+twist_spread+bulge_limit, dq+twist_spread+delta_mush, lbs"


def least(run: Iterable[float], first: float = 1.0) -> dict[str, float]:
    """first: the progress at which something is seen"""
    start, of_processor, seen = time.perf_counter(), time.process_time(), 0.0
    for share in run:
        if not seen and share >= first:
            seen = time.perf_counter() - start
    whole, of_processor = time.perf_counter() - start, time.process_time() - of_processor
    return {"first": round(seen or whole, 2), "all": round(whole, 2), "processor": round(of_processor, 2)}


def measure() -> dict[str, object]:
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    obj = next(each for each in scene.objects if any(m.type == "ARMATURE" for m in each.modifiers))
    bpy.context.view_layer.objects.active = obj
    bpy.ops.sinew.add()
    from sinew_addon.features.suggest import suggest

    found: dict[str, object] = {"vertices": len(obj.data.vertices)}
    runs = [least(suggest.scan(scene, [obj], "SCENE"), 0.5) for _round in range(ROUNDS)]
    found["Suggest"] = min(runs, key=lambda each: each["all"])
    with contextlib.suppress(ImportError):
        from sinew_addon.features.pages import contact_sheet
        from sinew_addon.skinning.variants import parse_list

        rows = [{obj: variant} for variant in parse_list(VARIANTS)]

        def draw() -> Iterable[float]:
            joints = contact_sheet.columns([obj])
            cells = contact_sheet.cells(joints, rows, SIZE)
            count = len(rows) * len(joints)
            found["cells"] = count
            return ((number + 1) / count for number, _cell in enumerate(cells))

        runs = [least(draw(), 1.0 / len(rows)) for _round in range(ROUNDS)]
        found["contact sheet"] = min(runs, key=lambda each: each["all"])
    return found


def main() -> None:
    bpy.ops.wm.open_mainfile(filepath=str(Path(os.environ["SINEW_RIGS"], "human.blend")))
    with common.registered():
        print(json.dumps(measure() | {"machine": common.machine()}))


if __name__ == "__main__":
    main()
