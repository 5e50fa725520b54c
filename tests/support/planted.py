# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults that are planted in good rigs, each with the joint at which Flex has to name it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix
from sinew_addon.attach import attach, properties
from sinew_addon.base.steps import result_of
from sinew_addon.deform import characters
from sinew_addon.features.flex import flex
from sinew_addon.features.flex.verdict import Verdict
from sinew_addon.features.measure.limits import Table
from sinew_addon.io import files, mesh_io

_TRUNK = {"chest": "spine_03", "neck": "neck_01", "head": "head", "hips": "pelvis", "spine": "spine_02"}
_LIMBS = {
    **{"clavicle": "clavicle", "upper_arm": "upperarm", "forearm": "lowerarm", "hand": "hand"},
    **{"finger": "middle_02", "thigh": "thigh", "shin": "calf", "foot": "foot", "toe": "ball"},
}
HUMAN = _TRUNK | {f"{plain}.{s.upper()}": f"{own}_{s}" for plain, own in _LIMBS.items() for s in "lr"}
"""What human.blend calls its bones."""


@dataclass
class Rig:
    """The open file's mesh: its weights [vertices, groups], its points at rest."""

    obj: bpy.types.Object
    names: dict[str, str]
    weights: np.ndarray
    points: np.ndarray

    @classmethod
    def open(cls, path: Path, names: dict[str, str]) -> Rig:
        files.open_file(path)
        obj = attach.deformed_meshes(list(bpy.context.scene.objects))[0]
        stored = mesh_io.read_group_weights(obj.data)
        weights = np.zeros((len(stored.counts), len(obj.vertex_groups)))
        weights[np.repeat(np.arange(len(stored.counts)), stored.counts), stored.groups] = stored.weights
        return cls(obj, names, weights, np.array([vertex.co for vertex in obj.data.vertices]))

    @property
    def armature(self) -> bpy.types.Object:
        return attach.armature_of(self.obj)

    def group(self, plain: str) -> int:
        return self.obj.vertex_groups[self.names[plain]].index

    def of(self, plain: str) -> np.ndarray:
        """Vertices that follow a bone most."""
        return np.flatnonzero(self.weights.argmax(axis=1) == self.group(plain))

    def patch(self, plain: str, count: int) -> np.ndarray:
        """Vertices in the middle of what follows a bone most."""
        own = self.of(plain)
        apart = np.linalg.norm(self.points[own] - self.points[own].mean(axis=0), axis=1)
        first = own[apart.argmin()]
        return own[np.argsort(np.linalg.norm(self.points[own] - self.points[first], axis=1))[:count]]

    def give(self, vertices: np.ndarray, plain: str, share: float = 1.0) -> None:
        """Gives vertices a share of a bone; what they had keeps the rest."""
        self.weights[vertices] *= 1.0 - share
        self.weights[vertices, self.group(plain)] += share

    def store(self) -> None:
        rows = {
            int(vertex): [(int(group), float(self.weights[vertex, group])) for group in np.flatnonzero(row)]
            for vertex, row in enumerate(self.weights > 0.0)
        }
        for group in self.obj.vertex_groups:
            group.remove(list(rows))
        for vertex, entries in rows.items():
            for number, weight in entries:
                self.obj.vertex_groups[number].add([vertex], weight, "REPLACE")

    def edit(self, plain: str, change: Callable[[bpy.types.EditBone], None]) -> None:
        bpy.context.view_layer.objects.active = self.armature
        bpy.ops.object.mode_set(mode="EDIT")
        change(self.armature.data.edit_bones[self.names[plain]])
        bpy.ops.object.mode_set(mode="OBJECT")

    def shell(self, near: str, follows: str) -> None:
        """Adds a small ball on the skin at a bone's middle, that follows a bone; "" for none."""
        size = float(np.ptp(self.points, axis=0).max())
        place = self.points[self.patch(near, 1)[0]]
        bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
        made = bpy.context.object
        made.data.transform(Matrix.Translation(place) @ Matrix.Scale(0.01 * size, 4))
        made.parent = self.obj
        modifier = made.modifiers.new("Armature", "ARMATURE")
        modifier.object = self.armature
        if follows:
            group = made.vertex_groups.new(name=self.names[follows])
            group.add(list(range(len(made.data.vertices))), 1.0, "REPLACE")

    def harden(self, plain: str, above: str) -> None:
        """Has vertices follow one of two bones alone."""
        pair = [self.group(plain), self.group(above)]
        shared = np.flatnonzero((self.weights[:, pair] > 0.0).all(axis=1))
        first = self.weights[shared, pair[0]] > self.weights[shared, pair[1]]
        total = self.weights[shared][:, pair].sum(axis=1)
        self.weights[shared, pair[0]] = np.where(first, total, 0.0)
        self.weights[shared, pair[1]] = np.where(first, 0.0, total)


