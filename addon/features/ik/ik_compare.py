# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures Blender's inverse kinematics and Sinew's on the same bones and frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core import ik as core
from ...deform import characters
from ...io import ik_io

BLENDER = "blender"
TURNS, UPDATES = 7, 20


@dataclass(frozen=True)
class Measured:
    """The result of one solver for one tree.

    errors        [frames], of the tips, in lengths of the chain
    acceleration  core.angular_acceleration()
    iterations    their mean; NaN where the solver does not report them
    microseconds  of one solve: the median of several runs, and half their interquartile range
    """

    solver: str
    tree: core.Tree
    errors: np.ndarray
    acceleration: float
    iterations: float
    microseconds: float
    spread: float
    matrices: np.ndarray


def measure(
    armature: bpy.types.Object,
    tree: core.Tree,
    frames: Sequence[int],
    methods: Sequence[core.ik.Method],
    progress: Callable[[float], None] = lambda _part: None,
) -> list[Measured]:
    """Measures Blender's solver first, then `methods`. Blender's time is that of an update with the
    constraints minus one without them, alternately; it includes Blender's other work for a constraint. All
    times are processor time. The caller restores the frame."""
    scene = bpy.context.scene
    theirs, posed = [], []
    for number, frame in enumerate(frames):
        characters.set_frame(scene, frame)
        theirs.append(ik_io.read_posed(armature, tree).bones)
        progress(0.5 * number / len(frames))
    with ik_io.muted(armature, tree):
        for number, frame in enumerate(frames):
            characters.set_frame(scene, frame)
            posed.append(ik_io.read_posed(armature, tree))
            progress(0.5 + 0.5 * number / len(frames))
    characters.set_frame(scene, frames[len(frames) // 2])
    stacked = core.stack(posed)
    problem = core.problem_of(tree, stacked)
    matrices = np.stack(theirs).astype(np.float64)
    found = [
        Measured(
            BLENDER,
            tree,
            core.tip_errors(tree, problem, matrices),
            core.angular_acceleration(matrices),
            float("nan"),
            *_time_of_blender(armature, tree),
            matrices,
        )
    ]
    for method in methods:
        solution = core.solve(tree, problem, method)
        rotations = core.blended(tree, problem, solution.rotations, stacked.influences)
        matrices = core.matrices_of(tree, problem, rotations)
        found.append(
            Measured(
                method,
                tree,
                core.tip_errors(tree, problem, matrices),
                core.angular_acceleration(matrices),
                float(np.mean(solution.iterations)),
                *_time_of(lambda method=method: core.solve(tree, problem, method), len(frames)),
                matrices,
            )
        )
    return found


def _summary(turns: Sequence[float]) -> tuple[float, float]:
    low, middle, high = np.percentile(turns, [25, 50, 75])
    return float(middle), float(high - low) / 2


def _time_of(work: Callable[[], object], count: int) -> tuple[float, float]:
    turns = []
    for _turn in range(TURNS):
        began = time.process_time()
        work()
        turns.append((time.process_time() - began) * 1e6 / count)
    return _summary(turns)


def _time_of_blender(armature: bpy.types.Object, tree: core.Tree) -> tuple[float, float]:
    def update() -> float:
        # The first update rebuilds the relations.
        bpy.context.view_layer.update()
        began = time.process_time()
        for _update in range(UPDATES):
            armature.update_tag(refresh={"DATA"})
            bpy.context.view_layer.update()
        return (time.process_time() - began) * 1e6 / UPDATES

    turns = []
    for _turn in range(TURNS):
        with_it = update()
        with ik_io.muted(armature, tree):
            turns.append(with_it - update())
    bpy.context.view_layer.update()
    return _summary(turns)
