# SPDX-License-Identifier: GPL-3.0-or-later
"""The range of motion as a page that turns, with the contact sheet beside it."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from pathlib import Path

import bpy

from ...base.scratch import scratch_folder
from ...base.steps import as_part
from ...io import armature_io
from ...skinning.variants import Variant
from ..measure import battery, motion_range
from ..measure.rigs import Rig
from . import contact_sheet, sheet_picture, viewer
from .contact_sheet import Bent
from .pictures import write_picture
from .sheet import Sheet
from .sheet_layout import Layout
from .viewer_page import PageSheet, Place

# The share of the time that drawing the sheet takes.
DRAWING = 0.7
# About so many pixels has a picture in the page.
IN_PAGE = 120


def page(
    scene: bpy.types.Scene,
    sheet: Sheet,
    joints: Sequence[Bent],
    rows: Mapping[str, Mapping[bpy.types.Object, Variant]],
    size: int,
    left_out: Sequence[str] = (),
) -> Generator[float, None, str]:
    """Yields the progress, returns the text of the page; draws what the sheet lacks.

    rows  by keys of variants, what each is for the meshes
    size  pixels of its pictures, as they are drawn

    Raises SinewError where no mesh can be shown.
    """
    count = len(rows) * len(joints)
    if len(sheet.cells) < count:
        for number, cell in enumerate(contact_sheet.cells(joints, list(rows.values()), size)):
            sheet.add(cell)
            yield DRAWING * (number + 1) / count
    poses, places = _poses(joints)
    layout = Layout(len(rows), len(joints), _size_in_page(size))
    of_page = PageSheet(
        _picture(sheet, layout.size, contact_sheet.ticks(scene, sheet.scale)),
        layout,
        list(rows),
        places,
        [f"{joint.joint}: {joint.pose.name}" for joint in joints],
    )
    meshes = [own.part.obj for own in joints[0].moment.inputs]
    steps = viewer.page(
        scene,
        sheet.title,
        dict.fromkeys(meshes, ()),
        viewer.attached_to(scene, meshes),
        list(rows),
        poses,
        left_out,
        variants=rows,
        beside=of_page,
    )
    return (yield from as_part(steps, DRAWING, 1.0 - DRAWING))


def _size_in_page(size: int) -> int:
    """Pixels of pictures in a page, where the whole sheet is seen at once and its letters are to be read."""
    each = max(round(size / IN_PAGE), 1)
    while size % each:
        each -= 1
    return size // each


def _picture(sheet: Sheet, size: int, ticks: Sequence[str]) -> bytes:
    """Returns a WebP."""
    with scratch_folder() as folder:
        path = Path(folder, "sheet.webp")
        write_picture(path, sheet_picture.compose(sheet, size, ticks))
        return path.read_bytes()


def _poses(joints: Sequence[Bent]) -> tuple[list[viewer.Pose], list[Place]]:
    """Returns the character at rest, its range of motion and what the sheet has else; and where each joint of
    the sheet is in it."""
    poses, places = [viewer.Pose(viewer.AT_REST)], []
    for rig in joints[0].rigs:
        limits = armature_io.read_limits(rig.armature)
        own = motion_range.poses(rig.bones, limits, rig.is_moving)
        poses += [_of_page(rig, pose, pose.name) for pose in own]
    for joint in joints:
        name = joint.pose.name
        # Those of a figure bend both sides.
        if name not in motion_range.COLUMNS:
            name = f"{joint.joint}: {name}"
        known = [(pose.name, pose.armature) for pose in poses]
        if (name, joint.rig.armature.name) not in known:
            poses.append(_of_page(joint.rig, joint.pose, name))
            known.append((name, joint.rig.armature.name))
        places.append(Place(known.index((name, joint.rig.armature.name)), joint.view))
    return poses, places


def _of_page(rig: Rig, pose: battery.Pose, name: str) -> viewer.Pose:
    rotations = {rig.bones.names[bone]: rotation for bone, rotation in pose.rotations.items()}
    return viewer.Pose(name, rig.armature.name, rotations)
