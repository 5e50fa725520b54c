# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves trees of bones within Blender's evaluation: a follower's driver requests it, after everything that a
tree depends on and before the bones that follow.

Blender evaluates on many threads, and renders beside the window, so only evaluated data is read and written.
Each dependency graph has its own follower, and nothing is kept between evaluations except a tree's solver,
which stores no pose.
"""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass

import bpy
import numpy as np
import sinew

from ...core.errors import SinewError
from ...io import ik_io
from .ik_one_frame import OneFrame
from .ik_records import Listener, live_constraints

log = logging.getLogger(__name__)

# Why an armature object's trees could not be solved, by its name. Threads add to it; handlers empty it.
problems: dict[str, str] = {}


@dataclass(frozen=True)
class _Known:
    """A tree, and all settings that it was read from."""

    settings: tuple
    one_frame: OneFrame


class _Thread(threading.local):
    """Keeps the Python thread state of each of Blender's threads, as making it takes long."""

    def __init__(self) -> None:
        sinew.keep_thread_state()
        # By the follower's name and the constraints. One for each thread, as a solver has one user at a time.
        self.known: dict[tuple[str, str], _Known] = {}


_thread = _Thread()


def requested(follower: bpy.types.Object, root: str, constraints: str) -> None:
    """Solves the tree of an evaluated follower."""
    if not follower.is_evaluated:
        # Something other than the driver reads the property.
        return
    # The driver's target is evaluated, as the follower is.
    armature = follower.animation_data.drivers[0].driver.variables[0].targets[0].id
    if armature is None or armature.pose is None:
        return
    try:
        one_frame = _one_frame_of(follower, armature, root, constraints)
    except SinewError:
        # It has changed since it was attached; the handler of this update notices that, too.
        return
    settings, bones = armature.sinew_ik, one_frame.tree.bones
    try:
        rotations = one_frame.solve(armature, settings.method, settings.iterations)
        _write(follower, armature, bones, rotations)
    except Exception as error:
        text = str(error) if isinstance(error, SinewError) else f"{type(error).__name__}: {error}"
        if armature.name not in problems:
            log.error("%s: inverse kinematics is not solved live: %s", armature.name, text)
        problems[armature.name] = text
        _write(follower, armature, bones, None)


def _one_frame_of(
    follower: bpy.types.Object, armature: bpy.types.Object, root: str, constraints: str
) -> OneFrame:
    key = follower.name, constraints
    known = _thread.known.get(key)
    if known is None or known.settings != ik_io.settings_of(armature, known.one_frame.tree):
        trees = ik_io.read_trees(armature, [root], live_constraints(armature))
        tree = next((tree for tree in trees if tree.bones[0] == root), None)
        if tree is None:
            raise SinewError(f"{armature.name}: no constraint pulls a chain from {root}")
        known = _Known(ik_io.settings_of(armature, tree), OneFrame(armature, tree))
        _thread.known[key] = known
    return known.one_frame


def _write(
    follower: bpy.types.Object,
    armature: bpy.types.Object,
    bones: tuple[str, ...],
    rotations: np.ndarray | None,
) -> None:
    """Writes rotations to the follower's channels; without rotations, the bones' own. By foreach_set(), as an
    assignment would tell Blender that the file has changed."""
    for number, name in enumerate(bones):
        own, channels = armature.pose.bones.get(name), follower.pose.bones.get(name)
        if own is None or channels is None:
            continue
        rotation = own.matrix_basis.to_quaternion() if rotations is None else rotations[number]
        for path, value in (
            ("location", own.location),
            ("rotation_quaternion", rotation),
            ("scale", own.scale),
        ):
            channels.path_resolve(path, False).foreach_set(tuple(value))


def register() -> None:
    Listener.requested = requested


def unregister() -> None:
    Listener.requested = None
    problems.clear()
