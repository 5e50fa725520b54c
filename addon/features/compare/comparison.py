# SPDX-License-Identifier: GPL-3.0-or-later
"""Live copies of a character beside it, one for each method, which can be removed completely.

A copy shares the original's mesh, follows its transform and has its modifiers. A modifier behind all others
displays it at another position. Everything a copy needs is in separate objects and actions, so that nothing
of the original changes.
"""

from collections.abc import Sequence

import bpy
import numpy as np

from ...attach import (
    attach,
    corrective_smooth,
    node_group,
    orphans,
    point_buffer,
    properties,
    property_groups,
    stack,
    upstream_proxy,
    variant_settings,
)
from ...attach.updates import updates_suspended
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import actions
from ...io.actions import players
from ...skinning.stages import ORDER
from ...skinning.variants import is_key, parse
from ...skinning.vectors import transformed
from ...ui.translations import tr
from . import comparison_state, offset_nodes

# The space between two characters, as a share of a character's width.
GAP = 0.12

# One for each method, in their order: a colour-blind-safe set (Okabe and Ito, 2008), and three that differ as
# much from it and from the original's white.
COLOURS = (
    (0.90, 0.60, 0.00),
    (0.34, 0.71, 0.91),
    (0.00, 0.62, 0.45),
    (0.94, 0.89, 0.26),
    (0.84, 0.37, 0.00),
    (0.80, 0.47, 0.65),
    (0.00, 0.45, 0.70),
    (0.20, 0.13, 0.90),
    (0.35, 0.18, 0.08),
    (0.75, 0.75, 0.60),
)
# In a copy these would run a second time, with separate caches, or affect other simulations.
LEFT_OUT = upstream_proxy.SIMULATIONS | {"COLLISION", "SURFACE"}
ACTION_MARK = "sinew_comparison"


def start(
    context: bpy.types.Context, meshes: Sequence[bpy.types.Object], methods: Sequence[str], right: np.ndarray
) -> list[str]:
    """Compares the visible parts of a character under `methods`, each of characters.method_names() or the key
    of a variant, in the context's scene and in place of the current comparison. Returns a sentence for each
    mesh that cannot be compared, and for each method that fails on one.

    right  [3], the direction of the screen's right in the world; the copies are placed along the nearest axis

    Raises SinewError, and leaves no comparison, where no mesh can be compared.
    """
    scene = context.scene
    before = comparison_state.of_scene(scene)
    arrangement = before.arrangement if before is not None else comparison_state.SIDE_BY_SIDE
    end(context)
    taken, problems = _comparable(meshes)
    # Before copies are made: the scene as it is now is already evaluated.
    axis = _row_axis(right)
    depsgraph = context.evaluated_depsgraph_get()
    points = np.concatenate([corners(obj.evaluated_get(depsgraph)) for obj in taken])
    collection = bpy.data.collections.new("Sinew Comparison")
    collection.hide_render = True
    scene.collection.children.link(collection)
    state = scene.sinew_comparison
    state.collection = collection
    try:
        with updates_suspended():
            for obj in taken:
                for number, method in enumerate(methods):
                    collection.objects.link(_copy(obj, method, _colour(method, number)))
            state.axis = axis
            state.spacing = _spacing(points, axis)
            state.first, state.second = methods[0], _other_than(methods[0], methods)
            state.arrangement = arrangement
    except BaseException:
        end(context)
        raise
    session.refresh(context)
    return [*problems, *(e for e in (properties.of(copy).error for copy in collection.objects) if e)]


def _other_than(first: str, methods: Sequence[str]) -> str:
    """Returns the method to flip to: the last of Sinew's own methods, if that is another one."""
    others = [method for method in methods if method != first]
    return next((m for m in reversed(others) if m != characters.BLENDER), others[-1] if others else first)


