# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares what an exported file plays with what Blender showed: export_check.py has the arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from ...attach import properties, upstream_proxy
from ...base.errors import SinewError
from ...deform import characters, session
from ...deform.skinned_object import SkinnedObject
from ...io import mesh_io
from ...skinning.influences import Influences
from ...skinning.vectors import transformed
from . import played as readers
from . import read_fbx, read_usd
from .export_check import EXPLAINED, Check, Comparison, Seen, SeenFrame, damaged_bones, plain, shears
from .played import Played

# The cosine of an angle: axes of a bone that are farther from a right one are named.
_SHEARED = 1e-3
_NAMED_BONES = 5
# The files that are glTF.
GLTF = (".glb", ".vrm")


class Recording:
    """What Blender shows of meshes, before an export changes anything.

    frames, between  whole frames, and times between them
    influences       of a vertex, at most, that the file will have; 0 for all
    kind             the file's ending
    report           called with the progress of export and check, 0 to 1
    left_out         a sentence for each mesh that can not be verified
    """

    def __init__(
        self,
        meshes: Sequence[bpy.types.Object],
        frames: Sequence[float],
        between: Sequence[float],
        influences: int,
        kind: str,
        report: Callable[[float], None],
    ) -> None:
        self.left_out: list[str] = []
        self._kind, self._influences, self._times = kind, influences, [*frames, *between]
        self._meshes: dict[str, _Mesh] = {}
        scene = bpy.context.scene
        self._rate = scene.render.fps / scene.render.fps_base
        self._played = {obj.name: _animations_of(obj) for obj in meshes}
        with characters.kept_frame(scene):
            if kind == ".glb":
                # Its exporter reads what stands still at this frame.
                characters.set_frame(scene, 0)
            for obj, state in session.deformed_now(meshes, bpy.context.evaluated_depsgraph_get()):
                if reason := _reason(obj, state):
                    self.left_out.append(f"{obj.name}: not verified: {reason}")
                else:
                    self._meshes[obj.name] = _Mesh(obj, state)
            for number, frame in enumerate((scene.frame_start, *self._times)):
                report(0.5 * number / (len(self._times) + 1))
                characters.set_frame(scene, frame)
                depsgraph = bpy.context.evaluated_depsgraph_get()
                for obj, state in session.deformed_now(meshes, depsgraph):
                    if obj.name in self._meshes:
                        each = self._meshes[obj.name].seen_at(obj, state, frame, kind)
                        self._meshes[obj.name].seen_frames.append(each)
        for mesh in self._meshes.values():
            mesh.between = mesh.seen_frames[1 + len(frames) :]
            mesh.frames = mesh.seen_frames[1 : 1 + len(frames)]

    def verify(self, path: Path, segments: Mapping[str, Mapping[int, str]]) -> list[Check]:
        """Reads the file, and compares; adds to `left_out`.

        segments  names of the plain bones for joints, by the names of objects
        """
        if self._kind in GLTF:
            played = {name for own in self._played.values() for _owner, name in own}
            read = readers.read_gltf(path, played, self._rate)
        elif self._kind == ".fbx":
            stacks = {
                name: {"|".join(names): first for names, first in own.items()}
                for name, own in self._played.items()
            }
            read = read_fbx.read_fbx(path, stacks, self._rate, self._times)
        else:
            read = read_usd.read_usd(path)
        checks = []
        for name, mesh in self._meshes.items():
            found = [each for each in read if plain(each.name) == plain(name)]
            try:
                if len(found) != 1:
                    raise SinewError(mesh.missing(len(found)))
                seen = mesh.seen(name, segments.get(name, {}), self._influences)
                # A .vrm has no animation: programs pose its bones.
                one = mesh.posed(found[0]) if self._kind == ".vrm" else found[0]
                checks.append(mesh.compared(seen, one, self._kind).check())
            except SinewError as error:
                self.left_out.append(f"{name}: not verified: {error}")
        return checks


