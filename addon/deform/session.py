# SPDX-License-Identifier: GPL-3.0-or-later
"""All skinned objects of the open file: brings them up to date with an evaluation."""

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..attach import (
    layout,
    node_group,
    normals,
    orphans,
    point_store,
    properties,
    references,
    stack,
    upstream_proxy,
)
from ..attach.subscribers import notify, subscribers
from ..attach.updates import is_rendering_in_window, may_change_file, phase, updates_suspended
from ..base.errors import SinewError
from ..skinning.precompute import precomputations
from . import after_update, apply_plan, events, modifier_edits, undo
from .bound import uid
from .changes import GONE, Changes, Find
from .in_depsgraph import DepsgraphRequests
from .plan import UNSEEN, Plan, State
from .skinned_object import SkinnedObject
from .update import update

log = logging.getLogger("sinew")

SkinnedObjects = list[tuple[bpy.types.Object, SkinnedObject]]


@dataclass
class Session:
    """What is known of the open file. References to objects are valid only between events; undo and loading
    make all of them invalid. Loading forgets everything, undo everything that undo.py does not keep.

    objects           the objects that have Sinew; None where they have to be found again
    objects_seen      what _objects_now() was then
    known             what is known of each, by its session_uid: of one that is not read, its plan
    pairs             those that are read, each with what was read of it
    armatures         the data of the armatures of those that are not switched off, by session_uid
    told              the error that was reported last for an object, by its session_uid
    depsgraph         the address of the depsgraph last seen
    view_layers       those whose evaluation was seen, as from identity_of_layer()
    without_upstream  the objects whose upstream proxy is not evaluated, as from without_upstream()
    missed            changes of evaluations that were not reacted to
    expected          meshes that Blender lists as changed because Sinew changed one of its settings
    seen              the meshes that had changed before functions behind Sinew's were called
    is_after_step     no evaluation was seen since the last undo or redo
    all_use_builtin   Armature modifiers deform all of them, and that can change only with an event that is
                      listened to
    """

    objects: list[bpy.types.Object] | None = None
    objects_seen: tuple[int, int] = (0, 0)
    known: dict[int, SkinnedObject | Plan] = field(default_factory=dict)
    pairs: SkinnedObjects = field(default_factory=list)
    armatures: set[int] = field(default_factory=set)
    told: dict[int, str] = field(default_factory=dict)
    depsgraph: int = 0
    view_layers: set[tuple[int, str]] = field(default_factory=set)
    without_upstream: set[tuple[int, int]] = field(default_factory=set)
    missed: Changes | None = None
    expected: set[int] = field(default_factory=set)
    seen: set[str] | None = None
    is_after_step: bool = False
    all_use_builtin: bool = False

    @property
    def is_idle(self) -> bool:
        """No object has Sinew, and no object has been added since that was found."""
        return self.objects == [] and self.objects_seen == _objects_now()


def _objects_now() -> tuple[int, int]:
    """How many objects the file has, and the highest session_uid among them. Blender counts these up, so both
    are the same only where no object was added or removed."""
    uids = np.zeros(len(bpy.data.objects), dtype=np.int32)
    bpy.data.objects.foreach_get("session_uid", uids)
    return len(uids), int(uids.max(initial=0))


current = Session()
requests = DepsgraphRequests()


def forget() -> None:
    """Forgets everything: it is read again at the next event."""
    # Others refer to `current` itself.
    vars(current).update(vars(Session(told=current.told)))
    name_requests()


def forget_object(obj: bpy.types.Object) -> None:
    """Forgets an object that Sinew is taken off; others stay bound."""
    gone = current.known.pop(obj.session_uid, None)
    current.objects, current.all_use_builtin = None, False
    current.pairs = [(other, skinned) for other, skinned in current.pairs if skinned is not gone]
    name_requests()


