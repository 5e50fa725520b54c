# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's events: on each frame and each change, look up the driven objects, deform, write."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..core.errors import SinewError
from ..core.influences import GroupWeights
from ..core.rig import Bones, RigFacts
from ..core.session import Binding, Frame
from ..core.shape_keys import ShapeKeys
from . import armature_io, drive, mesh_io, pose_driver, properties, survey
from .modifier_options import ModifierOptions

log = logging.getLogger("sinew")


@dataclass
class Driven:
    """What is known of one driven object between events; made again whenever it may be out of date."""

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


@dataclass
class Session:
    """The driven objects of the open file. Objects are kept by reference between events only; undo and
    loading make all references void, so both forget everything."""

    objects: list[bpy.types.Object] | None = None
    object_count: int = 0
    driven: dict[int, Driven] = field(default_factory=dict)
    updating: bool = False

    def forget(self) -> None:
        self.objects = None
        self.driven.clear()


session = Session()


def state_of(obj: bpy.types.Object) -> Driven | None:
    """What the panel shows of a driven object; None before its first frame."""
    return session.driven.get(obj.session_uid)


def refresh(context: bpy.types.Context) -> None:
    """Deforms all driven objects at the current frame, as after a change of settings."""
    if session.updating:
        # A handler turned an object off: asking for another evaluation now could be from a render's thread.
        return
    depsgraph = context.evaluated_depsgraph_get()
    _update(depsgraph, _Changes())
    # In a window the tagged meshes are evaluated before the next redraw; a script may read them at once.
    if bpy.app.background:
        context.view_layer.update()


def _method_changed(_obj: bpy.types.Object, context: bpy.types.Context) -> None:
    refresh(context)


def _enabled_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    settings = properties.of(obj)
    drive.switch(obj, settings.enabled)
    settings.error = ""
    refresh(context)


