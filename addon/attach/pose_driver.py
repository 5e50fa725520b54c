# SPDX-License-Identifier: GPL-3.0-or-later
"""The driver that ties a skinned object to the poses, which no modifier does while Sinew is at work.

Its variables read the bones, so Blender evaluates their poses even where the armature is hidden. On an input
of Sinew's modifier it also places Sinew within Blender's own evaluation: whenever a pose, the object's place,
its settings or its shape keys change, Blender evaluates the driver after them and before the modifiers, and
the last two variables ask Sinew for the points (in_evaluation). So a frame is evaluated once, as with a
modifier (seen on 4.2 to 5.2, viewport and render). A variable that reads a property is no script: it is also
read where files may not run any.

On a property of the object, which makes nothing dirty, it only keeps the poses evaluated: for points that are
written after the update. Its value is always 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from . import node_group, properties, references, stack

PATH = "sinew.pose"
# What the last two variables read.
OBJECT_REQUEST_PATH, MESH_REQUEST_PATH = "sinew.asked", "sinew_asked"
WORLD_MATRIX = "matrix_world[0][0]"
# Blender reads an object's size no sooner than its modifiers are evaluated (seen on 4.2 to 5.2).
EVALUATED_SIZE = "dimensions[0]"
_PREFIX = "sinew_"


@dataclass(frozen=True)
class _Variable:
    """What a variable reads."""

    target: bpy.types.ID
    path: str

    def is_read_by(self, variable: bpy.types.DriverVariable) -> bool:
        target = variable.targets[0]
        return variable.type == "SINGLE_PROP" and target.id == self.target and target.data_path == self.path

    def add_to(self, driver: bpy.types.Driver, name: str) -> None:
        variable = driver.variables.new()
        variable.name = name
        target = variable.targets[0]
        target.id_type = self.target.id_type
        target.id = self.target
        target.data_path = self.path


def ensure(obj: bpy.types.Object, poses: Sequence[tuple[bpy.types.Object, str]], in_depsgraph: bool) -> None:
    """Makes the driver as it has to be.

    poses   each an armature and the path of a property that is read no sooner than its bones are posed.
            Blender evaluates these bones, their parents and their constraints' targets, and no others.
    in_depsgraph  it asks Sinew for the points, once the point buffer and what stands in front are evaluated
    """
    variables = [_Variable(armature, path) for armature, path in poses]
    path = PATH
    if in_depsgraph:
        path = node_group.input_path(stack.sinew_modifier(obj), node_group.POSE)
        armatures = dict.fromkeys(armature for armature, _path in poses)
        # By a property, as Blender reads the transforms of the driver's own object without waiting for them.
        variables += [_Variable(each, WORLD_MATRIX) for each in (*armatures, obj)]
        helpers = (properties.of(obj).upstream_proxy, properties.of(obj).point_buffer)
        variables += [_Variable(helper, EVALUATED_SIZE) for helper in helpers if helper is not None]
        if obj.data.shape_keys is not None:
            variables.append(_Variable(obj.data.shape_keys, "eval_time"))
        variables += [_Variable(obj, OBJECT_REQUEST_PATH), _Variable(obj.data, MESH_REQUEST_PATH)]
    curve = _find(obj)
    if curve is not None:
        # One that failed once, as while its modifier had no node group, Blender does not evaluate again.
        is_valid = curve.is_valid and curve.driver.is_valid
        if curve.data_path == path and is_valid and _reads(curve.driver, variables):
            return
        _take_off(obj, curve)
    references.note(obj)
    curve = obj.driver_add(path)
    # Whatever the variables are, the value is 0: so no frame changes the input. By an assignment Blender
    # would also evaluate the object's keys, and take back what was moved without a key.
    curve.modifiers.new("GENERATOR").coefficients.foreach_set((0.0, 0.0))
    driver = curve.driver
    driver.type = "SUM"
    # Else it is what the property was just now, and differs from one time to the next.
    driver.expression = ""
    for number, variable in enumerate(variables):
        variable.add_to(driver, f"{_PREFIX}{number}")


def _reads(driver: bpy.types.Driver, variables: list[_Variable]) -> bool:
    return len(driver.variables) == len(variables) and all(
        new.is_read_by(old) for new, old in zip(variables, driver.variables, strict=True)
    )


def remove(obj: bpy.types.Object) -> None:
    """Takes the driver off, and the animation data where it was all of it."""
    curve = _find(obj)
    if curve is not None:
        _take_off(obj, curve)
        remove_empty_animation(obj)


def _take_off(obj: bpy.types.Object, curve: bpy.types.FCurve) -> None:
    obj.animation_data.drivers.remove(curve)
    # Blender has written its value there.
    properties.of(obj).property_unset("pose")


def remove_empty_animation(obj: bpy.types.Object) -> None:
    """Takes the object's animation data away where it is empty and was not there before Sinew."""
    animation = obj.animation_data
    if properties.of(obj).had_animation:
        return
    if animation.action is None and not animation.drivers and not animation.nla_tracks:
        obj.animation_data_clear()


def _find(obj: bpy.types.Object) -> bpy.types.FCurve | None:
    """Known by what its last variables read, as its path is that of a modifier which may have gone."""
    animation = obj.animation_data
    for curve in animation.drivers if animation is not None else ():
        if curve.data_path == PATH or _requests_points(curve.driver):
            return curve
    return None


def _requests_points(driver: bpy.types.Driver) -> bool:
    paths = [variable.targets[0].data_path for variable in list(driver.variables)[-2:]]
    return paths == [OBJECT_REQUEST_PATH, MESH_REQUEST_PATH]
