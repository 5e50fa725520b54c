# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks a mesh's weights and poses, on the mesh as it is edited, and remembers the findings until the
weights change."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import bmesh
import bpy
import numpy as np

from ...attach import attach
from ...attach.subscribers import subscribers
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import armature_io, mesh_io
from ...skinning.arrays import read
from ...skinning.influences import GroupWeights
from ...skinning.rig import Bones
from ...skinning.vectors import rotations_of, transformed
from ...ui import stepped
from ...ui.operators import selected
from ...ui.translations import tr
from ..measure.diagnostics import Finding
from ..measure.stray_weights import stray_weights
from ..measure.subjects import Edited


@dataclass
class Check:
    """The findings on an object, and what was checked.

    mesh     the session_uid of the mesh
    frames   which poses were checked, in words
    over     one of stepped.OVER; empty for a single pose
    beside   the session_uid of those that were checked together, as one character
    places   patches that Flex found, by their keys
    suspect  the mesh was touched since
    stale    weights, groups or bones have changed since the check
    """

    findings: list[Finding]
    frames: str
    mesh: int
    weights: GroupWeights
    groups: tuple[str, ...]
    bones: Bones
    over: str = ""
    beside: tuple[int, ...] = ()
    places: dict[str, Finding] = field(default_factory=dict)
    suspect: bool = False
    stale: bool = False

    @property
    def known(self) -> dict[str, Finding]:
        """All that can be shown and mended, by their keys."""
        return {**{finding.key: finding for finding in self.findings}, **self.places}


# How far the view is from a place, in sizes of the mesh.
NEAR = 0.3

# By the session_uid of the object.
_checks: dict[int, Check] = {}


def check(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], most_influences: int) -> None:
    """Checks weights, and the current pose. Raises SinewError that says why an object cannot be checked."""
    meshes = _read(objects)
    _add_pose(meshes, scene.frame_current)
    _keep(meshes, most_influences, tr("pose of frame {frame}", frame=scene.frame_current))


def check_frames(
    scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], most_influences: int, over: str
) -> Iterator[float]:
    """Checks weights, and the poses of all frames; yields the progress."""
    meshes = _read(objects)
    armatures = list(dict.fromkeys(attach.armature_of(obj) for obj in objects))
    frames = stepped.frames_over(scene, armatures, over)
    with stepped.kept_frame(scene, armatures):
        for number, frame in enumerate(frames):
            characters.set_frame(scene, frame)
            _add_pose(meshes, frame)
            yield (number + 1) / len(frames)
    poses = tr("poses of frames {first} to {last}", first=frames[0], last=frames[-1])
    _keep(meshes, most_influences, poses, over)


def of(obj: bpy.types.Object) -> Check | None:
    """Returns the findings on an object; `stale` is up to date."""
    found = _checks.get(obj.session_uid)
    if found is not None and not found.stale:
        groups = tuple(obj.vertex_groups.keys())
        found.stale = groups != found.groups or obj.data.session_uid != found.mesh
        found.stale = found.stale or (found.suspect and not _weights_equal(obj, found.weights))
        found.suspect = False
    return found


def check_again(scene: bpy.types.Scene, obj: bpy.types.Object, most_influences: int) -> Iterator[float]:
    """Repeats the last check, with those that were checked together; yields the progress."""
    found = of(obj)
    beside = found.beside if found is not None else ()
    objects = [obj, *(each for each in scene.objects if each != obj and each.session_uid in beside)]
    if found is not None and found.over:
        yield from check_frames(scene, objects, most_influences, found.over)
    else:
        check(scene, objects, most_influences)


def has(obj: bpy.types.Object, key: str) -> bool:
    """Whether this fault is known, and can be shown and mended."""
    found = of(obj)
    return found is not None and key in found.known


def keep_places(obj: bpy.types.Object, places: Sequence[Finding]) -> None:
    """Has patches of a mesh that was checked selected and mended as findings are."""
    _checks[obj.session_uid].places = {finding.key: finding for finding in places}


def forget_place(obj: bpy.types.Object, key: str) -> None:
    _checks[obj.session_uid].places.pop(key, None)


def finding_of(obj: bpy.types.Object, key: str) -> tuple[Check, Finding]:
    """Raises SinewError where no such fault is known, or the mesh now has other vertices."""
    found = of(obj)
    finding = found.known.get(key) if found is not None else None
    if finding is None:
        raise SinewError(f"{obj.name}: no such fault is known; press Check again")
    if len(found.weights.counts) != _vertex_count(obj):
        raise SinewError(f"{obj.name}: its vertices are others than those checked; press Check again")
    if not obj.data.is_editable:
        raise SinewError(f"{obj.name}: its mesh is linked from another file and can only be edited there")
    return found, finding


def select_vertices(
    obj: bpy.types.Object, vertices: np.ndarray, context: bpy.types.Context, bone: str = ""
) -> None:
    """Selects exactly these vertices, in edit mode, or in weight paint mode where the mesh is in it, and
    looks at them in the 3D views. Raises SinewError where that is not possible.

    bone  whose vertex group is made the active one; "" for none
    """
    if obj.name not in context.view_layer.objects or not obj.visible_get():
        raise SinewError(f"{obj.name} is hidden; show it to edit it")
    if bone in obj.vertex_groups:
        obj.vertex_groups.active_index = obj.vertex_groups[bone].index
    mesh = obj.data
    chosen = np.zeros(len(mesh.vertices), dtype=bool)
    chosen[vertices] = True
    is_painted = obj.mode == "WEIGHT_PAINT"
    if not is_painted:
        _make_active_alone(obj, context)
    # Hidden vertices cannot be selected.
    mesh.vertices.foreach_set("hide", read(mesh.vertices, "hide", kind=bool) & ~chosen)
    if is_painted:
        mesh.use_paint_mask_vertex = True
        mesh.vertices.foreach_set("select", chosen)
        mesh.update()
    else:
        _select_in_edit_mode(mesh, vertices, context)
    _look_at(context, obj, vertices)


