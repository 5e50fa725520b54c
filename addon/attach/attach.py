# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts Sinew in the place of an object's Armature modifiers, and takes it off again.

While Sinew deforms, the Armature modifiers stay in the stack, switched on, where other tools look for them;
in_depsgraph.py has Blender leave them out. In a saved file they deform, and Sinew's modifier is off, so that
a Blender without Sinew can play it. What the artist or a tool does to the modifiers' icons has the meaning
that attach/icons.py gives it.
"""

from collections.abc import Collection
from typing import TypeAlias

import bpy

from ..base.errors import SinewError
from ..base.phrases import phrase
from ..io.actions import animated_paths, is_animated, is_visibility_animated
from . import (
    baked,
    corrective_smooth,
    icons,
    point_store,
    pose_driver,
    properties,
    property_groups,
    setting_animation,
    stack,
    stage_settings,
    stored_vertex_data,
    undeformed,
    upstream_proxy,
)
from .icons import VIEWS, Deformer, Icons, Situation
from .stack import armature_modifier, sinew_modifier
from .subscribers import notify, subscribers
from .updates import updates_suspended

# The methods between which an Armature modifier's Preserve Volume chooses.
MODIFIERS_OWN = ("lbs", "dq")

# Armature modifiers that Sinew replaces, in their order, each with what Sinew stores about it.
Replaced: TypeAlias = list[tuple[bpy.types.ArmatureModifier, properties.SinewReplacedModifier]]


def armature_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Returns the armature that deforms a mesh object: by its first Armature modifier, whose armature Sinew
    keeps, or as its parent. Reads the stack as it is now; Sinew's record follows at the next event, and
    never while the mesh is hidden."""
    if obj.type != "MESH":
        return None
    modifier = armature_modifier(obj)
    # An undo can have the object in its own modifier.
    if modifier is not None and modifier.object not in (None, obj):
        return modifier.object
    if properties.has_sinew(obj):
        kept = properties.of(obj).replaced_modifiers
        same = (each for each in kept if modifier is not None and stack.modifier_of(obj, each) == modifier)
        found = next(same, None) or next(iter(kept), None)
        if found is not None and found.armature is not None:
            return found.armature
    return obj.parent if modifier is None and stack.parent_deforms(obj) else None


