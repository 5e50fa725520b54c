# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through frames, and measures the shapes that each method would give."""

from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ...attach import properties
from ...core.metrics import Measured, Shape
from ...core.suggestion import LONGEST, MEASURED, Suggestion
from ...ui import stepped
from ..heat import live
from ..heat.worst_frames import armatures_of, check_measurable, measure_at


def crossing_triangles(points: np.ndarray, triangles: np.ndarray) -> set[tuple[int, int]]:
    """Returns pairs of triangles that cross and share no vertex, the lower index first.

    points     [vertices, 3]
    triangles  int [triangles, 3]
    """
    tree = BVHTree.FromPolygons(points.tolist(), triangles.tolist(), all_triangles=True)
    pairs = np.array(tree.overlap(tree), dtype=np.int64).reshape(-1, 2)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    apart = ~(first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    return set(map(tuple, pairs[apart].tolist()))


# Counting crossings takes longer than everything else together, so it is done only at this many frames,
# evenly distributed.
CROSSING_FRAMES = 8

# By the session_uid of the scene. Computed again when needed, so not stored in the file.
suggestions: dict[int, Suggestion] = {}


def scan(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], over: str) -> Iterator[float]:
    """Yields the progress; then suggestions[scene.session_uid] has the result. The objects' own methods do
    not change.

    Raises SinewError where an object cannot be measured.
    """
    check_measurable(objects)
    armatures = armatures_of(objects)
    frames = stepped.frames_over(scene, armatures, over)
    places = np.linspace(0, len(frames) - 1, min(len(frames), CROSSING_FRAMES)).round().astype(int)
    counted = {frames[place] for place in places}
    labels = {name: method.label for name, method in properties.METHODS.items()}
    suggestion = Suggestion(labels, frames, 0.0)
    done, of_all = 0, len(frames) * len(labels)
    with stepped.kept_frame(scene, armatures):
        for frame in frames:
            subject, depsgraph = measure_at(scene, objects, properties.BLENDER, frame)
            at_rest = _crossings(subject.gauge.rest) if frame in counted else None
            suggestion.diagonal = subject.measured.rest.diagonal
            for method in labels:
                measured = live.measured_under(subject, method, depsgraph)
                _add(suggestion, method, frame, measured)
                if at_rest is not None:
                    new = len(_crossings(measured.shape) - at_rest)
                    suggestion.add(method, "crossings", new, frame)
                done += 1
                yield done / of_all
    suggestions[scene.session_uid] = suggestion


def _add(suggestion: Suggestion, method: str, frame: float, measured: Measured) -> None:
    for name, entry in MEASURED.items():
        suggestion.add(method, name, measured.entry(entry), frame)
    if not np.isfinite(measured.shape.points).all():
        suggestion.add(method, LONGEST, np.inf, frame)


def _crossings(shape: Shape) -> set[tuple[int, int]]:
    return crossing_triangles(shape.points.T, shape.surface.triangles)
