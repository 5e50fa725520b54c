# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through frames, and measures the shapes that each method would give."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import bpy
import numpy as np
import sinew
from mathutils.bvhtree import BVHTree

from ...attach import properties, stage_settings
from ...core import recommendation
from ...core.metrics import Measured, Shape
from ...core.phrases import phrase
from ...core.suggestion import LONGEST, MEASURED, Suggestion
from ...ui import stepped
from ..heat import live
from ..heat.worst_frames import armatures_of, check_measurable, measure_at
from . import worst_pictures


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


def frames_to_count(frames: Sequence[float]) -> set[float]:
    """Returns those of the frames at which crossings are counted."""
    places = np.linspace(0, len(frames) - 1, min(len(frames), CROSSING_FRAMES)).round().astype(int)
    return {frames[place] for place in places}


def crossings(shape: Shape) -> set[tuple[int, int]]:
    return crossing_triangles(shape.points.T, shape.surface.triangles)


def scan(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], over: str) -> Iterator[float]:
    """Yields the progress; then suggestions[scene.session_uid] has the result. The objects' own methods do
    not change.

    Raises SinewError where an object cannot be measured.
    """
    check_measurable(objects)
    armatures = armatures_of(objects)
    frames = stepped.frames_over(scene, armatures, over)
    counted = frames_to_count(frames)
    labels = {method.name: method.label for method in sinew.methods()}
    suggestion = Suggestion(labels.copy(), frames, 0.0)
    off = [each for each in recommendation.STAGES if not any(_is_on(obj, each.name) for obj in objects)]
    moments: list[Moment] = []
    # The recommended method is measured once more, where stages start from.
    done, of_all = 0, len(frames) * (len(labels) + 1 + len(off))
    with stepped.kept_frame(scene, armatures):
        for frame in frames:
            subject, depsgraph = measure_at(scene, objects, properties.BLENDER, frame)
            at_rest = crossings(subject.gauge.rest) if frame in counted else None
            suggestion.diagonal = subject.measured.rest.diagonal
            moments.append(Moment(frame, live.Moment.of(subject, depsgraph), at_rest))
            for method in labels:
                measured = live.measured_under(subject, method, depsgraph)
                _add(suggestion, method, frame, measured)
                if at_rest is not None:
                    new = len(crossings(measured.shape) - at_rest)
                    suggestion.add(method, "crossings", new, frame)
                done += 1
                yield done / of_all
    for _step in _add_stages(suggestion, off, moments):
        done += 1
        yield done / of_all
    worst_pictures.begin(scene)
    for name in suggestion.methods if worst_pictures.are_drawn() else ():
        worst_pictures.add(scene, name, _at_worst(suggestion, name, moments))
        yield 1.0
    suggestions[scene.session_uid] = suggestion


class Moment(NamedTuple):
    """A frame, with its crossings at rest; None where they are not counted."""

    frame: float
    moment: live.Moment
    at_rest: set[tuple[int, int]] | None


def _at_worst(suggestion: Suggestion, name: str, moments: Sequence[Moment]) -> Measured:
    """Measures a method, or the recommended one with a stage, in the frame of its longest edge."""
    frame = suggestion.worst[name, LONGEST].frame
    moment = next(each.moment for each in moments if each.frame == frame)
    if name in properties.METHODS:
        return moment.measured(name)
    return moment.measured(suggestion.recommended, more={name: recommendation.values_on(name)})


def _is_on(obj: bpy.types.Object, stage: str) -> bool:
    return stage_settings.is_on(properties.of(obj), stage)


def _add_stages(
    suggestion: Suggestion, stages: Sequence[recommendation.Candidate], moments: Sequence[Moment]
) -> Iterator[None]:
    """Adds the recommended method with each of the stages, and which of them help."""
    method = suggestion.recommended
    if not method:
        return
    suggestion.add_stages({each.name: stage_settings.STAGES[each.name].label for each in stages})
    weights = [np.sqrt(each.moment.pose.bent_areas) for each in moments]
    before = []
    for each in moments:
        before.append(recommendation.values_of(each.moment.measured(method), None))
        yield
    for stage in stages:
        more, gains = {stage.name: recommendation.values_on(stage.name)}, []
        for (frame, moment, at_rest), known, own in zip(moments, before, weights, strict=True):
            measured = moment.measured(method, more=more)
            _add(suggestion, stage.name, frame, measured)
            if at_rest is not None:
                new = len(crossings(measured.shape) - at_rest)
                suggestion.add(stage.name, "crossings", new, frame)
            values = recommendation.values_of(measured, None)
            gains.append(recommendation.gain(known, values, suggestion.diagonal, own))
            yield
        if recommendation.is_kept(stage, gains):
            suggestion.helping[stage.name] = phrase(stage.why)


def _add(suggestion: Suggestion, method: str, frame: float, measured: Measured) -> None:
    for name, entry in MEASURED.items():
        # A spread twist is not where the bones are that flips are measured against.
        if (method, name) != ("twist_spread", "flips"):
            suggestion.add(method, name, measured.entry(entry), frame)
    if not np.isfinite(measured.shape.points).all():
        suggestion.add(method, LONGEST, np.inf, frame)
