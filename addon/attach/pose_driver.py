# SPDX-License-Identifier: GPL-3.0-or-later
"""The driver that makes a skinned object depend on the poses, as no modifier does while Sinew deforms.

Its variables read the bones, so Blender evaluates their poses even if the armature is hidden. If it is on an
input of Sinew's modifier, it also calls Sinew within Blender's evaluation: whenever a pose, the object's
transform, its settings or its shape keys change, Blender evaluates the driver after them and before the
modifiers, and the last two variables request the points from Sinew (deform/in_depsgraph.py). So a frame is
evaluated once, as with any modifier (seen on 4.2 to 5.2, viewport and render). Variables that read properties
are no scripts: they are evaluated also where files may not run scripts.

If it is on a property of the object, it makes nothing dirty and only keeps the poses evaluated, for points
that are written after the update. Its value is always 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from . import node_group, properties, property_groups, references

PATH = "sinew.driver.pose"
# The properties that the last two variables read.
OBJECT_REQUEST_PATH, MESH_REQUEST_PATH = "sinew.driver.request", "sinew_request"
WORLD_MATRIX = "matrix_world[0][0]"
# Blender reads an object's dimensions only after its modifiers are evaluated (seen on 4.2 to 5.2).
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


def ensure(obj: bpy.types.Object, poses: Sequence[tuple[bpy.types.Object, str]], requests: str) -> None:
    """Makes the driver, or makes it again where it is not as it has to be.

    poses         armatures, each with the path of a property that Blender reads only after its bones are
                  posed. Blender evaluates these bones, their parents and their constraints' targets, and no
                  others.
    requests      the name of Sinew's modifier where the driver requests the points, after the point buffer
                  and the upstream proxy are evaluated; else empty
    """
    variables = [_Variable(armature, path) for armature, path in poses]
    path = PATH
    if requests:
        path = node_group.input_path(obj.modifiers[requests], node_group.POSE)
        armatures = dict.fromkeys(armature for armature, _path in poses)
        # Read through a property, as Blender does not wait for the driver's own object in transform
        # variables.
        variables += [_Variable(each, WORLD_MATRIX) for each in (*armatures, obj)]
        storage = properties.of(obj).storage
        helpers = (storage.upstream_proxy, storage.point_buffer)
        variables += [_Variable(helper, EVALUATED_SIZE) for helper in helpers if helper is not None]
        if obj.data.shape_keys is not None:
            variables.append(_Variable(obj.data.shape_keys, "eval_time"))
        variables += [_Variable(obj, OBJECT_REQUEST_PATH), _Variable(obj.data, MESH_REQUEST_PATH)]
    curve, identity = _find(obj), properties.of(obj).identity
    if curve is not None:
        # Blender does not evaluate a driver that is muted, or that failed once, as while its modifier had no
        # node group.
        is_valid = curve.is_valid and curve.driver.is_valid and not curve.mute
        # A duplicate has the token of its original.
        is_own = identity.token == obj.session_uid
        if is_own and curve.data_path == path and is_valid and _reads(curve.driver, variables):
            return
        _take_off(obj, curve)
    references.note(obj)
    property_groups.store(identity, "token", obj.session_uid)
    curve = obj.driver_add(path)
    # The modifier maps any value of the variables to 0, so no frame changes the input. Assigning the
    # coefficients would make Blender also evaluate the object's keys, and revert what was moved without a
    # key.
    curve.modifiers.new("GENERATOR").coefficients.foreach_set((0.0, 0.0))
    driver = curve.driver
    driver.type = "SUM"
    # Otherwise the expression is the property's current value, which differs each time.
    driver.expression = ""
    for number, variable in enumerate(variables):
        variable.add_to(driver, f"{_PREFIX}{number}")


def _reads(driver: bpy.types.Driver, variables: list[_Variable]) -> bool:
    return len(driver.variables) == len(variables) and all(
        new.is_read_by(old) for new, old in zip(variables, driver.variables, strict=True)
    )


def targets_of(obj: bpy.types.Object) -> list[bpy.types.ID | None]:
    """Returns what the driver's variables read, in their order; empty without a driver."""
    curve = _find(obj)
    return [] if curve is None else [variable.targets[0].id for variable in curve.driver.variables]


def remove(obj: bpy.types.Object) -> None:
    """Removes the driver, and the animation data if it had nothing else."""
    curve = _find(obj)
    if curve is not None:
        _take_off(obj, curve)
        remove_empty_animation(obj)


def _take_off(obj: bpy.types.Object, curve: bpy.types.FCurve) -> None:
    obj.animation_data.drivers.remove(curve)
    # Blender has written the driver's value there.
    properties.of(obj).driver.property_unset("pose")
    properties.of(obj).identity.property_unset("token")


def remove_empty_animation(obj: bpy.types.Object) -> None:
    """Removes the object's animation data if it is empty and did not exist before Sinew."""
    animation = obj.animation_data
    if properties.of(obj).before.had_animation:
        return
    if animation.action is None and not animation.drivers and not animation.nla_tracks:
        obj.animation_data_clear()


def _find(obj: bpy.types.Object) -> bpy.types.FCurve | None:
    """Finds the driver by what its last variables read, as its path contains a modifier that may be gone."""
    animation = obj.animation_data
    for curve in animation.drivers if animation is not None else ():
        if curve.data_path == PATH or _requests_points(curve.driver):
            return curve
    return None


def _requests_points(driver: bpy.types.Driver) -> bool:
    paths = [variable.targets[0].data_path for variable in list(driver.variables)[-2:]]
    return paths == [OBJECT_REQUEST_PATH, MESH_REQUEST_PATH]
