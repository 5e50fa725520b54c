# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map of a bake to bones: the error of the baked mesh at each vertex, before and after the bake, as
colours that views in Solid shading show. They exist only while it is on, as exporters would write them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.heat import linear, viridis
from ...io import mesh_io
from ...io.helper_bones_io import ERRORS, ERRORS_BEFORE
from ...io.mesh_io import find_attribute
from ...ui import shown_colours

BEFORE, AFTER, OFF = "BEFORE", "AFTER", "OFF"
OF_CHOICE = {BEFORE: ERRORS_BEFORE, AFTER: ERRORS}
# The colour attribute of the mesh.
COLOURS = "Sinew bake error, colours"


@dataclass(frozen=True)
class Summary:
    """The errors of a mesh, in units of the scene.

    squares  for each choice, the sum over the vertices
    most     the largest, before and after
    """

    vertices: int
    squares: dict[str, float]
    most: float


# By the session_uid of the mesh: panels are drawn often, and each bake makes a mesh.
_summaries: dict[int, Summary] = {}


def is_baked(obj: bpy.types.Object) -> bool:
    if obj.type != "MESH" or not obj.data.is_editable:
        return False
    return all(find_attribute(obj.data, name) for name in OF_CHOICE.values())


def shown(objects: Iterable[bpy.types.Object]) -> str:
    """Which errors the first of these shows that shows any."""
    return next((obj.data.sinew_bake_error for obj in objects if _has_colours(obj)), OFF)


def shown_meshes() -> Iterator[tuple[bpy.types.Mesh, str]]:
    """A source of shown_colours."""
    return ((obj.data, COLOURS) for obj in bpy.data.objects if _has_colours(obj))


def errors_of(mesh: bpy.types.Mesh, choice: str) -> np.ndarray:
    """float32 [vertices], in units of the scene."""
    found = np.zeros(len(mesh.vertices), dtype=np.float32)
    find_attribute(mesh, OF_CHOICE[choice]).data.foreach_get("value", found)
    return found


def summary_of(mesh: bpy.types.Mesh) -> Summary:
    known = _summaries.get(mesh.session_uid)
    if known is not None and known.vertices == len(mesh.vertices):
        return known
    errors = {choice: errors_of(mesh, choice) for choice in OF_CHOICE}
    squares = {choice: float(np.square(each, dtype=np.float64).sum()) for choice, each in errors.items()}
    most = max(float(each.max(initial=0.0)) for each in errors.values())
    _summaries[mesh.session_uid] = Summary(len(mesh.vertices), squares, most)
    return _summaries[mesh.session_uid]


def rms(objects: Sequence[bpy.types.Object], choice: str) -> float:
    """Over the vertices of all."""
    summaries = [summary_of(obj.data) for obj in objects]
    count = sum(summary.vertices for summary in summaries)
    return float(np.sqrt(sum(summary.squares[choice] for summary in summaries) / max(count, 1)))


def end_of_scale(objects: Sequence[bpy.types.Object]) -> float:
    """The largest error before and after: one range, so that the two can be compared."""
    return max(summary_of(obj.data).most for obj in objects)


def show(objects: Sequence[bpy.types.Object], choice: str) -> None:
    """Shows the errors of one of OF_CHOICE, or none."""
    meshes = {obj.data for obj in objects}
    hide(meshes)
    if choice == OFF:
        return
    end = max(end_of_scale(objects), 1e-30)
    for mesh in meshes:
        _add_colours(mesh, linear(viridis(errors_of(mesh, choice) / end)))
        mesh.sinew_bake_error = choice
        mesh.update_tag()
    shown_colours.sync()


def hide(meshes: Iterable[bpy.types.Mesh]) -> None:
    # Joining objects can give a mesh the attribute alone.
    of_these = [
        mesh
        for mesh in meshes
        if mesh.is_property_set("sinew_bake_error") or find_attribute(mesh, COLOURS) is not None
    ]
    for mesh in of_these:
        mesh.property_unset("sinew_bake_error")
    # Meshes get their active attribute back, which Blender would choose itself if this one was removed first.
    shown_colours.sync()
    for mesh in of_these:
        mesh_io.remove_attribute(mesh, COLOURS)
        mesh.update_tag()


def _has_colours(obj: bpy.types.Object) -> bool:
    if obj.type != "MESH" or not obj.data.is_property_set("sinew_bake_error"):
        return False
    return find_attribute(obj.data, COLOURS) is not None


def _add_colours(mesh: bpy.types.Mesh, colours: np.ndarray) -> None:
    rows = np.ones((len(colours), 4), dtype=np.float32)
    rows[:, :3] = colours
    attribute = mesh_io.add_attribute(mesh, COLOURS, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", rows.ravel())


def register() -> None:
    # Which errors it shows.
    bpy.types.Mesh.sinew_bake_error = bpy.props.StringProperty(options={"HIDDEN"})
    shown_colours.sources.append(shown_meshes)


def unregister() -> None:
    hide([mesh for mesh in bpy.data.meshes if mesh.is_editable])
    shown_colours.sources.remove(shown_meshes)
    _summaries.clear()
    del bpy.types.Mesh.sinew_bake_error
