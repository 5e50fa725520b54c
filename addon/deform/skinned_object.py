# SPDX-License-Identifier: GPL-3.0-or-later
"""One driven object: reads what Blender has of it, deforms, writes the points."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..attach import attach, point_store, pose_driver, properties, stack, upstream_proxy
from ..attach.modifier_options import ModifierOptions
from ..attach.updates import is_rendering_in_window
from ..core.errors import SinewError
from ..core.rig import Bones, RigFacts
from ..core.session import Binding, SkinStack, SkinStage, SkinStageFrame
from ..io import armature_io, mesh_io
from ..io.animation_paths import animated_paths, is_visibility_animated
from . import apply_plan, small_meshes, source, survey
from .changes import Changes
from .plan import MODES_OF_THE_MODIFIER, Plan, State
from .source import Source

# As often its node group is made again, which another add-on removes.
MAX_GROUP_LOSSES = 2
# As often as Sinew in a row could not deform a mesh within Blender's evaluation, it tries again there.
MAX_FAILURES_IN_A_ROW = 1


@dataclass
class SkinnedObject:
    """What is known of a driven object between events; made again whenever it may be out of date.

    armatures          the session_uid of each link's armature, 0 for none
    mix_group          the vertex group whose weights the links have for their mix
    keyed              for each link, whether an animation decides when its modifier is on
    watched            the session_uid of each object that the shape depends on
    frames             what decided the last frame
    rest_points        of the last frame
    dirtied_by_frames  the last change of frame moved the object or its rest points
    modifier           the name of Sinew's
    name               the object's own, by which an evaluation finds this
    losses             how often it had lost its node group
    looks              what the artist can change of the object itself
    plan               who deforms the object; applied to it unless needs_apply
    left_by            what had a small mesh left to its Armature modifiers, as small_meshes.choices(); empty
                       where it is not
    attribute          what holds the points within Blender's evaluation
    mesh_users         how many the mesh has; others could read while it is written
    is_alone           it has as many now
    answered           the address of the evaluated mesh that was given points in the last evaluation, or 0
    is_announced       Blender called handlers before the evaluation that goes on, or Sinew itself caused it
    is_touched         Sinew changed the object since
    first              the first point that was written last
    declined           why an evaluation since was not given points; empty where all were
    refusal            what the user has to see to before it can be
    attempts           how often in a row that was so
    failures, failure  how often it failed there, and what failed last
    is_suspect         the mesh may have changed since it was read: it is looked at with the next event, or
                       when somebody asks
    is_surprised       so an evaluation found that nobody had been told of
    lock               held while the chain works: a render may ask from a thread of its own
    shapes             how many have been written
    """

    mode: str
    armatures: list[int]
    options: list[ModifierOptions]
    visibility_keyed: list[bool]
    source: Source
    skin_stack: SkinStack
    facts: RigFacts
    mix_group: str = ""
    dependencies: set[int] = field(default_factory=set)
    frames: list[SkinStageFrame | None] | None = None
    rest_points: np.ndarray | None = None
    dirtied_by_frames: bool = False
    modifier: str = ""
    name: str = ""
    group_losses: int = 0
    object_state: list = field(default_factory=list)
    plan: Plan = field(default_factory=lambda: Plan(State.OFF))
    needs_apply: bool = True
    builtin_fingerprint: list[str] = field(default_factory=list)
    attribute: str = ""
    mesh_users: int = 0
    is_only_user: bool = True
    deformed_mesh: int = 0
    is_event_known: bool = True
    was_tagged: bool = False
    first: bytes | None = None
    skip_reason: str = ""
    user_error: SinewError | None = None
    failures_in_a_row: int = 0
    failures: int = 0
    failure: str = ""
    needs_recheck: bool = False
    changed_unannounced: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)
    milliseconds: float = 0.0
    shapes: int = 0

    def is_untouched_by(self, changes: Changes) -> bool:
        """Whether nothing that the shape depends on is among the changes."""
        return (
            changes.complete
            and not (changes.structure or changes.armatures)
            and self.dependencies.isdisjoint(changes.touched)
        )

    def was_deformed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the last evaluation gave the object its shape."""
        if self.uses_builtin:
            return self.builtin_fingerprint == small_meshes.fingerprint(obj)
        return (
            self.deformed_mesh != 0 and self.deformed_mesh == obj.data.evaluated_get(depsgraph).as_pointer()
        )

    def is_untouched_by_frame(self, obj: bpy.types.Object, meshes: set[int] | None) -> bool:
        """Whether a change of frame, whose Changes.meshes_in() these are and which changed nothing else, left
        what the shape is made of as it was. What is left to Blender has its shape in any case."""
        if meshes is None:
            return not self.needs_recheck
        if self.uses_builtin:
            self.needs_recheck = True
            return True
        if self.needs_recheck or obj.data.session_uid in meshes:
            return False
        return self.mode == obj.mode and self.object_state == _object_state(obj)

    def is_attached(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew's modifier is there, with its node group where that is needed: of what another
        add-on's handler takes away Blender tells nobody."""
        modifier = obj.modifiers.get(self.modifier)
        if self.uses_builtin:
            return modifier is not None
        return getattr(modifier, "node_group", None) is not None

    def fail(self, error: Exception) -> None:
        """Within an evaluation, which could not be given points."""
        if isinstance(error, SinewError):
            self.user_error = error
        self.skip_reason = self.failure = f"{type(error).__name__}: {error}"
        self.failures += 1

    @property
    def uses_builtin(self) -> bool:
        return bool(self.builtin_fingerprint)

    @property
    def points(self) -> np.ndarray:
        """The shape of the last frame, float32 [vertices, 3], object space; the chain's own."""
        with self.lock:
            return self.skin_stack.points

    @property
    def binding(self) -> Binding:
        """Of the first Armature modifier."""
        return self.skin_stack.skin_stages[0].binding


def update(
    obj: bpy.types.Object, skinned: SkinnedObject | None, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> SkinnedObject | None:
    """Deforms an object that is on, if anything changed; its state from now on, None where it waits for
    another evaluation, or is in a mode of the modifier.

    Raises SinewError with a sentence for the user where it can not be driven.
    """
    if obj.library is not None:
        # Its Armature modifier deforms it: that is how its file is saved.
        return None
    if skinned is not None and skinned.user_error is not None:
        raise skinned.user_error
    mode = obj.mode
    if skinned is not None and not skinned.is_attached(obj):
        skinned.needs_apply = True
        nodes = stack.sinew_modifier(obj)
        skinned.group_losses += nodes is not None and nodes.node_group is None
        if skinned.group_losses > MAX_GROUP_LOSSES:
            raise SinewError(
                f"{obj.name}: something removes Sinew's node group again and again, another add-on perhaps; "
                "stop that, then press Rebind"
            )
    if skinned is not None and skinned.name != obj.name:
        skinned.name, skinned.skip_reason = obj.name, "it has another name"
    if skinned is not None and skinned.needs_recheck:
        changes.meshes.add(obj.data.session_uid)
        changes.touched.add(obj.data.session_uid)
    if (
        skinned is not None
        and skinned.mode == mode
        and not (skinned.needs_apply or skinned.skip_reason)
        and skinned.is_untouched_by(changes)
    ):
        return skinned
    if mode in MODES_OF_THE_MODIFIER or obj.data.is_editmode:
        apply_plan.apply(obj, apply_plan.plan_of(obj))
        return None
    deformed_mesh = skinned is not None and not skinned.skip_reason and skinned.was_deformed(obj, depsgraph)
    if skinned is not None and skinned.skip_reason:
        skinned.failures_in_a_row += 1
    inspect = (
        skinned is None
        or skinned.mode != mode
        or skinned.needs_apply
        or bool(skinned.skip_reason)
        or changes.structure
    )
    keys = obj.data.shape_keys
    if not inspect and (
        obj.session_uid in changes.objects
        or changes.armatures
        or (keys is not None and keys.session_uid in changes.touched)
    ):
        # Being asked for points touches the object by itself.
        in_depsgraph = skinned.plan.state is State.IN_DEPSGRAPH
        inspect = not (deformed_mesh or in_depsgraph) or _object_state(obj) != skinned.object_state
    if (
        not inspect
        and deformed_mesh
        and not changes.armatures
        and obj.data.session_uid not in changes.touched
    ):
        skinned.dirtied_by_frames = False
        return skinned
    if inspect and is_rendering_in_window():
        # Seen to when the render has ended.
        if skinned is None:
            return None
        skinned.needs_apply, inspect = True, False
    wanted = before = skinned.plan if skinned is not None else None
    was_on = properties.of(obj).replaces_modifiers
    if inspect:
        _check(obj, changes)
        wanted = apply_plan.plan_of(
            obj, skinned.failure if skinned and skinned.failures_in_a_row > MAX_FAILURES_IN_A_ROW else ""
        )
        apply_plan.apply(obj, wanted)
    # First of all, as groups are renamed along with bones.
    bones_changed = skinned is not None and _bones_changed(obj, skinned, depsgraph, changes)
    # While Sinew's modifier was off, nothing had Blender evaluate what stands in front.
    if not source.is_ready(obj, depsgraph, was_on):
        # What is in another scene stays as it is.
        return None if obj.evaluated_get(depsgraph).is_evaluated else skinned
    known, known_source = skinned, skinned and skinned.source
    reads_later = skinned is not None and _reads_later(obj, skinned, depsgraph, changes)
    skinned = _current(obj, skinned, depsgraph, changes, inspect, reads_later, bones_changed)
    if skinned is not known and known is not None:
        skinned.failures, skinned.failure, skinned.failures_in_a_row = (
            known.failures,
            known.failure,
            known.failures_in_a_row,
        )
        skinned.group_losses = known.group_losses
    skinned.needs_recheck, skinned.changed_unannounced = reads_later, False
    if inspect or not skinned.dependencies:
        skinned.plan, skinned.needs_apply, skinned.name, skinned.was_tagged = wanted, False, obj.name, True
        skinned.builtin_fingerprint = small_meshes.fingerprint(obj) if wanted.state is State.BUILT_IN else []
        skinned.visibility_keyed = [is_visibility_animated(obj, m) for m in stack.armature_modifiers(obj)]
        skinned.modifier, skinned.object_state = stack.sinew_modifier(obj).name, _object_state(obj)
        mesh = obj.data.session_uid
        keys = _uid(obj.data.shape_keys)
        skinned.dependencies = {
            obj.session_uid,
            mesh,
            keys,
            _uid(properties.of(obj).upstream_proxy),
            *skinned.armatures,
        }
        if not wanted.uses_builtin:
            keep_poses_evaluated(obj, skinned)
    # A render lists all as new with each frame; to tag the object has Blender (4.2 to 5.2) copy it anew,
    # without what animation had set.
    is_same = skinned is known and skinned.source.equals(known_source)
    if skinned.uses_builtin:
        skinned.frames = None
    elif skinned.plan.state is State.IN_DEPSGRAPH:
        skinned.dirtied_by_frames = False
        if skinned.plan.in_buffer:
            point_store.set_rest_points(obj, skinned.source.points, anew=wanted != before)
        if skinned.skip_reason or not is_same or wanted != before:
            skinned.skip_reason, skinned.was_tagged = "", True
            # Blender evaluates the object once more, and so asks for its points.
            obj.update_tag(refresh={"OBJECT"})
    else:
        with skinned.lock:
            is_first = before is None or before.state is not State.AFTER_UPDATE
            _deform(obj, skinned, depsgraph, changes, inspect, is_first)
    skinned.source.known_key_values = skinned.source.key_values
    return skinned


def _reads_later(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether weights are read with the next event only: in a window, while a shape key's slider moves."""
    return not bpy.app.background and source.is_slider_moved(obj, skinned.source, depsgraph, changes)


def _object_state(obj: bpy.types.Object) -> list:
    """What the artist can change of the object itself that decides how it is driven."""
    settings = properties.of(obj)
    mesh, keys = obj.data, obj.data.shape_keys
    object_state = [
        settings.replaces_modifiers,
        obj.parent_type,
        _uid(obj.parent),
        mesh.session_uid,
        mesh.users,
        obj.show_only_shape_key,
    ]
    object_state.append(keys is None or keys.use_relative)
    if settings.upstream_proxy is not None:
        object_state.append(upstream_proxy.signature(obj))
    object_state += [armature.mode for armature in settings.armatures]
    # What an animation sets has no other event.
    object_state += sorted(path for path in animated_paths(obj) if path.startswith(("sinew.", "modifiers")))
    object_state += obj.vertex_groups.keys()
    for modifier in obj.modifiers:
        object_state += (modifier.name, modifier.show_viewport, modifier.show_render)
        if modifier.type == "ARMATURE":
            object_state += (modifier.object, attach.method_of(modifier), *ModifierOptions.values(modifier))
    return object_state


def _deform(
    obj: bpy.types.Object,
    skinned: SkinnedObject,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
    is_first: bool,
) -> None:
    """Writes the points of this evaluation for the next one, where they differ from what is there.

    is_first  the object was not deformed after the update before: what holds its points has others
    """
    # Binding is not part of a frame's time: it happens once.
    started, before = time.perf_counter(), skinned.rest_points
    differs = _shape(obj, skinned, depsgraph)
    if differs is None:
        return
    if changes.frame:
        reshaped = before is not None and skinned.rest_points is not before
        skinned.dirtied_by_frames = reshaped or obj.session_uid in changes.moved
    if differs or is_first:
        point_store.write(obj, skinned.skin_stack.points, skinned.source.points)
        skinned.milliseconds = 1000.0 * (time.perf_counter() - started)
    elif touched and not point_store.are_written(obj, len(skinned.rest_points)):
        point_store.write(obj, skinned.skin_stack.points, skinned.source.points)


def bring_up_to_date(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph
) -> SkinnedObject:
    """What is known of a mesh that is left to Blender becomes that of this evaluation, for those who measure
    or bake it; of others it is. Changes nothing in Blender.

    Raises SinewError where the mesh has become one that can not be driven.
    """
    if not skinned.uses_builtin:
        return skinned
    current = skinned
    if skinned.needs_recheck:
        current = _current(obj, skinned, depsgraph, Changes(meshes={obj.data.session_uid}))
        current.plan, current.needs_apply, current.needs_recheck = skinned.plan, skinned.needs_apply, False
        current.builtin_fingerprint, current.object_state, current.dependencies = (
            skinned.builtin_fingerprint,
            skinned.object_state,
            skinned.dependencies,
        )
    with current.lock:
        _shape(obj, current, depsgraph)
    return current


def _shape(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> bool | None:
    """Brings the chain's points up to this evaluation.

    Whether they differ from the last ones; None where what decides them is unknown, and the last stay.
    """
    replaced_modifiers = properties.of(obj).replaced_modifiers
    armatures = [s.armature and s.armature.evaluated_get(depsgraph) for s in replaced_modifiers]
    evaluated = obj.evaluated_get(depsgraph)
    settings = properties.of(evaluated)
    if [replaced.name for replaced in settings.replaced_modifiers] != [
        replaced.name for replaced in replaced_modifiers
    ]:
        # Sinew was put on, or modifiers moved, since Blender evaluated it: what animation makes of the
        # settings comes with the next time.
        settings = properties.of(obj)
    frames = _frames(evaluated, settings, armatures, skinned, depsgraph.mode)
    if frames is None or not _are_finite(frames):
        return None
    skinned.frames = frames
    skinned.rest_points = source.rest_points(obj, skinned.source, depsgraph)
    differs = skinned.skin_stack.deform(skinned.rest_points, frames)
    skinned.shapes += differs
    return differs


def deform_evaluated(evaluated: bpy.types.Object, mesh: bpy.types.Mesh, skinned: SkinnedObject) -> None:
    """Writes the points into an evaluated mesh, or into the evaluated carrier, while Blender evaluates its
    object, of evaluated data alone.

    Leaves it as it is where something is out of the ordinary: that is for update().
    """
    if skinned.plan.state is not State.IN_DEPSGRAPH:
        return
    settings = evaluated.sinew
    # Evaluated ones, as the driver reads them.
    armatures = [replaced.armature for replaced in settings.replaced_modifiers]
    if skinned.mode != evaluated.mode or not (skinned.is_only_user or skinned.plan.in_buffer):
        skinned.skip_reason = "its mode, or the users of its mesh, changed"
        return
    if [armature is None for armature in armatures] != [not uid for uid in skinned.armatures]:
        skinned.skip_reason = "its Armature modifiers changed"
        return
    shown = _points_to_write(settings, mesh, skinned)
    if shown is None or len(shown) != len(skinned.source.points):
        skinned.skip_reason = "its mesh changed"
        return
    if not (skinned.is_event_known or skinned.plan.in_buffer) and skinned.first is not None:
        # Another add-on's handler touched the mesh, of which Blender tells nobody: it is a new copy,
        # without the points that were written last.
        skinned.changed_unannounced |= shown[0].tobytes() != skinned.first
        skinned.needs_recheck |= skinned.changed_unannounced
    with skinned.lock:
        _deform_into(shown, evaluated, mesh, skinned, armatures)


def _points_to_write(
    settings: properties.SinewSettings, mesh: bpy.types.Mesh, skinned: SkinnedObject
) -> np.ndarray | None:
    """The memory of the evaluated mesh, or of the evaluated carrier; None where it is not there."""
    if not skinned.plan.in_buffer:
        return mesh_io.points_in(mesh, skinned.attribute)
    point_buffer = settings.point_buffer
    # What an evaluated object has as its data, Blender does not always mark as evaluated.
    if point_buffer is None or not point_buffer.is_evaluated:
        return None
    return mesh_io.points_in(point_buffer.data, mesh_io.POSITION)


def _deform_into(
    shown: np.ndarray,
    evaluated: bpy.types.Object,
    mesh: bpy.types.Mesh,
    skinned: SkinnedObject,
    armatures: list[bpy.types.Object],
) -> None:
    started = time.perf_counter()
    frames = _frames(evaluated, evaluated.sinew, armatures, skinned, "VIEWPORT")
    rest_points = source.evaluated_points(evaluated, mesh, skinned.source)
    if rest_points is None:
        skinned.skip_reason = "what modifiers in front make of its mesh changed"
        return
    if frames is None:
        # The last shape stays.
        last = skinned.skin_stack.points
        shown[:] = rest_points if last is None else last
    else:
        skinned.skin_stack.deform(rest_points, frames, shown)
        skinned.frames, skinned.rest_points = frames, rest_points
        skinned.shapes += 1
    if skinned.plan.in_buffer:
        point_store.mark_as_written(shown, skinned.source.points)
    skinned.first = shown[0].tobytes()
    skinned.deformed_mesh, skinned.skip_reason, skinned.failures_in_a_row = mesh.as_pointer(), "", 0
    skinned.milliseconds = 1000.0 * (time.perf_counter() - started)


def _are_finite(frames: list[SkinStageFrame | None]) -> bool:
    return all(np.isfinite(frame.pose).all() for frame in frames if frame is not None)


def keep_poses_evaluated(obj: bpy.types.Object, skinned: SkinnedObject) -> None:
    """Keeps the poses evaluated even where an armature is hidden, and has Blender ask for the points where it
    can."""
    settings, pairs, mesh = properties.of(obj), attach.replaced_modifiers(obj), obj.data
    skinned.attribute, skinned.mesh_users, skinned.is_only_user = settings.attribute, mesh.users, True
    poses = [
        (replaced.armature, path)
        for (_modifier, replaced), skin_stage in zip(pairs, skinned.skin_stack.skin_stages, strict=False)
        if replaced.armature is not None
        for path in armature_io.paths_to_wait_for(replaced.armature, skin_stage.binding.moving_bones)
    ]
    pose_driver.ensure(obj, list(dict.fromkeys(poses)), skinned.plan.state is State.IN_DEPSGRAPH)


def _check(obj: bpy.types.Object, changes: Changes) -> None:
    """Brings what Sinew keeps of the modifiers in line with what the artist did to them.

    Raises SinewError where those that Sinew works with are gone.
    """
    if stack.armature_modifier(obj) is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    # What decides the plan, such as Preserve Volume, is the artist's own.
    attach.resume_after_save(obj)
    attach.follow_stack(obj)
    attach.adopt_pointers(obj)
    _check_armatures(obj, changes)


def _check_armatures(obj: bpy.types.Object, changes: Changes) -> None:
    armatures = properties.of(obj).armatures
    if not armatures:
        raise SinewError(
            f"{obj.name}: its armature was deleted; choose another in the Armature modifier and press "
            "Rebind, or Remove"
        )
    for armature in armatures:
        if changes.structure and attach.is_deleted(armature):
            raise SinewError(
                f"{obj.name}: its armature {armature.name} was deleted, or is in no collection; choose "
                "another in the Armature modifier and press Rebind, or Remove"
            )


def _frames(
    evaluated: bpy.types.Object,
    settings: properties.SinewSettings,
    armatures: list[bpy.types.Object | None],
    skinned: SkinnedObject,
    mode: str,
) -> list[SkinStageFrame | None] | None:
    """What decides each link's part in this frame; None where that is unknown, and the last shape stays.

    settings   the object's, evaluated
    armatures  each link's, evaluated
    mode       the depsgraph's
    """
    method, scale_rule = settings.method, settings.scale_rule
    if not (method and scale_rule):
        raise SinewError(
            f"{evaluated.name}: the driver of its method or scale gives a number that stands for none; "
            f"methods are {', '.join(f'{m.number} {m.label}' for m in properties.METHODS.values())}"
        )
    frames: list[SkinStageFrame | None] = []
    for skin_stage, replaced, armature, visibility_keyed in zip(
        skinned.skin_stack.skin_stages,
        settings.replaced_modifiers,
        armatures,
        skinned.visibility_keyed,
        strict=False,
    ):
        flags = evaluated.modifiers[replaced.name] if visibility_keyed or skinned.uses_builtin else replaced
        if armature is None or armature.mode == "EDIT" or not _takes_part(flags, mode):
            frames.append(None)
            continue
        space = armature_io.bones_from_model(evaluated, armature)
        if space is None:
            # An armature scaled to nothing for a moment.
            return None
        pose = armature_io.read_pose(armature, skin_stage.binding.bones)
        own = properties.method_of_modifier(method, replaced.method, is_first=not frames)
        mix = settings.mixed_method if own == method else ""
        frames.append(SkinStageFrame(own, pose, space, scale_rule, mix))
    return frames


def _takes_part(flags: properties.SinewReplacedModifier | bpy.types.Modifier, mode: str) -> bool:
    return flags.show_render if mode == "RENDER" else flags.show_viewport


def _current(
    obj: bpy.types.Object,
    skinned: SkinnedObject | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    inspect: bool = False,
    reads_later: bool = False,
    bones_changed: bool = False,
) -> SkinnedObject:
    """The object's state, bound anew where its mesh, weights, bones or modifiers changed.

    inspect        the object itself may have changed
    is_read_later  its mesh may have, too, and is not read now
    bones_changed  its bones did
    """
    if skinned is None:
        return _bind(obj, depsgraph)
    skinned.mode = obj.mode
    if inspect:
        pairs = attach.replaced_modifiers(obj)
        armatures = [_uid(replaced.armature) for _modifier, replaced in pairs]
        options = [ModifierOptions.read(modifier) for modifier, _replaced_modifier in pairs]
        is_same_mix = skinned.mix_group == properties.of(obj).mix.group
        if skinned.armatures != armatures or skinned.options != options or not is_same_mix:
            return _bind(obj, depsgraph)
    if bones_changed:
        return _bind(obj, depsgraph, skinned)
    if not reads_later and source.has_changed(obj, skinned.source, depsgraph, changes, inspect):
        return _bind(obj, depsgraph, skinned)
    return skinned


def _uid(data: bpy.types.ID | None) -> int:
    return 0 if data is None else data.session_uid


def _bones_changed(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    changed = False
    for skin_stage, replaced in zip(
        skinned.skin_stack.skin_stages, properties.of(obj).replaced_modifiers, strict=False
    ):
        armature, known = replaced.armature, skin_stage.binding.bones
        if armature is None or armature.mode == "EDIT":
            continue
        if armature.data.session_uid in changes.armatures or not known.complete:
            bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
            changed |= not bones.equals(known)
    return changed


def _bind(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, old: SkinnedObject | None = None
) -> SkinnedObject:
    """Reads mesh, weights and bones; keeps the old bindings where they came out the same."""
    read = source.read(obj, depsgraph)
    pairs = attach.replaced_modifiers(obj)
    bones = [_read_bones(replaced.armature, depsgraph) for _modifier, replaced in pairs]
    if (
        old is not None
        and old.mix_group == properties.of(obj).mix.group
        and read.equals_but_for_points(old.source)
        and all(
            b.equals(skin_stage.binding.bones)
            for b, skin_stage in zip(bones, old.skin_stack.skin_stages, strict=False)
        )
    ):
        if np.array_equal(read.points, old.source.points):
            # The same array tells that nothing moved.
            read.points = old.source.points
        old.source = read
        return old
    options = [ModifierOptions.read(modifier) for modifier, _replaced_modifier in pairs]
    mix_group = properties.of(obj).mix.group
    mix_weights = _mix_weights(obj, read, mix_group)
    skin_stages = [
        SkinStage(
            Binding(option.weighting(obj, read.weights, its_bones), mix_weights),
            option.mask_weights(obj, read.weights),
            option.multi,
        )
        for option, its_bones in zip(options, bones, strict=True)
    ]
    facts = survey.describe(
        obj, pairs[0][1].armature, skin_stages[0].binding.weighting, read.points, depsgraph
    )
    armatures = [_uid(replaced.armature) for _modifier, replaced in pairs]
    visibility_keyed = [is_visibility_animated(obj, modifier) for modifier, _replaced_modifier in pairs]
    return SkinnedObject(
        obj.mode, armatures, options, visibility_keyed, read, SkinStack(skin_stages), facts, mix_group
    )


def _mix_weights(obj: bpy.types.Object, read: Source, name: str) -> np.ndarray | None:
    """float32 [vertices], 0 to 1; None where there is no such group."""
    group = obj.vertex_groups.get(name) if name else None
    return None if group is None else read.weights.of_group(group.index)


def _read_bones(armature: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> Bones:
    if armature is None or armature.mode == "EDIT":
        return Bones.none()
    return armature_io.read_bones(armature.evaluated_get(depsgraph))