def forget_for_step(changed: set[int]) -> None:
    """Called before undo and redo, which make every reference invalid.

    changed  the session_uid of objects that are changed for the step
    """
    known, depsgraph = {}, current.depsgraph
    if current.missed is None and not current.is_after_step:
        known = undo.known_before(living_pairs(), depsgraph)
    forget()
    current.known = {uid: skinned for uid, skinned in known.items() if uid not in changed}
    current.depsgraph, current.is_after_step = depsgraph, True


def adopt_after_step() -> None:
    """Called after undo and redo: the next evaluation deforms the objects that are still known."""
    _find_pairs([obj for obj in bpy.data.objects if properties.has_sinew(obj)])


def _find_pairs(objects: list[bpy.types.Object]) -> None:
    current.pairs = [(obj, skinned) for obj in objects if (skinned := skinned_of(obj)) is not None]
    current.armatures = {
        armature.data.session_uid
        for obj, skinned in current.pairs
        if skinned.plan.is_read
        for armature in properties.of(obj).armatures
    }
    name_requests()


def living_pairs() -> SkinnedObjects:
    """Returns the objects that are read, each with what was read of it, without those that were deleted since
    they were found."""
    return [(obj, skinned) for obj, skinned in current.pairs if _is_alive(obj)]


def _is_alive(obj: bpy.types.Object) -> bool:
    try:
        return obj.session_uid != 0
    except ReferenceError:
        return False


def name_requests() -> None:
    """Names the objects for their requests as they are called now, before an evaluation."""
    pairs = living_pairs()
    requests.set_objects({obj.session_uid: skinned for obj, skinned in pairs}, {obj.name for obj, _ in pairs})


def plan_of(obj: bpy.types.Object) -> Plan:
    """Returns who deforms an object that has Sinew, and when, as of the last event."""
    known = current.known.get(obj.session_uid, UNSEEN)
    return known if isinstance(known, Plan) else known.plan


def error_of(obj: bpy.types.Object) -> str:
    """Returns why Sinew can not deform it; empty where it can."""
    plan = plan_of(obj)
    return plan.reason if plan.state is State.REFUSED else ""


def skinned_of(obj: bpy.types.Object) -> SkinnedObject | None:
    """Returns what was read of an object; None for nothing, as plan_of() says."""
    known = current.known.get(obj.session_uid)
    return None if isinstance(known, Plan) else known


def deformed_now(
    objects: Iterable[bpy.types.Object] | None, depsgraph: bpy.types.Depsgraph | None
) -> list[tuple[bpy.types.Object, SkinnedObject]]:
    """Returns the objects that Sinew deforms now, or would if their Armature modifiers did not, each with
    what is known of it in this evaluation. Empty where depsgraph is None."""
    if depsgraph is None:
        return []
    pairs: SkinnedObjects = []
    for obj in objects or ():
        skinned = skinned_of(obj) if properties.of(obj).enabled else None
        if skinned is not None:
            with contextlib.suppress(SinewError):
                after_update.bring_up_to_date(obj, skinned, depsgraph)
                pairs.append((obj, skinned))
    return [(obj, skinned) for obj, skinned in pairs if skinned.shown.frames is not None]


# --- Settings


def refresh(context: bpy.types.Context, changed: bpy.types.Object | None = None) -> None:
    """Deforms the skinned objects at the current frame, as after a change of settings.

    changed  the only object whose plan may differ; None for all
    """
    if is_rendering_in_window():
        # Not waiting for the render's thread, which would go on to its next frame during what follows.
        phase.must_refresh = True
        return
    with updates_suspended() as may_react:
        if not (may_react and may_change_file()):
            # Updates are suspended, or a handler switched an object off: whoever did that goes on from here.
            return
        current.objects = None
        for obj, skinned in living_pairs():
            skinned.needs_plan |= changed is None or obj.session_uid == changed.session_uid
    # Handlers react to this evaluation by themselves, in time for what others' later handlers change. What
    # these change of objects that are deformed after the update is only there at its end.
    depsgraph = context.evaluated_depsgraph_get()
    update_all(depsgraph, Changes())
    # In a window the tagged meshes are evaluated before the next redraw; a script may read them at once.
    if bpy.app.background:
        # If no object waits, this evaluation only shows what was just changed: Sinew need not react to it.
        with contextlib.nullcontext() if without_upstream() else updates_suspended():
            context.view_layer.update()
        note_shown(depsgraph)
    upstream_proxy.compared.clear()