class _Mesh:
    """A mesh over frames. What is read of it once is at the current frame, which is the exporter's.

    seen_frames  the scene's first frame, where plain bones get their weights, and those to compare
    """

    def __init__(self, obj: bpy.types.Object, state: SkinnedObject) -> None:
        deformer = state.bound.first_deformer
        self.bones, self._weighting = deformer.bones, deformer.weighting
        self._from_rest = np.linalg.inv(self.bones.rest.astype(np.float64))
        self._basis = mesh_io.read_points(obj.data).astype(np.float64)
        self._has_keys = obj.data.shape_keys is not None
        self._has_several = len(properties.of(obj).replaced_modifiers) > 1
        self._corners = mesh_io.corner_vertices(obj.data)
        self._normals = mesh_io.corner_normals(obj.data)
        self._world = np.array(obj.matrix_world, dtype=np.float64)
        self._bones_from_model = state.shown.frames[0].bones_from_model.astype(np.float64)
        self._influences: Influences | None = None
        self._rig = properties.of(obj).armature.name
        self._sheared: dict[str, None] = {}
        # At each frame, the values of shape keys.
        self._values: dict[float, dict[str, float]] = {}
        self.seen_frames: list[SeenFrame] = []
        self.frames: list[SeenFrame] = []
        self.between: list[SeenFrame] = []

    def seen_at(self, obj: bpy.types.Object, state: SkinnedObject, frame: float, kind: str) -> SeenFrame:
        bones, given = self.bones, state.shown.frames[0]
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        rig = properties.of(obj).armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        world, armature = (np.array(each.matrix_world, dtype=np.float64) for each in (evaluated, rig))
        keys = evaluated.data.shape_keys if obj.data.shape_keys is not None else None
        self._values[frame] = {key.name: key.value for key in keys.key_blocks} if keys is not None else {}
        shown, final = transformed(state.points, world), characters.final_points(obj)
        rest = state.shown.rest_points.astype(np.float64)
        if self._influences is None or self._weighting.depends_on_points:
            in_armature = transformed(rest, given.bones_from_model)
            self._influences = self._weighting.influences_over_joints(in_armature)
        motions = given.pose.astype(np.float64) @ self._from_rest
        axes = bones.rest_axes.astype(np.float64)
        flat = np.full(len(bones.rest) - len(bones.names), -1)
        poses, parents = motions @ axes, np.append(bones.parents, flat)
        damaged = damaged_bones(poses, parents, kind)
        for bone in np.flatnonzero(shears(poses, parents)[: len(bones.names)] > _SHEARED):
            if rig.data.bones[bones.names[bone]].inherit_scale != "FULL":
                self._sheared[bones.names[bone]] = None
        return SeenFrame(
            frame,
            transformed(final, world) if len(final) == len(shown) else shown,
            shown,
            rest,
            np.concatenate([armature @ motions @ given.bones_from_model, world[None]]),
            np.concatenate([armature @ motions @ self._bones_from_model, self._world[None]]),
            np.append(damaged, 0.0),
            self._influences,
            self._seen_normals(evaluated.data, world),
        )

    def _seen_normals(self, mesh: bpy.types.Mesh, world: np.ndarray) -> np.ndarray | None:
        if len(mesh.loops) != len(self._normals) or not np.linalg.det(world):
            return None
        return (mesh_io.corner_normals(mesh) @ np.linalg.inv(world[:3, :3])).astype(np.float32)

    def seen(self, name: str, segments: Mapping[int, str], influences: int) -> Seen:
        """segments: names of the plain bones for joints, if there are some"""
        constant = self.seen_frames[0].influences
        if self.bones.bend and not segments:
            in_armature = transformed(self.seen_frames[0].rest, self._bones_from_model)
            constant = self._weighting.influences(in_armature)
        has_envelopes = not segments and (
            self._weighting.use_envelopes
            or bool(self.bones.envelopes.multiply[self._weighting.entries.bones].any())
        )
        names = self.bones.names_with(segments)
        return Seen(
            name,
            names,
            constant,
            influences,
            has_envelopes,
            self._has_keys,
            self._has_several,
            self._corners,
            self._normals,
            self.frames,
            self.between,
            self._names(),
        )

    def _names(self) -> dict[str, str]:
        sheared = list(self._sheared)
        more = ", …" if len(sheared) > _NAMED_BONES else ""
        of_bones = {"shear_scale": ", ".join(sheared[:_NAMED_BONES]) + more} if sheared else {}
        return {**of_bones, "transforms": self._rig}

    def missing(self, count: int) -> str:
        """Why the file has not one skin of it, but so many."""
        if count:
            return f"the file has {count} skinned meshes of this name; rename one"
        if not len(self._weighting.entries.bones):
            return (
                "the file has it without a skin, as no vertex has a weight, and bones' envelopes are in no "
                "file: paint weights, or parent it to a bone"
            )
        return "the file has no skin of it; show it, and its armature, to the exporter"

    def posed(self, found: Played) -> Played:
        """A skin of a .vrm in the poses of the scene's bones, about the file's own joints."""
        assert found.binds is not None
        numbers = {name: number for number, name in enumerate(self.bones.names)}
        bones = np.array([numbers.get(name, -1) for name in found.joints])
        at_rest = self._world @ np.linalg.inv(self._bones_from_model) @ self.bones.rest.astype(np.float64)
        # With the axes of the file's joints, which VRM 0 has along those of the world.
        placed = found.binds.copy()
        placed[bones >= 0, :3, 3] = at_rest[bones[bones >= 0], :3, 3]
        from_file = np.linalg.inv(self._world) @ placed @ np.linalg.inv(found.binds) @ found.up
        seen_frames = {each.frame: each for each in self.seen_frames}
        return replace(
            found,
            motions=lambda frame: seen_frames[frame].bound[bones] @ from_file,
            shapes=lambda frame: np.array([self._values[frame].get(name, 0.0) for name in found.shape_names]),
            is_animated=True,
        )

    def compared(self, seen: Seen, found: Played, kind: str) -> Comparison:
        """Raises SinewError where the file has other rest points."""
        # glTF has the rest points of skins in world space.
        place = np.linalg.pinv(self._world) @ found.up if kind in GLTF else np.identity(4)
        rest = transformed(found.rest, place)
        size = float(np.linalg.norm(np.ptp(self._basis, axis=0)))
        if len(rest) == len(self._basis) and np.abs(rest - self._basis).max(initial=0.0) <= EXPLAINED * size:
            return Comparison(seen, found, place, np.arange(len(rest)))
        near = _near(rest, self._basis, EXPLAINED * size)
        if not all(near):
            raise SinewError(
                "the file has other rest points, so that nothing can be compared; apply what changes them "
                "before the armature"
            )
        # Of vertices at one place, each of the file's is taken for the one that moves like it.
        vertices = np.array([own[0] for own in near])
        comparison = Comparison(seen, found, place, vertices)
        several = [row for row, own in enumerate(near) if len(own) > 1]
        if not several:
            return comparison
        seen_frames = [self.frames[0], self.frames[len(self.frames) // 2], self.frames[-1]]
        shapes = [comparison.played(each) for each in seen_frames]
        for row in several:
            apart = [
                max(np.linalg.norm(m.seen[v] - s[row]) for m, s in zip(seen_frames, shapes, strict=True))
                for v in near[row]
            ]
            vertices[row] = near[row][int(np.argmin(apart))]
        return Comparison(seen, found, place, vertices)


def _near(points: np.ndarray, others: np.ndarray, distance: float) -> list[list[int]]:
    """For each of the points, the others within this distance, the nearest first."""
    tree = KDTree(len(others))
    for number, point in enumerate(others):
        tree.insert(point, number)
    tree.balance()
    found = []
    for point in points:
        own = tree.find_range(point, distance)
        found.append([number for _point, number, _apart in sorted(own, key=lambda each: each[2])])
        if not own:
            break
    return found


def _reason(obj: bpy.types.Object, state: SkinnedObject) -> str:
    """Why it can not be compared; empty where it can."""
    if state.shown.frames[0] is None:
        return "its first Armature modifier is switched off"
    try:
        upstream_proxy.check_not_needed(obj, "which the file leaves out")
    except SinewError as error:
        return str(error)
    return ""


def _animations_of(obj: bpy.types.Object) -> dict[tuple[str, str], float]:
    """Names of the actions and of the NLA's tracks that move a mesh, after those of what they are on, with
    their first frames: exporters name animations by the ones or the others. The armature's are first."""
    found: dict[tuple[str, str], float] = {}
    owners = [properties.of(obj).armature, obj.data.shape_keys, obj]
    for owner in filter(None, owners):
        animation = owner.animation_data
        if animation is None:
            continue
        action = animation.action
        tracks = [
            track
            for track in animation.nla_tracks
            if (not track.mute if action is None else action in [s.action for s in track.strips])
        ]
        strips = [strip.action for track in tracks for strip in track.strips]
        for each in filter(None, strips if action is None else [action]):
            found.setdefault((owner.name, each.name), float(each.frame_range[0]))
        for track in tracks:
            found.setdefault((owner.name, track.name), 0.0)
    return found
