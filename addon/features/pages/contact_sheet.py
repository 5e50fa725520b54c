# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet: the joints of a character bent alike under several variants, each joint with one camera.

Shapes are computed and drawn beside Blender's evaluation: the file, its pose and its frame stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import bpy
import numpy as np
import sinew

from ...attach import properties
from ...base.errors import SinewError
from ...io import units
from ...skinning.variants import Variant
from ...skinning.vectors import unit
from ..measure import live, motion_range
from ..measure.heat_scale import HeatScale
from ..measure.joint_figures import Figures
from ..measure.motion_range import Column
from ..measure.rigs import Rig, posed, rigs_of
from . import shaded
from .sheet import Cell
from .views import View, joint_view

# Pixels of a picture, where nobody says otherwise.
SIZE = 240
# How far around a joint a picture shows, in mean lengths of the two limbs that meet there.
REACH = 1.0
# A joint that bends less of the surface than this share of all is not worth a column.
LEAST_BENT = 2e-4


# Joints of limbs, which are seen without the rest of the body.
OF_LIMBS = ("Elbow", "Wrist", "Knee", "Fingers")


class Bent:
    """One column: a joint of the character in its pose.

    rigs  of the character, which are at rest but for `rig`
    """

    def __init__(self, now: live.Moment, rigs: Sequence[Rig], rig: Rig, column: Column) -> None:
        self.joint, self.pose = column.joint, column.pose
        self.moment = posed(now, {rig.bones.names: column.pose})
        self.rigs, self.rig, self._bones = rigs, rig, column.bones

    @property
    def bent_share(self) -> float:
        pose = self.moment.pose
        return float(pose.bent_areas.sum()) / max(float(pose.rest.areas.sum()), 1e-30)

    @cached_property
    def view(self) -> View:
        """A view for all variants."""
        points = self.moment.measured_under([Variant.of("lbs")] * len(self.moment.inputs)).shape.points.T
        bone, world = self._bones[0], self.rig.world[:3, :3]
        motion = np.identity(4)
        motion[:3, :3] = self.pose.rotations[bone]
        axis = sinew.affine.to_screw(motion).axis
        axis, limb = (unit(world @ each) for each in (axis, self.rig.bones.limbs.vectors[bone]))
        return joint_view(points, points[self._is_near()], axis, limb)

    @cached_property
    def shown(self) -> np.ndarray | None:
        """bool [triangles], those that are drawn; None: all."""
        if self.joint not in OF_LIMBS:
            return None
        bones = self.rig.bones.deforming_parents
        taken = {int(bones[bone]) for bone in self._bones}.union(*map(self._carried, self._bones))
        return self._follow(taken)[self.moment.subject.gauge.surface.triangles].any(axis=1)

    @cached_property
    def limbs(self) -> np.ndarray:
        """bool [bones of the moment's frame]: those that meet at the joints."""
        return self._columns(set().union(*map(self._around, self._bones)))

    def _is_near(self) -> np.ndarray:
        """bool [vertices]: those around the joints, of the limbs that meet there."""
        bones, near = self.rig.bones, np.zeros(self.moment.subject.gauge.surface.vertex_count, bool)
        rest, linear, place = self.moment.pose.rest.points, self.rig.world[:3, :3], self.rig.world[:3, 3]
        for bone in self._bones:
            head, above = bones.rest[bone, :3, 3], int(bones.deforming_parents[bone])
            ways = np.stack([bones.limbs.vectors[bone], head - bones.rest[above, :3, 3]])
            # A chain that bends as a whole is seen whole.
            chain = bones.limbs.vectors[[each for each in self._bones if self._are_in_line(bone, each)]]
            lengths = (float(np.linalg.norm(each @ linear.T, axis=1).sum()) for each in (ways, chain))
            reach = REACH * max(lengths) / 2
            distances = np.linalg.norm(rest - (linear @ head + place)[:, None], axis=0)
            near |= (distances < reach) & self._follow(self._around(bone))
        if near.any():
            return near
        return self.moment.pose.is_bent if self.moment.pose.is_bent.any() else np.ones_like(near)

    def _are_in_line(self, bone: int, other: int) -> bool:
        return other in self._carried(bone) or bone in self._carried(other)

    def _around(self, bone: int) -> set[int]:
        """The bone, what carries it, and what it carries directly."""
        above = self.rig.bones.deforming_parents
        return {bone, int(above[bone]), *map(int, np.flatnonzero(above == bone))}

    def _follow(self, bones: set[int]) -> np.ndarray:
        """bool [vertices]: those that follow some of the rig's bones most."""
        heaviest = self.moment.pose.skin.limb_of_vertices
        return (heaviest >= 0) & self._columns(bones)[heaviest]

    def _columns(self, bones: set[int]) -> np.ndarray:
        """bool [bones of the moment's frame]"""
        found = []
        for own in self.moment.inputs:
            of_part = own.part.bound.first_deformer.bones
            is_own = of_part.names == self.rig.bones.names
            found.append(np.isin(of_part.owners, list(bones)) & is_own)
        return np.concatenate(found)

    def _carried(self, bone: int) -> set[int]:
        found = {bone}
        for other in self.rig.bones.from_the_root:
            if int(self.rig.bones.deforming_parents[other]) in found:
                found.add(other)
        return found


def columns(objects: Sequence[bpy.types.Object]) -> list[Bent]:
    """Returns the joints that bend the character's surface, of the armatures of meshes that Sinew deforms.

    Raises SinewError where there are none.
    """
    now = live.Moment.of(live.measure_now(objects, properties.BLENDER, "bend"))
    found: list[Bent] = []
    rigs = rigs_of(now)
    for rig in rigs:
        own = [Bent(now, rigs, rig, column) for column in motion_range.columns(rig.bones, rig.is_moving)]
        own = [each for each in own if each.bent_share >= LEAST_BENT]
        if not all(each.joint in motion_range.COLUMNS.values() for each in own):
            most = sorted(own, key=lambda each: -each.bent_share)[: motion_range.MOST_OTHERS]
            own = [each for each in own if each in most]
        found += own
    if not found:
        raise SinewError("No joint bends these meshes")
    return found


def headings(joints: Sequence[Bent]) -> list[tuple[str, str]]:
    """As Sheet.columns has them."""
    return [(joint.joint, joint.pose.name) for joint in joints]


def ticks(scene: bpy.types.Scene, scale: HeatScale) -> tuple[str, str]:
    """The least and the most of a sheet's colours, with units."""
    least, most = (units.text(scene, scale.metric.unit, value, short=True) for value in scale.ticks(2))
    return least, f"\u2265 {most}" if scale.clipped else most


def cells(
    joints: Sequence[Bent], rows: Sequence[Mapping[bpy.types.Object, Variant]], size: int
) -> Iterator[Cell]:
    """Draws row by row.

    rows  by object, the variant that it has
    size  pixels of a picture
    """
    first: list[np.ndarray] = []
    for row, of_objects in enumerate(rows):
        for column, bent in enumerate(joints):
            variants = [of_objects[own.part.obj] for own in bent.moment.inputs]
            measured = bent.moment.measured_under(variants)
            points = measured.shape.points
            if row == 0:
                first.append(points)
            picture = shaded.empty(size)
            if np.isfinite(points).all():
                distances = np.linalg.norm(points - first[column], axis=0)
                picture = shaded.picture(measured.shape, bent.view, size, bent.shown, distances)
            yield Cell(row, column, picture, Figures.of(measured, bent.limbs), bent.view.width)