def _comparable(meshes: Sequence[bpy.types.Object]) -> tuple[list[bpy.types.Object], list[str]]:
    """Returns the meshes that can be copied, and a sentence for each of the others; raises SinewError where
    none can."""
    taken, problems = [], []
    for obj in meshes:
        try:
            if obj.data.is_editmode:
                raise SinewError(f"{obj.name} is in edit mode; leave it first")
            if attach.armature_of(obj) is not None:
                attach.check_stack(obj, LEFT_OUT)
            taken.append(obj)
        except SinewError as error:
            problems.append(str(error))
    if not taken:
        raise SinewError(problems[0])
    return taken, problems


def is_on() -> bool:
    """Whether any scene of the file itself shows a comparison."""
    return bool(_states())


def label_shown(obj: bpy.types.Object) -> str:
    """Returns that of the shape that an object shows, with its stages."""
    if method_shown(obj) == characters.BLENDER:
        return tr(properties.method_label(characters.BLENDER))
    return tr(variant_settings.read(obj).label)


def method_shown(obj: bpy.types.Object) -> str:
    """Returns that of the shape that an object shows, one of characters.method_names()."""
    return properties.of(obj).method if session.plan_of(obj).is_read else characters.BLENDER


def originals(state: comparison_state.SinewComparison) -> list[bpy.types.Object]:
    """Returns the compared objects, without those that the artist has deleted."""
    found = {properties.of(copy).identity.copied: None for copy in comparison_state.copies_of(state)}
    return [obj for obj in found if obj is not None and obj.users_collection]


def _states() -> list[comparison_state.SinewComparison]:
    found = (comparison_state.of_scene(scene) for scene in bpy.data.scenes if scene.library is None)
    return [state for state in found if state is not None]


def is_without_original() -> bool:
    """Whether copies are left of which no original is there, or none with an armature: the artist has deleted
    the character, its armature or the scene."""
    shown = {copy for state in _states() for copy in comparison_state.copies_of(state)}
    copies = [obj for obj in bpy.data.objects if properties.is_copy(obj) and obj.library is None]
    if not copies:
        return False
    compared = [properties.of(copy).identity.copied for copy in shown]
    there = (obj for obj in compared if obj is not None and obj.users_collection)
    armatures = (attach.armature_of(obj) for obj in there)
    return not any(armature is not None and not attach.is_deleted(armature) for armature in armatures)


def is_original(obj: bpy.types.Object) -> bool:
    """Whether a comparison shows copies of it."""
    return any(obj in originals(state) for state in _states())


def is_of_none_with_sinew() -> bool:
    """Whether none of the compared objects has Sinew."""
    compared = {obj for state in _states() for obj in originals(state)}
    return not any(map(properties.has_sinew, compared))


def end(context: bpy.types.Context) -> None:
    """Removes everything that any comparison made in the open file, even if it was changed since."""
    copies = [obj for obj in bpy.data.objects if properties.is_copy(obj) and obj.library is None]
    if not is_on() and not copies:
        return
    collections = []
    for scene in bpy.data.scenes:
        state = comparison_state.of_scene(scene)
        if state is not None and scene.library is None:
            collections += [(scene, state.collection)] if state.collection is not None else []
            scene.property_unset("sinew_comparison")
    compared = {properties.of(copy).identity.copied for copy in copies} - {None}
    # Of scenes that the artist has deleted.
    inside = {each for copy in copies for each in copy.users_collection if not each.is_embedded_data}
    inside -= {collection for _scene, collection in collections}
    loose = [each for each in inside if each.users == each.use_fake_user]
    for copy in copies:
        session.forget_object(copy)
        upstream_proxy.remove(copy)
        point_buffer.remove(copy)
    bpy.data.batch_remove(copies)
    for scene, collection in collections:
        _remove_collection(scene, collection)
    bpy.data.batch_remove(loose)
    # An object that the artist deleted was kept in the file only by its copies.
    for obj in compared:
        if obj.users == 0:
            bpy.data.objects.remove(obj)
    # What belonged to copies that were deleted by hand.
    for action in [action for action in bpy.data.actions if action.get(ACTION_MARK)]:
        bpy.data.actions.remove(action)
    offset_nodes.remove_unused()
    orphans.remove()
    session.refresh(context)


