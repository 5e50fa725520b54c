# SPDX-License-Identifier: GPL-3.0-or-later
"""One driven object: reads what Blender has of it, deforms, writes the points."""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.errors import SinewError
from ..core.influences import GroupWeights
from ..core.rig import Bones, RigFacts
from ..core.session import Binding, Frame
from ..core.shape_keys import ShapeKeys
from . import armature_io, drive, mesh_io, pose_driver, properties, survey
from .changes import Changes
from .modifier_options import ModifierOptions

# Tools of these modes look for the armature behind a modifier: painting by bone, groups that follow renames.
MODES_THAT_NEED_THE_POINTER = {"EDIT", "WEIGHT_PAINT"}


@dataclass
class Driven:
    """What is known of a driven object between events; made again whenever it may be out of date."""

    armature: int  # its session_uid
    options: ModifierOptions
    binding: Binding
    facts: RigFacts
    group_names: list[str]
    weights: GroupWeights
    rest_points: np.ndarray
    shape_keys: ShapeKeys | None
    milliseconds: float = 0.0
    key_values: np.ndarray | None = None
    mixed_points: np.ndarray | None = None


def update(
    obj: bpy.types.Object, driven: Driven | None, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> Driven | None:
    """Deforms an object that is on, if anything changed; its state from now on.

    Raises SinewError with a sentence for the user where it can not be driven.
    """
    settings = properties.of(obj)
    if obj.library is not None or obj.data.library is not None:
        raise SinewError(
            f"{obj.name} is linked from another file: its Armature modifier deforms it; make it local to use "
            "Sinew here"
        )
    drive.adopt_pointer(obj)
    if obj.mode in MODES_THAT_NEED_THE_POINTER:
        drive.give_back_pointer(obj)
    if obj.data.is_editmode:
        # The mesh has no attributes to write to; what was edited is read on leaving the mode.
        return None
    armature = _armature(obj, changes)
    if armature.mode == "EDIT":
        # Bones are fitted to the rest shape, and Blender renames groups along with them.
        drive.give_back_pointer(obj)
        mesh_io.write_points_once(obj.data, settings.attribute, mesh_io.read_points(obj.data.vertices))
        return None
    if obj.mode not in MODES_THAT_NEED_THE_POINTER:
        drive.clear_pointer(obj)
    _check_stack(obj, changes)
    evaluated = obj.evaluated_get(depsgraph)
    evaluated_armature = armature.evaluated_get(depsgraph)
    space = armature_io.bones_from_model(evaluated, evaluated_armature)
    if space is None:
        # An armature scaled to nothing for a moment: nothing can be said, the last shape stays.
        return driven
    driven = _current(obj, armature, evaluated_armature, space, driven, depsgraph, changes)
    # Binding is not part of a frame's time: it happens once.
    started = time.perf_counter()
    frame = Frame(
        method=evaluated.sinew.method,
        pose=armature_io.read_pose(evaluated_armature, driven.binding.bones),
        bones_from_model=space,
        rest_points=_rest_points(obj, driven, depsgraph),
    )
    if not np.isfinite(frame.pose).all():
        return driven
    points = driven.binding.deform(frame)
    if points is not None:
        mesh_io.write_points(obj.data, settings.attribute, points)
        driven.milliseconds = 1000.0 * (time.perf_counter() - started)
    elif obj.data.attributes.get(settings.attribute) is None:
        mesh_io.write_points(obj.data, settings.attribute, driven.binding.points)
    return driven


def hold_pose(obj: bpy.types.Object, driven: Driven) -> None:
    """Keeps the pose evaluated even where the armature is hidden."""
    armature = properties.of(obj).armature
    moving = driven.binding.moving_bones
    pose_driver.ensure(obj, armature, [*moving, *armature_io.handles_of(armature, moving)])


def _armature(obj: bpy.types.Object, changes: Changes) -> bpy.types.Object:
    armature = properties.of(obj).armature
    # Deleting takes an object out of all collections; our pointer alone still keeps it in the file.
    local = armature is not None and armature.library is None
    if changes.structure and local and not armature.users_collection:
        raise SinewError(
            f"{obj.name}: its armature {armature.name} was deleted, or is in no collection; choose another "
            "in the Armature modifier and press Rebind, or Remove"
        )
    if armature is None:
        raise SinewError(
            f"{obj.name}: its armature was deleted; choose another in the Armature modifier and press "
            "Rebind, or Remove"
        )
    return armature


def _check_stack(obj: bpy.types.Object, changes: Changes) -> None:
    """Raises SinewError where the modifiers that Sinew works with are gone or in the wrong order."""
    if drive.armature_modifier(obj) is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    nodes = drive.sinew_modifier(obj)
    if nodes is None or nodes.node_group is None:
        raise SinewError(f"{obj.name}: its Sinew modifier was deleted; press Remove, then Add Sinew")
    if obj.session_uid in changes.objects:
        drive.check_in_front(obj)


def _current(
    obj: bpy.types.Object,
    armature: bpy.types.Object,
    evaluated_armature: bpy.types.Object,
    space: np.ndarray,
    driven: Driven | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
) -> Driven:
    """The object's state, bound anew where its mesh, weights, bones or modifier changed."""
    options = ModifierOptions.read(drive.armature_modifier(obj))
    if driven is None or driven.armature != armature.session_uid or driven.options != options:
        return _bind(obj, armature, evaluated_armature, space, options)
    bones_changed = False
    if armature.data.session_uid in changes.armatures or not driven.binding.bones.complete:
        bones = armature_io.read_bones(evaluated_armature)
        _follow_renamed_bones(obj, driven.binding.bones, bones)
        bones_changed = not bones.equals(driven.binding.bones)
    regrouped = (
        obj.session_uid in changes.objects and [g.name for g in obj.vertex_groups] != driven.group_names
    )
    if bones_changed or regrouped or _mesh_changed(obj, driven, depsgraph, changes):
        return _bind(obj, armature, evaluated_armature, space, options, driven)
    return driven


def _mesh_changed(
    obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether points, weights or shape keys may differ from those read."""
    mesh, keys, known = obj.data, obj.data.shape_keys, driven.shape_keys
    if len(mesh.vertices) != len(driven.rest_points) or (keys is None) != (known is None):
        return True
    if keys is not None and tuple(block.name for block in keys.key_blocks) != known.names:
        return True
    if mesh.session_uid not in changes.meshes:
        return False
    if keys is None:
        return True
    # Shape keys dirty the mesh whenever one moves, and weights do not change by that: reading them again on
    # every step of a slider or every frame of an animation would cost more than the frame.
    if changes.frame and keys.animation_data is not None:
        return False
    return np.array_equal(mesh_io.read_key_values(obj, depsgraph), driven.key_values)


def _bind(
    obj: bpy.types.Object,
    armature: bpy.types.Object,
    evaluated_armature: bpy.types.Object,
    space: np.ndarray,
    options: ModifierOptions,
    old: Driven | None = None,
) -> Driven:
    """Reads mesh, weights and bones; keeps the old binding where they came out the same."""
    bones = armature_io.read_bones(evaluated_armature)
    weights = mesh_io.read_group_weights(obj.data)
    names = [group.name for group in obj.vertex_groups]
    points = mesh_io.read_points(obj.data.vertices)
    keys = mesh_io.read_shape_keys(obj, weights)
    if (
        old is not None
        and names == old.group_names
        and bones.equals(old.binding.bones)
        and weights.equals(old.weights)
    ):
        old.rest_points, old.shape_keys = points, keys
        old.key_values = old.mixed_points = None
        return old
    weighting = options.weighting(obj, weights, bones)
    facts = survey.describe(obj, armature, weighting, points @ space[:3, :3].T + space[:3, 3])
    binding = Binding(weighting, options.mask_weights(obj, weights))
    driven = Driven(armature.session_uid, options, binding, facts, names, weights, points, keys)
    hold_pose(obj, driven)
    return driven


def _follow_renamed_bones(obj: bpy.types.Object, old: Bones, new: Bones) -> None:
    """Blender renames the vertex groups of a renamed bone only where a modifier points to the armature;
    while Sinew holds the pointer it is ours to do."""
    if not np.array_equal(old.rest, new.rest):
        return
    renamed = {b: a for b, a in zip(old.names, new.names, strict=True) if b != a}
    moving = [(group, renamed[group.name]) for group in obj.vertex_groups if group.name in renamed]
    staying = {group.name for group in obj.vertex_groups} - set(renamed)
    # Two bones can have swapped names: no group may stand in the way of another.
    for number, (group, _name) in enumerate(moving):
        group.name = f"\x01{number}"
    for group, name in moving:
        group.name = name if name not in staying else next(b for b, a in renamed.items() if a == name)


def _rest_points(obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Rest points with shape keys at their values; the same array as before where nothing changed."""
    if driven.shape_keys is None:
        return driven.rest_points
    values = mesh_io.read_key_values(obj, depsgraph)
    if driven.mixed_points is None or not np.array_equal(values, driven.key_values):
        driven.key_values = values
        driven.mixed_points = driven.shape_keys.mix(values)
    if obj.show_only_shape_key:
        pinned = mesh_io.read_pinned_points(obj)
        if not np.array_equal(pinned, driven.mixed_points):
            driven.mixed_points = pinned
            # Whatever the values are, leaving the pin mixes again.
            driven.key_values = np.full_like(values, np.nan)
    return driven.mixed_points
