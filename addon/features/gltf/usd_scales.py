# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones' scales in a .usdc, at every frame. Blender's exporter leaves a sample out while all of its
numbers are within 0.01 of the last one that it wrote (seen on 4.2 to 5.3): a bone that grows from 1.0 to
1.008, or from 0.02 to 0.029, stays as it was."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...io import armature_io
from ...io.usd import has_pxr, pxr
from .export_check import plain, relative

# Nearer samples than this are left out by Blender's exporter; a distance that is worth a word.
_LEFT_OUT, _SMALL = 0.01, 0.001


@dataclass
class Scales:
    """
    names  of the bones of each armature object, in the order of USD's joints
    poses  float64 [bones, 4, 4] of each, by frames, relative to the parent
    """

    names: dict[str, list[str]] = field(default_factory=dict)
    poses: dict[str, dict[float, np.ndarray]] = field(default_factory=dict)

    def take(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        for rig in [obj for obj in scene.objects if obj.type == "ARMATURE" and obj.visible_get()]:
            evaluated = rig.evaluated_get(depsgraph)
            bones = armature_io.read_bones(evaluated)
            posed = armature_io.read_pose(evaluated, bones)[: len(bones.names)].astype(np.float64)
            self.names[rig.name] = list(bones.names)
            own = self.poses.setdefault(rig.name, {})
            own[scene.frame_current_final] = relative(posed, bones.parents)

    def write(self, path: Path) -> list[str]:
        """Writes all samples again of the armatures that the file has. Returns a sentence for each whose
        scales stay wrong, as this Blender has no USD for scripts."""
        if not has_pxr():
            lost = {rig: _lost(np.array(list(poses.values()))) for rig, poses in self.poses.items()}
            return [
                f"{rig}: bones' scales are up to {most:.2g} off in the file, where they change slowly; "
                "write it with Blender 4.4 or newer"
                for rig, most in lost.items()
                if most > _SMALL
            ]
        usd, skel, vt = pxr("Usd", "UsdSkel", "Vt")
        stage = usd.Stage.Open(str(path))
        for prim in [each for each in stage.Traverse() if each.IsA(skel.Skeleton)]:
            source = skel.BindingAPI(prim).GetAnimationSource()
            animation = skel.Animation(source) if source else None
            rig = self._rig_of(prim, animation) if animation else None
            if rig is not None:
                found = {
                    frame: skel.DecomposeTransforms(vt.Matrix4dArray.FromNumpy(poses.swapaxes(1, 2)))[2]
                    for frame, poses in self.poses[rig].items()
                }
                _write(animation.GetScalesAttr(), found)
        stage.GetRootLayer().Save()
        return []

    def _rig_of(self, prim: Any, animation: Any) -> str | None:
        """The only armature object that it may be of."""
        joints = [str(path).rpartition("/")[2] for path in animation.GetJointsAttr().Get() or ()]
        found = [
            rig
            for rig, names in self.names.items()
            if plain(rig) == plain(prim.GetName()) and list(map(plain, names)) == list(map(plain, joints))
        ]
        return found[0] if len(found) == 1 else None


def _write(attribute: Any, found: dict[float, Any]) -> None:
    """found: half floats [joints, 3] at each frame"""
    first = next(iter(found.values()), None)
    if any(each != first for each in found.values()):
        attribute.Clear()
        for frame, scale in found.items():
            attribute.Set(scale, frame)


def _lost(poses: np.ndarray) -> float:
    """How far the scales in a file are from those of poses [frames, bones, 4, 4], at most."""
    scales, most = np.linalg.norm(poses[:, :, :3, :3], axis=2), 0.0
    written = scales[0]
    for scale in scales:
        apart = float(np.abs(scale - written).max(initial=0.0))
        if apart < _LEFT_OUT:
            most = max(most, apart)
        else:
            written = scale
    return most


@contextmanager
def recorded() -> Iterator[Scales]:
    """Context in which an exporter goes through the frames."""
    scales = Scales()
    handlers = bpy.app.handlers.frame_change_post
    handlers.append(scales.take)
    try:
        yield scales
    finally:
        handlers.remove(scales.take)
