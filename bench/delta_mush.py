# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the stage delta_mush with Blender's Corrective Smooth, on a sheet of 317 x 317 vertices bent by
an Armature modifier: python bench/delta_mush.py [--name NAME]

Once with the vertices row by row, which is best for Blender, and once in random order.

Nanoseconds per vertex, minimum of alternating runs. For Blender, and for Sinew in Blender, this is the
additional time of a change of frame compared with no smoothing; for the library it is one call on one
thread. In Blender, Sinew uses as many threads as useful.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import bpy
import common
import numpy as np
import sinew
from limb import least_frame, make_limb
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session
from sinew_addon.io import mesh_io

SIDE, ROUNDS = 317, 8
ORDERS = ("rows", "random")
CASES = [(kind, iterations) for kind in ("simple", "length_weighted") for iterations in (5, 20)]


def make_sheet(order: str) -> bpy.types.Object:
    """A noisy sheet with two bones. order: of its vertices, one of ORDERS"""
    x, y = (axis.ravel() * 2.0 / (SIDE - 1) for axis in np.mgrid[:SIDE, :SIDE])
    points = np.stack([x, y - 1.0, 0.003 * np.random.default_rng(0).normal(size=len(x))], axis=1)
    first = np.arange(SIDE * (SIDE - 1)).reshape(-1, SIDE)[:, :-1].ravel()
    faces = np.stack([first, first + SIDE, first + SIDE + 1, first + 1], axis=1)
    if order == "random":
        vertices = np.random.default_rng(1).permutation(len(points))
        points, faces = points[vertices], np.argsort(vertices)[faces]
    return make_limb(points, faces)


def added(use: Callable[[str | None, int], None]) -> dict[str, float]:
    """The seconds that each case adds to a frame, by minimum times.

    use  sets the object up for a kind of smoothing and its iterations; None: for a frame without
    """
    candidates = {"none": (None, 0)} | {f"{kind} {n}": (kind, n) for kind, n in CASES}
    least = dict.fromkeys(candidates, math.inf)
    for _round in range(ROUNDS):
        for name, case in candidates.items():
            use(*case)
            bpy.context.scene.frame_set(1)
            least[name] = min(least[name], least_frame())
    return {name: seconds - least["none"] for name, seconds in least.items() if name != "none"}


def of_blender(obj: bpy.types.Object) -> dict[str, float]:
    smooth = obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH")

    def use(kind: str | None, iterations: int) -> None:
        smooth.show_viewport = kind is not None
        if kind is not None:
            smooth.smooth_type, smooth.iterations = kind.upper(), iterations

    found = added(use)
    obj.modifiers.remove(smooth)
    return found


def of_sinew(obj: bpy.types.Object) -> dict[str, float]:
    attach.add(obj, "lbs")
    session.refresh(bpy.context)
    stage = properties.of(obj).delta_mush

    def use(kind: str | None, iterations: int) -> None:
        stage.enabled = kind is not None
        if kind is not None:
            stage.smooth_type, stage.iterations = kind, iterations

    return added(use)


def of_library(obj: bpy.types.Object) -> dict[str, float]:
    """Times of the library's own calls, on one thread."""
    bpy.context.scene.frame_set(11)
    rest, topology = mesh_io.read_points(obj.data), mesh_io.read_topology(obj.data)
    points = session.skinned_of(obj).points.copy()
    out = np.empty_like(points)
    found = {}
    for kind, iterations in CASES:
        mush = sinew.DeltaMush(
            rest,
            topology.face_offsets,
            topology.corner_vertices,
            topology.edges,
            iterations=iterations,
            smooth_type=kind,
        )
        times = []
        for _run in range(100):
            started = time.perf_counter()
            mush.apply(points, out=out, threads=1)
            times.append(time.perf_counter() - started)
        found[f"{kind} {iterations}"] = min(times)
    return found


def measure(order: str) -> dict[str, dict[str, float]]:
    """Nanoseconds per vertex for each part and case."""
    obj = make_sheet(order)
    parts = {"Corrective Smooth": of_blender(obj), "Sinew in Blender": of_sinew(obj)}
    parts["library, one thread"] = of_library(obj)
    count = len(obj.data.vertices)
    return {
        part: {case: 1e9 * seconds / count for case, seconds in times.items()}
        for part, times in parts.items()
    }


def main() -> None:
    arguments = common.options(__doc__, "").parse_args()
    tables = {order: measure(order) for order in ORDERS}
    print(f"{SIDE * SIDE:,} vertices, Blender {bpy.app.version_string}; ns a vertex")
    for order, table in tables.items():
        for case, blenders in table["Corrective Smooth"].items():
            ratio = blenders / table["library, one thread"][case]
            numbers = "  ".join(f"{part} {of_part[case]:7.1f}" for part, of_part in table.items())
            print(f"{order:7} {case:18} {numbers}  {ratio:.1f} times")
    if arguments.name:
        facts = {"blender": bpy.app.version_string, "vertices": SIDE * SIDE, "ns_a_vertex": tables}
        common.write(arguments.name, command="bench/delta_mush.py", machine=common.machine(), **facts)


with common.registered():
    main()