def note_shown(depsgraph: bpy.types.Depsgraph) -> None:
    """Notes the meshes that viewports show, at the end of an event, or of an evaluation by Sinew."""
    new = [pair for pair in current.pairs if not pair[1].evaluation.given <= {pair[1].viewport_mesh}]
    # Those of renders and exporters are others.
    if new and depsgraph == depsgraph.view_layer.depsgraph:
        for obj, skinned in new:
            if _is_alive(obj):
                skinned.note_shown(obj, depsgraph)


def refresh_between_steps(context: bpy.types.Context) -> None:
    """Calls refresh() from handlers and timers, for which Blender makes no undo step."""
    with references.between_steps():
        refresh(context)


@contextlib.contextmanager
def changing(context: bpy.types.Context) -> Iterator[None]:
    """Context in which settings are changed, and nothing else; at its end everything is deformed by them."""
    # So that changes made by others before are recorded separately.
    context.evaluated_depsgraph_get()
    with updates_suspended():
        yield
    for obj in filter(properties.has_sinew, bpy.data.objects):
        expect_mesh_update(obj)
    refresh(context)


def setting_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Called when one of an object's Sinew settings was changed: its shape may differ, and what prevented it
    may be gone."""
    if plan_of(obj).state is State.REFUSED:
        _forget_unless_bare(obj)
    refresh(context, obj)
    # Blender then touches the object's mesh. In a window that is a separate evaluation; a script may change
    # weights before it.
    if not bpy.app.background:
        expect_mesh_update(obj)


def _forget_unless_bare(obj: bpy.types.Object) -> None:
    """Forgets the object, so that the next event reads it. Without an Armature modifier it stays refused:
    unknown, it would lose Sinew, and with it its settings."""
    if stack.armature_modifier(obj) is not None:
        current.known.pop(obj.session_uid, None)


def read_again(obj: bpy.types.Object) -> None:
    """Has the next refresh() read mesh, weights and bones of the object again, also after an error, and
    switches it on. The caller suspends updates meanwhile."""
    _forget_unless_bare(obj)
    precomputations.stopped.clear()
    settings = properties.of(obj)
    if not settings.enabled:
        settings.enabled = True


# --- Reactions to an evaluation


def update_all(depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    """Brings all objects up to date with an evaluation and its changes, and notifies the subscribers."""
    # Those of another evaluation.
    changes.bones.clear()
    normals.users_of_all.cache_clear()
    with updates_suspended():
        if depsgraph.mode == "VIEWPORT":
            current.view_layers.add(identity_of_layer(depsgraph.scene, depsgraph.view_layer))
        if current.missed is not None:
            changes.add(current.missed)
            current.missed = None
        if current.is_after_step:
            _drop_unknown(depsgraph, changes)
        read_later = _drop_expected(changes)
        _remove_groups_taken_apart(changes)
        _adopt_copied_modifiers(changes)
        _note_readers(changes)
        for _obj, skinned in current.pairs:
            skinned.needs_recheck |= changes.lost
        for obj in objects_with_sinew(changes.structure):
            _update(obj, depsgraph, changes)
        # Undo would free what it refers to.
        normals.users_of_all.cache_clear()
        _find_pairs(objects_with_sinew())
        for obj, skinned in current.pairs:
            skinned.needs_recheck |= obj.data.session_uid in read_later
        current.all_use_builtin = _do_all_use_builtin()
        notify(subscribers.deformed, current.objects or [], depsgraph)
        notify(subscribers.frame_shown)


def _drop_unknown(depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    """Forgets objects that an undo step changed. Called with the first evaluation after undo or redo."""
    current.is_after_step = False
    current.known = {
        obj.session_uid: skinned
        for obj, skinned in current.pairs
        if changes.complete and undo.is_known_after(obj, skinned, depsgraph, changes)
    }


def identity_of_layer(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> tuple[int, str]:
    return scene.session_uid, layer.name


def needs_first_evaluations() -> bool:
    """Whether an object needs handlers to be deformed in an evaluation, not only the driver."""
    with contextlib.suppress(ReferenceError):
        return any(
            plan_of(obj).state is State.WAITING or plan_of(obj).is_written
            # After undo and redo the objects have to be found again.
            for obj in (bpy.data.objects if current.objects is None else current.objects)
            if properties.has_sinew(obj)
        )
    # The object was deleted since the list was made: an event follows.
    return False


def objects_with_sinew(may_be_others: bool = False) -> list[bpy.types.Object]:
    """Returns the objects that have Sinew. Searches again where objects were, or may have been, added or
    removed."""
    if current.objects is None or may_be_others or current.objects_seen != _objects_now():
        current.objects = [obj for obj in bpy.data.objects if properties.has_sinew(obj)]
        if may_change_file():
            orphans.remove()
        current.objects_seen = _objects_now()
        notify(subscribers.objects_changed, current.objects)
        point_store.unshare(current.objects)
        uids = {obj.session_uid for obj in current.objects}
        current.known = {uid: known for uid, known in current.known.items() if uid in uids}
    return current.objects


def without_upstream() -> set[tuple[int, int]]:
    """Returns the objects whose upstream proxy Blender has yet to evaluate for the viewport, each by its
    session_uid and that of the proxy, which may be made anew meanwhile."""
    return {
        (obj.session_uid, uid(properties.of(obj).storage.upstream_proxy))
        for obj in objects_with_sinew()
        if plan_of(obj).state is State.WAITING
        and properties.of(obj).replaces_modifiers
        and layout.read(obj).icons[0].sinew
    }


def were_all_deformed(depsgraph: bpy.types.Depsgraph, original: Find) -> bool:
    """Whether the evaluation gave all skinned objects their points, and nothing else has to be checked."""
    if (
        current.objects is None
        or current.depsgraph != depsgraph.as_pointer()
        or not Changes.are_of_meshes_only(depsgraph)
    ):
        return False
    # Objects that use their Armature modifiers do not need the list, which takes long to make.
    if depsgraph.id_type_updated("NODETREE") and node_group.taken_apart():
        return False
    meshes = set() if current.all_use_builtin else Changes.meshes_in(depsgraph, original)
    if meshes and GONE in meshes:
        return False
    if not _is_each(
        lambda obj, skinned: (
            skinned.was_deformed(obj, depsgraph)
            and skinned.is_untouched_by_frame(obj, meshes)
            # Up to Blender 5.1 the points are requested also for a modifier without its node group.
            and skinned.is_attached(obj)
        )
    ):
        return False
    notify(subscribers.frame_shown)
    return True


def were_only_posed(depsgraph: bpy.types.Depsgraph, original: Find) -> bool:
    """Whether nothing but poses changed since the last evaluation, and this one gave all skinned objects
    their points: there is nothing else to be checked."""
    is_known = current.objects is not None and current.depsgraph == depsgraph.as_pointer()
    if not is_known or current.is_after_step or current.missed is not None or current.expected:
        return False
    changes = Changes.of_poses(depsgraph, original)
    if changes is None or not changes.armatures <= current.armatures:
        return False
    if not _is_each(lambda obj, skinned: skinned.was_only_posed(obj, depsgraph, changes)):
        return False
    notify(subscribers.frame_shown)
    return True


def _is_each(holds: Callable[[bpy.types.Object, SkinnedObject], bool]) -> bool:
    """Whether something holds for each object that Sinew reads, and each was read."""
    try:
        for obj in current.objects or ():
            known = current.known.get(obj.session_uid, UNSEEN)
            was_read = not isinstance(known, Plan)
            plan = known.plan if was_read else known
            if plan.is_read and not (was_read and holds(obj, known)):
                return False
    except ReferenceError:
        # The object was deleted since the list was made.
        return False
    return True


def _do_all_use_builtin() -> bool:
    """Whether Sinew has nothing to do in a frame, as long as nothing but poses changes."""
    return all(
        plan_of(obj).state in (State.OFF, State.REFUSED)
        or (plan_of(obj).uses_builtin and obj.animation_data is None)
        for obj in current.objects or ()
    )


def _update(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    old, known = plan_of(obj), skinned_of(obj)
    try:
        now = layout.read(obj) if _may_be_removed(obj, changes) else None
        if now is not None and modifier_edits.follow_removal(obj, now, old, known):
            return
        found = update(obj, now, old, known, depsgraph, changes)
    except ReferenceError:
        # The object was deleted since the list was made.
        current.objects = None
        return
    except Exception as error:
        found = _refuse(obj, old, error)
    current.known[obj.session_uid] = found
    if not isinstance(found, Plan):
        current.told.pop(obj.session_uid, None)
    # Each error is reported once.
    elif found.state is State.REFUSED and current.told.get(obj.session_uid) != found.reason:
        log.error("%s", found.reason)
        current.told[obj.session_uid] = found.reason


def _refuse(obj: bpy.types.Object, old: Plan, error: Exception) -> Plan:
    """Gives a failing object back to its Armature modifier. Returns its plan."""
    if is_rendering_in_window():
        log.error("%s: %s; the last shape stays until the end of the render", obj.name, error)
        phase.must_refresh = True
        return UNSEEN
    if isinstance(error, SinewError):
        refused = Plan(State.REFUSED, str(error))
    else:
        text = f"{obj.name}: {type(error).__name__}: {error}; press Rebind, or Remove"
        refused = Plan(State.REFUSED, text)
        log.error("%s", text, exc_info=error)
        current.told[obj.session_uid] = text
    try:
        apply_plan.apply(obj, layout.read(obj), old, refused)
    except Exception as failure:
        log.error("%s: its Armature modifier may not deform it: %s", obj.name, failure, exc_info=failure)
    return refused


def _may_be_removed(obj: bpy.types.Object, changes: Changes) -> bool:
    """Whether its stack has to be looked at for Sinew's modifier."""
    skinned = skinned_of(obj)
    are_listed = changes.structure or obj.session_uid in changes.objects or not changes.complete
    if not are_listed and (skinned is None or skinned.is_attached(obj)):
        return False
    return obj.is_editable and may_change_file()


