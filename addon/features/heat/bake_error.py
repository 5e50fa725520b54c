# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors of a bake to bones, as quantities of the heat map. The bake has stored them in the mesh;
Sinew is off such a mesh, so its colours are an attribute of the mesh itself while they are shown, and only
then, as exporters would write them."""

from collections.abc import Sequence

import bpy
import numpy as np

from ...attach import properties
from ...io import mesh_io
from ...ui.translations import tr
from ..bake.helper_bones_io import ERRORS, ERRORS_BEFORE
from ..measure.heat_scale import HeatScale
from . import heat_nodes, measures

AFTER, BEFORE = measures.BAKE_ERRORS
_ATTRIBUTES = {AFTER: ERRORS, BEFORE: ERRORS_BEFORE}


# By the session_uid of the mesh and the number of its vertices: panels are drawn often, and each bake makes a
# mesh.
_summaries: dict[tuple[int, int], dict[str, tuple[float, float]]] = {}


def is_baked(obj: bpy.types.Object) -> bool:
    # In edit mode attributes can not be read.
    if obj.type != "MESH" or not obj.data.is_editable or obj.data.is_editmode:
        return False
    return all(mesh_io.find_attribute(obj.data, name) for name in _ATTRIBUTES.values())


def errors_of(mesh: bpy.types.Mesh, quantity: str, count: int) -> np.ndarray:
    """float32 [count], in units of the scene; 0 for a mesh of other vertices, or without errors."""
    found = np.zeros(count, dtype=np.float32)
    attribute = mesh_io.find_attribute(mesh, _ATTRIBUTES[quantity])
    if attribute is not None and len(attribute.data) == count:
        attribute.data.foreach_get("value", found)
    return found


def summary_of(mesh: bpy.types.Mesh) -> dict[str, tuple[float, float]]:
    """Returns for each quantity the sum of the squared errors, and the largest, in units of the scene."""
    key = mesh.session_uid, len(mesh.vertices)
    if key not in _summaries:
        errors = {name: errors_of(mesh, name, key[1]) for name in _ATTRIBUTES}
        _summaries[key] = {
            name: (float(np.square(each, dtype=np.float64).sum()), float(each.max(initial=0.0)))
            for name, each in errors.items()
        }
    return _summaries[key]


def rms(objects: Sequence[bpy.types.Object], quantity: str) -> float:
    """Over the vertices of all."""
    count = sum(len(obj.data.vertices) for obj in objects)
    squares = sum(summary_of(obj.data)[quantity][0] for obj in objects)
    return float(np.sqrt(squares / max(count, 1)))


def scale_of(settings: measures.SinewMeasures, objects: Sequence[bpy.types.Object]) -> HeatScale:
    """Returns one range for the errors before and after, so that the two can be compared."""
    most = max(most for obj in objects for _squares, most in summary_of(obj.data).values())
    return HeatScale.over_values(settings.metric, 0.0, most, 0.0)


def shown(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Returns the objects without Sinew that show their errors in a scene."""
    if not scene.is_property_set("sinew_measures") or measures.of(scene).quantity not in _ATTRIBUTES:
        return []
    return [obj for obj in scene.objects if is_on(obj) and is_baked(obj)]


def is_on(obj: bpy.types.Object) -> bool:
    """Whether the heat map is on for an object without Sinew."""
    return properties.shows_heat(obj) and not properties.has_sinew(obj)


def colour(scene: bpy.types.Scene) -> None:
    """Writes the colours of what is shown into the meshes."""
    objects, settings = shown(scene), measures.of(scene)
    for mesh in {obj.data for obj in objects}:
        errors = errors_of(mesh, settings.quantity, len(mesh.vertices))
        heat_nodes.write_to_mesh(mesh, scale_of(settings, objects).linear_colours(errors))


def legend_of(scene: bpy.types.Scene) -> tuple[HeatScale, str] | None:
    """Returns the range and the title of a scene's legend; None where it shows no errors."""
    objects = shown(scene)
    if not objects:
        return None
    settings = measures.of(scene)
    return scale_of(settings, objects), tr(settings.metric.label)