def _remove_collection(scene: bpy.types.Scene, collection: bpy.types.Collection) -> None:
    """Removes the collection. What the artist put into it stays in the scene."""
    for obj in collection.objects:
        if len(obj.users_collection) == 1:
            scene.collection.objects.link(obj)
    for child in collection.children:
        if child.name not in scene.collection.children:
            scene.collection.children.link(child)
    bpy.data.collections.remove(collection)


def corners(evaluated: bpy.types.Object) -> np.ndarray:
    """float64 [8, 3]: the corners of an evaluated object's bounding box, in world space."""
    matrix = np.array(evaluated.matrix_world)
    return transformed(np.array([tuple(corner) for corner in evaluated.bound_box]), matrix)


def _colour(method: str, number: int) -> tuple[float, float, float]:
    names = characters.method_names()
    return COLOURS[(names.index(method) if method in names else number) % len(COLOURS)]


def _copy(obj: bpy.types.Object, method: str, colour: tuple[float, float, float]) -> bpy.types.Object:
    """Returns a copy, deformed by `method` if an armature deforms it, in no collection yet."""
    variant = parse(method) if is_key(method) else None
    label = variant.title if variant is not None else properties.method_label(method)
    copy = upstream_proxy.copy_that_follows(obj, f"{obj.name} {label}")
    original = properties.of(obj) if properties.has_sinew(obj) else None
    replaced = corrective_smooth.replaced_modifier(obj) if original is not None else None
    smooth = replaced.name if replaced is not None else None
    _use_own_actions(copy)
    _take_sinew_off(copy)
    stack.remove_types(copy, LEFT_OUT)
    if copy.field is not None:
        copy.field.type = "NONE"
    copy.hide_select = True
    copy.color = (*colour, 1.0)
    settings = properties.of(copy)
    settings.identity.copied, settings.identity.method = obj, method
    if method != characters.BLENDER and attach.armature_of(copy) is not None:
        attach.add(copy, variant.method if variant is not None else method)
        if original is not None:
            settings.scale_rule = original.scale_rule
            # A copy shows one method, without another mixed in.
            property_groups.copy_groups(original, settings, (*properties.METHOD_GROUPS, *ORDER))
            if smooth is not None:
                # The stage replaces it.
                copy.modifiers.remove(copy.modifiers[smooth])
        if variant is not None:
            variant_settings.use([copy], variant)
    offset_nodes.add(copy)
    return copy


def _take_sinew_off(copy: bpy.types.Object) -> None:
    """Makes a copy like its original before Sinew was added."""
    if not properties.has_sinew(copy):
        return
    # The referenced objects belong to the original.
    storage = properties.of(copy).storage
    storage.point_buffer = storage.upstream_proxy = None
    storage.attribute = ""
    # Otherwise Blender 5.2 counts them as used even after the modifier is removed.
    nodes = stack.sinew_modifier(copy)
    if nodes is not None:
        node_group.forget_helpers(nodes)
    attach.take_off(copy)


def _use_own_actions(copy: bpy.types.Object) -> None:
    """Gives the copy its own actions, without keys of the original's settings now or later: each copy keeps
    its method."""
    animation = copy.animation_data
    for player in players(animation) if animation is not None else ():
        if player.action is not None:
            handle = actions.handle_of(actions.slot_of(player))
            actions.play_by_handle(player, player.action.copy(), handle)
            player.action[ACTION_MARK] = True


def _row_axis(right: np.ndarray) -> np.ndarray:
    """float64 [3]: the one of -X, +X, -Y and +Y that is nearest to `right` [3], which points to the right of
    the screen; +X where that is vertical."""
    axis = np.zeros(3)
    nearest = int(np.abs(right[:2]).argmax())
    axis[nearest] = -1.0 if right[nearest] < 0.0 else 1.0
    return axis


def _spacing(points: np.ndarray, axis: np.ndarray) -> float:
    """The distance between neighbouring characters along `axis` [3]; 1 where they have no width along it.

    points  [n, 3], n > 0, the character's, or the corners of its bounding box
    """
    width = float(np.ptp(points @ axis))
    return (1.0 + GAP) * width if width > 0.0 else 1.0
