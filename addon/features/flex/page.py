# SPDX-License-Identifier: GPL-3.0-or-later
"""The poses of the battery as a page that turns, with what was found in them."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

import bpy

from ...base.errors import SinewError
from ..pages import viewer
from ..pages.viewer_page import METHODS, Found
from . import flex
from .report import headline
from .verdict import Finding, Joint


def page(
    scene: bpy.types.Scene,
    title: str,
    objects: Sequence[bpy.types.Object],
    result: flex.Result,
    left_out: Sequence[str] = (),
) -> Generator[float, None, str]:
    """Yields the progress, returns the text of the page; nothing is changed.

    objects  those that were bent

    Raises SinewError where no mesh can be shown, and where a bone is gone.
    """
    methods = list(dict.fromkeys([*result.own.values(), *(result.methods or METHODS)]))
    poses, numbers = [viewer.Pose(viewer.AT_REST)], {}
    for (armature, joint, name), rotations in result.poses.items():
        rig = scene.objects.get(armature)
        if rig is None or rig.type != "ARMATURE" or not {joint, *rotations} <= set(rig.data.bones.keys()):
            raise SinewError(f"{armature} has other bones than those that were bent; press Flex again")
        # Joints that are bent at once have one pose.
        if poses[-1].rotations is not rotations:
            label = name if len(rotations) > 1 else f"{joint}: {name}"
            poses.append(viewer.Pose(label, armature, rotations))
        numbers[armature, joint, name] = len(poses) - 1
    joints = {id(finding): joint for joint in result.verdict.joints for finding in joint.findings}
    findings = []
    for own, others in result.verdict.by_cause():
        for finding in (own, *others):
            joint = joints[id(finding)]
            pose = numbers.get((joint.armature, joint.name, finding.pose), 0)
            findings.append(_entry(scene, joint, finding, pose))
    found = Found(headline(result.verdict.to_dict()), findings)
    attached = viewer.attached_to(scene, objects)
    of_each: dict[bpy.types.Object, Sequence[bpy.types.Object]] = dict.fromkeys(objects, ())
    return viewer.page(scene, title, of_each, attached, methods, poses, left_out, found)


def _entry(scene: bpy.types.Scene, joint: Joint, finding: Finding, frame: int) -> dict[str, Any]:
    armature, limit = scene.objects[joint.armature], finding.limit
    has_value = limit.name != "inert"
    return {
        "joint": joint.name,
        "measure": limit.label,
        "value": limit.number(finding.value) if has_value else "",
        "limit": limit.bound if has_value else "",
        "frame": frame,
        "mesh": finding.mesh,
        "vertex": finding.vertex,
        "size": max(armature.matrix_world.to_scale()) * armature.data.bones[joint.name].length,
        "meaning": limit.meaning,
        "advice": finding.advice,
        "mends": finding.mends,
    }
