# SPDX-License-Identifier: GPL-3.0-or-later
"""Observes what an event shows of an object, and does what react.py decides."""

from contextlib import suppress
from dataclasses import dataclass, replace

import bpy

from ..attach import attach, layout, normals, point_store, properties, stack, stage_settings, upstream_proxy
from ..attach.layout import Layout
from ..attach.updates import may_change_file
from ..base.errors import SinewError
from ..io import armature_io
from ..io.actions import animated_paths
from . import after_update, apply_plan, bound, events, precomputing, source
from .bound import uid
from .changes import Changes
from .plan import Plan, State, plan
from .react import Facts, Inputs, Reading, Step, reading_of, step_of
from .skinned_object import Noted, SkinnedObject

# How often the node group is restored after another add-on removed it.
MAX_GROUP_LOSSES = 2
# How often in a row Sinew may fail to deform a mesh within Blender's evaluation and still try again there.
MAX_FAILURES_IN_A_ROW = 1
# The failure where the driver never requests the points.
NOT_REQUESTED = "Blender did not request the points"


def update(
    obj: bpy.types.Object,
    now: Layout | None,
    old: Plan,
    skinned: SkinnedObject | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
) -> SkinnedObject | Plan:
    """Deforms an object, or has Blender do so with the next evaluation, if anything changed.

    now      its layout; None where it was not read yet
    old      its plan until now
    skinned  what was read of it; None for nothing

    Returns what is known of it from now on; its plan where nothing is read. Raises SinewError with a sentence
    for the user where Sinew cannot deform it.
    """
    event = _Event(obj, now, old, skinned, depsgraph, changes)
    event.follow()
    facts = event.observe()
    step = step_of(facts)
    if step is Step.REPLAN:
        event.replan(facts)
    if step is Step.NOTHING or not event.plan.is_read or not event.is_upstream_there():
        return event.left_as_it_is(facts)
    event.read()
    event.settle(facts)
    event.show()
    return event.skinned


