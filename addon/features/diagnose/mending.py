# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons that mend a finding, on exactly its vertices."""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from ...base.errors import SinewError
from ...io import mesh_io
from ...ui.translations import counted, tr
from ..measure.diagnostics import Finding
from . import diagnose
from .mend import Rows, WeightMender

# How far a vertex may be from the mirrored position, as a share of the mesh's diagonal.
MIRROR_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Mend:
    """A button: its name, and what it does in one sentence."""

    name: str
    label: str
    description: str


LIMIT = Mend(
    "limit", "Limit Total", "Keep the largest weights of these vertices, and scale them to a sum of 1"
)
NORMALIZE = Mend("normalize", "Normalize", "Scale the weights of these vertices to a sum of 1")
SMOOTH = Mend("smooth", "Smooth", "Bring the weights of these vertices closer to those of their neighbours")
FILL = Mend(
    "fill", "From Neighbours", "Give these vertices the weights of those around them, from the border in"
)
MIRROR = Mend(
    "mirror",
    "From Other Side",
    "Give these vertices the weights of those at the mirrored place (X), in the groups of the other side",
)
UNBIND = Mend(
    "unbind",
    "Remove Influence",
    "Take the bone off these vertices, and scale their other weights to a sum of 1; those that had no other "
    "get the weights of those around them",
)
REMOVE = Mend("remove", "Remove Groups", "Delete these vertex groups; those that are locked stay")
ALL = {mend.name: mend for mend in (LIMIT, NORMALIZE, SMOOTH, FILL, MIRROR, UNBIND, REMOVE)}

_STRAY = (UNBIND, MIRROR, SMOOTH)
# By the finding's name.
MENDS = {
    "bleed": _STRAY,
    "astray": _STRAY,
    "other_side": _STRAY,
    "unweighted": (FILL, MIRROR),
    "stretch": (SMOOTH,),
    "flips": (SMOOTH,),
    "no_weights": (FILL, MIRROR),
    "small_sums": (NORMALIZE, FILL, MIRROR),
    "many_influences": (LIMIT,),
    "boneless_groups": (REMOVE,),
    "order_of_groups": (SMOOTH,),
    "near_half_turn": (SMOOTH,),
    "jumps": (SMOOTH,),
}


def draw(layout: bpy.types.UILayout, obj: bpy.types.Object, name: str, key: str) -> None:
    """Draws the buttons of a finding."""
    mends = MENDS.get(name, ())
    # Three side by side would be too narrow to read.
    grid = layout.grid_flow(row_major=True, columns=min(len(mends), 2), even_columns=True, align=True)
    for each in mends:
        button = grid.operator("sinew.mend", text=each.label)
        button.object, button.finding, button.how = obj.name, key, each.name


def mend(obj: bpy.types.Object, finding: str, how: str, most_influences: int) -> str:
    """Changes weights or groups. Returns what was done, in words.

    Raises SinewError, and changes nothing, where nothing can be done.
    """
    check, found = diagnose.finding_of(obj, finding)
    if check.stale:
        raise SinewError(f"{obj.name}: its weights, groups or bones have changed since; press Check again")
    if how not in {each.name for each in MENDS.get(found.name, ())}:
        raise SinewError(f"{obj.name}: {how!r} does not mend {found.title.lower()}")
    if how == REMOVE.name:
        return _remove(obj, found)
    rows = _rows(obj, check, found, how, most_influences)
    if not rows:
        raise SinewError(f"{obj.name}: {_NOTHING[how]}")
    mesh_io.write_group_weights(obj, rows)
    left = len(found.vertices) - len(rows)
    done = counted(len(rows), "{count} vertex", "{count} vertices")
    return tr("{done}; {count} could not be", done=done, count=f"{left:,}") if left else done


_NOTHING = {
    LIMIT.name: "no weights to limit",
    NORMALIZE.name: "no weights to scale; their groups may be locked",
    SMOOTH.name: "no weights to smooth",
    FILL.name: "no vertex with weights is connected to these",
    UNBIND.name: "the group of the bone is locked, or gone",
    MIRROR.name: "no vertex with weights is at the mirrored place of these",
}


def _remove(obj: bpy.types.Object, found: Finding) -> str:
    groups = [obj.vertex_groups[name] for name in found.groups if name in obj.vertex_groups]
    groups = [group for group in groups if not group.lock_weight]
    if not groups:
        raise SinewError(f"{obj.name}: these groups are locked")
    for group in groups:
        obj.vertex_groups.remove(group)
    return counted(len(groups), "{count} group", "{count} groups")


def _rows(
    obj: bpy.types.Object, check: diagnose.Check, found: Finding, how: str, most_influences: int
) -> Rows:
    if obj.mode == "EDIT":
        # The check has read the edited mesh, too.
        obj.update_from_editmode()
    mirror_of = _mirrored_groups(obj, check) if how == MIRROR.name else []
    is_bone = check.bones.of_groups([group.name for group in obj.vertex_groups]) >= 0
    is_locked = np.array([group.lock_weight for group in obj.vertex_groups], dtype=bool)
    mender, vertices = WeightMender(check.weights, is_bone, is_locked), found.vertices.tolist()
    if how == MIRROR.name:
        return mender.mirrored(_mirror_pairs(obj, vertices), mirror_of)
    if how == LIMIT.name:
        return mender.limited(vertices, most_influences)
    if how == NORMALIZE.name:
        return mender.normalized(vertices)
    if how == UNBIND.name:
        group = obj.vertex_groups.get(found.bone)
        number = group.index if group is not None and not group.lock_weight else -1
        return mender.without(vertices, number, mesh_io.read_topology(obj.data).edges, most_influences)
    work = mender.smoothed if how == SMOOTH.name else mender.filled
    return work(vertices, mesh_io.read_topology(obj.data).edges, most_influences)


def _mirrored_groups(obj: bpy.types.Object, check: diagnose.Check) -> list[int]:
    """[groups that were checked]: the group of the other side, made if its bone has none yet; otherwise the
    group itself."""
    bones = {name for name, deforms in zip(check.bones.names, check.bones.deform, strict=True) if deforms}
    found = []
    for number, name in enumerate(check.groups):
        other = bpy.utils.flip_name(name)
        if other not in obj.vertex_groups and other in bones and name in bones:
            obj.vertex_groups.new(name=other)
        group = obj.vertex_groups.get(other)
        found.append(number if group is None else group.index)
    return found


def _mirror_pairs(obj: bpy.types.Object, vertices: Sequence[int]) -> dict[int, int]:
    """Returns the vertex at the mirrored position, for each vertex that has one; not itself, and no other
    vertex that is mended."""
    points, mended = mesh_io.read_points(obj.data), set(vertices)
    tolerance = MIRROR_TOLERANCE * float(np.linalg.norm(np.ptp(points, axis=0)))
    others = [index for index in range(len(points)) if index not in mended]
    tree = KDTree(len(others))
    for index in others:
        tree.insert(points[index], index)
    tree.balance()
    nearest = {v: tree.find((-points[v][0], points[v][1], points[v][2])) for v in vertices}
    return {v: index for v, (_place, index, far) in nearest.items() if index is not None and far <= tolerance}
