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
    animation,
    armature_io,
    drive,
    mesh_io,
    points,
    pose_driver,
    properties,
    small_meshes,
    source,
    stack,
    survey,
)
from .changes import Changes
from .modifier_options import ModifierOptions
from .source import Source

# Tools of these modes work through the Armature modifier, which shows its own shape meanwhile.
MODES_OF_THE_MODIFIER = {"EDIT", "SCULPT"}
# Tools of this one look for the armature behind a modifier, to paint by bone.
MODES_THAT_NEED_THE_POINTER = {"WEIGHT_PAINT"}


@dataclass
class Driven:
    """What is known of a driven object between events; made again whenever it may be out of date.

    armatures          the session_uid of each link's armature, 0 for none
    keyed              for each link, whether an animation decides when its modifier is on
    watched            the session_uid of each object that the shape depends on
    frames             what decided the last frame
    rest_points        of the last frame
    dirtied_by_frames  the last change of frame moved the object or its rest points
    looks              what the artist can change of the object itself
    left_by            what had a small mesh left to its Armature modifiers, as small_meshes.choices(); empty
                       where it is not
    asking             the driver asks for the points within Blender's evaluation
    attribute          what holds them there
    mesh_users         how many the mesh has; others could read while it is written
    answered           the address of the evaluated mesh that was given points in the last evaluation, or 0
    is_kept            the mesh itself holds the last points too, not only the evaluated one
    is_suspect         the mesh may have changed since it was read: left to Blender, it is looked at when
                       somebody asks
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
    watched: set[int] = field(default_factory=set)
    frames: list[LinkFrame | None] | None = None
    rest_points: np.ndarray | None = None
    dirtied_by_frames: bool = False
    looks: list = field(default_factory=list)
    left_by: list[str] = field(default_factory=list)
    asking: bool = False
    attribute: str = ""
    mesh_users: int = 0
    answered: int = 0
    is_kept: bool = True
    is_suspect: bool = False
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
            return True
        if self.is_left:
            self.is_suspect = True
            return True
        if obj.data.session_uid in meshes:
            keys = obj.data.shape_keys
            # Animated ones touch their mesh on each frame.
            if keys is None or keys.animation_data is None:
                return False
        return self.mode == obj.mode and self.looks == _looks(obj)

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
        # Blender lets nothing be written in bulk to linked data.
        raise SinewError(
            f"{obj.name} is linked from another file: its Armature modifier deforms it; make a library "
            "override to use Sinew here"
        )
    mode = obj.mode
    if driven is not None and driven.is_suspect:
        changes.meshes.add(obj.data.session_uid)
        changes.touched.add(obj.data.session_uid)
    if driven is not None and driven.mode == mode and driven.is_untouched_by(changes):
        return driven
    if mode in MODES_OF_THE_MODIFIER or obj.data.is_editmode:
        drive.switch(obj, on=False)
        return None
    answered = driven is not None and driven.is_answered(obj, depsgraph)
    touched = changes.structure or bool(changes.armatures) or obj.session_uid in changes.objects
    # What else decides that an object is left comes with no frame.
    is_left = (answered and driven.is_left and changes.frame) or small_meshes.is_left_to_blender(obj)
    left_or_taken = driven is not None and is_left != driven.is_left
    if answered and not (changes.structure or changes.armatures or left_or_taken):
        # Being asked for points touches the object by itself.
        touched = _looks(obj) != driven.looks
        if not touched and driven.mode == mode and obj.data.session_uid not in changes.touched:
            driven.dirtied_by_frames = False
            return driven
    touched = touched or left_or_taken
    was_on = properties.of(obj).standing_in
    if driven is None or touched or driven.mode != mode:
        _maintain(obj, changes, is_left)
    # While Sinew's modifier was off, nothing had Blender evaluate what stands in front.
    if not source.is_ready(obj, depsgraph, was_on):
        # What is in another scene stays as it is.
        return None if obj.evaluated_get(depsgraph).is_evaluated else driven
    known, known_source = driven, driven and driven.source
    driven = _current(obj, driven, depsgraph, changes, touched)
    driven.left_by = small_meshes.choices(obj) if is_left else []
    driven.is_suspect = False
    if touched or not driven.watched:
        driven.looks = _looks(obj)
        mesh = obj.data.session_uid
        driven.watched = {obj.session_uid, mesh, _uid(properties.of(obj).front), *driven.armatures}
        if not is_left:
            hold_pose(obj, driven)
    if is_left:
        driven.asking, driven.frames = False, None
    elif answered and driven is known and driven.source is known_source:
        driven.dirtied_by_frames = False
    else:
        with driven.lock:
            _deform(obj, driven, depsgraph, changes, touched)
    driven.source.known_key_values = driven.source.key_values
    return driven


def _looks(obj: bpy.types.Object) -> list:
    """What the artist can change of the object itself that decides how it is driven."""
    settings = properties.of(obj)
    looks = [settings.standing_in, obj.parent_type, obj.data.session_uid, obj.show_only_shape_key]
    looks += obj.vertex_groups.keys()
    for modifier in obj.modifiers:
        looks += (modifier.name, modifier.show_viewport, modifier.show_render)
        if modifier.type == "ARMATURE":
            looks += (modifier.object, *ModifierOptions.values(modifier))
    return looks


def _deform(
    obj: bpy.types.Object,
    driven: Driven,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
) -> None:
    """Writes the points of this evaluation for the next one, where they differ from what is there."""
    # Binding is not part of a frame's time: it happens once.
    started, before = time.perf_counter(), driven.rest_points
    differs = _shape(obj, driven, depsgraph)
    if differs is None:
        return
    if changes.frame:
        reshaped = before is not None and driven.rest_points is not before
        driven.dirtied_by_frames = reshaped or obj.session_uid in changes.moved
    if differs:
        points.write(obj, driven.chain.points)
        driven.milliseconds = 1000.0 * (time.perf_counter() - started)
    elif _are_lost(obj, driven, changes, touched):
        points.write(obj, driven.chain.points)
    else:
        return
    driven.is_kept = True


def bring_up_to_date(obj: bpy.types.Object, driven: Driven, depsgraph: bpy.types.Depsgraph) -> Driven:
    """What is known of a mesh that is left to Blender becomes that of this evaluation, for those who measure
    or bake it; of others it is. Changes nothing in Blender.

    Raises SinewError where the mesh has become one that can not be driven.
    """
    if not driven.is_left:
        return driven
    current = driven
    if driven.is_suspect:
        current = _current(obj, driven, depsgraph, Changes(meshes={obj.data.session_uid}), touched=False)
        current.left_by, current.looks, current.watched = driven.left_by, driven.looks, driven.watched
        current.is_suspect = False
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
    if frames is None or not all(np.isfinite(frame.pose).all() for frame in frames if frame is not None):
        return None
    driven.frames = frames
    driven.rest_points = source.rest_points(obj, driven.source, depsgraph)
    differs = driven.chain.deform(driven.rest_points, frames)
    driven.shapes += differs
    return differs


def _are_lost(obj: bpy.types.Object, driven: Driven, changes: Changes, touched: bool) -> bool:
    """Whether the evaluated mesh may have other points than those that were given last."""
    if not driven.is_kept and (not changes.complete or obj.data.session_uid in changes.touched):
        # It was made anew of the mesh itself.
        return True
    return touched and not points.are_written(obj, len(driven.rest_points))


def deform_evaluated(evaluated: bpy.types.Object, mesh: bpy.types.Mesh, driven: Driven) -> None:
    """Writes the points into an evaluated mesh, while Blender evaluates its object.

    Leaves it as it is where something is out of the ordinary: that is for update().
    """
    obj, settings = evaluated.original, evaluated.sinew
    if not driven.asking or driven.mode != evaluated.mode or driven.mesh_users != obj.data.users:
        return
    # Evaluated ones, as the driver reads them.
    armatures = [stand_in.armature for stand_in in settings.stand_ins]
    if len(armatures) != len(driven.chain.links) or None in armatures:
        return
    attribute = mesh.attributes.get(driven.attribute)
    shown = None if attribute is None else mesh_io.points_in(attribute)
    if shown is None:
        return
    with driven.lock:
        started = time.perf_counter()
        frames = _frames(evaluated, settings, armatures, driven, "VIEWPORT")
        if frames is None:
            return
        driven.rest_points = source.keyed_points(obj, mesh, driven.source)
        driven.chain.deform(driven.rest_points, frames, shown)
        driven.frames, driven.answered, driven.is_kept = frames, mesh.as_pointer(), False
        driven.dirtied_by_frames = False
        driven.shapes += 1
        driven.milliseconds = 1000.0 * (time.perf_counter() - started)


def hold_pose(obj: bpy.types.Object, driven: Driven) -> None:
    """Keeps the poses evaluated even where an armature is hidden, and has Blender ask for the points where it
    can."""
    settings, pairs, mesh = properties.of(obj), drive.stand_ins(obj), obj.data
    driven.attribute, driven.mesh_users = settings.attribute, mesh.users
    driven.asking = (
        bool(settings.attribute)
        # Its colours are written into the mesh itself, which is evaluated once more for them.
        and not settings.heat
        and mesh.users - mesh.use_fake_user == 1
        and not any(driven.keyed)
        and all(stand_in.show_viewport == stand_in.show_render for _modifier, stand_in in pairs)
    )
    poses = [
        (stand_in.armature, path)
        for (_modifier, stand_in), link in zip(pairs, driven.chain.links, strict=False)
        if stand_in.armature is not None
        for path in armature_io.paths_to_wait_for(stand_in.armature, link.binding.moving_bones)
    ]
    pose_driver.ensure(obj, list(dict.fromkeys(poses)), driven.asking)


def _maintain(obj: bpy.types.Object, changes: Changes, is_left: bool) -> None:
    """Brings modifiers, pointers and what holds the points in line with what the artist did.

    Raises SinewError where the modifiers that Sinew works with are gone.
    """
    if stack.armature_modifier(obj) is None:
        raise SinewError(f"{obj.name}: its Armature modifier was deleted; press Remove")
    nodes = stack.sinew_modifier(obj)
    if nodes is None or nodes.node_group is None:
        raise SinewError(f"{obj.name}: its Sinew modifier was deleted; press Remove, then Add Sinew")
    drive.follow_stack(obj)
    if properties.of(obj).standing_in == is_left:
        drive.switch(obj, on=not is_left)
        if is_left:
            points.put_away(obj)
    if is_left:
        drive.adopt_pointers(obj)
    elif obj.mode in MODES_THAT_NEED_THE_POINTER or _bones_are_edited(obj):
        drive.adopt_pointers(obj)
        drive.give_back_pointers(obj)
    else:
        drive.clear_pointers(obj)
    points.arrange(obj)
    _check_armatures(obj, changes)


def _bones_are_edited(obj: bpy.types.Object) -> bool:
    """Whether Blender renames groups along with bones."""
    return any(armature.mode == "EDIT" for armature in properties.of(obj).armatures)


def _check_armatures(obj: bpy.types.Object, changes: Changes) -> None:
    armatures = properties.of(obj).armatures
    if not armatures:
        raise SinewError(
            f"{obj.name}: its armature was deleted; choose another in the Armature modifier and press "
            "Rebind, or Remove"
        )
    for armature in armatures:
        # Deleting takes an object out of all collections; our pointer alone still keeps it in the file.
        if changes.structure and armature.library is None and not armature.users_collection:
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
        frames.append(LinkFrame(own, pose, space, scale_rule))
    return frames


def _takes_part(flags: properties.SinewStandIn | bpy.types.Modifier, mode: str) -> bool:
    return flags.show_render if mode == "RENDER" else flags.show_viewport


def _current(
    obj: bpy.types.Object,
    driven: Driven | None,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
) -> Driven:
    """The object's state, bound anew where its mesh, weights, bones or modifiers changed."""
    if driven is None:
        return _bind(obj, depsgraph)
    driven.mode = obj.mode
    if touched:
        pairs = drive.stand_ins(obj)
        armatures = [_uid(stand_in.armature) for _modifier, stand_in in pairs]
        options = [ModifierOptions.read(modifier) for modifier, _stand_in in pairs]
        if driven.armatures != armatures or driven.options != options:
            return _bind(obj, depsgraph)
    if _bones_changed(obj, driven, depsgraph, changes):
        return _bind(obj, depsgraph, driven)
    if source.has_changed(obj, driven.source, depsgraph, changes, touched):
        return _bind(obj, depsgraph, driven)
    return driven


