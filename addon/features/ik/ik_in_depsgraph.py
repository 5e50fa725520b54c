# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of bones solved within Blender's own evaluation: a follower's driver asks for it, after all that a
tree depends on and before the bones that follow.

Blender evaluates on many threads, and for a render beside the window: only evaluated data is read and
written. Each dependency graph has its own follower, and nothing is kept from one evaluation to the next but
the solver of a tree, which holds no pose.
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

# By the name of an armature object, why its trees could not be solved. Threads add to it; handlers empty it.
problems: dict[str, str] = {}


@dataclass(frozen=True)
class _Known:
    """A tree, and all settings that it was read from."""

    settings: tuple
    one_frame: OneFrame


class _Thread(threading.local):
    """Keeps Python's state of each of Blender's threads, which takes long to make anew each time."""

    def __init__(self) -> None:
        sinew.keep_thread_state()
        # By the follower's name and what pulls: one of each thread, as a solver has one user at a time.
        self.known: dict[tuple[str, str], _Known] = {}


_thread = _Thread()


def requested(follower: bpy.types.Object, root: str, constraints: str) -> None:
    """Solves the tree of an evaluated follower."""
    if not follower.is_evaluated:
        # Somebody else reads the property.
        return
    # Evaluated, as the follower is.
    armature = follower.animation_data.drivers[0].driver.variables[0].targets[0].id
    if armature is None or armature.pose is None:
        return
    try:
        one_frame = _one_frame_of(follower, armature, root, constraints)
    except SinewError:
        # Changed since it was put on, which the handler of this update sees, too.
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
    """Into the follower's channels; without rotations, the bones' own. By foreach_set(), as an assignment
    would tell Blender that a file has changed."""
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