@dataclass
class _Event:
    """What one event means for one object.

    seen              its layout; None where it has to be read
    plan, is_planned  its plan now, and whether that was made in this event
    is_applied        and whether it was applied: one that stays need not be
    is_read           whether any of what was read of it was read again
    inputs            how it differed from that
    is_copy_outdated  the upstream proxy's copy of the mesh has to be made again
    is_rescaled       lengths among its settings are others for the mesh than before
    differs           its shape may differ from the one that is shown
    """

    obj: bpy.types.Object
    seen: Layout | None
    old: Plan
    skinned: SkinnedObject | None
    depsgraph: bpy.types.Depsgraph
    changes: Changes
    is_planned: bool = False
    is_applied: bool = False
    is_read: bool = False
    is_copy_outdated: bool = False
    is_rescaled: bool = False
    differs: bool = False

    def __post_init__(self) -> None:
        self.plan, self.inputs = self.old, Inputs()
        self.bound_before = None if self.skinned is None else self.skinned.bound
        self.was_on = properties.of(self.obj).replaces_modifiers
        self.error = _error_of(self.obj, self.old, self.skinned)
        self.is_prevented = bool(self.error) or not properties.of(self.obj).enabled

    @property
    def layout(self) -> Layout:
        """The object's, read once, and again after the stack was changed."""
        self.seen = self.seen or layout.read(self.obj)
        return self.seen

    def follow(self) -> None:
        """Notes another scale of the object, and brings the upstream proxy's copy of the mesh up to date."""
        skinned, mesh, changes = self.skinned, self.obj.data, self.changes
        if mesh.session_uid in changes.meshes and events.others_are_subscribed():
            # It is listed by what Sinew has evaluated within the event, as by what others' handlers change.
            upstream_proxy.compare_again(self.obj)
        if skinned is None or self.is_prevented:
            return
        if skinned.needs_recheck:
            changes.meshes.add(mesh.session_uid)
            changes.touched.add(mesh.session_uid)
        if may_change_file():
            self._follow_scale()
        if mesh.session_uid in changes.meshes and not mesh.is_editmode:
            self._follow_mesh()

    def _follow_scale(self) -> None:
        """Not where animation scales it, which would have the mesh bound anew with each frame."""
        obj, changes = self.obj, self.changes
        is_moved = not changes.frame and obj.session_uid in changes.moved and obj.is_editable
        self.is_rescaled = is_moved and stage_settings.has_other_scale(obj)
        for each in (obj, obj.evaluated_get(self.depsgraph)) if self.is_rescaled else ():
            stage_settings.note_scale(each)

    def _follow_mesh(self) -> None:
        obj = self.obj
        self.is_copy_outdated = not upstream_proxy.is_current(obj)
        if self.is_copy_outdated and self.changes.frame and self.old.is_in_depsgraph:
            # Blender evaluates what handlers change, and Sinew deforms within that.
            upstream_proxy.follow_points(obj)
            self.is_copy_outdated = not upstream_proxy.is_current(obj)
        elif self.is_copy_outdated and self.changes.frame:
            upstream_proxy.share_mesh(obj)

    # --- Observing

    def observe(self) -> Facts:
        """Returns the facts. What would not matter beside the others is not looked at."""
        obj, skinned, changes = self.obj, self.skinned, self.changes
        if skinned is None or self.is_prevented:
            return Facts(may_change_file(), skinned is not None, self.is_prevented)
        facts = Facts(
            may_change_file(),
            # What a method needs may have been computed since the evaluation.
            is_due=skinned.needs_plan or skinned.has_new_data or self.is_rescaled,
            is_detached=not skinned.is_attached(obj),
            was_skipped=bool(skinned.evaluation.skip_reason) or skinned.noted.name != obj.name,
            is_other=skinned.noted.layout.mode != apply_plan.mode_of(obj)
            or self.is_copy_outdated
            or (skinned.noted.are_options_keyed and self._has_other_modifiers()),
            is_up_to_date=skinned.is_untouched_by(changes),
        )
        if facts.calls_for_plan or facts.is_up_to_date:
            return facts
        if self._is_unrequested():
            return replace(facts, lacks_points=True)
        if self._may_be_other():
            return replace(facts, is_other=True)
        # Blender lists an armature's bones with each change of its pose.
        has_shape = skinned.was_deformed(obj, self.depsgraph) and obj.data.session_uid not in changes.touched
        return replace(facts, is_up_to_date=has_shape and not self._have_bones_changed())

    def _has_other_modifiers(self) -> bool:
        return bound.is_of_other_modifiers(self.obj, self.layout, self.skinned.bound, self.depsgraph)

    def _is_unrequested(self) -> bool:
        """Computes its shape where Blender did not request it, as where the driver is muted. Returns whether
        it is another one."""
        obj, skinned, depsgraph = self.obj, self.skinned, self.depsgraph
        if not skinned.plan.is_in_depsgraph or skinned.evaluation.given:
            return False
        is_known = not skinned.needs_recheck and skinned.is_as_noted(obj, self.layout)
        is_hidden = depsgraph.mode == "VIEWPORT" and not obj.visible_get(view_layer=depsgraph.view_layer)
        if not is_known or is_hidden or not obj.evaluated_get(depsgraph).is_evaluated:
            return False
        if not source.is_ready(obj, depsgraph) or self._have_bones_changed():
            return False
        if source.has_changed(obj, skinned.bound.source, depsgraph, self.changes, touched=True):
            return False
        with skinned.lock, suppress(armature_io.NotPosedError):
            return skinned.shown.frames is not None and after_update.shape(obj, skinned, depsgraph)
        return False

    def _may_be_other(self) -> bool:
        """Whether the object, or what is around it, may not be as it was when its plan was applied."""
        obj, skinned, changes = self.obj, self.skinned, self.changes
        if changes.structure:
            # Of undo steps and of other depsgraphs not all is listed.
            if changes.after_step or not changes.complete or not skinned.has_same_surroundings(obj):
                return True
        elif not (
            changes.armatures
            or obj.session_uid in changes.objects
            or uid(obj.data.shape_keys) in changes.touched
        ):
            return False
        is_mesh_touched = obj.data.session_uid in changes.touched
        if is_mesh_touched and normals.domain_of(obj.data) != skinned.noted.normals_domain:
            return True
        is_reshaped = skinned.plan.uses_builtin and not skinned.was_deformed(obj, self.depsgraph)
        return is_reshaped or not skinned.is_as_noted(obj, self.layout)

    def _have_bones_changed(self) -> bool:
        # While it was off, changes were not recorded.
        are_unknown = self.old.state is State.OFF or self.changes.after_step
        return self.skinned.have_bones_changed(self.obj, self.depsgraph, self.changes, are_unknown)

    # --- Performing

    def replan(self, facts: Facts) -> None:
        """Decides anew who deforms the object, and applies that."""
        if self.skinned is not None:
            _count_failures(self.obj, self.skinned, facts)
        if attach.follow_own_icons(self.obj, self.layout):
            self.seen = None
        new = plan(apply_plan.first_facts(self.obj, self.layout, self.error))
        if new.is_read:
            self.seen = _check_modifiers(self.obj, self.layout, self.changes)
            new = self._full_plan()
        self.is_applied = not self._stays(facts, new)
        if self.is_applied:
            apply_plan.apply(self.obj, self.layout, self.old, new)
            self.seen = None
        self.plan, self.is_planned = new, True

    def _stays(self, facts: Facts, new: Plan) -> bool:
        """Whether the plan stays, and so does what it was applied to: choosing a method changes no modifier,
        and most undo steps change nothing of the object."""
        skinned, obj = self.skinned, self.obj
        if skinned is None or new != self.old or not new.is_in_depsgraph:
            return False
        may_stay = replace(facts, is_due=False, is_other=facts.is_other and not self.changes.after_step)
        if may_stay.calls_for_plan or not skinned.is_as_noted(obj, self.layout):
            return False
        return skinned.has_same_surroundings(obj)

    def _full_plan(self) -> Plan:
        failure = ""
        if self.skinned is not None and self.skinned.failures.in_a_row > MAX_FAILURES_IN_A_ROW:
            failure = self.skinned.failures.last
        lacks = precomputing.lacking(self.obj, self.skinned)
        return plan(apply_plan.all_facts(self.obj, self.layout, failure, lacks))

    def is_upstream_there(self) -> bool:
        """Whether Blender has evaluated what the object is made from."""
        # Before anything else, as groups are renamed along with bones.
        have_bones_changed = self.skinned is not None and self._have_bones_changed()
        self.inputs = Inputs(have_bones_changed=have_bones_changed)
        # While Sinew's modifier was off, nothing made Blender evaluate the upstream proxy.
        return source.is_ready(self.obj, self.depsgraph, self.was_on)

    def read(self) -> None:
        """Reads what may be out of date of what the object is deformed by. Requires is_upstream_there()."""
        obj, skinned, depsgraph, changes = self.obj, self.skinned, self.depsgraph, self.changes
        if skinned is None:
            read = bound.read(obj, depsgraph, self.layout)
            self.skinned = SkinnedObject(read, Noted.of(obj, self.layout, self.plan, read), self.plan)
            return
        known = skinned.bound.source
        # In a render, keys may set other options while plans wait.
        may_be_other = self.is_planned or not may_change_file()
        self.inputs = replace(
            self.inputs,
            has_other_modifiers=may_be_other and self._has_other_modifiers(),
            has_other_mesh=source.has_changed(obj, known, depsgraph, changes, self.is_planned),
            is_slider_moved=not bpy.app.background and source.is_slider_moved(obj, known, depsgraph, changes),
            lacks_surface=bound.lacks_surface(obj, skinned.bound),
        )
        reading = reading_of(self.inputs)
        if reading is not Reading.NOTHING:
            old = skinned.bound if reading is Reading.CHANGED else None
            has_same_bones = not self.inputs.have_bones_changed
            skinned.bind(bound.read(obj, depsgraph, self.layout, old, has_same_bones))
        self.is_read = reading is not Reading.NOTHING

    def settle(self, facts: Facts) -> None:
        """Requests what its methods need, and notes the object as it is now."""
        obj, skinned = self.obj, self.skinned
        is_of_another_stack = skinned.bound.is_of_another_stack(self.bound_before)
        skinned.needs_recheck = self.inputs.is_slider_moved
        skinned.evaluation.changed_unannounced = False
        new = self.plan = self._with_data(self.plan)
        # A render lists everything as new with each frame. Tagging the object makes Blender (4.2 to 5.2) copy
        # it again, without what animation had set.
        is_same = not is_of_another_stack and skinned.bound.source.equals(self.bound_before.source)
        is_same &= not (skinned.has_new_data or self.is_rescaled)
        is_new_plan = self.bound_before is None or not new.gives_as(self.old)
        self.differs = facts.was_skipped or facts.lacks_points or not is_same or is_new_plan
        if self.is_applied:
            self._note(new)
        else:
            if (self.is_read and new.is_in_depsgraph) or (is_of_another_stack and not new.uses_builtin):
                # Other bones may move it, and another add-on may have removed the driver.
                apply_plan.apply_driver(obj, self.layout, skinned.bound, new)
            waits = skinned.needs_plan or facts.calls_for_plan
            skinned.needs_plan = waits and not self.is_planned
            noted, versions = skinned.noted, skinned.bound.data_versions
            volume = obj.matrix_world.determinant() if self.is_rescaled else noted.volume
            skinned.noted = replace(
                noted, layout=replace(noted.layout, mode=obj.mode), data_versions=versions, volume=volume
            )
        skinned.plan = new
        if new.is_in_depsgraph:
            if new.in_buffer:
                rest, count = skinned.bound.source.points, skinned.normal_count
                point_store.set_rest_points(obj, self.depsgraph, rest, count, anew=is_new_plan)
        elif not new.is_written:
            skinned.shown = replace(skinned.shown, frames=None)

    def _with_data(self, wanted: Plan) -> Plan:
        """Requests the data that the methods need, and returns the plan with what they lack. It needs the
        same modifiers and storage, so it need not be applied again."""
        if wanted.uses_builtin:
            return wanted
        if wanted.normals.domain:
            # Not within Blender's evaluation: it takes as long as several frames.
            self.skinned.bound.source.make_normals()
        precomputing.request(self.obj, self.skinned, self.depsgraph)
        return replace(wanted, lacks=precomputing.lacking(self.obj, self.skinned))

    def _note(self, new: Plan) -> None:
        """Notes that the plan was applied, and the state of the object it was applied to."""
        obj, skinned = self.obj, self.skinned
        if not new.uses_builtin:
            apply_plan.apply_driver(obj, self.layout, skinned.bound, new)
            # A driver can count as an animation of the stack.
            self.seen = None
            skinned.evaluation.is_only_user = True
        # After Sinew's driver is added, as the driver counts as animation, too.
        skinned.noted = Noted.of(obj, self.layout, new, skinned.bound)
        if not new.is_in_depsgraph:
            # Animation may have set other icons in a copy that was not made anew: those of the object count.
            skinned.left_out.clear()
        skinned.needs_plan = False
        if self.changes.frame and self.depsgraph.mode == "RENDER":
            # Applying the plan can have Blender copy the object again: what the frame has set is set again.
            obj.update_tag(refresh={"OBJECT", "TIME"})

    def show(self) -> None:
        """Has Blender evaluate the object once more, or writes its points, where its shape may differ."""
        obj, skinned, changes = self.obj, self.skinned, self.changes
        if self.plan.is_in_depsgraph and self.differs:
            # Blender then requests its points.
            skinned.evaluation.skip_reason = ""
            # The object is then copied again, and what the change of frame has set has to be set again:
            # originals of hidden objects do not have it.
            obj.update_tag(refresh={"OBJECT", "TIME"} if changes.frame else {"OBJECT"})
        elif self.plan.is_written:
            is_first = self.differs or not self.old.is_written
            try:
                with skinned.lock:
                    after_update.deform(obj, skinned, self.depsgraph, changes, self.is_planned, is_first)
            except armature_io.NotPosedError:
                # It belongs to another scene: the next evaluation of that gives it its shape.
                skinned.needs_plan = True
        skinned.bound.source.known_key_values = skinned.bound.source.key_values

    def left_as_it_is(self, facts: Facts) -> SkinnedObject | Plan:
        """Returns what is known of an object that is not brought up to date."""
        skinned, plan = self.skinned, self.plan
        if self.is_planned and not plan.is_read:
            if skinned is None or plan.state is not State.OFF:
                return plan
            # So that it need not be read again when it is switched on.
            skinned.plan, skinned.needs_plan = plan, True
        elif self.is_planned:
            # What is hidden, or in another scene, stays as it is.
            is_shown = self.obj.visible_get(view_layer=self.depsgraph.view_layer)
            is_evaluated = is_shown and self.obj.evaluated_get(self.depsgraph).is_evaluated
            if skinned is None or is_evaluated:
                return replace(plan, state=State.WAITING)
        elif skinned is not None:
            skinned.needs_plan |= facts.calls_for_plan
        return self.old if skinned is None else skinned


