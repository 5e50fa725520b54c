# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew within Blender's evaluation: pose_driver's driver requests a mesh's points after the poses and before
the modifiers, and they are written into evaluated data.

Blender evaluates on many threads, and renders beside the window. So this code reads evaluated data only: an
original may go at any moment. Anything unusual, such as changed weights, is left to the handlers, which run
afterwards and may change the file.
"""

import time

import bpy
import numpy as np
import sinew

from ..attach import point_store, properties
from ..attach.icons import ICONS, Deformer, Icons
from ..attach.layout import is_deforming_body
from ..attach.modifier_options import ModifierOptions
from ..io import mesh_io
from ..io.actions import animated_paths
from . import pose, source
from .skinned_object import LeftOut, Shown, SkinnedObject

# How many evaluated copies of an object are remembered.
_MAX_COPIES = 32
_NO_NORMALS = np.empty((0, 3), dtype=np.float32)


class DepsgraphRequests:
    """The functions that the driver's last variables call: the first names the object, the second, on the
    same thread, its mesh."""

    def __init__(self) -> None:
        # The object that each thread named last.
        self._requesting: dict[int, bpy.types.Object] = {}
        self.set_objects({}, set())

    def set_objects(self, objects: dict[int, SkinnedObject], names: set[str]) -> None:
        """objects: by the token of their settings, which evaluated copies have, too.

        names  of these: a duplicate that nobody has seen yet has the token of its original
        """
        # Replaced, never changed, as other threads may be reading it.
        self._known = objects, names

    def object_requested(self, evaluated: bpy.types.Object) -> None:
        # Python does not know Blender's threads: for each call from one it would create a thread state and
        # remove it again, which takes 50 to 100 us on two cores.
        sinew.keep_thread_state()
        self._requesting[sinew.thread_id()] = evaluated

    def mesh_requested(self, evaluated_mesh: bpy.types.Mesh) -> None:
        evaluated = self._requesting.pop(sinew.thread_id(), None)
        if evaluated is None or not (evaluated.is_evaluated and evaluated_mesh.is_evaluated):
            # Something other than the driver reads the property.
            return
        objects, names = self._known
        skinned = objects.get(evaluated.sinew.identity.token)
        if skinned is None or evaluated.name not in names:
            return
        try:
            deform(evaluated, evaluated_mesh, skinned)
        except Exception as error:
            # The handlers deal with it, and the panel shows it.
            skinned.evaluation.given.discard(evaluated_mesh.as_pointer())
            skinned.fail(error)


def deform(evaluated: bpy.types.Object, mesh: bpy.types.Mesh, skinned: SkinnedObject) -> None:
    """Writes the points into the evaluated mesh, or into the evaluated point buffer.

    If anything is unusual it writes nothing and notes the reason, for update().
    """
    if not skinned.plan.is_in_depsgraph:
        return
    with skinned.lock:
        reason = _deform(evaluated, mesh, skinned)
        if reason:
            skinned.evaluation.skip_reason = reason
            skinned.evaluation.given.discard(mesh.as_pointer())


def _deform(evaluated: bpy.types.Object, mesh: bpy.types.Mesh, skinned: SkinnedObject) -> str:
    """Returns why update() has to deal with the object; empty where the points are written."""
    started, settings, bound = time.perf_counter(), evaluated.sinew, skinned.bound
    # Evaluated ones, as the driver reads them.
    modifiers = [(replaced, replaced.armature) for replaced in settings.replaced_modifiers]
    is_own_mesh = skinned.evaluation.is_only_user or skinned.plan.in_buffer
    if skinned.noted.layout.mode != evaluated.mode or not is_own_mesh:
        return "its mode, or the users of its mesh, changed"
    if [armature is None for _replaced, armature in modifiers] != [not uid for uid in bound.armatures]:
        return "its Armature modifiers changed"
    names = (skinned.noted.layout.sinew, *(replaced.name for replaced, _armature in modifiers))
    if not all(name in evaluated.modifiers for name in names):
        return "its modifiers were renamed"
    if skinned.noted.are_options_keyed and bound.options != [
        ModifierOptions.read(evaluated.modifiers[replaced.name]) for replaced, _armature in modifiers
    ]:
        return "an animation set options of its Armature modifiers"
    if skinned.plan.leaves_out and is_deforming_body(evaluated):
        return "it has become a rigid body that reads its deformed mesh"
    memory = _memory_to_write(settings, mesh, skinned)
    if memory is None:
        return "its mesh changed"
    evaluation = skinned.evaluation
    icons = pose.icons_of(evaluated, modifiers, skinned)
    is_for_viewports = skinned.viewport_mesh == mesh.as_pointer()
    _leave_out(evaluated, modifiers if is_for_viewports and skinned.plan.leaves_out else [], skinned, icons)
    out, normals = memory
    frames = pose.read(evaluated, settings, modifiers, skinned, icons)
    rest_points = source.evaluated_points(evaluated, mesh, bound.source)
    if rest_points is None:
        return "what modifiers in front make of its mesh changed"
    values = pose.stage_values(settings)
    bound.skin_stack.deform(rest_points, frames, out, values)
    if len(normals):
        bound.write_normals(out, rest_points, skinned.plan.normals, normals)
    if skinned.plan.in_buffer:
        point_store.mark_as_written(out, bound.source.points)
    evaluation.given.add(mesh.as_pointer())
    evaluation.skip_reason, skinned.failures.in_a_row = "", 0
    number, taken = skinned.shown.number + 1, 1000.0 * (time.perf_counter() - started)
    skinned.shown = Shown(frames, rest_points, values, number, taken)
    # An animation can choose a method whose data has not been requested yet.
    is_new_need = not skinned.plan.lacks and pose.lacks_data(bound, frames)
    return "what its method needs is not computed" if is_new_need else ""


def _leave_out(
    evaluated: bpy.types.Object, modifiers: pose.Modifiers, skinned: SkinnedObject, icons: tuple[Icons, Icons]
) -> None:
    """Switches these Armature modifiers off in evaluated data, where Sinew's modifier comes after them and
    sets each vertex: on a large mesh they take as long as Sinew. Sinew's own are on where it deforms.
    foreach_set() tags nothing, which is not allowed here. Once for each copy that Blender makes.

    Exporters evaluate for themselves, and find them as they are: USD writes a skin where one is on.
    """
    stack_now, known = evaluated.modifiers, skinned.noted.layout
    left_out = {replaced.name for replaced, _armature in modifiers}
    copy, is_marked = evaluated.as_pointer(), stack_now[known.sinew].show_in_editmode
    if is_marked and copy in skinned.left_out and skinned.left_out[copy].modifiers == left_out:
        return
    names = map(bpy.utils.escape_identifier, (*known.own, *known.replaced))
    starts = tuple(f'modifiers["{name}"].show_' for name in names)
    if any(path.startswith(starts) for path in animated_paths(evaluated)):
        # An animation that was just added decides from now on.
        return
    if len(skinned.left_out) > _MAX_COPIES:
        # Each frame of a render can have made one.
        skinned.left_out.clear()
    skinned.left_out[copy] = LeftOut(left_out, icons)
    for icon, of_view in zip(ICONS, icons, strict=True):
        is_by_sinew = of_view.deformer is Deformer.SINEW
        shown = [
            is_by_sinew
            if m.name in known.own
            else getattr(m, icon) and not (is_by_sinew and m.name in left_out)
            for m in stack_now
        ]
        stack_now.foreach_set(icon, shown)
    # A mark, which goes when Blender copies the icons from the original again (pose.icons_of).
    marked = [m.show_in_editmode or m.name == known.sinew for m in stack_now]
    stack_now.foreach_set("show_in_editmode", marked)


def _memory_to_write(
    settings: properties.SinewSettings, mesh: bpy.types.Mesh, skinned: SkinnedObject
) -> tuple[np.ndarray, np.ndarray] | None:
    """The memory of the points and of the normals (empty where Blender computes these), in the evaluated mesh
    or in the evaluated point buffer. None where it does not exist or has another size."""
    points, count = len(skinned.bound.source.points), skinned.normal_count
    if not skinned.plan.in_buffer:
        of_points, of_normals = skinned.noted.attributes
        to_points, to_normals = mesh_io.vectors_in(mesh, of_points), _NO_NORMALS
        if count:
            to_normals = mesh_io.vectors_in(mesh, of_normals, skinned.plan.normals.domain)
        if to_points is None or to_normals is None:
            return None
        return (to_points, to_normals) if (len(to_points), len(to_normals)) == (points, count) else None
    buffer = settings.storage.point_buffer
    # Blender does not always mark an evaluated object's data as evaluated, so the object itself is checked.
    if buffer is None or not buffer.is_evaluated:
        return None
    stored = mesh_io.vectors_in(buffer.data, mesh_io.POSITION)
    if stored is None or len(stored) != points + count:
        return None
    return stored[:points], stored[points:]
