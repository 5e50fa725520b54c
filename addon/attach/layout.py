# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object's stack of modifiers is in one event, as plain values: read once, compared by ==, passed on.

Modifiers are known by their names, which a stack has once each: undo makes references to them invalid.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import bpy

from ..io.actions import animated_paths
from . import node_group, properties
from .icons import ICONS, Deformer, Icons
from .modifier_options import NAMES, ModifierOptions
from .modifier_types import HARMLESS_UPSTREAM, LEFT_OUT_IN_PAINT, ONLY_DEFORM, PAINT_MODES

MARK_NAME = "Sinew Stack Mark"


class Armature(NamedTuple):
    """How an Armature modifier is set. What keys or drivers set is not here: it differs in each evaluation.

    uid      the session_uid of its armature; 0 for none
    method   its own, as from method_of(); empty where Preserve Volume is animated
    options  those that Sinew reproduces; None where one of them is animated
    """

    uid: int
    method: str
    options: ModifierOptions | None


class Modifier(NamedTuple):
    """One modifier of a stack.

    uid       its persistent_uid
    kind      its type, as Blender names it
    shown     whether its icons for the viewport and for renders are on
    keyed     whether keys or drivers switch these icons
    edited    Geometry Nodes: whether its icon for edit mode is on
    group     Geometry Nodes: what Sinew's node group is for (node_group.py), 0 for another; else None
    is_bound  Laplacian Deform: whether it is bound
    levels    Subdivision Surface: its levels in the viewport and in renders, None for animated ones
    armature  an Armature modifier's
    """

    name: str
    uid: int
    kind: str
    shown: tuple[bool, bool]
    keyed: tuple[bool, bool]
    edited: bool = False
    group: int | None = None
    is_bound: bool = False
    levels: tuple[int | None, int | None] = (None, None)
    armature: Armature | None = None

    @property
    def is_on(self) -> bool:
        return any(self.shown)

    @property
    def can_be_on(self) -> bool:
        """Whether it is on, or an animation may switch it on."""
        return any(self.shown) or any(self.keyed)


@dataclass(frozen=True)
class Layout:
    """The stack of a mesh object.

    modifiers          in their order
    replaced           the names of the Armature modifiers that Sinew replaces, or would replace
    mark, sinew, neutral
                       the names of Sinew's own (undeformed.py), in their order; empty for none
    own_icons          those that the artist gave Sinew's modifier, in the viewport and in renders
    mode               the object's
    parent_deforms     its parent deforms it before all modifiers (parent type Armature)
    is_deforming_body  a rigid body reads the mesh that the modifiers deform (is_deforming_body())
    """

    modifiers: tuple[Modifier, ...]
    replaced: tuple[str, ...]
    mark: str
    sinew: str
    neutral: str
    own_icons: tuple[bool, bool]
    mode: str
    parent_deforms: bool
    is_deforming_body: bool

    @cached_property
    def by_name(self) -> dict[str, Modifier]:
        return {modifier.name: modifier for modifier in self.modifiers}

    @cached_property
    def own(self) -> tuple[str, ...]:
        """The names of Sinew's modifiers."""
        return tuple(filter(None, (self.mark, self.sinew, self.neutral)))

    @property
    def helping(self) -> tuple[str, ...]:
        """The names of those that change nothing (undeformed.py)."""
        return tuple(filter(None, (self.mark, self.neutral)))

    @cached_property
    def skins(self) -> tuple[Modifier, ...]:
        """The Armature modifiers that Sinew replaces, or would replace, in their order."""
        return tuple(self.by_name[name] for name in self.replaced)

    @cached_property
    def ahead(self) -> tuple[Modifier, ...]:
        """Those before the ones that Sinew replaces, without Sinew's own, and without those that Blender
        leaves out in the object's mode."""
        end = self._index(self.replaced[0]) if self.replaced else len(self.modifiers)
        left_out = LEFT_OUT_IN_PAINT if self.mode in PAINT_MODES else ()
        ahead = (m for m in self.modifiers[:end] if m.name not in self.own and m.kind not in left_out)
        return tuple(m for m in ahead if not m.group)

    @cached_property
    def changes_ahead(self) -> tuple[Modifier, ...]:
        """Those that are on, or may be, and change positions, topology or weights."""
        return tuple(m for m in self.ahead if m.can_be_on and m.kind not in HARMLESS_UPSTREAM)

    @cached_property
    def behind(self) -> tuple[Modifier, ...]:
        """Those behind the ones that Sinew replaces, or would replace, without Sinew's own."""
        if not (self.replaced or self.parent_deforms):
            return ()
        start = self._index(self.replaced[-1]) + 1 if self.replaced else 0
        return tuple(m for m in self.modifiers[start:] if m.name not in self.own)

    @cached_property
    def icons(self) -> tuple[Icons, Icons]:
        """The icons in the viewport and in renders, with those that Sinew's modifier has while Sinew is on.
        One that is animated may be on in any frame."""
        keyed = self.by_name[self.sinew].keyed if self.sinew else (False, False)
        viewport, render = (
            Icons(
                self.own_icons[view] or keyed[view],
                tuple(skin.shown[view] or skin.keyed[view] for skin in self.skins),
            )
            for view in range(2)
        )
        return viewport, render

    @property
    def icons_in_this_frame(self) -> tuple[Icons, Icons]:
        """As icons, but animated ones are as Blender has set them for this frame."""
        own = self.own_icons
        viewport, render = (
            Icons(own[view], tuple(skin.shown[view] for skin in self.skins)) for view in range(2)
        )
        return viewport, render

    @property
    def deforms(self) -> bool:
        """Whether Sinew deforms it in one of the views while it is on."""
        return any(icons.deformer is Deformer.SINEW for icons in self.icons)

    @property
    def is_visibility_keyed(self) -> bool:
        """Whether an animation switches one of the Armature modifiers, or one of Sinew's, on and off."""
        return any(any(self.by_name[name].keyed) for name in (*self.replaced, *self.own))

    @property
    def is_deformed_read(self) -> bool:
        """Whether Blender reads the mesh behind the leading modifiers that just deform, so without Sinew's: a
        rigid body, and brushes where a later modifier makes another mesh (sculpt_update_object in Blender's
        sources of 4.2 to 5.2)."""
        makes_another = any(m.can_be_on and m.kind not in ONLY_DEFORM for m in self.behind)
        return self.is_deforming_body or (self.mode in PAINT_MODES and makes_another)

    def has_switches_of(self, obj: bpy.types.Object) -> bool:
        """Whether names, icons and levels are as they are now: all that can differ where Blender lists only a
        pose (Changes.of_poses)."""
        return len(self.modifiers) == len(obj.modifiers) and all(
            known.name == now.name
            and known.shown == (now.show_viewport, now.show_render)
            and (known.kind != "NODES" or known.edited == now.show_in_editmode)
            and (known.kind != "SUBSURF" or _are_levels(known, now))
            for known, now in zip(self.modifiers, obj.modifiers, strict=True)
        )

    def _index(self, name: str) -> int:
        return next(number for number, modifier in enumerate(self.modifiers) if modifier.name == name)


