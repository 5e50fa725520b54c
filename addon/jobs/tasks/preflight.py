# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds out whether a file needs Sinew, and what in it Sinew cannot deform: for `sinew check`, before
rendering on a farm."""

from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np

from ...attach import attach, layout, other_tools, properties, upstream_proxy
from ...attach.updates import updates_suspended
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import files, mesh_io
from ...skinning.influences import entries_of_bones

# Painting leaves smaller differences.
_OTHER_SUM = 0.01


def check(task: dict, report: Callable[..., None]) -> dict:
    """Checks the file "source" of a task.

    "meshes": name and method of each mesh that Sinew deforms; "problems": a sentence for each thing that
    Sinew cannot do, with what to do about it; "notes": remarks that are no faults. Raises SinewError where
    the file cannot be read. The open file must not be used afterwards.
    """
    report("opening it")
    # In its saved state, before Sinew reacts to what it finds.
    with updates_suspended():
        notes = files.open_file(Path(task["source"]))
    report("trying it")
    # The originals of library overrides are in the file as well, linked, and do not matter.
    overridden = {obj.override_library.reference for obj in bpy.data.objects if obj.override_library}
    objects = [obj for obj in bpy.data.objects if obj not in overridden and not properties.is_copy(obj)]
    skinned = [obj for obj in objects if properties.has_sinew(obj)]
    # Read before they are tried, which switches them on.
    enabled = [obj for obj in skinned if properties.of(obj).enabled]
    meshes = [
        {"object": obj.name, "method": properties.of(obj).method}
        for obj in enabled
        if layout.read(obj).deforms
    ]
    off = [obj.name for obj in skinned if obj not in enabled]
    told = [
        f"{obj.name}: {sentence}"
        for obj in enabled
        for sentence in (*session.plan_of(obj).view_reasons, *attach.notes(obj))
    ]
    problems = [problem for obj in objects if not properties.has_sinew(obj) for problem in _remains(obj)]
    problems += _not_deformable(skinned)
    by_sinew = [obj for obj in enabled if properties.of(obj).replaces_modifiers]
    told += [f"{obj.name}: {sentence}" for obj in by_sinew for sentence in other_tools.notes(obj)]
    if unequal := [obj.name for obj in enabled if _has_other_sums(obj)]:
        told.append(
            f"{', '.join(unequal)}: weights do not sum to 1, which Blender divides by, and other programs "
            "may not (Weights > Normalize All)"
        )
    if by_sinew:
        told.append(other_tools.APPLYING)
    notes += [f"{name} is switched off: its Armature modifier deforms it" for name in off]
    notes += told
    notes += [
        f"library {library.filepath} is missing: whether Sinew deforms what it links is not known"
        for library in bpy.data.libraries
        if _is_missing(library)
    ]
    return {"meshes": meshes, "problems": problems, "notes": notes}


def _not_deformable(objects: list[bpy.types.Object]) -> Iterator[str]:
    """Yields a sentence for each object with settings of Sinew that it cannot deform. Each is evaluated,
    visible in its scene, as Blender does not evaluate hidden objects."""
    left = []
    for obj in objects:
        problem = _obstacle(obj)
        if problem is not None:
            yield problem
        else:
            left.append(obj)
    for scene in bpy.data.scenes:
        here = [obj for obj in left if obj.name in scene.objects and obj.library is None]
        left = [obj for obj in left if obj not in here]
        if not here:
            continue
        bpy.context.window.scene = scene
        characters.show(here)
        wanted = [(obj, properties.of(obj).method) for obj in here]
        yield from (str(error) for error in characters.use_methods(wanted) if error is not None)


def _has_other_sums(obj: bpy.types.Object) -> bool:
    """Whether weights of bones, where a vertex has some, sum to other than 1."""
    deforming = {b.name for rig in properties.of(obj).armatures for b in rig.data.bones if b.use_deform}
    of_bone = np.array([0 if group.name in deforming else -1 for group in obj.vertex_groups], dtype=np.int32)
    entries = entries_of_bones(mesh_io.read_group_weights(obj.data), of_bone)
    sums = np.bincount(entries.vertices, weights=entries.weights, minlength=len(entries.counts))
    return bool((np.abs(sums - 1.0) > _OTHER_SUM)[sums > 0.0].any())


def _is_missing(library: bpy.types.Library) -> bool:
    return not Path(bpy.path.abspath(library.filepath)).exists()


def _obstacle(obj: bpy.types.Object) -> str | None:
    """Returns a problem that is found without an evaluation."""
    gone = [replaced.name for replaced in properties.of(obj).replaced_modifiers if replaced.armature is None]
    if gone and attach.armature_of(obj) is None:
        return f"{obj.name}: the armature of {', '.join(gone)} is gone; choose another one, or Remove Sinew"
    now = layout.read(obj)
    if not now.replaced:
        return (
            f"{obj.name}: the Armature modifier that Sinew stands in for is gone; Remove Sinew, or add the "
            "modifier anew"
        )
    if not obj.is_editable:
        return (
            f"{obj.name} is linked from another file, where Sinew deforms it; make a library override of it "
            "(Object > Library Override > Make)"
        )
    if obj.override_library is not None and _is_missing(obj.override_library.reference.library):
        library = obj.override_library.reference.library.filepath
        return f"{obj.name} overrides what is in {library}, which is missing; put the file there"
    try:
        upstream_proxy.check(obj, now)
    except SinewError as error:
        return str(error)
    return None


def _remains(obj: bpy.types.Object) -> Iterator[str]:
    """Yields remains of Sinew on an object without its settings."""
    if obj.type != "MESH" or properties.is_helper(obj):
        return
    own = layout.read(obj).sinew
    if own:
        yield (
            f"{obj.name}: has the modifier {own} of Sinew without its settings, and keeps one shape; delete "
            "that modifier and add Sinew again"
        )
