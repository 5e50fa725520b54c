# SPDX-License-Identifier: GPL-3.0-or-later
"""What the first Armature modifier of an object gets: rest points and weights, read from the mesh or from the
upstream proxy."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import bpy
import numpy as np

from ..attach import layout, normals, properties, stored_vertex_data, upstream_proxy
from ..io import mesh_io
from ..skinning.arrays import are_equal
from ..skinning.influences import GroupWeights
from ..skinning.shading import Shading, SurfaceNormals
from ..skinning.shape_keys import ShapeKeys
from ..skinning.stage_mesh import Topology
from .changes import Changes

# What is read each time.
_READ = (
    *("weights", "points", "mesh_points", "sdef_keys"),
    *("topology", "surface_topology", "shading", "shape_keys"),
)


@dataclass
class Source:
    """Read once, and again when it may be out of date.

    group_names       of the vertex groups of the mesh that the Armature modifier gets: a node group can give
                      it others than the object's
    points            float32 [vertices, 3], object space, without shape keys
    triangles         int32 [triangles, 3], of surface_points; None where no method needs them, as reading
                      them takes long
    stored            vertex data of methods that is stored in the file, by its key; read along with triangles
    topology          faces and edges
    surface_topology  those of the mesh that has surface_points
    shading           what else its normals depend on
    mesh_points       float32 [the mesh's vertices, 3], object space: the mesh's own, without upstream
                      modifiers
    sdef_keys         float32 [4, vertices, 3], as from mesh_io.read_sdef_keys(); None without them
    mesh              the session_uid of the object's mesh
    from_upstream     read from the upstream proxy
    normals_domain    the normals that draw the mesh, as from normals.domain_of()
    key_values        of the shape keys that are mixed in mixed_points
    known_key_values  their values when changes were last checked
    """

    group_names: list[str]
    weights: GroupWeights
    points: np.ndarray
    triangles: np.ndarray | None
    topology: Topology
    surface_topology: Topology
    mesh_points: np.ndarray
    mesh: int
    shape_keys: ShapeKeys | None
    sdef_keys: np.ndarray | None = None
    shading: Shading = field(default_factory=Shading)
    from_upstream: bool = False
    normals_domain: str = ""
    stored: dict[str, np.ndarray] = field(default_factory=dict)
    key_values: np.ndarray | None = None
    known_key_values: np.ndarray | None = None
    mixed_points: np.ndarray | None = None
    _rest_normals: tuple[np.ndarray, str, np.ndarray] | None = None

    @property
    def own_points(self) -> np.ndarray | None:
        """mesh_points, where upstream modifiers keep the number of vertices; else None."""
        return self.mesh_points if len(self.mesh_points) == len(self.points) else None

    @property
    def surface_points(self) -> np.ndarray:
        """float32 [vertices, 3], the points that methods compute vertex data from: the mesh's own, even if
        they are moved upstream; where upstream changes the number of vertices, its points when it was
        read."""
        return self.points if self.own_points is None else self.own_points

    def equals(self, other: Source) -> bool:
        return self is other or (
            self.group_names == other.group_names and self._has_same(other, *_READ, "triangles")
        )

    def has_same_weights(self, other: Source) -> bool:
        return self.group_names == other.group_names and self._has_same(other, "weights")

    def has_same_surface(self, other: Source) -> bool:
        """Whether everything that methods compute vertex data from, except weights, is the same. It is where
        upstream only moves points."""
        return self._has_same(other, "mesh_points", "triangles", "sdef_keys")

    def has_same_shading(self, other: Source) -> bool:
        """Whether the same points give the same normals."""
        return self._has_same(other, "shading", "topology")

    def _has_same(self, other: Source, *names: str) -> bool:
        return all(are_equal(getattr(self, name), getattr(other, name)) for name in names)

    def make_normals(self) -> None:
        """Prepares the normals. Otherwise the first frame would, which takes as long as several frames."""
        _made = self.normals

    @cached_property
    def normals(self) -> SurfaceNormals:
        return SurfaceNormals(len(self.points), self.topology, self.shading)

    def rest_normals(self, rest_points: np.ndarray, domain: str) -> np.ndarray:
        """float32 [vertices or corners, 3], the normals of the rest points; the same array for the same
        points."""
        known = self._rest_normals
        if known is None or known[0] is not rest_points or known[1] != domain:
            found = np.empty((self.normal_count(domain), 3), dtype=np.float32)
            self.normals.write(rest_points, domain, found)
            known = self._rest_normals = (rest_points, domain, found)
        return known[2]

    def normal_count(self, domain: str) -> int:
        """domain: POINT or CORNER; empty for no normals."""
        if not domain:
            return 0
        return len(self.points if domain == "POINT" else self.topology.corner_vertices)

    def take_what_equals(self, other: Source) -> None:
        """Takes over the other's arrays that equal these, and triangles of the same faces. So later
        comparisons cost nothing, and an identical array signals that nothing moved."""
        for name in _READ:
            if self._has_same(other, name):
                setattr(self, name, getattr(other, name))
        has_same_faces = self.surface_topology is other.surface_topology and self.mesh == other.mesh
        if has_same_faces and self.surface_points is other.surface_points:
            self.triangles, self.stored = other.triangles, other.stored
        self.keep_normals_of(other)

    def is_still(self, other: Source) -> bool:
        """Whether all of the other was taken over."""
        plain = ("group_names", "mesh", "from_upstream", "normals_domain")
        return all(getattr(self, name) is getattr(other, name) for name in (*_READ, "triangles")) and all(
            getattr(self, name) == getattr(other, name) for name in plain
        )

    def keep_normals_of(self, other: Source) -> None:
        """Takes over the prepared normals of the other, where these are the same."""
        made = other.__dict__.get("normals")
        if made is not None and self.has_same_shading(other) and len(self.points) == len(other.points):
            self.__dict__["normals"] = made


def is_ready(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, was_on: bool = True) -> bool:
    """Returns False until Blender has evaluated the upstream proxy: it was just made, or Sinew was off and
    nothing needed it."""
    if properties.of(obj).storage.upstream_proxy is None:
        return True
    return was_on and upstream_proxy.evaluated_mesh(obj, depsgraph) is not None


def read(
    obj: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    with_surface: bool = False,
    known: Source | None = None,
) -> Source:
    """Requires is_ready().

    with_surface  with the triangles, and with the stored data that was computed from them
    known         what was read of the object before: returned itself where it is still the same; else all
                  that is the same is taken from it
    """
    names = _group_names(obj, depsgraph)
    from_upstream = properties.of(obj).storage.upstream_proxy is not None
    mesh = upstream_proxy.evaluated_mesh(obj, depsgraph) if from_upstream else obj.data
    weights = mesh_io.read_group_weights(mesh, known and known.weights)
    points = _finite(mesh_io.read_points(mesh, known and known.points))
    mesh_points = points
    if from_upstream:
        mesh_points = _finite(mesh_io.read_points(obj.data, known and known.mesh_points))
    keys = None if from_upstream else mesh_io.read_shape_keys(obj, weights, known and known.shape_keys)
    sdef_keys = mesh_io.read_sdef_keys(obj.data)
    if len(mesh_points) != len(points):
        sdef_keys = None
    topology = surface_topology = mesh_io.read_topology(mesh, known and known.topology)
    if from_upstream and len(mesh_points) == len(points):
        surface_topology = mesh_io.read_topology(obj.data, known and known.surface_topology)
    shading = mesh_io.read_shading(mesh, known and known.shading)
    domain = normals.domain_of(mesh)
    surface = (points, None, topology, surface_topology, mesh_points, obj.data.session_uid)
    source = Source(names, weights, *surface, keys, sdef_keys, shading, from_upstream, domain)
    if known is not None:
        source.take_what_equals(known)
    if source.triangles is None and with_surface:
        # Where points are moved upstream, Blender may split the quads of that mesh differently.
        source.triangles = mesh_io.read_triangles(mesh if source.own_points is None else obj.data)
        source.stored = stored_vertex_data.read(obj.data)
    return known if known is not None and source.is_still(known) else source


def has_changed(
    obj: bpy.types.Object,
    source: Source,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
) -> bool:
    """Whether points, weights, groups or shape keys may differ from those read, apart from key values and
    points moved upstream.

    touched  the object itself may have changed
    """
    helper = properties.of(obj).storage.upstream_proxy
    if (helper is not None) != source.from_upstream or source.mesh != obj.data.session_uid:
        return True
    if touched and _group_names(obj, depsgraph) != source.group_names:
        return True
    if helper is not None:
        mesh = upstream_proxy.evaluated_mesh(obj, depsgraph)
        evaluated = helper.session_uid in changes.objects
        if len(mesh.vertices) != len(source.points) or obj.data.session_uid in changes.meshes:
            return True
        return evaluated and (not changes.frame or upstream_proxy.changes_weights(layout.read(obj)))
    mesh, keys, known = obj.data, obj.data.shape_keys, source.shape_keys
    if len(mesh.vertices) != len(source.points) or (keys is None) != (known is None):
        return True
    if keys is not None and tuple(block.name for block in keys.key_blocks) != known.names:
        return True
    return mesh.session_uid in changes.meshes


def _group_names(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Requires is_ready()."""
    proxy = properties.of(obj).storage.upstream_proxy
    return (obj if proxy is None else proxy.evaluated_get(depsgraph)).vertex_groups.keys()


def is_slider_moved(
    obj: bpy.types.Object, source: Source, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether the values of shape keys differ from those known. Setting a value touches the mesh as an edit
    does, and reading all keys at each step of a slider would cost more than the frame."""
    keys = obj.data.shape_keys
    if keys is None or source.from_upstream or obj.data.session_uid not in changes.meshes:
        return False
    values = mesh_io.read_key_values(keys.evaluated_get(depsgraph))
    known = source.known_key_values
    return known is not None and not np.array_equal(values, known)


def rest_points(obj: bpy.types.Object, source: Source, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """float32 [vertices, 3] at this evaluation; the same array as before where nothing changed.

    Requires is_ready().
    """
    if properties.of(obj).storage.upstream_proxy is not None:
        return _upstream_points(upstream_proxy.evaluated_mesh(obj, depsgraph), source)
    return _keyed_points(obj.evaluated_get(depsgraph), obj.data.evaluated_get(depsgraph), source)


def evaluated_points(
    evaluated: bpy.types.Object, evaluated_mesh: bpy.types.Mesh, source: Source
) -> np.ndarray | None:
    """The same from evaluated data alone; None where its vertices are not those that were read."""
    if not source.from_upstream:
        return _keyed_points(evaluated, evaluated_mesh, source)
    upstream = evaluated.sinew.storage.upstream_proxy
    if upstream is None or not upstream.is_evaluated or len(upstream.data.vertices) != len(source.points):
        return None
    return _upstream_points(upstream.data, source)


def _finite(points: np.ndarray) -> np.ndarray:
    """Returns the points, with the origin in place of those that are not finite: these would stop all
    others."""
    is_finite = np.isfinite(points)
    return points if is_finite.all() else np.where(is_finite.all(axis=1, keepdims=True), points, 0.0)


def _upstream_points(mesh: bpy.types.Mesh, source: Source) -> np.ndarray:
    points = _finite(mesh_io.read_points(mesh, source.points))
    if not are_equal(points, source.points):
        source.points = points
    return source.points


def _keyed_points(evaluated: bpy.types.Object, evaluated_mesh: bpy.types.Mesh, source: Source) -> np.ndarray:
    if source.shape_keys is None:
        return source.points
    values = mesh_io.read_key_values(evaluated_mesh.shape_keys)
    if source.mixed_points is None or not np.array_equal(values, source.key_values):
        source.key_values = values
        source.mixed_points = _finite(source.shape_keys.mix(values))
    if evaluated.show_only_shape_key:
        keys = evaluated_mesh.shape_keys
        active, names = evaluated.active_shape_key_index, source.group_names
        pinned = _finite(mesh_io.read_pinned_points(keys, active, names, source.weights))
        if not np.array_equal(pinned, source.mixed_points):
            source.mixed_points = pinned
            # NaN equals nothing: leaving the pin mixes again, whatever the values are.
            source.key_values = np.full_like(values, np.nan)
    return source.mixed_points