def read(obj: bpy.types.Object) -> Layout:
    paths = animated_paths(obj)
    modifiers = tuple(_modifier(modifier, paths) for modifier in obj.modifiers)
    mark, sinew, neutral = _own(obj, modifiers)
    return Layout(
        modifiers,
        _replaced(obj, modifiers, {mark, sinew, neutral}),
        mark,
        sinew,
        neutral,
        _own_icons(obj, sinew),
        obj.mode,
        parent_deforms(obj),
        is_deforming_body(obj),
    )


def _modifier(modifier: bpy.types.Modifier, paths: set[str]) -> Modifier:
    kind, name = modifier.type, modifier.name
    start = f'modifiers["{bpy.utils.escape_identifier(name)}"].' if paths else ""
    shown = modifier.show_viewport, modifier.show_render
    keyed = f"{start}show_viewport" in paths, f"{start}show_render" in paths
    known = (name, modifier.persistent_uid, kind, shown, keyed)
    if kind == "NODES":
        nodes = modifier.node_group
        group = None if nodes is None else nodes.get(node_group.MARK, 0)
        return Modifier(*known, edited=modifier.show_in_editmode, group=group)
    if kind == "SUBSURF":
        viewport = None if f"{start}levels" in paths else modifier.levels
        render = None if f"{start}render_levels" in paths else modifier.render_levels
        return Modifier(*known, levels=(viewport, render))
    if kind == "ARMATURE":
        armature = modifier.object
        method = "" if f"{start}use_deform_preserve_volume" in paths else method_of(modifier)
        is_keyed = not paths.isdisjoint(start + option for option in NAMES)
        options = None if is_keyed else ModifierOptions.read(modifier)
        return Modifier(
            *known, armature=Armature(armature.session_uid if armature is not None else 0, method, options)
        )
    return Modifier(*known, is_bound=kind == "LAPLACIANDEFORM" and modifier.is_bind)


def _are_levels(known: Modifier, now: bpy.types.SubsurfModifier) -> bool:
    viewport, render = known.levels
    return viewport in (None, now.levels) and render in (None, now.render_levels)


def method_of(modifier: bpy.types.ArmatureModifier) -> str:
    """Returns the method of the modifier itself."""
    return "dq" if modifier.use_deform_preserve_volume else "lbs"


def _own_icons(obj: bpy.types.Object, sinew: str) -> tuple[bool, bool]:
    if not obj.is_property_set("sinew"):
        return True, True
    kept = properties.of(obj).stack
    own = obj.modifiers[sinew] if kept.replaces_modifiers and sinew else kept
    viewport, render = (getattr(own, icon) for icon in ICONS)
    return viewport, render


