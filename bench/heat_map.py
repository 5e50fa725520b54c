# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what the heat map adds to a frame in Blender: python bench/heat_map.py [FILE.blend MESH]

Without a file, a tube of 100,000 vertices. Frames with each measure and without alternate; prints the
differences of the minimum times in milliseconds.
"""

from __future__ import annotations

import math
import sys

import bpy
import common
import numpy as np
from limb import least_frame, make_limb
from sinew_addon.attach import attach
from sinew_addon.deform import session
from sinew_addon.features.heat import measures
from sinew_addon.features.measure.metrics import METRICS

SIDES, RINGS, ROUNDS = 200, 500, 8


def make_tube() -> bpy.types.Object:
    x = np.repeat(np.linspace(0.0, 2.0, RINGS), SIDES)
    angle = np.tile(2 * np.pi * np.arange(SIDES) / SIDES, RINGS)
    points = np.stack([x, 0.25 * np.cos(angle), 0.25 * np.sin(angle)], axis=1)
    here = np.arange((RINGS - 1) * SIDES)
    beside = here // SIDES * SIDES + (here + 1) % SIDES
    return make_limb(points, np.stack([here, beside, beside + SIDES, here + SIDES], axis=1))


def least_time() -> float:
    """The minimum time of a frame, milliseconds."""
    return 1000.0 * least_frame()


def main() -> None:
    if len(sys.argv) == 3:
        bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
        obj = bpy.data.objects[sys.argv[2]]
    else:
        obj = make_tube()
    scene = bpy.context.scene
    attach.add(obj, "dq")
    session.refresh(bpy.context)
    least = {name: math.inf for name in ("off", *METRICS)}
    for _round in range(ROUNDS):
        least["off"] = min(least["off"], least_time())
        obj.sinew.heat = True
        for name in METRICS:
            measures.of(scene).quantity = name
            least[name] = min(least[name], least_time())
        obj.sinew.heat = False
    print(f"{len(obj.data.vertices):,} vertices; a frame without heat map: {least['off']:.2f} ms")
    for name in METRICS:
        print(f"{name:10} {least[name] - least['off']:6.2f} ms more")


with common.registered():
    main()
