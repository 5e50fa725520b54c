# SPDX-License-Identifier: GPL-3.0-or-later
"""What an event means for one skinned object: what is read again, what changes in the file, who deforms
it."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..attach import attach, normals, point_store, pose_driver, properties, stack
from ..attach.updates import is_rendering_in_window
from ..core.errors import SinewError
from ..io import armature_io
from ..io.animation_paths import animated_paths
from . import after_update, apply_plan, bound, precomputing, source
from .changes import Changes
from .plan import Plan, State, plan
from .skinned_object import SkinnedObject

# How often the node group is restored after another add-on removed it.
MAX_GROUP_LOSSES = 2
# How often in a row Sinew may fail to deform a mesh within Blender's evaluation and still try again there.
MAX_FAILURES_IN_A_ROW = 1
# The failure where Blender never asks.
NOT_REQUESTED = "Blender did not request the points"


def update(
    obj: bpy.types.Object,
    old: Plan,
    skinned: SkinnedObject | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
) -> SkinnedObject | Plan:
    """Deforms an object, or has Blender do so with the next evaluation, if anything changed.

    old      its plan until now
    skinned  what was read of it; None for nothing

    Returns what is known of it from now on; its plan where nothing is read. Raises SinewError with a sentence
    for the user where Sinew cannot deform it.
    """
    error = old.reason if old.state is State.REFUSED else _unknown_method(obj)
    inspect = skinned is None or bool(error) or not properties.of(obj).enabled
    if not inspect and _is_unchanged(obj, skinned, changes):
        return skinned
    inspect = inspect or _needs_inspection(obj, skinned, depsgraph, changes)
    if not inspect and _has_shape(obj, skinned, depsgraph, changes):
        skinned.dirtied_by_frames = False
        return skinned
    if inspect and is_rendering_in_window():
        # This is done when the render has ended.
        if skinned is None:
            return old
        skinned.needs_apply, inspect = True, False
        if error or not properties.of(obj).enabled:
            return skinned
    return _react(obj, old, skinned, depsgraph, changes, inspect, error)


def _react(
    obj: bpy.types.Object,
    old: Plan,
    skinned: SkinnedObject | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    inspect: bool,
    error: str,
) -> SkinnedObject | Plan:
    """inspect: the object itself may have changed; error: why it can not be deformed."""
    before, known = (None, None) if skinned is None else (skinned.plan, skinned.bound)
    was_on = properties.of(obj).replaces_modifiers
    new = _apply_plan(obj, old, skinned, changes, error) if inspect else old
    if not new.is_read:
        if skinned is None or new.state is not State.OFF:
            return new
        # So that it need not be read again when it is switched on.
        skinned.plan, skinned.needs_apply = new, True
        return skinned
    # Before anything else, as groups are renamed along with bones.
    bones_changed = skinned is not None and _have_bones_changed(obj, skinned, depsgraph, changes)
    # While Sinew's modifier was off, nothing made Blender evaluate the upstream proxy.
    if not source.is_ready(obj, depsgraph, was_on):
        # What is hidden, or in another scene, stays as it is.
        is_shown = obj.visible_get(view_layer=depsgraph.view_layer)
        if skinned is not None and not (is_shown and obj.evaluated_get(depsgraph).is_evaluated):
            return skinned
        return replace(new, state=State.WAITING_UPSTREAM)
    skinned = _bind(obj, skinned, depsgraph, changes, inspect, bones_changed)
    new = _with_data(obj, skinned, new, depsgraph)
    if inspect or skinned.bound.is_of_another_stack(known):
        _note_applied(obj, skinned, new, in_render_frame=changes.frame and depsgraph.mode == "RENDER")
    skinned.plan = new
    # A render lists everything as new with each frame. Tagging the object makes Blender (4.2 to 5.2) copy it
    # again, without what animation had set.
    is_same = not skinned.bound.is_of_another_stack(known) and skinned.bound.source.equals(known.source)
    is_same &= not skinned.has_new_data
    skinned.data_versions = skinned.bound.data_versions
    if new.is_in_depsgraph:
        _request_points(obj, skinned, depsgraph, changes, is_new_plan=new != before, is_same=is_same)
    elif new.after_update:
        is_first = before is None or not before.after_update
        with skinned.lock:
            after_update.deform(obj, skinned, depsgraph, changes, inspect, is_first or not is_same)
    else:
        skinned.shown.frames = None
    skinned.bound.source.known_key_values = skinned.bound.source.key_values
    return skinned


def _note_applied(obj: bpy.types.Object, skinned: SkinnedObject, plan: Plan, in_render_frame: bool) -> None:
    if not plan.uses_builtin:
        keep_poses_evaluated(obj, skinned, plan)
    # After Sinew's driver is added, as the driver counts as animation, too.
    skinned.note_object(obj, plan)
    if in_render_frame:
        # Applying the plan can have Blender copy the object again: what the frame has set is set again.
        obj.update_tag(refresh={"OBJECT", "TIME"})


def _lacks_points(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether Blender evaluated another pose without requesting the points, as where the driver is muted."""
    evaluation = skinned.evaluation
    if not skinned.plan.is_in_depsgraph or skinned.needs_apply or evaluation.mesh or evaluation.skip_reason:
        return False
    is_known = (
        skinned.mode == apply_plan.mode_of(obj) and not skinned.needs_recheck and skinned.is_as_noted(obj)
    )
    is_hidden = depsgraph.mode == "VIEWPORT" and not obj.visible_get(view_layer=depsgraph.view_layer)
    if not is_known or is_hidden or not obj.evaluated_get(depsgraph).is_evaluated:
        return False
    if not source.is_ready(obj, depsgraph) or _have_bones_changed(obj, skinned, depsgraph, changes):
        return False
    if source.has_changed(obj, skinned.bound.source, depsgraph, changes, touched=True):
        return False
    with skinned.lock:
        return skinned.shown.frames is not None and after_update.shape(obj, skinned, depsgraph)