def parent_deforms(obj: bpy.types.Object) -> bool:
    """Whether the object's parent deforms it before all modifiers (parent type Armature)."""
    return obj.parent is not None and obj.parent_type == "ARMATURE" and obj.parent.type == "ARMATURE"


def is_deforming_body(obj: bpy.types.Object) -> bool:
    """Whether it is a rigid body of source Deform, or one of any source that is Deforming
    (rigidbody_get_mesh, rigidbody_update_sim_ob in Blender's sources of 4.2 to 5.2)."""
    body = obj.rigid_body
    return body is not None and (body.mesh_source == "DEFORM" or body.use_deform)


# --- Sinew's own


def _own(obj: bpy.types.Object, modifiers: Sequence[Modifier]) -> Iterator[str]:
    """Yields the names of the modifier that marks the mesh, of Sinew's own, and of the one that changes
    nothing; empty for none. Each is found by its node group or its uid, or, without Sinew's settings, by its
    name. Reads no settings of an object that has none, which would make them."""
    mark_uid = sinew_uid = neutral_uid = 0
    if obj.is_property_set("sinew"):
        kept = properties.of(obj).stack
        mark_uid, neutral_uid = kept.mark_uid, kept.neutral_uid
        sinew_uid = kept.modifier_uid if properties.has_sinew(obj) else 0
    nodes = [modifier for modifier in modifiers if modifier.kind == "NODES"]
    bare = [modifier for modifier in nodes if modifier.group is None]
    marks = (m.name for m in nodes if m.group == node_group.STACK_MARK)
    mark = next(marks, "") or _found(bare, mark_uid, MARK_NAME)
    yield mark
    others = (m.name for m in nodes if m.group and m.name != mark)
    ours = (m.name for m in bare if m.name != mark and (m.name.startswith("Sinew") or m.uid == sinew_uid))
    yield next(others, "") or next(ours, "")
    free = [m for m in modifiers if m.kind == "LAPLACIANDEFORM" and not m.is_bound]
    yield _found(free, neutral_uid, "Sinew")


def _found(modifiers: Sequence[Modifier], uid: int, name: str) -> str:
    same = (modifier.name for modifier in modifiers if modifier.uid == uid)
    return next(same, "") or next((m.name for m in modifiers if m.name.startswith(name)), "")


# --- What Sinew replaces


def _replaced(obj: bpy.types.Object, modifiers: tuple[Modifier, ...], own: set[str]) -> tuple[str, ...]:
    """Returns the names of the Armature modifiers that Sinew replaces, or would replace: the first and those
    directly behind it, which Blender may chain as Multi Modifiers."""
    run = []
    for modifier in modifiers[_start(obj, modifiers, own) :]:
        if modifier.armature is not None:
            run.append(modifier.name)
        elif modifier.name not in own:
            break
    return tuple(run)


def _start(obj: bpy.types.Object, modifiers: tuple[Modifier, ...], own: set[str]) -> int:
    """Returns the index of the first Armature modifier that Sinew replaces. Without Sinew, that is the first
    with an armature, preferably one that is on."""
    count = len(modifiers)
    if not properties.has_sinew(obj):
        found = [n for n, m in enumerate(modifiers) if m.armature is not None and m.armature.uid]
        return min(found, key=lambda number: not modifiers[number].can_be_on, default=count)
    behind_own = max((n for n, m in enumerate(modifiers) if m.name in own), default=count) + 1
    kept = (find(modifiers, "ARMATURE", each) for each in properties.of(obj).replaced_modifiers)
    known = sorted(number for number in kept if number is not None)
    start = next(iter(known), behind_own)
    # New modifiers between Sinew's and the first known one count.
    between = modifiers[behind_own:start]
    if between and all(m.armature is not None for m in between):
        start = behind_own
    # So do new ones directly before Sinew's or before the first.
    ahead = min(start, count) - 1
    while ahead >= 0 and modifiers[ahead].name in own:
        ahead -= 1
    # So do others in place of those that are gone, if Sinew's is behind them.
    while ahead >= 0 and _joins(modifiers[ahead], are_gone=not known):
        start, ahead = ahead, ahead - 1
    return start


def _joins(modifier: Modifier, are_gone: bool) -> bool:
    """Whether one directly in front of those that Sinew replaces, or in place of them, is replaced, too."""
    skin = modifier.armature
    return skin is not None and (are_gone or (skin.uid != 0 and modifier.can_be_on))


def find(
    modifiers: Sequence[Modifier],
    kind: str,
    kept: properties.SinewReplacedModifier | properties.SinewSwitchedOff,
) -> int | None:
    """Returns the index of the modifier of this type that Sinew has replaced or switched off, even if it was
    moved and renamed; else of one of its name; else None."""
    found = [(number, modifier) for number, modifier in enumerate(modifiers) if modifier.kind == kind]
    same = (number for number, modifier in found if modifier.uid == kept.uid)
    return next(same, next((number for number, modifier in found if modifier.name == kept.name), None))