def _error_of(obj: bpy.types.Object, old: Plan, skinned: SkinnedObject | None) -> str:
    """Returns why it can not be deformed, as a sentence; empty where it can."""
    if old.state is State.REFUSED:
        return old.reason
    # pose.read() reports drivers whose number names no method.
    if not properties.has_known_methods(properties.of(obj)) and "sinew.method" not in animated_paths(obj):
        return f"{obj.name}: its method is of a newer Sinew; update Sinew, or choose another method"
    if skinned is not None and skinned.evaluation.user_error is not None:
        return str(skinned.evaluation.user_error)
    return ""


def _count_failures(obj: bpy.types.Object, skinned: SkinnedObject, facts: Facts) -> None:
    """Raises SinewError where something prevents Sinew again and again."""
    if facts.lacks_points:
        skinned.failures.add(NOT_REQUESTED)
    skinned.failures.in_a_row += facts.was_skipped or facts.lacks_points
    nodes = stack.sinew_modifier(obj) if facts.is_detached else None
    skinned.group_losses += nodes is not None and nodes.node_group is None
    if skinned.group_losses > MAX_GROUP_LOSSES:
        raise SinewError(
            f"{obj.name}: something removes Sinew's node group again and again, another add-on perhaps; "
            "stop that, then press Rebind"
        )


def _check_modifiers(obj: bpy.types.Object, now: Layout, changes: Changes) -> Layout:
    """Brings what Sinew stores about the modifiers in line with what the artist did to them. Returns the
    layout after that.

    Raises SinewError where those that Sinew works with are gone.
    """
    if not now.replaced:
        raise SinewError(
            f"{obj.name}: its Armature modifier was deleted or applied; add another and press Rebind, or "
            "Remove"
        )
    # The plan depends on settings such as Preserve Volume as the artist set them.
    if attach.restore_volume(obj):
        now = layout.read(obj)
    now = attach.follow_stack(obj, now)
    attach.check_behind(obj, now)
    attach.adopt_pointers(obj, now)
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
    return now
