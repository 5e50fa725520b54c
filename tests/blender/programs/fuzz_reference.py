# SPDX-License-Identifier: GPL-3.0-or-later
"""A rig's whole stack of Armature modifiers by the float64 reference, for methods that Blender lacks, and
the stages after it.

Sinew reads the same from Blender, poses and weights, for `lbs` and `dq`, whose oracle is Blender itself.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import sinew
from sinew_addon.skinning import skin_stack

sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
import bulge_limit_reference
import delta_mush_reference
import reference
import twist_spread_reference
import weld_reference
from sinew_addon.skinning.bulge_limit import segments
from sinew_addon.skinning.twist_spread import blend_of

METHODS = {method.name: method for method in sinew.methods()}
MARGIN = 1e-3
# Relative to the diagonal.
LEAST_STABLE = 2e-6
# Near 180 degrees from rest, the error of a rotation's logarithm in float32 is its rounding divided by the
# margin.
MARGINS = {"log": 0.03}


def deform(
    stack: skin_stack.SkinStack,
    rest_points: np.ndarray,
    frames: list[skin_stack.ModifierFrame | None],
    vertices: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """float64 [of `vertices`, 3], object space, and bool [of them]: those where rounding does not decide.

    frames    the input of the stack, with Blender 4's scale rule
    vertices  int [any number] the only ones that are deformed
    """
    points = rest_points.astype(np.float64)
    decided = np.ones(len(vertices), dtype=bool)
    # The starting point of a Multi Modifier: the input of the modifier before it.
    start_before = points
    for skin, frame in zip(stack.skins, frames, strict=True):
        start = start_before if skin.multi else points
        start_before = start
        if frame is None:
            continue
        deformed, is_decided = _by_one_modifier(skin.deformer, frame, start, vertices)
        share = np.ones(len(vertices)) if skin.mask is None else skin.mask[vertices].astype(np.float64)
        points = points.copy()
        points[vertices] += share[:, None] * (deformed - points[vertices])
        decided &= is_decided
    return points[vertices], decided


def stages_after(
    stack: skin_stack.SkinStack,
    points: np.ndarray,
    rest_points: np.ndarray,
    frames: list[skin_stack.ModifierFrame | None],
    values: Mapping[str, Mapping[str, Any]],
    rounding: np.ndarray | float = 0.0,
) -> np.ndarray:
    """float64 [vertices, 3], object space: the shape after the stages that follow the blend.

    points    [vertices, 3], the shape before them
    frames    as for deform()
    values    of the parameters of each enabled stage
    rounding  [vertices, 3], added to `points` and to what is smoothed, to find the effect of their rounding
    """
    after = stack.stages_after
    points = points.astype(np.float64) + rounding
    if "twist_spread" in values:
        mask = after.masks.get("twist_spread")
        points = _twisted(stack, points, rest_points, frames, mask, values["twist_spread"])
    if "bulge_limit" in values:
        mask = after.masks.get("bulge_limit")
        points = _limited(stack, points, rest_points, frames, mask, values["bulge_limit"])
    if "delta_mush" in values:
        options = dict(values["delta_mush"])
        weights = after.masks.get("delta_mush")
        if options.pop("invert_group") and weights is not None:
            weights = 1.0 - weights
        topology, own = after.mesh.topology, after.mesh.rest_points
        faces = np.split(topology.corner_vertices, topology.face_offsets[1:-1])
        faces = [face.tolist() for face in faces if len(face)]
        first = list(range(len(points)))
        if options.pop("weld") and own is not None:
            moved_by = [each.entries.influences() for each in after.mesh.weightings]
            rows = [weld_reference.rows_of(each.offsets, each.bones, each.weights) for each in moved_by]
            masks = [
                mask
                for mask in (after.masks.get("delta_mush"), *after.mesh.modifier_masks)
                if mask is not None
            ]
            first = weld_reference.standing_for(own, *rows, *masks)
        rest = rest_points if own is None else own

        def smooth(kept, start, faces, edges, weights):
            mesh = rest[kept], faces, edges
            error = rounding[kept] if np.ndim(rounding) else rounding
            return delta_mush_reference.delta_mush(start, mesh, weights=weights, rounding=error, **options)

        points = weld_reference.smoothed_by_places(smooth, first, points, faces, topology.edges, weights)
    return points


def _of_first_bones(
    stack: skin_stack.SkinStack,
    points: np.ndarray,
    rest_points: np.ndarray,
    frames: list[skin_stack.ModifierFrame | None],
    mask: np.ndarray | None,
    stage_of: Callable[..., np.ndarray],
) -> np.ndarray:
    """Uses the bones of the first participating modifier whose own mask contains all of a vertex.

    stage_of  takes the points, rest points and influences in armature space, the motions, the mask, the
              ModifierSkin and its frame
    """
    number = next((i for i, frame in enumerate(frames) if frame is not None), None)
    if number is None:
        return points
    skin, frame = stack.skins[number], frames[number]
    mask = np.ones(len(points)) if mask is None else mask
    if skin.mask is not None:
        mask = np.where(skin.mask >= 1.0, mask, 0.0)
    space, weighting = frame.bones_from_model, skin.deformer.weighting
    rest = _moved(space, rest_points.astype(np.float64))
    influences = weighting.influences_over_joints(rest)
    mesh = rest, influences.offsets, influences.bones, influences.weights
    motions = frame.pose.astype(np.float64) @ np.linalg.inv(weighting.bones.rest.astype(np.float64))
    result = stage_of(_moved(space, points), mesh, motions, mask, skin, frame)
    return _moved(np.linalg.inv(space), result)


def _limited(*given: Any) -> np.ndarray:
    *of_mesh, options = given

    def limited(points, mesh, motions, mask, skin, _frame):
        ends = segments(skin.deformer.bones)
        return bulge_limit_reference.limit(points, *mesh, *ends, motions, mask=mask, **options)

    return _of_first_bones(*of_mesh, limited)


def _twisted(*given: Any) -> np.ndarray:
    *of_mesh, options = given

    def twisted(points, mesh, motions, mask, skin, frame):
        bones, inputs = skin.deformer.bones, np.array(frame.twists, np.float32).reshape(-1, 9)
        twists = bones.twists
        return twist_spread_reference.spread(
            points,
            *mesh,
            *(twists.rows, twists.heads, twists.tails, bones.rest_axes, motions),
            parents=twists.parents,
            amount=options["amount"],
            amounts=inputs[:, 0],
            curves=inputs[:, 1],
            channels=inputs[:, 2:] if options["turns"] else None,
            blend=blend_of(frame.method),
            mix_blend=blend_of(frame.mix or frame.method),
            mask=mask,
            mix=skin.deformer.mix_weights if frame.mix else None,
        )[0]

    return _of_first_bones(*of_mesh, twisted)


def _by_one_modifier(
    deformer: skin_stack.SkinDeformer,
    frame: skin_stack.ModifierFrame,
    points: np.ndarray,
    vertices: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Points, and whether they are independent of rounding."""
    deformed, decided = _by_one_method(deformer, frame, frame.method, points, vertices)
    if not frame.mix or deformer.mix_weights is None:
        return deformed, decided
    second, is_decided = _by_one_method(deformer, frame, frame.mix, points, vertices)
    share = np.clip(deformer.mix_weights[vertices].astype(np.float64), 0.0, 1.0)
    mixed = deformed + share[:, None] * (second - deformed)
    return mixed, (decided | (share == 1.0)) & (is_decided | (share == 0.0))


