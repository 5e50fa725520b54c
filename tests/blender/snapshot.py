# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything in Blender's data about an object, to compare before and after."""

from __future__ import annotations

import bpy
import numpy as np

# Changes with any edit, and is not stored in files.
VOLATILE = {"rna_type", "session_uid", "is_evaluated", "execution_time", "name_full", "is_active"}


def properties_of(data: bpy.types.bpy_struct) -> dict[str, str]:
    """Each plain property as text; collections by their length."""
    result = {}
    for prop in data.bl_rna.properties:
        if prop.identifier in VOLATILE:
            continue
        value = getattr(data, prop.identifier)
        if prop.type == "COLLECTION":
            result[prop.identifier] = str(len(value))
        elif prop.type == "POINTER":
            result[prop.identifier] = getattr(value, "name", "") if value is not None else "None"
        elif getattr(prop, "is_array", False):
            result[prop.identifier] = str([float(v) for v in np.array(value).ravel()])
        else:
            result[prop.identifier] = repr(value)
    return result


def of_object(obj: bpy.types.Object) -> dict[str, object]:
    mesh = obj.data
    points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", points)
    return {
        "object": {k: v for k, v in properties_of(obj).items() if k != "sinew"},
        "custom": sorted(obj.keys()),
        "settings": obj.is_property_set("sinew"),
        "modifiers": [properties_of(modifier) for modifier in obj.modifiers],
        "active modifier": obj.modifiers.active.name if obj.modifiers.active else None,
        "mesh": properties_of(mesh),
        "attributes": sorted((a.name, a.domain, a.data_type) for a in mesh.attributes),
        "points": points.tobytes(),
        "weights": [[(g.group, g.weight) for g in vertex.groups] for vertex in mesh.vertices],
        "keys": animated_paths(obj),
    }


def animated_paths(obj: bpy.types.Object) -> list[str] | None:
    if obj.animation_data is None:
        return None
    action = obj.animation_data.action
    drivers = [driver.data_path for driver in obj.animation_data.drivers]
    return [action.name if action else "", *drivers]


def of_file() -> dict[str, object]:
    """Names of all data in the open file, and each mesh object completely."""
    names = {
        kind: sorted(item.name for item in getattr(bpy.data, kind))
        for kind in ("objects", "meshes", "armatures", "node_groups", "actions", "collections", "materials")
    }
    return {"names": names, "objects": {o.name: of_object(o) for o in bpy.data.objects if o.type == "MESH"}}
