# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through frames, measures two methods at each vertex, and writes the better one's share as the vertex
group of the stage Mix."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from ...attach import group_uses, properties, stage_settings
from ...base.errors import SinewError
from ...deform import session
from ...io import mesh_io
from ...skinning.vectors import transformed
from ...ui import stepped
from ...ui.translations import tr
from ..measure import live
from ..measure.crossings import crossings, frames_to_count
from ..measure.measured_on import armatures_of
from ..measure.worst_frames import check_measurable, measure_at
from .shares import VertexErrors, shares

STAGE = stage_settings.STAGES["mix"]
# The second method where none is chosen: linear blending collapses where rotations bulge, and the reverse.
ROTATIONS, LINEAR = "dq", "lbs"
LINEAR_ONES = {LINEAR, "sdef"}


def second_method(obj: bpy.types.Object) -> str:
    """Returns the one that Mix has, or the complement of the object's method."""
    settings = properties.of(obj)
    return settings.mixed_method or (ROTATIONS if settings.method in LINEAR_ONES else LINEAR)


def why_not(obj: bpy.types.Object) -> str:
    """Returns why the group can not be written; empty where it can."""
    if not obj.is_editable or not obj.data.is_editable or obj.override_library is not None:
        return f"{obj.name}: its mesh comes from another file, where vertex groups have to be made"
    if obj.data.is_editmode:
        return f"{obj.name}: its mesh is in edit mode; leave it first"
    if second_method(obj) == properties.of(obj).method:
        return f"{obj.name}: Mix has the mesh's own method; choose another one there"
    return ""


@dataclass
class AutoMix:
    """One click: steps() measures, and changes nothing; then write() writes.

    objects    that can be written; those that share a mesh get the same group
    smoothing  see features.auto_mix.shares.shares()
    """

    scene: bpy.types.Scene
    objects: Sequence[bpy.types.Object]
    over: str
    smoothing: float
    _shares: list[np.ndarray] = field(default_factory=list)

    def steps(self) -> Iterator[float]:
        """Yields the progress. Raises SinewError where an object can not be measured."""
        check_measurable(self.objects)
        armatures = armatures_of(self.objects)
        frames = stepped.frames_over(self.scene, armatures, self.over)
        counted = frames_to_count(frames)
        found: VertexErrors | None = None
        with stepped.kept_frame(self.scene, armatures):
            for number, frame in enumerate(frames):
                subject = measure_at(self.scene, self.objects, properties.BLENDER, frame)
                measured = live.measured_of_mix(subject, second_method)
                if found is None:
                    found, sources = VertexErrors(measured[0].rest_distances), self._sources(subject)
                elif len(found.thickness) != subject.gauge.surface.vertex_count:
                    raise SinewError(
                        f"Its vertices are others at frame {frame}: a modifier in front changes them"
                    )
                crossing = None
                if frame in counted:
                    at_rest = crossings(subject.gauge.rest)
                    crossing = tuple(_triangles(crossings(each.shape) - at_rest) for each in measured)
                found.add(measured, crossing)
                yield (number + 1) / len(frames)
        assert found is not None
        meshes = self._meshes
        points, triangles, first = [], [], 0
        for mesh, obj in meshes.items():
            own = mesh_io.read_points(mesh)
            points.append(transformed(own, np.array(obj.matrix_world)))
            triangles.append(mesh_io.read_triangles(mesh) + first)
            first += len(own)
        joined = np.concatenate(points)
        at = found.of_sources(sources, len(joined))
        result = yield from shares(joined, np.concatenate(triangles), at, self.smoothing)
        self._shares = np.split(result, np.cumsum([len(each) for each in points])[:-1])

    @property
    def _meshes(self) -> dict[bpy.types.Mesh, bpy.types.Object]:
        """Each mesh with the first object that has it."""
        return {obj.data: obj for obj in reversed(self.objects)}

    def _sources(self, subject: live.Subject) -> np.ndarray:
        """int [n, 2]: vertices of all meshes, each with the measured vertex that stands for it.

        Where modifiers in front make others, that is the nearest at rest.
        """
        starts, first = {}, 0
        for mesh in self._meshes:
            starts[mesh] = first
            first += len(mesh.vertices)
        pairs, first_measured = [], 0
        for part in subject.parts:
            mesh, rest = part.obj.data, part.skinned.shown.rest_points
            vertices = np.arange(len(mesh.vertices))
            nearest = vertices if len(rest) == len(vertices) else _nearest(mesh_io.read_points(mesh), rest)
            pairs.append(np.column_stack([starts[mesh] + vertices, first_measured + nearest]))
            first_measured += len(rest)
        return np.concatenate(pairs)

    def write(self, context: bpy.types.Context) -> Iterator[str]:
        """Writes the groups, yields a sentence for each mesh, and switches Mix on."""
        groups: dict[bpy.types.Mesh, bpy.types.VertexGroup] = {}
        for (mesh, obj), weights in zip(self._meshes.items(), self._shares, strict=True):
            groups[mesh], kept = _own_group(obj)
            _write(mesh, groups[mesh], weights)
            if kept:
                text = "{name}: {kept} is locked or has another use, and stays as it is; Mix has {group} now"
                yield tr(text, name=obj.name, kept=kept, group=groups[mesh].name)
            yield tr(
                "{name}: {second} at {share} of the vertices, by the vertex group {group}",
                name=obj.name,
                second=tr(properties.method_label(second_method(obj))),
                share=f"{np.count_nonzero(weights) / max(len(weights), 1):.0%}",
                group=groups[mesh].name,
            )
        # Weights are written before, as in there only settings may change.
        with session.changing(context):
            for obj in self.objects:
                mix = properties.of(obj).mix
                mix.method, mix.group = second_method(obj), groups[obj.data].name


def _triangles(pairs: set[tuple[int, int]]) -> np.ndarray:
    return np.unique(np.array(list(pairs), dtype=np.int64))


def _nearest(points: np.ndarray, among: np.ndarray) -> np.ndarray:
    """int [points]: the nearest of others to each."""
    if not len(among):
        raise SinewError("A modifier in front leaves no vertices to measure")
    tree = KDTree(len(among))
    for number, point in enumerate(among.tolist()):
        tree.insert(point, number)
    tree.balance()
    return np.array([tree.find(point)[1] for point in points.tolist()], dtype=np.int64)


def _own_group(obj: bpy.types.Object) -> tuple[bpy.types.VertexGroup, str]:
    """Returns the group of the object's Mix, a new one where that is locked or has another use, and the name
    of the one that is left."""
    name = properties.of(obj).mix.group
    group = obj.vertex_groups.get(name) if name else None
    if group is not None and not (group.lock_weight or group_uses.used(obj, {name}, but=STAGE.name)):
        return group, ""
    made = obj.vertex_groups.new(name=STAGE.label if group is not None or not name else name)
    return made, "" if group is None else name


def _write(mesh: bpy.types.Mesh, group: bpy.types.VertexGroup, weights: np.ndarray) -> None:
    group.remove(range(len(weights)))
    for vertex in np.flatnonzero(weights).tolist():
        group.add([vertex], float(weights[vertex]), "REPLACE")
    mesh.update_tag()
