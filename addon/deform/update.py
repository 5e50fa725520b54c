# SPDX-License-Identifier: GPL-3.0-or-later
"""Observes what an event shows of an object, and performs what react.py decides."""

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
from .react import Action, Facts, Known, needs_nothing, react
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
    facts = event.observe()
    while (action := react(facts, event.known)) is not Action.NOTHING:
        facts = event.perform(action, facts)
    return event.result(facts)


@dataclass
class _Event:
    """What one event means for one object."""

    obj: bpy.types.Object
    seen: Layout | None
    old: Plan
    skinned: SkinnedObject | None
    depsgraph: bpy.types.Depsgraph
    changes: Changes

    def __post_init__(self) -> None:
        # Whether the upstream proxy's copy of the mesh has to be made again; None before it was compared.
        self.is_copy_outdated: bool | None = None
        # Whether lengths among its settings are others for the mesh than before.
        self.is_rescaled = False
        self.known = Known(self.old, is_bound=self.skinned is not None)
        self.bound_before = None if self.skinned is None else self.skinned.bound
        self.was_on = properties.of(self.obj).replaces_modifiers
        self.error = _error_of(self.obj, self.old, self.skinned)

    @property
    def layout(self) -> Layout:
        """The object's, read once, and again after the stack was changed."""
        self.seen = self.seen or layout.read(self.obj)
        return self.seen

    # --- Observing

    def observe(self) -> Facts:
        """Returns the facts by which to decide; others do not matter then."""
        obj, skinned = self.obj, self.skinned
        may_change = may_change_file()
        is_prevented = bool(self.error) or not properties.of(obj).enabled
        if skinned is None or is_prevented:
            facts = Facts(may_change=may_change, is_prevented=is_prevented)
        else:
            facts = self._of_bound(skinned, may_change)
        if needs_nothing(facts, self.known) or (may_change and (skinned is None or facts.calls_for_plan)):
            return facts
        return self._with_rest(facts)

    def _of_bound(self, skinned: SkinnedObject, may_change: bool) -> Facts:
        obj, changes = self.obj, self.changes
        if skinned.needs_recheck:
            changes.meshes.add(obj.data.session_uid)
            changes.touched.add(obj.data.session_uid)
        facts = Facts(
            may_change=may_change,
            # What a method needs may have been computed since the evaluation.
            is_due=skinned.needs_apply or skinned.has_new_data or (may_change and self._follows_scale()),
            is_detached=not skinned.is_attached(obj),
            was_skipped=bool(skinned.evaluation.skip_reason) or skinned.noted.name != obj.name,
            is_other=skinned.noted.layout.mode != apply_plan.mode_of(obj)
            or self._find_outdated_copy()
            or (skinned.noted.are_options_keyed and self._has_other_modifiers(skinned)),
            is_untouched=skinned.is_untouched_by(changes),
        )
        if facts.calls_for_plan or facts.is_untouched:
            return facts
        if self._lacks_points(skinned):
            return replace(facts, lacks_points=True)
        if self._may_be_other(skinned):
            return replace(facts, is_other=True)
        # Blender lists an armature's bones with each change of its pose.
        has_shape = skinned.was_deformed(obj, self.depsgraph) and obj.data.session_uid not in changes.touched
        return replace(facts, has_shape=has_shape and not self._have_bones_changed())

    def _follows_scale(self) -> bool:
        """Notes another scale of the object. Not where animation scales it, which would have the mesh bound
        anew with each frame."""
        obj, changes = self.obj, self.changes
        if changes.frame or obj.session_uid not in changes.moved or not obj.is_editable:
            return False
        if not stage_settings.has_other_scale(obj):
            return False
        for each in (obj, obj.evaluated_get(self.depsgraph)):
            stage_settings.note_scale(each)
        self.is_rescaled = True
        return True

    def _find_outdated_copy(self) -> bool:
        """Whether the upstream proxy's copy of the mesh has to be made again."""
        obj, changes = self.obj, self.changes
        if obj.data.session_uid not in changes.meshes or obj.data.is_editmode:
            return False
        self.is_copy_outdated = not upstream_proxy.is_current(obj)
        if self.is_copy_outdated and changes.frame and self.old.is_in_depsgraph:
            # Blender evaluates what handlers change, and Sinew deforms within that.
            upstream_proxy.follow_points(obj)
            self.is_copy_outdated = not upstream_proxy.is_current(obj)
        elif self.is_copy_outdated and changes.frame:
            upstream_proxy.share_mesh(obj)
        return self.is_copy_outdated

    def _has_other_modifiers(self, skinned: SkinnedObject) -> bool:
        return bound.is_of_other_modifiers(self.obj, self.layout, skinned.bound, self.depsgraph)

    def _is_copy_known(self) -> bool:
        """Whether the copy was compared or made in this event. The mesh is listed by what Sinew has evaluated
        within it, as by what others' handlers change."""
        is_listed = self.obj.data.session_uid in self.changes.meshes
        is_new = upstream_proxy.was_just_made(self.obj)
        return self.is_copy_outdated is not None or (
            is_new and not (is_listed and events.others_are_subscribed())
        )

    def _with_rest(self, facts: Facts) -> Facts:
        """Adds what decides what is read."""
        obj, skinned, depsgraph, changes = self.obj, self.skinned, self.depsgraph, self.changes
        # Before anything else, as groups are renamed along with bones.
        have_bones_changed = skinned is not None and self._have_bones_changed()
        # While Sinew's modifier was off, nothing made Blender evaluate the upstream proxy.
        if not source.is_ready(obj, depsgraph, self.was_on):
            return replace(facts, is_upstream_there=False)
        if skinned is None:
            return facts
        read = skinned.bound.source
        return replace(
            facts,
            has_other_modifiers=self._has_other_modifiers(skinned),
            have_bones_changed=have_bones_changed,
            has_other_mesh=source.has_changed(obj, read, depsgraph, changes, self.known.is_planned),
            is_slider_moved=not bpy.app.background and source.is_slider_moved(obj, read, depsgraph, changes),
            lacks_surface=bound.lacks_surface(obj, skinned.bound),
        )

    def _lacks_points(self, skinned: SkinnedObject) -> bool:
        """Whether Blender evaluated another pose without requesting the points, as where the driver is
        muted."""
        obj, depsgraph = self.obj, self.depsgraph
        if not skinned.plan.is_in_depsgraph or skinned.evaluation.mesh:
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

    def _may_be_other(self, skinned: SkinnedObject) -> bool:
        """Whether the object, or what is around it, may not be as it was when its plan was applied."""
        obj, changes = self.obj, self.changes
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

    def perform(self, action: Action, facts: Facts) -> Facts:
        """Returns the facts by which to decide on."""
        if action is Action.REPLAN:
            self._replan(facts)
            return self._with_rest(facts) if self.known.plan.is_read else facts
        if action in (Action.REBIND, Action.READ):
            self._read(facts, is_whole=action is Action.REBIND)
        elif action is Action.SETTLE:
            self._settle(facts)
        else:
            self._show(is_tagged=action is Action.TAG)
        return facts

    def _replan(self, facts: Facts) -> None:
        if self.skinned is not None:
            _count_failures(self.obj, self.skinned, facts)
        new = plan(apply_plan.first_facts(self.obj, self.layout, self.error))
        if new.is_read:
            self.seen = _check_modifiers(self.obj, self.layout, self.changes)
            new = self._full_plan()
        if not self._is_applied(facts, new):
            if not (new.uses_builtin or self._is_copy_known()):
                self.is_copy_outdated = not upstream_proxy.is_current(self.obj)
            if self.is_copy_outdated:
                upstream_proxy.set_outdated(self.obj)
            apply_plan.apply(self.obj, self.old, new)
            self.seen = None
        self.known = replace(self.known, plan=new, is_planned=True)

    def _is_applied(self, facts: Facts, new: Plan) -> bool:
        """Whether the plan stays, and so does what it was applied to: choosing a method changes no
        modifier."""
        skinned, obj = self.skinned, self.obj
        if skinned is None or new != self.old or not new.is_in_depsgraph:
            return False
        is_only_due = facts.is_due and not replace(facts, is_due=False).calls_for_plan
        return is_only_due and skinned.is_as_noted(obj, self.layout) and skinned.has_same_surroundings(obj)

    def _full_plan(self) -> Plan:
        failure = ""
        if self.skinned is not None and self.skinned.evaluation.failures_in_a_row > MAX_FAILURES_IN_A_ROW:
            failure = self.skinned.evaluation.failure
        waits_for = precomputing.waits_for(self.obj, self.skinned)
        return plan(apply_plan.all_facts(self.obj, self.layout, failure, waits_for))

    def _read(self, facts: Facts, is_whole: bool) -> None:
        obj, skinned, depsgraph = self.obj, self.skinned, self.depsgraph
        if skinned is None:
            read = bound.read(obj, depsgraph, self.layout)
            noted = Noted.of(obj, self.layout, self.known.plan, read)
            self.skinned = SkinnedObject(read, noted, self.known.plan, needs_apply=True)
        elif is_whole:
            skinned.bind(bound.read(obj, depsgraph, self.layout))
        elif facts.have_bones_changed or facts.has_other_mesh:
            skinned.bind(bound.read(obj, depsgraph, self.layout, skinned.bound))
        else:
            skinned.bind(bound.with_surface(obj, depsgraph, skinned.bound))
        self.known = replace(self.known, is_bound=True, is_read=True)

    def _settle(self, facts: Facts) -> None:
        obj, skinned, known = self.obj, self.skinned, self.known
        is_of_another_stack = skinned.bound.is_of_another_stack(self.bound_before)
        skinned.needs_recheck, skinned.evaluation.changed_unannounced = facts.is_slider_moved, False
        new = self._with_data(known.plan)
        # A render lists everything as new with each frame. Tagging the object makes Blender (4.2 to 5.2) copy
        # it again, without what animation had set.
        is_same = not is_of_another_stack and skinned.bound.source.equals(self.bound_before.source)
        is_same &= not (skinned.has_new_data or self.is_rescaled)
        is_new_plan = self.bound_before is None or not new.gives_as(self.old)
        if known.is_planned or is_of_another_stack:
            self._note(new)
        else:
            if known.is_read and new.is_in_depsgraph:
                # Another add-on may have removed it since the last evaluation.
                apply_plan.apply_driver(obj, self.layout, skinned.bound, new)
            skinned.needs_apply |= facts.calls_for_plan
            noted, versions = skinned.noted, skinned.bound.data_versions
            skinned.noted = replace(
                noted, layout=replace(noted.layout, mode=obj.mode), data_versions=versions
            )
        skinned.plan = new
        if new.is_in_depsgraph:
            if new.in_buffer:
                rest, count = skinned.bound.source.points, skinned.normal_count
                point_store.set_rest_points(obj, self.depsgraph, rest, count, anew=is_new_plan)
        elif not new.is_written:
            skinned.shown = replace(skinned.shown, frames=None)
        self.known = replace(known, plan=new, is_settled=True, differs=not is_same or is_new_plan)

    def _with_data(self, wanted: Plan) -> Plan:
        """Requests the data that the methods need and returns the resulting plan. A plan that waits needs the
        same modifiers and storage as one that does not, so it need not be applied again."""
        if wanted.uses_builtin:
            return wanted
        if wanted.normals.domain:
            # Not within Blender's evaluation: it takes as long as several frames.
            self.skinned.bound.source.make_normals()
        precomputing.request(self.obj, self.skinned, self.depsgraph)
        waits_for = precomputing.waits_for(self.obj, self.skinned)
        is_same = waits_for == (wanted.reason if wanted.state is State.WAITING else "")
        return wanted if is_same else self._full_plan()

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
        skinned.needs_apply, skinned.evaluation.was_tagged = False, True
        if self.changes.frame and self.depsgraph.mode == "RENDER":
            # Applying the plan can have Blender copy the object again: what the frame has set is set again.
            obj.update_tag(refresh={"OBJECT", "TIME"})

    def _show(self, is_tagged: bool) -> None:
        obj, skinned = self.obj, self.skinned
        if is_tagged:
            # Blender evaluates the object once more, and thereby requests its points.
            skinned.evaluation.skip_reason, skinned.evaluation.was_tagged = "", True
            # The object is then copied again, and what the change of frame has set has to be set again:
            # originals of hidden objects do not have it.
            obj.update_tag(refresh={"OBJECT", "TIME"} if self.changes.frame else {"OBJECT"})
        else:
            is_first = self.known.differs or not self.old.is_written
            with skinned.lock:
                is_planned = self.known.is_planned
                try:
                    after_update.deform(obj, skinned, self.depsgraph, self.changes, is_planned, is_first)
                except armature_io.NotPosedError:
                    # It belongs to another scene: the next evaluation of that gives it its shape.
                    skinned.needs_apply = True
        self.known = replace(self.known, is_given=True)

    # --- The result

    def result(self, facts: Facts) -> SkinnedObject | Plan:
        skinned, known = self.skinned, self.known
        if known.is_settled:
            skinned.bound.source.known_key_values = skinned.bound.source.key_values
            return skinned
        if not known.is_planned:
            if skinned is None:
                return self.old
            if facts.calls_for_plan:
                skinned.needs_apply = True
            return skinned
        if not known.plan.is_read:
            if skinned is None or known.plan.state is not State.OFF:
                return known.plan
            # So that it need not be read again when it is switched on.
            skinned.plan, skinned.needs_apply = known.plan, True
            return skinned
        # What is hidden, or in another scene, stays as it is.
        is_shown = self.obj.visible_get(view_layer=self.depsgraph.view_layer)
        if skinned is not None and not (is_shown and self.obj.evaluated_get(self.depsgraph).is_evaluated):
            return skinned
        return replace(known.plan, state=State.WAITING_UPSTREAM)


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
        skinned.evaluation.note_failure(NOT_REQUESTED)
    skinned.evaluation.failures_in_a_row += facts.was_skipped or facts.lacks_points
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