def verdict() -> Verdict:
    scene = bpy.context.scene
    meshes, _left = characters.deformable_meshes(scene, Path("planted"), ["dq"])
    return result_of(flex.flex(meshes, (), Table(), dict.fromkeys(meshes, properties.BLENDER))).verdict


def found(of: Verdict) -> set[tuple[str, str]]:
    """Joints and names of findings."""
    return {(each.joint, each.limit.name) for each in of.findings}


@dataclass(frozen=True)
class Plant:
    """joints: any of these may be named; findings: by any of these"""

    name: str
    plant: Callable[[Rig], object]
    joints: tuple[str, ...]
    findings: tuple[str, ...]

    @property
    def is_of_bones(self) -> bool:
        return self.findings[0] in ("roll", "pivot")


def _swap(rig: Rig, *plain: str) -> None:
    for each in plain:
        pair = [rig.group(f"{each}.L"), rig.group(f"{each}.R")]
        rig.weights[:, pair] = rig.weights[:, pair[::-1]]


def _noise(rig: Rig, plain: str, above: str) -> None:
    pair = [rig.group(plain), rig.group(above)]
    shared = np.flatnonzero((rig.weights[:, pair] > 0.05).all(axis=1))
    share = np.random.default_rng(7).random(len(shared))
    total = rig.weights[shared][:, pair].sum(axis=1)
    rig.weights[shared, pair[0]], rig.weights[shared, pair[1]] = share * total, (1.0 - share) * total


def _clear(rig: Rig, plain: str) -> None:
    rig.weights[:, rig.group(plain)] = 0.0


def _into(rig: Rig, plain: str, other: str, share: float = 1.0) -> None:
    """Moves weights of a bone to another."""
    own = rig.group(plain)
    rig.weights[:, rig.group(other)] += share * rig.weights[:, own]
    rig.weights[:, own] *= 1.0 - share


def _rename(rig: Rig, plain: str) -> None:
    rig.obj.vertex_groups[rig.names[plain]].name = "renamed"


def _no_deform(rig: Rig, plain: str) -> None:
    rig.armature.data.bones[rig.names[plain]].use_deform = False


def _roll(rig: Rig, plain: str, degrees: float) -> None:
    rig.edit(plain, lambda bone: setattr(bone, "roll", bone.roll + np.radians(degrees)))


def _move_head(rig: Rig, plain: str, lengths: float) -> None:
    def change(bone: bpy.types.EditBone) -> None:
        bone.use_connect = False
        bone.head += lengths * bone.length * bone.z_axis

    rig.edit(plain, change)


def _parent(rig: Rig, plain: str, other: str) -> None:
    def change(bone: bpy.types.EditBone) -> None:
        bone.use_connect = False
        bone.parent = rig.armature.data.edit_bones[rig.names[other]] if other else None

    rig.edit(plain, change)


def _scaled(rig: Rig, plain: str, factor: float) -> None:
    rig.weights[rig.of(plain)] *= factor


