# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how long one edit takes in a scene of many skinned meshes: python bench/edits.py [MESHES]

Until Blender and Sinew have evaluated it. Least times in milliseconds, without Sinew and then with it.
"""

from __future__ import annotations

import sys

import bpy
import common
import frames
from instant import Step, least
from sinew_addon.attach import attach
from sinew_addon.deform import session


def edits(obj: bpy.types.Object) -> dict[str, Step]:
    """Edits of one object that need no Sinew: by name, functions of a running number."""
    armature = obj.modifiers["Armature"].object

    def add_empty(_count: int) -> None:
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Empty", None))

    def pose(count: int) -> None:
        armature.pose.bones[0].rotation_quaternion = (1.0, 0.01 * count, 0.0, 0.0)

    return {
        "pose its armature": pose,
        "move it": lambda count: setattr(obj, "location", (count, 0.0, 0.0)),
        "hide or show it": lambda count: obj.hide_set(count % 2 == 0),
        "rename it": lambda count: setattr(obj, "name", f"Name {count}"),
        "add a modifier": lambda _count: obj.modifiers.new("Smooth", "SMOOTH"),
        "add an empty": add_empty,
    }


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) == 2 else 100
    bpy.ops.wm.read_factory_settings(use_empty=True)
    objects = [frames.make_tube(frames.Case(5_000, bones=8), index) for index in range(count)]
    print(f"{count} meshes of 5,000 vertices, each with an armature of its own; ms without Sinew, and with")
    without = {name: least(edit) for name, edit in edits(objects[0]).items()}
    for obj in objects:
        attach.add(obj, "dq")
    session.refresh(bpy.context)
    chosen = objects[1]
    for name, edit in edits(chosen).items():
        print(f"{name:18} {without[name]:7.1f} {least(edit):7.1f}")
    methods = ("lbs", "dq")
    choosing = least(lambda count: setattr(chosen.sinew, "method", methods[count % 2]))
    print(f"{'choose its method':26} {choosing:7.1f}")


with common.registered():
    main()