def rebind(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Reads everything of the object anew: mesh, weights, bones. Switches it on again after an error."""
    session.driven.pop(obj.session_uid, None)
    settings = properties.of(obj)
    settings.error = ""
    if not settings.enabled:
        settings.enabled = True  # refreshes
    else:
        drive.switch(obj, on=True)
        refresh(context)


@dataclass
class _Changes:
    """What Blender says changed in this update, by session_uid."""

    objects: set[int] = field(default_factory=set)
    meshes: set[int] = field(default_factory=set)
    keys: set[int] = field(default_factory=set)
    armatures: set[int] = field(default_factory=set)
    structure: bool = False

    @classmethod
    def read(cls, depsgraph: bpy.types.Depsgraph) -> _Changes:
        changes = cls()
        for update in depsgraph.updates:
            what = update.id
            if isinstance(what, bpy.types.Object):
                if update.is_updated_geometry:
                    changes.objects.add(what.original.session_uid)
            elif isinstance(what, bpy.types.Mesh):
                if update.is_updated_geometry:
                    changes.meshes.add(what.original.session_uid)
            elif isinstance(what, bpy.types.Key):
                changes.keys.add(what.original.session_uid)
            elif isinstance(what, bpy.types.Armature):
                changes.armatures.add(what.original.session_uid)
            elif isinstance(what, bpy.types.Scene | bpy.types.Collection):
                changes.structure = True
        return changes


def _update(depsgraph: bpy.types.Depsgraph, changes: _Changes) -> None:
    session.updating = True
    try:
        for obj in _driven_objects(changes):
            _update_or_turn_off(obj, depsgraph, changes)
    finally:
        session.updating = False


def _update_or_turn_off(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: _Changes) -> None:
    try:
        settings = properties.of(obj)
        if settings.enabled and obj.mode != "EDIT":
            _update_object(obj, settings, depsgraph, changes)
    except ReferenceError:
        # Deleted since the objects were listed.
        session.objects = None
    except Exception as error:
        _turn_off(obj, settings, error)


def _driven_objects(changes: _Changes) -> list[bpy.types.Object]:
    if session.objects is None or changes.structure or len(bpy.data.objects) != session.object_count:
        session.objects = [obj for obj in bpy.data.objects if properties.is_driven(obj)]
        session.object_count = len(bpy.data.objects)
        drive.separate_attributes(session.objects)
        for obj in session.objects:
            _check_armature(obj)
            drive.clear_pointer(obj)
        known = {obj.session_uid for obj in session.objects}
        session.driven = {uid: driven for uid, driven in session.driven.items() if uid in known}
    return session.objects


def _check_armature(obj: bpy.types.Object) -> None:
    """Lets go of an armature that the artist deleted: our pointer alone would keep it in the file."""
    armature = properties.of(obj).armature
    if armature is not None and armature.library is None and not armature.users_collection:
        properties.of(obj).armature = None


def _turn_off(obj: bpy.types.Object, settings: properties.SinewSettings, error: Exception) -> None:
    """Hands a failing object back to its Armature modifier, and says why once."""
    session.driven.pop(obj.session_uid, None)
    settings.enabled = False
    if isinstance(error, SinewError):
        settings.error = str(error)
        log.error("%s", error)
    else:
        settings.error = f"{obj.name}: {type(error).__name__}: {error}; press Rebind, or Remove"
        log.error("%s", settings.error, exc_info=error)


def _update_object(
    obj: bpy.types.Object,
    settings: properties.SinewSettings,
    depsgraph: bpy.types.Depsgraph,
    changes: _Changes,
) -> None:
    if obj.session_uid in changes.objects:
        drive.clear_pointer(obj)
    armature = settings.armature
    if armature is None:
        raise SinewError(
            f"{obj.name}: its armature was deleted; choose another in the Armature modifier and press "
            "Rebind, or Remove"
        )
    if armature.mode == "EDIT":
        return
    evaluated = obj.evaluated_get(depsgraph)
    evaluated_armature = armature.evaluated_get(depsgraph)
    space = armature_io.bones_from_model(evaluated, evaluated_armature)
    driven = _current(obj, armature, evaluated_armature, space, changes)
    # Binding is not part of a frame's time: it happens once.
    started = time.perf_counter()
    frame = Frame(
        method=evaluated.sinew.method,
        pose=armature_io.read_pose(evaluated_armature, driven.binding.bones),
        bones_from_model=space,
        rest_points=_rest_points(obj, driven, depsgraph),
    )
    points = driven.binding.deform(frame)
    if points is not None:
        mesh_io.write_points(obj.data, settings.attribute, points)
        driven.milliseconds = 1000.0 * (time.perf_counter() - started)


def _current(
    obj: bpy.types.Object,
    armature: bpy.types.Object,
    evaluated_armature: bpy.types.Object,
    space: np.ndarray,
    changes: _Changes,
) -> Driven:
    """The object's state, bound anew where its mesh, weights, bones or modifier changed."""
    driven = session.driven.get(obj.session_uid)
    modifier = drive.armature_modifier(obj)
    if modifier is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    options = ModifierOptions.read(modifier)
    if driven is None or driven.armature != armature.session_uid or driven.options != options:
        return _bind(obj, armature, evaluated_armature, space, options)
    mesh = obj.data
    keys = mesh.shape_keys
    bones_changed = False
    if armature.data.session_uid in changes.armatures:
        bones = armature_io.read_bones(evaluated_armature)
        _follow_renamed_bones(obj, driven.binding.bones, bones)
        bones_changed = not bones.equals(driven.binding.bones)
    regrouped = (
        obj.session_uid in changes.objects and [g.name for g in obj.vertex_groups] != driven.group_names
    )
    # A moved shape key slider dirties the mesh on every step; weights do not change by it.
    by_keys = keys is not None and keys.session_uid in changes.keys
    touched = mesh.session_uid in changes.meshes and not by_keys
    if bones_changed or regrouped or touched or len(mesh.vertices) != len(driven.rest_points):
        return _bind(obj, armature, evaluated_armature, space, options, driven)
    return driven


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
    session.driven[obj.session_uid] = driven
    pose_driver.ensure(obj, armature, binding.moving_bones)
    return driven


def _follow_renamed_bones(obj: bpy.types.Object, old: Bones, new: Bones) -> None:
    """Blender renames the vertex groups of a renamed bone only where a modifier points to the armature;
    while Sinew holds the pointer it is ours to do."""
    if not np.array_equal(old.rest, new.rest):
        return
    for before, after in zip(old.names, new.names, strict=True):
        group = obj.vertex_groups.get(before) if before != after else None
        if group is not None and before not in new.names and after not in obj.vertex_groups:
            group.name = after


def _rest_points(obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Rest points with shape keys at their values; the same array as before where nothing changed."""
    if driven.shape_keys is None:
        return driven.rest_points
    values = mesh_io.read_key_values(obj, depsgraph)
    if driven.mixed_points is None or not np.array_equal(values, driven.key_values):
        driven.key_values = values
        driven.mixed_points = driven.shape_keys.mix(values)
    return driven.mixed_points


@persistent
def on_frame_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    _update(depsgraph, _Changes.read(depsgraph))


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    _update(depsgraph, _Changes.read(depsgraph))


@persistent
def on_data_replaced(*_args: object) -> None:
    """Undo, redo and loading: every reference is void and the attributes hold other points."""
    session.forget()


@persistent
def on_loaded(*_args: object) -> None:
    session.forget()
    refresh(bpy.context)


@persistent
def on_save(*_args: object) -> None:
    """A saved file has the Armature modifiers' pointers: without Sinew they need only switching on."""
    for obj in bpy.data.objects:
        if properties.is_driven(obj):
            drive.give_back(obj)


@persistent
def on_saved(*_args: object) -> None:
    for obj in bpy.data.objects:
        if properties.is_driven(obj) and properties.of(obj).enabled:
            drive.clear_pointer(obj)
            state = state_of(obj)
            if state is not None:
                pose_driver.ensure(obj, properties.of(obj).armature, state.binding.moving_bones)


_HANDLERS = {
    "frame_change_post": [on_frame_change],
    "depsgraph_update_post": [on_depsgraph_update],
    "undo_pre": [on_data_replaced],
    "undo_post": [on_data_replaced],
    "redo_pre": [on_data_replaced],
    "redo_post": [on_data_replaced],
    "load_pre": [on_data_replaced],
    "load_post": [on_loaded],
    "save_pre": [on_save],
    "save_post": [on_saved],
    "save_post_fail": [on_saved],
}


def register() -> None:
    session.forget()
    properties.listeners.method_changed = _method_changed
    properties.listeners.enabled_changed = _enabled_changed
    for event, functions in _HANDLERS.items():
        getattr(bpy.app.handlers, event).extend(functions)


def unregister() -> None:
    for event, functions in _HANDLERS.items():
        registered = getattr(bpy.app.handlers, event)
        for function in functions:
            if function in registered:
                registered.remove(function)
    session.forget()