TORN = ("stretch", "flips", "bulge", "crossings", "volume_loss", "volume_gain", "radius")
PLANTS = (
    Plant(
        "a patch without weights",
        lambda r: r.weights.__setitem__(r.patch("forearm.L", 20), 0.0),
        ("forearm.L",),
        ("unweighted",),
    ),
    Plant(
        "one vertex without weights",
        lambda r: r.weights.__setitem__(r.patch("shin.R", 1), 0.0),
        ("shin.R",),
        ("unweighted",),
    ),
    Plant(
        "weights of almost nothing",
        lambda r: _scaled(r, "foot.L", 1e-6),
        ("foot.L", "toe.L"),
        ("unweighted",),
    ),
    Plant("a mesh without weights", lambda r: r.shell("head", ""), ("head",), ("unweighted",)),
    Plant(
        "a loose shell at the chest",
        lambda r: r.shell("chest", ""),
        ("chest", "clavicle.L", "clavicle.R"),
        ("unweighted",),
    ),
    Plant(
        "a shell that follows a far bone",
        lambda r: r.shell("head", "foot.L"),
        ("foot.L",),
        ("astray", "bleed", "other_side"),
    ),
    Plant(
        "a shell that stays at the hips", lambda r: r.shell("hand.L", "hips"), ("hips",), ("astray", "bleed")
    ),
    Plant("no group of a forearm", lambda r: _clear(r, "forearm.L"), ("forearm.L",), ("inert",)),
    Plant("no group of a finger", lambda r: _into(r, "finger.L", "hand.L"), ("finger.L",), ("inert",)),
    Plant("a group of another name", lambda r: _rename(r, "shin.L"), ("shin.L",), ("inert",)),
    Plant("a bone without Deform", lambda r: _no_deform(r, "upper_arm.R"), ("upper_arm.R",), ("inert",)),
    Plant(
        "the hand bleeds into the hip",
        lambda r: r.give(r.patch("thigh.L", 30), "hand.L", 0.3),
        ("hand.L",),
        ("bleed", "astray"),
    ),
    Plant(
        "the foot moves a vertex of the head",
        lambda r: r.give(r.patch("head", 1), "foot.L", 0.5),
        ("foot.L",),
        ("bleed", "astray"),
    ),
    Plant(
        "a finger bleeds into the belly",
        lambda r: r.give(r.patch("spine", 10), "finger.R", 0.1),
        ("finger.R",),
        ("bleed",),
    ),
    Plant(
        "the head bleeds into a knee",
        lambda r: r.give(r.patch("shin.L", 30), "head", 0.2),
        ("head",),
        ("bleed",),
    ),
    Plant(
        "the forearm follows the shin",
        lambda r: r.give(r.patch("forearm.L", 60), "shin.L"),
        ("shin.L",),
        ("astray",),
    ),
    Plant(
        "the toes follow the other foot",
        lambda r: r.give(r.of("toe.L"), "toe.R"),
        ("toe.R", "toe.L"),
        ("other_side", "astray", "inert"),
    ),
    Plant(
        "a patch of the other thigh",
        lambda r: r.give(r.patch("thigh.L", 40), "thigh.R", 0.6),
        ("thigh.R",),
        ("other_side",),
    ),
    Plant(
        "arms swapped",
        lambda r: _swap(r, "upper_arm", "forearm"),
        ("upper_arm.L", "upper_arm.R", "forearm.L"),
        ("other_side",),
    ),
    Plant("feet swapped", lambda r: _swap(r, "foot", "toe"), ("foot.L", "foot.R"), ("other_side",)),
    Plant(
        "weights of one shoulder halved",
        lambda r: _into(r, "upper_arm.R", "clavicle.R", 0.5),
        ("upper_arm.L", "upper_arm.R", "clavicle.L"),
        ("asymmetry",),
    ),
    Plant("one knee moved down", lambda r: _into(r, "shin.L", "thigh.L", 0.4), ("shin.L",), ("asymmetry",)),
    Plant("rolled by 45 degrees", lambda r: _roll(r, "forearm.L", 45.0), ("forearm.L",), ("roll",)),
    Plant("rolled by 90 degrees", lambda r: _roll(r, "shin.L", 90.0), ("shin.L",), ("roll",)),
    Plant("rolled by half a turn", lambda r: _roll(r, "thigh.L", 180.0), ("thigh.L",), ("roll",)),
    Plant("a hard elbow", lambda r: r.harden("forearm.L", "upper_arm.L"), ("forearm.L",), TORN),
    Plant("a hard knee", lambda r: r.harden("shin.R", "thigh.R"), ("shin.R",), TORN),
    Plant("a twist in one edge", lambda r: r.harden("hand.L", "forearm.L"), ("hand.L",), TORN),
    Plant("a noisy knee", lambda r: _noise(r, "shin.L", "thigh.L"), ("shin.L",), (*TORN, "asymmetry")),
    Plant("a knee's pivot in front", lambda r: _move_head(r, "shin.L", 0.5), ("shin.L",), ("pivot", *TORN)),
    Plant(
        "a shoulder's pivot behind",
        lambda r: _move_head(r, "upper_arm.L", -1.2),
        ("upper_arm.L",),
        ("pivot", *TORN),
    ),
    Plant(
        "a forearm on the hips", lambda r: _parent(r, "forearm.L", "hips"), ("upper_arm.L", "forearm.L"), TORN
    ),
    Plant("a hand on the chest", lambda r: _parent(r, "hand.L", "chest"), ("hand.L", "forearm.L"), TORN),
)