def _uid(armature: bpy.types.Object | None) -> int:
    return 0 if armature is None else armature.session_uid


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
            # Of a mesh that is left to it Blender has renamed them itself.
            if not driven.is_left:
                _follow_renamed_bones(obj, known, bones)
            changed |= not bones.equals(known)
    return changed


def _bind(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, old: Driven | None = None) -> Driven:
    """Reads mesh, weights and bones; keeps the old bindings where they came out the same."""
    read = source.read(obj, depsgraph)
    pairs = drive.stand_ins(obj)
    bones = [_read_bones(stand_in.armature, depsgraph) for _modifier, stand_in in pairs]
    if (
        old is not None
        and read.equals_but_for_points(old.source)
        and all(b.equals(link.binding.bones) for b, link in zip(bones, old.chain.links, strict=False))
    ):
        if np.array_equal(read.points, old.source.points):
            # The same array tells that nothing moved.
            read.points = old.source.points
        old.source = read
        return old
    options = [ModifierOptions.read(modifier) for modifier, _stand_in in pairs]
    links = [
        Link(
            Binding(option.weighting(obj, read.weights, its_bones)),
            option.mask_weights(obj, read.weights),
            option.multi,
        )
        for option, its_bones in zip(options, bones, strict=True)
    ]
    facts = survey.describe(obj, pairs[0][1].armature, links[0].binding.weighting, read.points, depsgraph)
    armatures = [_uid(stand_in.armature) for _modifier, stand_in in pairs]
    keyed = [animation.is_visibility_animated(obj, modifier) for modifier, _stand_in in pairs]
    return Driven(obj.mode, armatures, options, keyed, read, Chain(links), facts)


def _read_bones(armature: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> Bones:
    if armature is None or armature.mode == "EDIT":
        return Bones.none()
    return armature_io.read_bones(armature.evaluated_get(depsgraph))


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
