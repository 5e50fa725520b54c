# SPDX-License-Identifier: GPL-3.0-or-later
"""A rig's whole stack of Armature modifiers by the float64 reference, for methods that Blender lacks.

What Sinew reads of Blender, poses and weights, is what `lbs` and `dq` have, whose oracle is Blender itself.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from sinew_addon.core import session as core_session

sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
import reference

MARGIN = 1e-3
# Near half a turn from rest, the logarithm of a rotation in float32 errs by its rounding divided by the
# margin.
MARGINS = {"log": 0.03}


def deform(
    stack: core_session.SkinStack,
    rest_points: np.ndarray,
    frames: list[core_session.SkinStageFrame | None],
    vertices: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """float64 [of `vertices`, 3], object space, and bool [of them] those where rounding does not decide.

    frames    as the stack takes them, of scale rule Blender 4 and without mix
    vertices  int [any number] the only ones that are deformed
    """
    points = rest_points.astype(np.float64)
    decided = np.ones(len(vertices), dtype=bool)
    # What a Multi Modifier starts from: the input of the modifier before it.
    start_before = points
    for stage, frame in zip(stack.skin_stages, frames, strict=True):
        start = start_before if stage.multi else points
        start_before = start
        if frame is None:
            continue
        deformed, margins = _by_one_modifier(stage.binding, frame, start, vertices)
        share = np.ones(len(vertices)) if stage.mask is None else stage.mask[vertices].astype(np.float64)
        points = points.copy()
        points[vertices] += share[:, None] * (deformed - points[vertices])
        decided &= margins > MARGINS.get(frame.method, MARGIN)
    return points[vertices], decided


def _by_one_modifier(
    binding: core_session.Binding,
    frame: core_session.SkinStageFrame,
    points: np.ndarray,
    vertices: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    space, back = frame.bones_from_model, np.linalg.inv(frame.bones_from_model)
    in_armature = _moved(space, points)
    influences = binding.weighting.influences_over_joints(in_armature)
    spans = [slice(influences.offsets[v], influences.offsets[v + 1]) for v in vertices]
    data = {}
    if binding.vertex_data is not None:
        kept = binding.vertex_data.of(frame.method, space)
        # cor's are points.
        data = {} if kept is None else {frame.method: _moved(space, kept.astype(np.float64))[vertices]}
    deformed, margins = reference.deform(
        frame.method,
        in_armature[vertices],
        np.cumsum([0, *(span.stop - span.start for span in spans)]),
        np.concatenate([influences.bones[span] for span in spans]),
        np.concatenate([influences.weights[span] for span in spans]),
        frame.pose.astype(np.float64) @ np.linalg.inv(binding.bones.rest.astype(np.float64)),
        binding.bones.rest_axes.astype(np.float64),
        data,
    )
    return _moved(back, deformed), margins


def _moved(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ transform[:3, :3].T + transform[:3, 3]