def _have_bones_changed(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    # While it was off, changes were not recorded.
    are_unknown = skinned.plan.state is State.OFF or changes.after_step
    return bound.have_bones_changed(obj, skinned.bound, depsgraph, changes, are_unknown)


def _check_attached(obj: bpy.types.Object, skinned: SkinnedObject) -> None:
    """Notes changes of Sinew's modifier and of the object's name since the last event.

    Raises SinewError where the user has to fix something first.
    """
    if skinned.evaluation.user_error is not None:
        raise skinned.evaluation.user_error
    if not skinned.is_attached(obj):
        skinned.needs_apply = True
        nodes = stack.sinew_modifier(obj)
        skinned.group_losses += nodes is not None and nodes.node_group is None
        if skinned.group_losses > MAX_GROUP_LOSSES:
            raise SinewError(
                f"{obj.name}: something removes Sinew's node group again and again, another add-on perhaps; "
                "stop that, then press Rebind"
            )
    if skinned.name != obj.name:
        skinned.name, skinned.evaluation.skip_reason = obj.name, "it has another name"


def _is_unchanged(obj: bpy.types.Object, skinned: SkinnedObject, changes: Changes) -> bool:
    """Whether nothing has to be read again. A mesh that needs a recheck counts as changed.

    Raises SinewError where the user has to fix something first.
    """
    _check_attached(obj, skinned)
    if skinned.needs_recheck:
        changes.meshes.add(obj.data.session_uid)
        changes.touched.add(obj.data.session_uid)
    return (
        skinned.mode == apply_plan.mode_of(obj)
        and not (skinned.needs_apply or skinned.evaluation.skip_reason)
        and skinned.is_untouched_by(changes)
    )


def _needs_inspection(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether the object itself may have changed, or could not be deformed as planned."""
    if _lacks_points(obj, skinned, depsgraph, changes):
        skinned.evaluation.note_failure(NOT_REQUESTED)
    is_skipped = bool(skinned.evaluation.skip_reason)
    if is_skipped:
        skinned.evaluation.failures_in_a_row += 1
    if skinned.mode != apply_plan.mode_of(obj) or skinned.needs_apply or is_skipped or changes.structure:
        return True
    keys = obj.data.shape_keys
    is_touched = obj.session_uid in changes.objects or uid_in(keys, changes.touched)
    if not (is_touched or changes.armatures):
        return False
    if obj.data.session_uid in changes.touched and normals.domain_of(obj.data) != skinned.normals_domain:
        return True
    # Requesting points touches the object, too.
    explains_touch = skinned.plan.is_in_depsgraph or skinned.was_deformed(obj, depsgraph)
    return not explains_touch or not skinned.is_as_noted(obj)


def uid_in(data: bpy.types.ID | None, uids: set[int]) -> bool:
    return data is not None and data.session_uid in uids


def _has_shape(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether the last evaluation gave it its shape, and nothing else changed that has to be read."""
    return (
        skinned.was_deformed(obj, depsgraph)
        and obj.data.session_uid not in changes.touched
        # Blender lists an armature's bones with each change of its pose.
        and not _have_bones_changed(obj, skinned, depsgraph, changes)
    )


def _apply_plan(
    obj: bpy.types.Object, old: Plan, skinned: SkinnedObject | None, changes: Changes, error: str
) -> Plan:
    """Raises SinewError where the modifiers that Sinew works with are gone."""
    wanted = plan(apply_plan.first_facts(obj, error))
    if wanted.is_read:
        _check_modifiers(obj, changes)
        waits_for = precomputing.waits_for(obj, skinned)
        wanted = plan(apply_plan.all_facts(obj, _failure_of(skinned), waits_for))
    apply_plan.apply(obj, old, wanted)
    return wanted


def _failure_of(skinned: SkinnedObject | None) -> str:
    """Why Sinew cannot deform it within Blender's evaluation; empty where nothing prevents it."""
    if skinned is None or skinned.evaluation.failures_in_a_row <= MAX_FAILURES_IN_A_ROW:
        return ""
    return skinned.evaluation.failure


def _with_data(
    obj: bpy.types.Object, skinned: SkinnedObject, wanted: Plan, depsgraph: bpy.types.Depsgraph
) -> Plan:
    """Requests the data that the methods need and returns the resulting plan. A plan that waits needs the
    same modifiers and storage as one that does not, so it need not be applied again."""
    if wanted.uses_builtin:
        return wanted
    if wanted.normals.domain:
        # Not within Blender's evaluation: it takes as long as several frames.
        skinned.bound.source.make_normals()
    precomputing.request(obj, skinned, depsgraph)
    waits_for = precomputing.waits_for(obj, skinned)
    if waits_for == (wanted.reason if wanted.state is State.WAITING else ""):
        return wanted
    return plan(apply_plan.all_facts(obj, _failure_of(skinned), waits_for))


def _unknown_method(obj: bpy.types.Object) -> str:
    """Returns a sentence where a method is one that this Sinew does not know."""
    # A driver that gives a number without a method has a sentence of its own.
    if properties.has_known_methods(properties.of(obj)) or "sinew.method" in animated_paths(obj):
        return ""
    return f"{obj.name}: its method is of a newer Sinew; update Sinew, or choose another method"


def _check_modifiers(obj: bpy.types.Object, changes: Changes) -> None:
    """Brings what Sinew stores about the modifiers in line with what the artist did to them.

    Raises SinewError where those that Sinew works with are gone.
    """
    if stack.armature_modifier(obj) is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    # The plan depends on settings such as Preserve Volume as the artist set them.
    attach.restore_volume(obj)
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


def _bind(
    obj: bpy.types.Object,
    skinned: SkinnedObject | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    inspect: bool,
    bones_changed: bool,
) -> SkinnedObject:
    """Binds the object again where its mesh, weights, bones or modifiers changed.

    inspect  the object itself may have changed
    """
    if skinned is None:
        return SkinnedObject(bound.read(obj, depsgraph), obj.name, obj.mode)
    skinned.mode = obj.mode
    # In a window, while a shape key's slider moves, weights are read only at the next event.
    reads_later = not bpy.app.background and source.is_slider_moved(
        obj, skinned.bound.source, depsgraph, changes
    )
    if inspect and bound.is_of_other_modifiers(obj, skinned.bound):
        skinned.bind(bound.read(obj, depsgraph))
    elif bones_changed or (
        not reads_later and source.has_changed(obj, skinned.bound.source, depsgraph, changes, inspect)
    ):
        skinned.bind(bound.read(obj, depsgraph, skinned.bound))
    elif bound.lacks_surface(obj, skinned.bound):
        skinned.bind(bound.with_surface(obj, depsgraph, skinned.bound))
    skinned.needs_recheck, skinned.evaluation.changed_unannounced = reads_later, False
    return skinned


def _request_points(
    obj: bpy.types.Object,
    skinned: SkinnedObject,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    is_new_plan: bool,
    is_same: bool,
) -> None:
    """Has Blender evaluate the object once more, and thereby request its points, where they may differ."""
    skinned.dirtied_by_frames = False
    if skinned.plan.in_buffer:
        rest_points = skinned.bound.source.points
        point_store.set_rest_points(obj, depsgraph, rest_points, skinned.normal_count, anew=is_new_plan)
    if skinned.evaluation.skip_reason or not is_same or is_new_plan:
        skinned.evaluation.skip_reason, skinned.evaluation.was_tagged = "", True
        # The object is then copied again, and what the change of frame has set has to be set again: originals
        # of hidden objects do not have it.
        obj.update_tag(refresh={"OBJECT", "TIME"} if changes.frame else {"OBJECT"})


def keep_poses_evaluated(obj: bpy.types.Object, skinned: SkinnedObject, plan: Plan) -> None:
    """Keeps the poses evaluated even where an armature is hidden, and has Blender request the points where
    the plan says so."""
    settings, pairs, mesh = properties.of(obj), attach.replaced_modifiers(obj), obj.data
    skinned.attribute, skinned.normals_attribute = settings.attribute, settings.normals_attribute
    skinned.mesh_users, skinned.is_only_user = mesh.users, True
    poses = [
        (replaced.armature, path)
        for (_modifier, replaced), stage in zip(pairs, skinned.bound.skin_stack.skin_stages, strict=False)
        if replaced.armature is not None
        for path in armature_io.paths_to_wait_for(replaced.armature, stage.deformer.moving_bones)
    ]
    pose_driver.ensure(obj, list(dict.fromkeys(poses)), plan.is_in_depsgraph)