def _by_one_method(
    deformer: skin_stack.SkinDeformer,
    frame: skin_stack.ModifierFrame,
    method: str,
    points: np.ndarray,
    vertices: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    space, back = frame.bones_from_model, np.linalg.inv(frame.bones_from_model)
    in_armature = _moved(space, points)
    influences = deformer.weighting.influences_over_joints(in_armature)
    spans = [slice(influences.offsets[v], influences.offsets[v + 1]) for v in vertices]
    kept = None if deformer.vertex_data is None else deformer.vertex_data.of(method, space)
    data: dict[str, np.ndarray] = {}
    if kept is not None and METHODS[method].rows_by_bone:
        data = {method: _moments(kept.astype(np.float64), vertices, space, influences, in_armature)}
    elif kept is not None:
        data = {method: _points_kept(space, kept[vertices].astype(np.float64))}

    def by(data: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        return reference.deform(
            method,
            in_armature[vertices],
            np.cumsum([0, *(span.stop - span.start for span in spans)]),
            np.concatenate([influences.bones[span] for span in spans]),
            np.concatenate([influences.weights[span] for span in spans]),
            frame.pose.astype(np.float64) @ np.linalg.inv(deformer.bones.rest.astype(np.float64)),
            deformer.bones.rest_axes.astype(np.float64),
            data,
            frame.parameters
            | {f"{method}.parents": deformer.bones.twists.parents, f"{method}.turns": frame.turns},
        )

    deformed, margins = by(data)
    decided = margins > MARGINS.get(method, MARGIN)
    if data and METHODS[method].rows_by_bone:
        decided &= _have_same_extents(kept.astype(np.float64), data[method], vertices)
        # Bones that move far apart amplify the rounding of a small neighbourhood's moments.
        rounded = {name: _with_other_rounding(rows) for name, rows in data.items()}
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        decided &= np.abs(by(rounded)[0] - deformed).max(axis=1) <= LEAST_STABLE * extent
    return _moved(back, deformed), decided


def _points_kept(space: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """The vertex data of a method: points one after the other, followed by numbers that are no points."""
    count = kept.shape[1] // 3
    points = kept[:, : 3 * count].reshape(len(kept), count, 3)
    return np.hstack([_moved(space, points).reshape(len(kept), -1), kept[:, 3 * count :]])


def _moments(
    rows: np.ndarray, vertices: np.ndarray, space: np.ndarray, influences: Any, points: np.ndarray
) -> np.ndarray:
    """[rows, 12]: index into `vertices`, bone, weight, first moment, and xx, yy, zz, yz, xz, xy of the
    second, in armature space. A vertex without rows is its own neighbourhood."""
    found = []
    for place, vertex in enumerate(vertices):
        own = rows[slice(*np.searchsorted(rows[:, 0], (vertex, vertex + 1)))]
        if not own[:, 2].sum() > 0.0:
            span = slice(influences.offsets[vertex], influences.offsets[vertex + 1])
            share = influences.weights[span] / influences.weights[span].sum()
            of_point = share[:, None] * np.array([1.0, *points[vertex], *np.zeros(6)])
            found.append(np.column_stack([np.full(len(share), place), influences.bones[span], of_point]))
            continue
        found.append(_moved_moments(space, np.column_stack([np.full(len(own), place), own[:, 1:]])))
    return np.concatenate(found)


def _have_same_extents(kept: np.ndarray, moved: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Whether a neighbourhood is a point, or does not exist, in object space, where the library decides
    it, and in armature space, where the distance from the origin matters."""

    def is_point(rows: np.ndarray, number: int) -> bool:
        return not reference.methods.has_extent(reference.kept_of("ddm", rows, number) or ())

    return np.array([is_point(kept, v) == is_point(moved, place) for place, v in enumerate(vertices)])


def _moved_moments(space: np.ndarray, rows: np.ndarray) -> np.ndarray:
    linear, (i, j) = space[:3, :3], ([0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1])
    second = np.empty((len(rows), 3, 3))
    second[:, i, j] = second[:, j, i] = rows[:, 6:]
    first = rows[:, 3:6] @ linear.T + rows[:, 2:3] * space[:3, 3]
    return np.column_stack([rows[:, :3], first, (linear @ second @ linear.T)[:, i, j]])


def _with_other_rounding(rows: np.ndarray) -> np.ndarray:
    """First moments with another possible rounding to float32."""
    rows = rows.copy()
    steps = np.random.default_rng(len(rows)).uniform(-1.0, 1.0, (len(rows), 3))
    rows[:, 3:6] += steps * np.finfo(np.float32).eps * np.abs(rows[:, 3:6]).max(initial=0.0)
    return rows


def _moved(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ transform[:3, :3].T + transform[:3, 3]