def _look_at(context: bpy.types.Context, obj: bpy.types.Object, vertices: np.ndarray) -> None:
    """By hand: Blender's View Selected comes no nearer to a single vertex."""
    points = transformed(mesh_io.read_points(obj.data)[vertices], np.array(obj.matrix_world))
    size = max(NEAR * max(obj.dimensions), 2.0 * float(np.linalg.norm(np.ptp(points, axis=0))))
    for area in context.screen.areas if context.screen is not None else ():
        if area.type == "VIEW_3D" and area.spaces.active.region_3d is not None:
            view = area.spaces.active.region_3d
            view.view_location = points.mean(axis=0).tolist()
            view.view_distance = min(view.view_distance, size)


def _make_active_alone(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    active = context.view_layer.objects.active
    if active is not None and active.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    # All selected meshes would enter edit mode, too, with their own selections.
    for other in selected(context):
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


def _select_in_edit_mode(mesh: bpy.types.Mesh, vertices: np.ndarray, context: bpy.types.Context) -> None:
    # Not through the context: Blender 4.2 would keep the scene with the context, and crash without it.
    context.scene.tool_settings.mesh_select_mode = (True, False, False)
    bpy.ops.object.mode_set(mode="EDIT")
    # Not by foreach_set before: Blender 5.0 crashed in it, on edges or faces of a mesh with hidden ones.
    edited = bmesh.from_edit_mesh(mesh)
    for elements in (edited.faces, edited.edges, edited.verts):
        for element in elements:
            element.select = False
    edited.verts.ensure_lookup_table()
    for index in vertices:
        edited.verts[index].select = True
    edited.select_flush_mode()
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def _read(objects: Sequence[bpy.types.Object]) -> list[Edited]:
    found, depsgraph = [], bpy.context.evaluated_depsgraph_get()
    for obj in objects:
        armature = attach.armature_of(obj)
        if armature is None:
            raise SinewError(f"{obj.name}: no armature deforms it; there are no weights to check")
        if armature.data.is_editmode:
            raise SinewError(f"{armature.name} is in edit mode; leave it first")
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        found.append(Edited.read(obj, depsgraph))
    return found


def _add_pose(meshes: Sequence[Edited], frame: float) -> None:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for mesh in meshes:
        armature, bones = attach.armature_of(mesh.obj).evaluated_get(depsgraph), mesh.weighting.bones
        pose = armature_io.read_pose(armature, bones).astype(np.float64)
        # A bone without size rotates nothing.
        motions = pose[:, :3, :3] @ np.linalg.pinv(bones.rest[:, :3, :3].astype(np.float64))
        mesh.pose_check.add_pose(rotations_of(motions), frame)


def _keep(meshes: Sequence[Edited], most_influences: int, frames: str, over: str = "") -> None:
    beside = tuple(mesh.obj.session_uid for mesh in meshes)
    for mesh, stray in zip(meshes, stray_weights(meshes), strict=True):
        obj = mesh.obj
        before = _checks.get(obj.session_uid)
        is_same = before is not None and before.mesh == obj.data.session_uid
        _checks[obj.session_uid] = Check(
            [*stray, *mesh.findings(most_influences)],
            frames,
            obj.data.session_uid,
            mesh.weights,
            tuple(obj.vertex_groups.keys()),
            mesh.weighting.bones,
            over,
            beside,
            before.places if is_same else {},
        )


def _vertex_count(obj: bpy.types.Object) -> int:
    if obj.mode == "EDIT":
        return len(bmesh.from_edit_mesh(obj.data).verts)
    return len(obj.data.vertices)


def _weights_equal(obj: bpy.types.Object, weights: GroupWeights) -> bool:
    if _vertex_count(obj) != len(weights.counts):
        return False
    if obj.mode == "EDIT":
        # Before it is written back to the mesh.
        return mesh_io.read_edited_weights(bmesh.from_edit_mesh(obj.data)).equals(weights)
    state = session.skinned_of(obj)
    if state is not None and not state.bound.source.from_upstream:
        # Sinew has read them already.
        return state.bound.source.weights.equals(weights)
    return mesh_io.read_group_weights(obj.data).equals(weights)


def _on_evaluated(depsgraph: bpy.types.Depsgraph) -> None:
    if not _checks:
        return
    # By names from evaluated data: earlier handlers may have deleted the originals.
    meshes, armatures = set(), set()
    for update in depsgraph.updates:
        if isinstance(update.id, bpy.types.Mesh) and update.is_updated_geometry:
            meshes.add(update.id.name_full)
        elif isinstance(update.id, bpy.types.Armature):
            armatures.add(update.id.name_full)
    if not (meshes or armatures):
        return
    for obj in bpy.data.objects:
        found = _checks.get(obj.session_uid)
        if found is None:
            continue
        found.suspect |= obj.data.name_full in meshes
        armature = attach.armature_of(obj) if armatures else None
        if armature is None or armature.data.name_full not in armatures or armature.data.is_editmode:
            continue
        bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
        found.stale |= not bones.equals(found.bones)


def _on_stepped() -> None:
    for found in _checks.values():
        found.suspect = True


SUBSCRIPTIONS = (
    (subscribers.evaluated, _on_evaluated),
    (subscribers.stepped, _on_stepped),
    (subscribers.loading, _checks.clear),
)
forget = _checks.clear