def _remove_groups_taken_apart(changes: Changes) -> None:
    """Removes node groups that were changed: their objects then get new ones, or an error where that happens
    again and again."""
    if not (changes.node_groups and may_change_file()):
        return
    # A group that had a removed one inside is then changed, too.
    while groups := node_group.taken_apart():
        for group in groups:
            log.warning("The node group %s is Sinew's own: it was changed, and is made again", group.name)
            bpy.data.node_groups.remove(group)


def _adopt_copied_modifiers(changes: Changes) -> None:
    for obj in changes.edited if may_change_file() else ():
        # The object may have been deleted since.
        with contextlib.suppress(ReferenceError):
            changes.structure |= modifier_edits.adopt_copy(obj)


def _note_readers(changes: Changes) -> None:
    """An edited object may now read other objects' meshes, which decides who computes normals."""
    with contextlib.suppress(ReferenceError):
        if any(normals.may_read_meshes(obj) for obj in changes.edited):
            for _obj, skinned in current.pairs:
                skinned.needs_plan |= bool(skinned.plan.normals.domain or skinned.plan.normals_reason)


def expect_mesh_update(obj: bpy.types.Object) -> None:
    """Notes that the next evaluation lists the object's mesh because of Sinew's own changes."""
    current.expected.add(obj.data.session_uid)


def _drop_expected(changes: Changes) -> set[int]:
    """Removes the meshes that are listed because of Sinew's own changes. Returns those that somebody else may
    have changed at the same time: they are read again at the next event."""
    expected, current.expected = changes.meshes & current.expected, set()
    if changes.frame:
        return set()
    changes.meshes -= expected
    return expected if events.others_are_subscribed() or not bpy.app.background else set()
