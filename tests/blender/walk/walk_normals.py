# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks whether normals that Sinew gave to an evaluated mesh belong to its current points, edges and faces.

The oracle is the library, which test_normals.py compares with Blender. Here it gets the mesh's current data,
so it detects normals of an earlier frame, of other sharp edges, or changed by later modifiers. At the corners
of a face without area rounding decides: they are left out."""

from __future__ import annotations

import bpy
import numpy as np
from sinew_addon.attach import properties, upstream_proxy
from sinew_addon.io import mesh_io
from sinew_addon.skinning.arrays import read
from sinew_addon.skinning.shading import Shading, SurfaceNormals

# In each component.
NEAR = 1e-4
# A face has no area below this share of the square of the mesh's size.
FLAT = 1e-6


def faults(obj: bpy.types.Object, mesh: bpy.types.Mesh, points: np.ndarray) -> list[str]:
    """A sentence if they differ.

    mesh    evaluated
    points  float32 [vertices, 3], its own
    """
    given = None if mesh.is_editmode else mesh.attributes.get(mesh_io.CUSTOM_NORMALS)
    if given is None or given.data_type != "FLOAT_VECTOR" or _has_free(obj.data):
        return []
    if not obj.is_property_set("sinew"):
        return [f"{obj.name}: it has normals that nobody gave"]
    if properties.of(obj).normals == properties.SKINNED_NORMALS:
        return []
    depsgraph = bpy.context.evaluated_depsgraph_get()
    proxy = properties.of(obj).storage.upstream_proxy
    upstream = None if proxy is None else upstream_proxy.evaluated_mesh(obj, depsgraph)
    source = upstream or obj.data
    shown, own = mesh_io.read_shading(mesh), mesh_io.read_shading(source)
    shading = Shading(shown.sharp_edges, shown.sharp_faces, own.custom)
    expected = np.empty((mesh_io.domain_size(mesh, given.domain), 3), dtype=np.float32)
    normals = SurfaceNormals(len(points), mesh_io.read_topology(mesh), shading)
    normals.write(points, given.domain, expected)
    found = np.empty_like(expected)
    given.data.foreach_get("vector", found.ravel())
    decided = _are_decided(mesh, points, given.domain)
    worst = float(np.abs(found - expected)[decided].max(initial=0.0))
    if worst <= NEAR:
        return []
    return [f"{obj.name}: a normal of Sinew's is {worst} from that of the surface"]


def _are_decided(mesh: bpy.types.Mesh, points: np.ndarray, domain: str) -> np.ndarray:
    """bool [vertices or corners]: whether all faces at the vertex have an area."""
    counts, areas = read(mesh.polygons, "loop_total", kind=np.int32), read(mesh.polygons, "area")
    is_flat = areas <= FLAT * float(np.ptp(points, axis=0).max(initial=0.0)) ** 2
    corners, decided = mesh_io.corner_vertices(mesh), np.ones(len(points), dtype=bool)
    decided[corners[np.repeat(is_flat, counts)]] = False
    return decided if domain == "POINT" else decided[corners]


def _has_free(mesh: bpy.types.Mesh) -> bool:
    attribute = None if mesh.is_editmode else mesh.attributes.get(mesh_io.CUSTOM_NORMALS)
    return attribute is not None and attribute.data_type == "FLOAT_VECTOR"