def deformed_meshes(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns those of `objects` that are meshes deformed by an armature, or that have Sinew, without a
    comparison's copies."""
    return [
        o
        for o in objects
        if o.type == "MESH"
        and not properties.is_helper(o)
        and not properties.is_copy(o)
        and (properties.has_sinew(o) or armature_of(o) is not None)
    ]


def not_meshes(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns those of `objects` that an armature deforms and that Sinew leaves to Blender, such as
    lattices."""
    return [
        o for o in objects if o.type != "MESH" and any(m.type == "ARMATURE" and m.object for m in o.modifiers)
    ]


def check_can_add(obj: bpy.types.Object) -> None:
    """Raises SinewError that says why Sinew cannot deform a mesh object, and what to do."""
    if armature_of(obj) is None:
        raise SinewError(f"{obj.name}: no Armature modifier with an armature; parent the mesh to one first")
    if not obj.is_editable:
        raise SinewError(
            f"{obj.name} is linked from another file; make a library override of it first "
            "(Object > Library Override > Make)"
        )
    if obj.mode == "EDIT":
        raise SinewError(f"{obj.name} is in edit mode; leave it first")
    check_stack(obj)


def check_stack(obj: bpy.types.Object, left_out: Collection[str] = ()) -> None:
    """Raises SinewError where an object's other modifiers, without types of `left_out`, do not permit
    Sinew's."""
    upstream_proxy.check(obj)
    check_behind(obj, left_out)


def check_behind(obj: bpy.types.Object, left_out: Collection[str] = ()) -> None:
    """Raises SinewError where a modifier behind, without types of `left_out`, does not permit Sinew's."""
    for modifier in stack.downstream(obj):
        if modifier.type in stack.NEED_ORIGINAL_MESH.difference(left_out):
            raise SinewError(
                f"{obj.name}: in front of {modifier.name} Blender permits only modifiers that just deform, "
                "so not Sinew's; move it in front of the Armature modifier, or apply or remove it"
            )


def add(obj: bpy.types.Object, method: str | None = None, is_shown: bool = True) -> None:
    """Puts Sinew on an object. It deforms after the next session.refresh(). Without `method`, each Armature
    modifier keeps its own method.

    is_shown  it deforms also where the Armature modifiers are off in both views

    Raises SinewError, and changes nothing, where that is not possible.
    """
    if properties.has_sinew(obj):
        if method is not None:
            # For all Armature modifiers.
            properties.of(obj).method = method
        return
    check_can_add(obj)
    with updates_suspended():
        _add(obj, method, is_shown)


def _add(obj: bpy.types.Object, method: str | None, is_shown: bool) -> None:
    active, before = obj.modifiers.active, {modifier.name for modifier in obj.modifiers}
    try:
        _replace_modifiers(obj, method)
        if is_shown and not stack.visibility_is_animated(obj):
            _begin_with_icons(obj)
    except Exception as error:
        parent_type = properties.of(obj).before.parent_type
        properties.clear(obj)
        for modifier in [m for m in obj.modifiers if m.name not in before]:
            obj.modifiers.remove(modifier)
        if parent_type:
            obj.parent_type = parent_type
        if not isinstance(error, RuntimeError):
            raise
        # Blender refuses an operation with such an error, and gives the reason.
        reason = str(error).strip().removeprefix("Error: ")
        raise SinewError(f"{obj.name}: Sinew can not be added to its modifiers: {reason}") from error
    finally:
        obj.modifiers.active = active


def _replace_modifiers(obj: bpy.types.Object, method: str | None) -> None:
    settings = properties.of(obj)
    if armature_modifier(obj) is None:
        _make_modifier_of_parent(obj)
    run = stack.armature_modifiers(obj)
    nodes = obj.modifiers.new("Sinew", "NODES")
    settings.stack.modifier_uid = nodes.persistent_uid
    nodes.show_expanded = False
    nodes.show_in_editmode = False
    _show(nodes, False, False)
    # Not to the end of the stack, where the artist may have pinned other modifiers.
    stack.move_behind(obj, nodes, run[-1])
    settings.before.had_animation = obj.animation_data is not None
    settings.method = method or method_of(run[0])
    properties.make_groups(settings)
    stage_settings.note_scale(obj)
    for modifier, replaced in replaced_modifiers(obj):
        replaced.armature = modifier.object
        if method is None and method_of(modifier) != settings.method:
            replaced.method = method_of(modifier)


def _begin_with_icons(obj: bpy.types.Object) -> None:
    """Has Sinew deform in both views where the Armature modifiers are off in both: what replaces them, such
    as a bake, is switched off then."""
    pairs = replaced_modifiers(obj)
    views = {name: _view(obj, pairs, name) for name in VIEWS}
    if any(any(view.shown) for view in views.values()):
        return
    for name, view in views.items():
        _store(obj, pairs, name, view.switched_on())
    _set_icons(obj, Situation.OFF)
    baked.switch_off(obj)


def notes(obj: bpy.types.Object) -> list[str]:
    """Returns sentences on an animated method, on icons that were set back, on what Add found switched off,
    and on what it switched off itself."""
    found = []
    settings = properties.of(obj)
    if settings.method in MODIFIERS_OWN and any(
        is_volume_followed(obj, m) for m, _ in replaced_modifiers(obj)
    ):
        text = "Its Preserve Volume is animated, and chooses between Linear Blend and Dual Quaternion"
        found.append(phrase(text))
    if undeformed.was_switched(obj):
        text = "Sinew's two helping modifiers follow the icon of its own: switch the modifier Sinew"
        found.append(phrase(text))
    if was_off(obj):
        text = "Its Armature modifier was off before Sinew; Remove switches it off again"
        found += [phrase(text), *baked.notes(obj)]
    return found


def hangs_on(obj: bpy.types.Object, armatures: Collection[bpy.types.Object]) -> bool:
    """Whether an object is parented to one of the armatures or its bones, or to what is."""
    parent = obj.parent
    while parent is not None and parent not in armatures:
        parent = parent.parent
    return parent is not None


def method_of(modifier: bpy.types.ArmatureModifier) -> str:
    """Returns the method of the modifier itself."""
    return "dq" if modifier.use_deform_preserve_volume else "lbs"


def is_volume_animated(obj: bpy.types.Object, modifier: bpy.types.ArmatureModifier) -> bool:
    """Whether keys or drivers set its Preserve Volume."""
    return is_animated(obj, modifier, "use_deform_preserve_volume")


def is_volume_followed(obj: bpy.types.Object, modifier: bpy.types.ArmatureModifier) -> bool:
    """Whether an animated Preserve Volume decides between the two methods of the modifier itself. A copy in a
    comparison has the method that its label names."""
    return is_volume_animated(obj, modifier) and not properties.is_copy(obj)


def _make_modifier_of_parent(obj: bpy.types.Object) -> None:
    """Makes a modifier of the parent type Armature, which deforms without a modifier in the stack."""
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    obj.modifiers.move(list(obj.modifiers).index(modifier), 0)
    modifier.object = obj.parent
    modifier.use_bone_envelopes = True
    properties.of(obj).before.parent_type = obj.parent_type
    obj.parent_type = "OBJECT"


def remove(obj: bpy.types.Object) -> None:
    """Takes Sinew off as take_off() does, for the artist.

    Raises SinewError, and changes nothing, where Sinew would be back after loading the file.
    """
    nodes = sinew_modifier(obj)
    if obj.override_library is not None and nodes is not None and nodes.is_override_data:
        # A script can remove it from the override, but then Blender loads it again, and the Armature modifier
        # twice.
        raise SinewError(
            f"{obj.name}: Sinew comes with it from its library; switch it off here, or remove it there"
        )
    take_off(obj)


def take_off(obj: bpy.types.Object, is_by_others: bool = False) -> None:
    """Takes Sinew off: the Armature modifiers are as before, and nothing of Sinew stays in the file.

    is_by_others  somebody removed its modifier
    """
    with updates_suspended():
        _take_off(obj, is_by_others)
    notify(subscribers.after_removal)


def _take_off(obj: bpy.types.Object, is_by_others: bool) -> None:
    follow_icons(obj)
    switch(obj, on=False)
    restore_volume(obj)
    settings, nodes = properties.of(obj), sinew_modifier(obj)
    for modifier, replaced in replaced_modifiers(obj):
        if not _is_keyed(obj, modifier, replaced):
            _show(modifier, *own_visibility(replaced))
    baked.switch_on(obj)
    notify(subscribers.before_removal, obj)
    (undeformed.remove_later if is_by_others else undeformed.remove)(obj)
    if nodes is not None:
        active = obj.modifiers.active if obj.modifiers.active != nodes else armature_modifier(obj)
        obj.modifiers.remove(nodes)
        obj.modifiers.active = active
    if settings.before.parent_type:
        modifier = armature_modifier(obj)
        if modifier is not None:
            obj.modifiers.remove(modifier)
        obj.parent_type = settings.before.parent_type
    point_store.remove(obj)
    if not any(
        other.data == obj.data and properties.has_sinew(other) for other in bpy.data.objects if other != obj
    ):
        stored_vertex_data.remove(obj.data)
    setting_animation.remove(obj)
    properties.clear(obj)


def switch(obj: bpy.types.Object, on: bool, is_alone: bool = False) -> None:
    """On: Sinew deforms where the icons say so. Off: the Armature modifiers deform, and Sinew's modifier is
    off.

    is_alone  where Sinew deforms, the Armature modifiers are off
    """
    settings = properties.of(obj)
    if on:
        restore_volume(obj)
        adopt_pointers(obj)
        _note_keyed_visibility(obj)
        # Where an animation switches Sinew's modifier off, Armature modifiers that are on would deform.
        nodes = sinew_modifier(obj)
        is_alone = is_alone or (nodes is not None and is_visibility_animated(obj, nodes))
        # Tools for weights find the deforming bones through Armature modifiers that are on.
        is_alone = is_alone and obj.mode != "WEIGHT_PAINT" and not stack.is_deformed_mesh_read(obj)
        _set_icons(obj, Situation.ALONE if is_alone else Situation.SINEW)
        return
    if settings.replaces_modifiers:
        restore_builtin(obj)
    elif settings.enabled:
        _note_keyed_visibility(obj)
    _set_icons(obj, Situation.BUILT_IN if settings.enabled else Situation.OFF)


def is_off(obj: bpy.types.Object) -> bool:
    """Whether its modifiers are as they have to be while Sinew is off."""
    settings = properties.of(obj)
    return not settings.enabled and Situation(settings.stack.situation) is Situation.OFF


def follow_icons(obj: bpy.types.Object) -> None:
    """Takes over what the artist or a tool did to the icons since they were set."""
    _follow_ended_keys(obj)
    settings, nodes, pairs = properties.of(obj), sinew_modifier(obj), replaced_modifiers(obj)
    situation = Situation(settings.stack.situation)
    # With a modifier that is gone, Sinew's icon was another.
    is_any_gone = len(settings.replaced_modifiers) > len(pairs)
    for name in VIEWS:
        view = _view(obj, pairs, name)
        before = icons.icons(view, situation)
        undeformed.note_switched(obj, name, before.sinew)
        modifiers = tuple(
            was_on if _is_keyed(obj, modifier, replaced) else getattr(modifier, f"show_{name}")
            for (modifier, replaced), was_on in zip(pairs, before.modifiers, strict=True)
        )
        is_unknown = is_any_gone or nodes is None or is_animated(obj, nodes, f"show_{name}")
        # Where an Armature modifier that was off is animated now, Sinew's icon is off until it is set below.
        is_unknown |= any(
            is_visibility_animated(obj, modifier)
            and not (replaced.visibility_is_keyed or getattr(replaced, f"show_{name}"))
            for modifier, replaced in pairs
        )
        now = Icons(before.sinew if is_unknown else getattr(nodes, f"show_{name}"), modifiers)
        if now == before:
            continue
        is_left = situation is Situation.BUILT_IN and view.deformer is Deformer.SINEW
        if is_left and now.sinew and obj.mode not in ("EDIT", "SCULPT"):
            # The artist wants Sinew to deform it, though it is small.
            property_groups.store(settings, "leave_small", False)
        _store(obj, pairs, name, icons.follow(view, situation, now))
    # So that what was taken over is not taken for another click.
    _set_icons(obj, situation)


def _follow_ended_keys(obj: bpy.types.Object) -> None:
    """Where an animation does not set an Armature modifier's icons any more, they stay as it left them."""
    ended = [
        (modifier, replaced)
        for modifier, replaced in replaced_modifiers(obj)
        if replaced.visibility_is_keyed and not is_visibility_animated(obj, modifier)
    ]
    if not ended:
        return
    for modifier, replaced in ended:
        property_groups.store(replaced, "visibility_is_keyed", False)
        for name in VIEWS:
            property_groups.store(replaced, f"show_{name}", getattr(modifier, f"show_{name}"))
        for name in VIEWS:
            property_groups.store(replaced, f"was_off_{name}", False)
    _set_icons(obj, Situation(properties.of(obj).stack.situation))


def show(obj: bpy.types.Object) -> None:
    """Has Sinew deform it in both views, whatever was switched before."""
    pairs = replaced_modifiers(obj)
    for name in VIEWS:
        _store(obj, pairs, name, _view(obj, pairs, name).switched_on())
    _set_icons(obj, Situation(properties.of(obj).stack.situation))


def deformers(obj: bpy.types.Object) -> tuple[Deformer, Deformer]:
    """Returns what deforms it in the viewport and in renders while Sinew is on. What animated icons do is not
    known."""
    pairs = replaced_modifiers(obj)
    viewport, render = (_view(obj, pairs, name).deformer for name in VIEWS)
    return viewport, render


def deforms(obj: bpy.types.Object) -> bool:
    """Whether Sinew deforms it in one of the views while it is on."""
    return Deformer.SINEW in deformers(obj)


def do_views_differ(obj: bpy.types.Object) -> bool:
    """Whether Sinew deforms by other Armature modifiers in the viewport than in renders."""
    pairs = replaced_modifiers(obj)
    viewport, render = (_view(obj, pairs, name).taking_part for name in VIEWS)
    return any(viewport) and any(render) and viewport != render


def _view(obj: bpy.types.Object, pairs: Replaced, name: str) -> icons.View:
    shown, forced, switched = (
        tuple(getattr(replaced, f"{kind}_{name}") for _modifier, replaced in pairs)
        for kind in ("show", "was_off", "switched")
    )
    # One that an animation switches may be on in any frame.
    shown = tuple(is_shown or _is_keyed(obj, *pair) for is_shown, pair in zip(shown, pairs, strict=True))
    return icons.View(shown, forced, getattr(properties.of(obj).stack, f"hidden_{name}"), switched)


def _store(obj: bpy.types.Object, pairs: Replaced, name: str, view: icons.View) -> None:
    property_groups.store(properties.of(obj).stack, f"hidden_{name}", view.hidden)
    none = (False,) * len(pairs)
    for pair, shown, forced, switched in zip(
        pairs, view.shown, view.forced or none, view.switched or none, strict=True
    ):
        _modifier, replaced = pair
        if not _is_keyed(obj, *pair):
            property_groups.store(replaced, f"show_{name}", shown)
        property_groups.store(replaced, f"was_off_{name}", forced)
        property_groups.store(replaced, f"switched_{name}", switched)


def _set_icons(obj: bpy.types.Object, situation: Situation) -> None:
    settings, nodes, pairs = properties.of(obj), sinew_modifier(obj), replaced_modifiers(obj)
    helping, smooth = stack.helping_modifiers(obj), {}
    # Where Sinew deformed until now, an animation that came meanwhile has not set the icons yet.
    is_animation_known = situation.is_by_sinew or Situation(settings.stack.situation) is Situation.OFF
    for name in VIEWS:
        view = _view(obj, pairs, name)
        wanted = icons.icons(view, situation)
        for (modifier, replaced), is_on in zip(pairs, wanted.modifiers, strict=True):
            is_keyed = is_visibility_animated(obj, modifier)
            if not (is_keyed if is_animation_known else replaced.visibility_is_keyed):
                _show_in(modifier, name, is_on)
        if nodes is not None and not is_animated(obj, nodes, f"show_{name}"):
            _show_in(nodes, name, wanted.sinew)
        for modifier in helping:
            # Where an animation switches Sinew's, they stay on, as they change nothing.
            _show_in(modifier, name, wanted.sinew)
        smooth[name] = not situation.is_by_sinew or view.deformer is Deformer.ARMATURE
    undeformed.mark(obj, situation.is_by_sinew)
    corrective_smooth.switch(obj, **smooth)
    property_groups.store(settings.stack, "situation", situation.value)


def use_nearest_volume(obj: bpy.types.Object) -> None:
    """Sets the Armature modifiers' Preserve Volume to what is nearest to Sinew's method, while they deform:
    in a saved file, and in modes whose tools need them. Set once: what the artist switches meanwhile
    stays."""
    settings = properties.of(obj)
    pairs = replaced_modifiers(obj)
    nearest = [
        properties.method_of_modifier(settings.method, replaced.method, is_first=number == 0) == "dq"
        for number, (_modifier, replaced) in enumerate(pairs)
    ]
    if settings.before.has_nearest_volume:
        before = [replaced.preserve_volume == replaced.was_nearest for _modifier, replaced in pairs]
        if nearest == before:
            return
        # The method has changed since.
        restore_volume(obj)
    for (modifier, replaced), wanted in zip(pairs, nearest, strict=True):
        own = modifier.use_deform_preserve_volume
        if is_volume_animated(obj, modifier):
            wanted = own
        property_groups.store(replaced, "preserve_volume", own)
        property_groups.store(replaced, "was_nearest", own == wanted)
        _preserve_volume(modifier, wanted)
    property_groups.store(settings.before, "has_nearest_volume", True)


def restore_volume(obj: bpy.types.Object) -> None:
    """Gives the Armature modifiers the artist's own Preserve Volume again."""
    settings = properties.of(obj)
    if not settings.before.has_nearest_volume:
        return
    for replaced in settings.replaced_modifiers:
        modifier = stack.modifier_of(obj, replaced)
        # What the artist has switched since stays, too.
        if modifier is not None and not replaced.was_nearest:
            _preserve_volume(modifier, replaced.preserve_volume)
    property_groups.store(settings.before, "has_nearest_volume", False)


def has_switched_volume(obj: bpy.types.Object) -> bool:
    """Whether one of the Armature modifiers has another Preserve Volume than the artist's at the moment."""
    settings = properties.of(obj)
    are_nearest = all(each.was_nearest for each in settings.replaced_modifiers)
    return settings.before.has_nearest_volume and not are_nearest


def _preserve_volume(modifier: bpy.types.ArmatureModifier, preserve: bool) -> None:
    if modifier.use_deform_preserve_volume != preserve:
        modifier.use_deform_preserve_volume = preserve


def _note_keyed_visibility(obj: bpy.types.Object) -> None:
    """Notes which Armature modifiers' icons an animation sets from now on."""
    is_first = not properties.of(obj).replaces_modifiers
    for modifier, replaced in replaced_modifiers(obj):
        if not is_visibility_animated(obj, modifier):
            continue
        if is_first or replaced.visibility_is_keyed:
            for name in VIEWS:
                property_groups.store(replaced, f"show_{name}", getattr(modifier, f"show_{name}"))
        # While the object is hidden, no animation sets icons that Sinew has switched off.
        elif obj.visible_get():
            # Where one sets only the other icon, this one is restored.
            for name in VIEWS:
                if not is_animated(obj, modifier, f"show_{name}"):
                    _show_in(modifier, name, getattr(replaced, f"show_{name}"))
        if obj.visible_get():
            property_groups.store(replaced, "visibility_is_keyed", True)


def _is_keyed(
    obj: bpy.types.Object, modifier: bpy.types.ArmatureModifier, replaced: properties.SinewReplacedModifier
) -> bool:
    """Whether an animation sets its icons, or did so last, and not Sinew."""
    return replaced.visibility_is_keyed or is_visibility_animated(obj, modifier)


def own_visibility(replaced: properties.SinewReplacedModifier) -> tuple[bool, bool]:
    """Returns an Armature modifier's icons without Sinew: in the viewport, and in renders."""
    viewport, render = (
        getattr(replaced, f"show_{name}") and not getattr(replaced, f"was_off_{name}") for name in VIEWS
    )
    return viewport, render


def was_off(obj: bpy.types.Object) -> bool:
    """Whether the Armature modifiers were off in both views before Sinew."""
    kept = properties.of(obj).replaced_modifiers
    return any(replaced.was_off_viewport and replaced.was_off_render for replaced in kept)


def _show(modifier: bpy.types.Modifier | None, viewport: bool, render: bool) -> None:
    _show_in(modifier, "viewport", viewport)
    _show_in(modifier, "render", render)


def _show_in(modifier: bpy.types.Modifier | None, name: str, value: bool) -> None:
    # Setting an unchanged value makes Blender evaluate the object, too.
    if modifier is not None and getattr(modifier, f"show_{name}") != value:
        setattr(modifier, f"show_{name}", value)


def _replaced_modifier(
    obj: bpy.types.Object, modifier: bpy.types.ArmatureModifier
) -> properties.SinewReplacedModifier:
    """Returns what Sinew stores about an Armature modifier, and makes it where it is missing."""
    replaced_modifiers = properties.of(obj).replaced_modifiers
    found = next((s for s in replaced_modifiers if stack.modifier_of(obj, s) == modifier), None)
    if found is None:
        situation, nodes = Situation(properties.of(obj).stack.situation), sinew_modifier(obj)
        is_alone = situation is Situation.ALONE
        pairs = ((stack.modifier_of(obj, each), each) for each in replaced_modifiers)
        known = [pair for pair in pairs if pair[0] is not None]
        for name in VIEWS if situation.is_by_sinew and known else ():
            view = _view(obj, known, name)
            if view.deformer is Deformer.NOTHING and not view.hidden and getattr(modifier, f"show_{name}"):
                # Sinew's icon is off because nothing deformed the mesh here. This modifier does.
                _show_in(nodes, name, True)
        found = replaced_modifiers.add()
        found.show_viewport, found.show_render = modifier.show_viewport, modifier.show_render
        found.visibility_is_keyed = is_visibility_animated(obj, modifier)
        for name in () if found.visibility_is_keyed else VIEWS:
            if getattr(properties.of(obj).stack, f"hidden_{name}"):
                # Whoever added it while Sinew is hidden means it to deform.
                setattr(found, f"switched_{name}", getattr(modifier, f"show_{name}"))
            elif is_alone and nodes is not None and getattr(nodes, f"show_{name}"):
                _show_in(modifier, name, False)
        found.preserve_volume, found.was_nearest = modifier.use_deform_preserve_volume, True
    property_groups.store(found, "name", modifier.name)
    property_groups.store(found, "uid", modifier.persistent_uid)
    return found


def replaced_modifiers(obj: bpy.types.Object) -> Replaced:
    """Returns the Armature modifiers that Sinew replaces, in their order, each with what Sinew stores about
    it."""
    run, kept = stack.armature_modifiers(obj), properties.of(obj).replaced_modifiers
    count = len(kept)
    pairs = [(modifier, _replaced_modifier(obj, modifier)) for modifier in run]
    if len(kept) != count:
        # Adding one makes Blender move the earlier ones in memory.
        pairs = [(modifier, _replaced_modifier(obj, modifier)) for modifier in run]
    return pairs


def follow_stack(obj: bpy.types.Object) -> None:
    """Follows the artist's changes of the stack, where modifiers were moved, renamed or deleted. Each
    Armature modifier keeps its method; one that no longer follows the first without a gap deforms by itself
    again."""
    settings = properties.of(obj)
    follow_icons(obj)
    stack.position_own(obj)
    kept = settings.replaced_modifiers
    names = [replaced.name for _modifier, replaced in replaced_modifiers(obj)]
    if [replaced.name for replaced in kept] == names:
        return
    methods = _methods(settings)
    for name in methods.keys() - set(names):
        modifier = obj.modifiers.get(name)
        if settings.replaces_modifiers and modifier is not None and modifier.type == "ARMATURE":
            _restore_pointer(modifier, kept[name])
            if not kept[name].visibility_is_keyed:
                _show(modifier, *own_visibility(kept[name]))
        kept.remove(kept.find(name))
    for place, name in enumerate(names):
        kept.move(kept.find(name), place)
    if "sinew.method" not in animated_paths(obj):
        settings.method = methods[names[0]]
    for name, method in _methods(settings).items():
        if method != methods[name]:
            kept[name].method = methods[name]


def _methods(settings: properties.SinewSettings) -> dict[str, str]:
    """Returns the method of each Armature modifier that Sinew replaces, by the modifier's name."""
    return {
        replaced.name: properties.method_of_modifier(settings.method, replaced.method, is_first=number == 0)
        for number, replaced in enumerate(settings.replaced_modifiers)
    }


def adopt_pointers(obj: bpy.types.Object) -> None:
    """Takes over armatures that the artist chose in the Armature modifiers."""
    for modifier, replaced in replaced_modifiers(obj):
        # An undo can have the object in its own modifier (point_store.clear_references_to_itself).
        if modifier.object not in (None, obj, replaced.armature):
            replaced.armature = modifier.object


def restore_pointers(obj: bpy.types.Object) -> None:
    """Makes the Armature modifiers point to their armatures again."""
    for modifier, replaced in replaced_modifiers(obj):
        _restore_pointer(modifier, replaced)


def _restore_pointer(
    modifier: bpy.types.ArmatureModifier, replaced: properties.SinewReplacedModifier
) -> None:
    armature = replaced.armature
    if armature is not None and is_deleted(armature):
        modifier.object = None
    elif modifier.object is None and armature is not None:
        modifier.object = armature


def is_deleted(armature: bpy.types.Object) -> bool:
    """Whether the user deleted it: it is then in no collection, and only Sinew's pointer keeps it in the
    file."""
    return armature.library is None and not armature.users_collection


def restore_builtin(obj: bpy.types.Object) -> None:
    """Makes the Armature modifiers point to their armatures again, and removes Sinew's driver."""
    restore_pointers(obj)
    pose_driver.remove(obj)
