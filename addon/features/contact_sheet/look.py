# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes to what a cell shows: its pose, and the view from the same side; and back."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Self

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ...deform import characters
from ..measure.battery import Pose
from ..motion_range import clip
from ..pages.contact_sheet import Bent
from ..pages.views import View, camera_axes

SECONDS = 0.35
# Room around what the picture shows.
MARGIN = 1.1


@dataclass(frozen=True)
class Eye:
    """What a 3D view looks at."""

    rotation: Quaternion
    location: Vector
    distance: float
    perspective: str

    @classmethod
    def of(cls, view: bpy.types.RegionView3D) -> Self:
        place = view.view_rotation.copy(), view.view_location.copy(), view.view_distance
        return cls(*place, view.view_perspective)

    @classmethod
    def on(cls, view: bpy.types.RegionView3D, wanted: View, share: float) -> Self:
        """share: of the view's width that may show it"""
        right, up = camera_axes(wanted.direction)
        axes = Matrix(np.stack([right, up, wanted.direction], axis=1).tolist())
        before = cls.of(view)
        view.view_perspective, view.view_distance = "ORTHO", 1.0
        view.update()
        # Of clip space, which is 2 wide and 2 high.
        shown = min(2.0 * share / view.window_matrix[0][0], 2.0 / view.window_matrix[1][1])
        before.show(view)
        distance = MARGIN * wanted.width / shown
        return cls(axes.to_quaternion(), Vector(wanted.target.tolist()), distance, "ORTHO")

    def show(self, view: bpy.types.RegionView3D) -> None:
        view.view_rotation, view.view_location = self.rotation, self.location
        view.view_distance, view.view_perspective = self.distance, self.perspective


@dataclass
class Flight:
    """From one eye to another in a straight way, slower at its ends."""

    start: Eye
    end: Eye
    began: float = field(default_factory=time.perf_counter)

    def step(self, view: bpy.types.RegionView3D) -> bool:
        """Returns whether it goes on."""
        passed = min((time.perf_counter() - self.began) / SECONDS, 1.0)
        share = passed * passed * (3.0 - 2.0 * passed)
        distance = self.start.distance * (self.end.distance / self.start.distance) ** share
        rotation = self.start.rotation.slerp(self.end.rotation, share)
        location = self.start.location.lerp(self.end.location, share)
        Eye(rotation, location, distance, self.end.perspective).show(view)
        return passed < 1.0


@dataclass
class Posed:
    """A character in a joint's pose, until end().

    held  its armatures that did not play a range of motion
    """

    scene: bpy.types.Scene
    held: list[bpy.types.Object] = field(default_factory=list)

    def show(self, joint: Bent) -> None:
        """Other armatures of the character are at rest. Raises SinewError, and leaves nothing changed."""
        self.end()
        try:
            for rig in joint.rigs:
                own = joint.pose if rig is joint.rig else Pose(joint.pose.name, {})
                if not clip.is_on(rig.armature):
                    self.held.append(rig.armature)
                clip.show(self.scene, rig.armature, rig.bones, own)
        except BaseException:
            self.end()
            raise
        bpy.context.view_layer.update()

    def end(self) -> None:
        """Gives the artist's pose and frame back."""
        while self.held:
            armature = self.held.pop()
            # Saving has given it back, too.
            if clip.is_on(armature):
                clip.restore(armature)
        if clip.armatures_on():
            characters.set_frame(self.scene, self.scene.frame_float)
