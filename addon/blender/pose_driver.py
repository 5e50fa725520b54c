# SPDX-License-Identifier: GPL-3.0-or-later
"""A driver that makes Blender evaluate a pose whose armature is hidden.

Blender evaluates a hidden armature only for something visible that depends on it. While Sinew is at work no
modifier does; a driver on a property of the mesh object that reads the bones does instead, without making the
mesh itself dirty (seen on 4.2 and 5.2, viewport and render). Its value means nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from . import properties

PATH = "sinew.pose"


def ensure(obj: bpy.types.Object, bones: Sequence[tuple[bpy.types.Object, str]]) -> None:
    """The driver reads exactly `bones`, each an armature and a bone's name. All bones that move vertices must
    be named: Blender evaluates those, their parents and their constraints' targets, and no others."""
    curve = _find(obj)
    if curve is not None:
        variables = curve.driver.variables
        if [(v.targets[0].id, v.targets[0].bone_target) for v in variables] == list(bones):
            return
        remove(obj)
    driver = obj.driver_add(PATH).driver
    driver.type = "SUM"
    for number, (target, name) in enumerate(bones):
        variable = driver.variables.new()
        variable.name = f"bone{number}"
        variable.type = "TRANSFORMS"
        variable.targets[0].id = target
        variable.targets[0].bone_target = name


def remove(obj: bpy.types.Object) -> None:
    """Takes the driver off, and the animation data where it was all of it."""
    if _find(obj) is not None:
        obj.driver_remove(PATH)
        remove_empty_animation(obj)


def remove_empty_animation(obj: bpy.types.Object) -> None:
    """Takes the object's animation data away where it is empty and was not there before Sinew."""
    animation = obj.animation_data
    if properties.of(obj).had_animation:
        return
    if animation.action is None and not animation.drivers and not animation.nla_tracks:
        obj.animation_data_clear()


def _find(obj: bpy.types.Object) -> bpy.types.FCurve | None:
    animation = obj.animation_data
    return animation.drivers.find(PATH) if animation is not None else None
