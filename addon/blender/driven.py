# SPDX-License-Identifier: GPL-3.0-or-later
"""One driven object: reads what Blender has of it, deforms, writes the points."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core.errors import SinewError
from ..core.rig import Bones, RigFacts
from ..core.session import Binding, Chain, Link, LinkFrame
from . import (
    armature_io,
    attach,
    drive,
    front,
    mesh_io,
    points,
    pose_driver,
    properties,
    small_meshes,
    source,
    stack,
    survey,
)
from .animation_paths import animated_paths, is_visibility_animated
from .changes import Changes
from .modifier_options import ModifierOptions
from .plan import MODES_OF_THE_MODIFIER, Plan, State
from .source import Source
from .updates import is_rendering_in_window

# As often its node group is made again, which another add-on removes.
MOST_LOSSES = 2
# As often as Sinew in a row could not deform a mesh within Blender's evaluation, it tries again there.
MOST_ATTEMPTS = 1


@dataclass
class Driven:
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
    keyed: list[bool]
    source: Source
    chain: Chain
    facts: RigFacts
    mix_group: str = ""
    watched: set[int] = field(default_factory=set)
    frames: list[LinkFrame | None] | None = None
    rest_points: np.ndarray | None = None
    dirtied_by_frames: bool = False
    modifier: str = ""
    name: str = ""
    losses: int = 0
    looks: list = field(default_factory=list)
    plan: Plan = field(default_factory=lambda: Plan(State.OFF))
    needs_apply: bool = True
    left_by: list[str] = field(default_factory=list)
    attribute: str = ""
    mesh_users: int = 0
    is_alone: bool = True
    answered: int = 0
    is_announced: bool = True
    is_touched: bool = False
    first: bytes | None = None
    declined: str = ""
    refusal: SinewError | None = None
    attempts: int = 0
    failures: int = 0
    failure: str = ""
    is_suspect: bool = False
    is_surprised: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)
    milliseconds: float = 0.0
    shapes: int = 0

    def is_untouched_by(self, changes: Changes) -> bool:
        """Whether nothing that the shape depends on is among the changes."""
        return (
            changes.complete
            and not (changes.structure or changes.armatures)
            and self.watched.isdisjoint(changes.touched)
        )

    def is_answered(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the last evaluation gave the object its shape."""
        if self.is_left:
            return self.left_by == small_meshes.choices(obj)
        return self.answered != 0 and self.answered == obj.data.evaluated_get(depsgraph).as_pointer()

    def is_untouched_by_frame(self, obj: bpy.types.Object, meshes: set[int] | None) -> bool:
        """Whether a change of frame, whose Changes.meshes_in() these are and which changed nothing else, left
        what the shape is made of as it was. What is left to Blender has its shape in any case."""
        if meshes is None:
            return not self.is_suspect
        if self.is_left:
            self.is_suspect = True
            return True
        if self.is_suspect or obj.data.session_uid in meshes:
            return False
        return self.mode == obj.mode and self.looks == _looks(obj)

    def is_attached(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew's modifier is there, with its node group where that is needed: of what another
        add-on's handler takes away Blender tells nobody."""
        modifier = obj.modifiers.get(self.modifier)
        if self.is_left:
            return modifier is not None
        return getattr(modifier, "node_group", None) is not None

    def fail(self, error: Exception) -> None:
        """Within an evaluation, which could not be given points."""
        if isinstance(error, SinewError):
            self.refusal = error
        self.declined = self.failure = f"{type(error).__name__}: {error}"
        self.failures += 1

    @property
    def is_left(self) -> bool:
        return bool(self.left_by)

    @property
    def points(self) -> np.ndarray:
        """The shape of the last frame, float32 [vertices, 3], object space; the chain's own."""
        with self.lock:
            return self.chain.points

    @property
    def binding(self) -> Binding:
        """Of the first Armature modifier."""
        return self.chain.links[0].binding


def update(
    obj: bpy.types.Object, driven: Driven | None, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> Driven | None:
    """Deforms an object that is on, if anything changed; its state from now on, None where it waits for
    another evaluation, or is in a mode of the modifier.

    Raises SinewError with a sentence for the user where it can not be driven.
    """
    if obj.library is not None:
        # Its Armature modifier deforms it: that is how its file is saved.
        return None
    if driven is not None and driven.refusal is not None:
        raise driven.refusal
    mode = obj.mode
    if driven is not None and not driven.is_attached(obj):
        driven.needs_apply = True
        nodes = stack.sinew_modifier(obj)
        driven.losses += nodes is not None and nodes.node_group is None
        if driven.losses > MOST_LOSSES:
            raise SinewError(
                f"{obj.name}: something removes Sinew's node group again and again, another add-on perhaps; "
                "stop that, then press Rebind"
            )
    if driven is not None and driven.name != obj.name:
        driven.name, driven.declined = obj.name, "it has another name"
    if driven is not None and driven.is_suspect:
        changes.meshes.add(obj.data.session_uid)
        changes.touched.add(obj.data.session_uid)
    if (
        driven is not None
        and driven.mode == mode
        and not (driven.needs_apply or driven.declined)
        and driven.is_untouched_by(changes)
    ):
        return driven
    if mode in MODES_OF_THE_MODIFIER or obj.data.is_editmode:
        attach.apply(obj, attach.plan_of(obj))
        return None
    answered = driven is not None and not driven.declined and driven.is_answered(obj, depsgraph)
    if driven is not None and driven.declined:
        driven.attempts += 1
    inspect = (
        driven is None
        or driven.mode != mode
        or driven.needs_apply
        or bool(driven.declined)
        or changes.structure
    )
    keys = obj.data.shape_keys
    if not inspect and (
        obj.session_uid in changes.objects
        or changes.armatures
        or (keys is not None and keys.session_uid in changes.touched)
    ):
        # Being asked for points touches the object by itself.
        in_depsgraph = driven.plan.state is State.IN_DEPSGRAPH
        inspect = not (answered or in_depsgraph) or _looks(obj) != driven.looks
    if not inspect and answered and not changes.armatures and obj.data.session_uid not in changes.touched:
        driven.dirtied_by_frames = False
        return driven
    if inspect and is_rendering_in_window():
        # Seen to when the render has ended.
        if driven is None:
            return None
        driven.needs_apply, inspect = True, False
    wanted = before = driven.plan if driven is not None else None
    was_on = properties.of(obj).standing_in
    if inspect:
        _check(obj, changes)
        wanted = attach.plan_of(obj, driven.failure if driven and driven.attempts > MOST_ATTEMPTS else "")
        attach.apply(obj, wanted)
    # First of all, as groups are renamed along with bones.
    bones_changed = driven is not None and _bones_changed(obj, driven, depsgraph, changes)
    # While Sinew's modifier was off, nothing had Blender evaluate what stands in front.
    if not source.is_ready(obj, depsgraph, was_on):
        # What is in another scene stays as it is.
        return None if obj.evaluated_get(depsgraph).is_evaluated else driven
    known, known_source = driven, driven and driven.source
    is_read_later = driven is not None and _is_read_later(obj, driven, depsgraph, changes)
    driven = _current(obj, driven, depsgraph, changes, inspect, is_read_later, bones_changed)
    if driven is not known and known is not None:
        driven.failures, driven.failure, driven.attempts = known.failures, known.failure, known.attempts
        driven.losses = known.losses
    driven.is_suspect, driven.is_surprised = is_read_later, False
    if inspect or not driven.watched:
        driven.plan, driven.needs_apply, driven.name, driven.is_touched = wanted, False, obj.name, True
        driven.left_by = small_meshes.choices(obj) if wanted.state is State.BUILT_IN else []
        driven.keyed = [is_visibility_animated(obj, m) for m in stack.armature_modifiers(obj)]
        driven.modifier, driven.looks = stack.sinew_modifier(obj).name, _looks(obj)
        mesh = obj.data.session_uid
        keys = _uid(obj.data.shape_keys)
        driven.watched = {obj.session_uid, mesh, keys, _uid(properties.of(obj).front), *driven.armatures}
        if not wanted.uses_builtin:
            hold_pose(obj, driven)
    # A render lists all as new with each frame; to tag the object has Blender (4.2 to 5.2) copy it anew,
    # without what animation had set.
    is_same = driven is known and driven.source.equals(known_source)
    if driven.is_left:
        driven.frames = None
    elif driven.plan.state is State.IN_DEPSGRAPH:
        driven.dirtied_by_frames = False
        if driven.plan.in_buffer:
            points.make_room(obj, driven.source.points, anew=wanted != before)
        if driven.declined or not is_same or wanted != before:
            driven.declined, driven.is_touched = "", True
            # Blender evaluates the object once more, and so asks for its points.
            obj.update_tag(refresh={"OBJECT"})
    else:
        with driven.lock:
            is_first = before is None or before.state is not State.AFTER_UPDATE
            _deform(obj, driven, depsgraph, changes, inspect, is_first)
    driven.source.known_key_values = driven.source.key_values
    return driven


def _is_read_later(
    obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether weights are read with the next event only: in a window, while a shape key's slider moves."""
    return not bpy.app.background and source.is_slider_moved(obj, driven.source, depsgraph, changes)


def _looks(obj: bpy.types.Object) -> list:
    """What the artist can change of the object itself that decides how it is driven."""
    settings = properties.of(obj)
    mesh, keys = obj.data, obj.data.shape_keys
    looks = [
        settings.standing_in,
        obj.parent_type,
        _uid(obj.parent),
        mesh.session_uid,
        mesh.users,
        obj.show_only_shape_key,
    ]
    looks.append(keys is None or keys.use_relative)
    if settings.front is not None:
        looks.append(front.signature(obj))
    looks += [armature.mode for armature in settings.armatures]
    # What an animation sets has no other event.
    looks += sorted(path for path in animated_paths(obj) if path.startswith(("sinew.", "modifiers")))
    looks += obj.vertex_groups.keys()
    for modifier in obj.modifiers:
        looks += (modifier.name, modifier.show_viewport, modifier.show_render)
        if modifier.type == "ARMATURE":
            looks += (modifier.object, drive.method_of(modifier), *ModifierOptions.values(modifier))
    return looks


def _deform(
    obj: bpy.types.Object,
    driven: Driven,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
    is_first: bool,
) -> None:
    """Writes the points of this evaluation for the next one, where they differ from what is there.

    is_first  the object was not deformed after the update before: what holds its points has others
    """
    # Binding is not part of a frame's time: it happens once.
    started, before = time.perf_counter(), driven.rest_points
    differs = _shape(obj, driven, depsgraph)
    if differs is None:
        return
    if changes.frame:
        reshaped = before is not None and driven.rest_points is not before
        driven.dirtied_by_frames = reshaped or obj.session_uid in changes.moved
    if differs or is_first:
        points.write(obj, driven.chain.points, driven.source.points)
        driven.milliseconds = 1000.0 * (time.perf_counter() - started)
    elif touched and not points.are_written(obj, len(driven.rest_points)):
        points.write(obj, driven.chain.points, driven.source.points)


def bring_up_to_date(obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph) -> Driven:
    """What is known of a mesh that is left to Blender becomes that of this evaluation, for those who measure
    or bake it; of others it is. Changes nothing in Blender.

    Raises SinewError where the mesh has become one that can not be driven.
    """
    if not driven.is_left:
        return driven
    current = driven
    if driven.is_suspect:
        current = _current(obj, driven, depsgraph, Changes(meshes={obj.data.session_uid}))
        current.plan, current.needs_apply, current.is_suspect = driven.plan, driven.needs_apply, False
        current.left_by, current.looks, current.watched = driven.left_by, driven.looks, driven.watched
    with current.lock:
        _shape(obj, current, depsgraph)
    return current


def _shape(obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph) -> bool | None:
    """Brings the chain's points up to this evaluation.

    Whether they differ from the last ones; None where what decides them is unknown, and the last stay.
    """
    stand_ins = properties.of(obj).stand_ins
    armatures = [s.armature and s.armature.evaluated_get(depsgraph) for s in stand_ins]
    evaluated = obj.evaluated_get(depsgraph)
    settings = properties.of(evaluated)
    if [stand_in.name for stand_in in settings.stand_ins] != [stand_in.name for stand_in in stand_ins]:
        # Sinew was put on, or modifiers moved, since Blender evaluated it: what animation makes of the
        # settings comes with the next time.
        settings = properties.of(obj)
    frames = _frames(evaluated, settings, armatures, driven, depsgraph.mode)
    if frames is None or not _are_finite(frames):
        return None
    driven.frames = frames
    driven.rest_points = source.rest_points(obj, driven.source, depsgraph)
    differs = driven.chain.deform(driven.rest_points, frames)
    driven.shapes += differs
    return differs


def deform_evaluated(evaluated: bpy.types.Object, mesh: bpy.types.Mesh, driven: Driven) -> None:
    """Writes the points into an evaluated mesh, or into the evaluated carrier, while Blender evaluates its
    object, of evaluated data alone.

    Leaves it as it is where something is out of the ordinary: that is for update().
    """
    if driven.plan.state is not State.IN_DEPSGRAPH:
        return
    settings = evaluated.sinew
    # Evaluated ones, as the driver reads them.
    armatures = [stand_in.armature for stand_in in settings.stand_ins]
    if driven.mode != evaluated.mode or not (driven.is_alone or driven.plan.in_buffer):
        driven.declined = "its mode, or the users of its mesh, changed"
        return
    if [armature is None for armature in armatures] != [not uid for uid in driven.armatures]:
        driven.declined = "its Armature modifiers changed"
        return
    shown = _points_to_write(settings, mesh, driven)
    if shown is None or len(shown) != len(driven.source.points):
        driven.declined = "its mesh changed"
        return
    if not (driven.is_announced or driven.plan.in_buffer) and driven.first is not None:
        # Another add-on's handler touched the mesh, of which Blender tells nobody: it is a new copy,
        # without the points that were written last.
        driven.is_surprised |= shown[0].tobytes() != driven.first
        driven.is_suspect |= driven.is_surprised
    with driven.lock:
        _deform_into(shown, evaluated, mesh, driven, armatures)


def _points_to_write(
    settings: properties.SinewSettings, mesh: bpy.types.Mesh, driven: Driven
) -> np.ndarray | None:
    """The memory of the evaluated mesh, or of the evaluated carrier; None where it is not there."""
    if not driven.plan.in_buffer:
        return mesh_io.points_in(mesh, driven.attribute)
    carrier = settings.carrier
    # What an evaluated object has as its data, Blender does not always mark as evaluated.
    if carrier is None or not carrier.is_evaluated:
        return None
    return mesh_io.points_in(carrier.data, mesh_io.POSITION)


def _deform_into(
    shown: np.ndarray,
    evaluated: bpy.types.Object,
    mesh: bpy.types.Mesh,
    driven: Driven,
    armatures: list[bpy.types.Object],
) -> None:
    started = time.perf_counter()
    frames = _frames(evaluated, evaluated.sinew, armatures, driven, "VIEWPORT")
    rest_points = source.evaluated_points(evaluated, mesh, driven.source)
    if rest_points is None:
        driven.declined = "what modifiers in front make of its mesh changed"
        return
    if frames is None:
        # The last shape stays.
        last = driven.chain.points
        shown[:] = rest_points if last is None else last
    else:
        driven.chain.deform(rest_points, frames, shown)
        driven.frames, driven.rest_points = frames, rest_points
        driven.shapes += 1
    if driven.plan.in_buffer:
        points.make_differ(shown, driven.source.points)
    driven.first = shown[0].tobytes()
    driven.answered, driven.declined, driven.attempts = mesh.as_pointer(), "", 0
    driven.milliseconds = 1000.0 * (time.perf_counter() - started)


def _are_finite(frames: list[LinkFrame | None]) -> bool:
    return all(np.isfinite(frame.pose).all() for frame in frames if frame is not None)


def hold_pose(obj: bpy.types.Object, driven: Driven) -> None:
    """Keeps the poses evaluated even where an armature is hidden, and has Blender ask for the points where it
    can."""
    settings, pairs, mesh = properties.of(obj), drive.stand_ins(obj), obj.data
    driven.attribute, driven.mesh_users, driven.is_alone = settings.attribute, mesh.users, True
    poses = [
        (stand_in.armature, path)
        for (_modifier, stand_in), link in zip(pairs, driven.chain.links, strict=False)
        if stand_in.armature is not None
        for path in armature_io.paths_to_wait_for(stand_in.armature, link.binding.moving_bones)
    ]
    pose_driver.ensure(obj, list(dict.fromkeys(poses)), driven.plan.state is State.IN_DEPSGRAPH)


def _check(obj: bpy.types.Object, changes: Changes) -> None:
    """Brings what Sinew keeps of the modifiers in line with what the artist did to them.

    Raises SinewError where those that Sinew works with are gone.
    """
    if stack.armature_modifier(obj) is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    # What decides the plan, such as Preserve Volume, is the artist's own.
    drive.resume_after_save(obj)
    drive.follow_stack(obj)
    drive.adopt_pointers(obj)
    _check_armatures(obj, changes)


def _check_armatures(obj: bpy.types.Object, changes: Changes) -> None:
    armatures = properties.of(obj).armatures
    if not armatures:
        raise SinewError(
            f"{obj.name}: its armature was deleted; choose another in the Armature modifier and press "
            "Rebind, or Remove"
        )
    for armature in armatures:
        if changes.structure and drive.is_deleted(armature):
            raise SinewError(
                f"{obj.name}: its armature {armature.name} was deleted, or is in no collection; choose "
                "another in the Armature modifier and press Rebind, or Remove"
            )


def _frames(
    evaluated: bpy.types.Object,
    settings: properties.SinewSettings,
    armatures: list[bpy.types.Object | None],
    driven: Driven,
    mode: str,
) -> list[LinkFrame | None] | None:
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
    frames: list[LinkFrame | None] = []
    for link, stand_in, armature, keyed in zip(
        driven.chain.links, settings.stand_ins, armatures, driven.keyed, strict=False
    ):
        flags = evaluated.modifiers[stand_in.name] if keyed or driven.is_left else stand_in
        if armature is None or armature.mode == "EDIT" or not _takes_part(flags, mode):
            frames.append(None)
            continue
        space = armature_io.bones_from_model(evaluated, armature)
        if space is None:
            # An armature scaled to nothing for a moment.
            return None
        pose = armature_io.read_pose(armature, link.binding.bones)
        own = properties.method_of_link(method, stand_in.method, is_first=not frames)
        mix = settings.mixed_method if own == method else ""
        frames.append(LinkFrame(own, pose, space, scale_rule, mix))
    return frames


def _takes_part(flags: properties.SinewStandIn | bpy.types.Modifier, mode: str) -> bool:
    return flags.show_render if mode == "RENDER" else flags.show_viewport


def _current(
    obj: bpy.types.Object,
    driven: Driven | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    inspect: bool = False,
    is_read_later: bool = False,
    bones_changed: bool = False,
) -> Driven:
    """The object's state, bound anew where its mesh, weights, bones or modifiers changed.

    inspect        the object itself may have changed
    is_read_later  its mesh may have, too, and is not read now
    bones_changed  its bones did
    """
    if driven is None:
        return _bind(obj, depsgraph)
    driven.mode = obj.mode
    if inspect:
        pairs = drive.stand_ins(obj)
        armatures = [_uid(stand_in.armature) for _modifier, stand_in in pairs]
        options = [ModifierOptions.read(modifier) for modifier, _stand_in in pairs]
        is_same_mix = driven.mix_group == properties.of(obj).mix.group
        if driven.armatures != armatures or driven.options != options or not is_same_mix:
            return _bind(obj, depsgraph)
    if bones_changed:
        return _bind(obj, depsgraph, driven)
    if not is_read_later and source.has_changed(obj, driven.source, depsgraph, changes, inspect):
        return _bind(obj, depsgraph, driven)
    return driven


def _uid(data: bpy.types.ID | None) -> int:
    return 0 if data is None else data.session_uid


def _bones_changed(
    obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    changed = False
    for link, stand_in in zip(driven.chain.links, properties.of(obj).stand_ins, strict=False):
        armature, known = stand_in.armature, link.binding.bones
        if armature is None or armature.mode == "EDIT":
            continue
        if armature.data.session_uid in changes.armatures or not known.complete:
            bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
            changed |= not bones.equals(known)
    return changed


def _bind(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, old: Driven | None = None) -> Driven:
    """Reads mesh, weights and bones; keeps the old bindings where they came out the same."""
    read = source.read(obj, depsgraph)
    pairs = drive.stand_ins(obj)
    bones = [_read_bones(stand_in.armature, depsgraph) for _modifier, stand_in in pairs]
    if (
        old is not None
        and old.mix_group == properties.of(obj).mix.group
        and read.equals_but_for_points(old.source)
        and all(b.equals(link.binding.bones) for b, link in zip(bones, old.chain.links, strict=False))
    ):
        if np.array_equal(read.points, old.source.points):
            # The same array tells that nothing moved.
            read.points = old.source.points
        old.source = read
        return old
    options = [ModifierOptions.read(modifier) for modifier, _stand_in in pairs]
    mix_group = properties.of(obj).mix.group
    mix_weights = _mix_weights(obj, read, mix_group)
    links = [
        Link(
            Binding(option.weighting(obj, read.weights, its_bones), mix_weights),
            option.mask_weights(obj, read.weights),
            option.multi,
        )
        for option, its_bones in zip(options, bones, strict=True)
    ]
    facts = survey.describe(obj, pairs[0][1].armature, links[0].binding.weighting, read.points, depsgraph)
    armatures = [_uid(stand_in.armature) for _modifier, stand_in in pairs]
    keyed = [is_visibility_animated(obj, modifier) for modifier, _stand_in in pairs]
    return Driven(obj.mode, armatures, options, keyed, read, Chain(links), facts, mix_group)


def _mix_weights(obj: bpy.types.Object, read: Source, name: str) -> np.ndarray | None:
    """float32 [vertices], 0 to 1; None where there is no such group."""
    group = obj.vertex_groups.get(name) if name else None
    return None if group is None else read.weights.of_group(group.index)


def _read_bones(armature: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> Bones:
    if armature is None or armature.mode == "EDIT":
        return Bones.none()
    return armature_io.read_bones(armature.evaluated_get(depsgraph))
