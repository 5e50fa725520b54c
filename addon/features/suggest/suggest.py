# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through frames, and measures the shapes that each method would give."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import bpy
import numpy as np
import sinew

from ...attach import properties
from ...base.steps import as_part
from ...ui import stepped
from ..measure import live
from ..measure.crossings import crossings, frames_to_count
from ..measure.measured_on import CHOICE, STAGES, MeasuredOn, armatures_of
from ..measure.metrics import Measured
from ..measure.suggestion import LONGEST, MEASURED, Suggestion
from ..measure.worst_frames import check_measurable, measure_at
from . import recommend
from .recommendation import Choice

RECOMMENDED = "recommended"
"""In Suggestion.methods: the recommended method with its stages, where it has any."""
# The share of the time that the choice takes.
CHOOSING = 0.5
# Intersections take longest, and are most where most of the surface is bent: they are counted in so many
# frames.
COUNTED = 6
# How far apart methods may take a vertex of one bone, as a part of the diagonal: rounding.
MOVED_ALIKE = 1e-5


class Known(NamedTuple):
    """
    choice  what was recommended then: the row RECOMMENDED
    basis   what was measured
    """

    suggestion: Suggestion
    choice: Choice
    basis: MeasuredOn


# By the session_uid of the scene. Computed again when needed, so not stored in the file.
suggestions: dict[int, Known] = {}


def scan(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], over: str) -> Iterator[float]:
    """Yields the progress; then suggestions[scene.session_uid] has the result, and recommend.choices has what
    is recommended. The objects' own methods do not change.

    Raises SinewError where an object cannot be measured.
    """
    armatures = armatures_of(objects)
    frames = stepped.frames_over(scene, armatures, over)
    check_measurable(objects)
    of_choice, basis = (MeasuredOn.of(scene, objects, depth, over) for depth in (CHOICE, STAGES))
    read: dict[float, live.Moment] = {}
    choice = yield from as_part(recommend.search(scene, objects, over, read), 0.0, CHOOSING)
    # The panel shows it while the rest is measured.
    recommend.keep(scene, choice, of_choice)
    drop_old(scene, objects)
    yield CHOOSING
    counted = set(sorted(read, key=lambda frame: -read[frame].pose.bent_areas.sum())[:COUNTED])
    counted = counted or frames_to_count(frames)
    labels = {method.name: method.label for method in sinew.methods()}
    suggestion = Suggestion(
        labels | ({RECOMMENDED: "Recommended"} if choice.variant.stages else {}), frames, 0.0
    )
    rest, at_rest = None, set()
    with stepped.kept_frame(scene, armatures):
        for count, frame in enumerate(frames):
            # None stays longer than it is needed: it keeps what is measured of it.
            moment = read.pop(frame, None) or live.Moment.of(
                measure_at(scene, objects, properties.BLENDER, frame)
            )
            # Shape keys change it, and nothing else.
            if frame in counted and (rest is None or not np.array_equal(rest, moment.pose.rest.points)):
                rest, at_rest = moment.pose.rest.points, crossings(moment.pose.rest)
            suggestion.diagonal = moment.pose.rest.diagonal
            first = None
            for number, method in enumerate(suggestion.methods, start=1):
                measured = _measured(method, moment, choice)
                first = first or measured
                _add(suggestion, method, frame, measured, choice)
                if frame in counted:
                    new = len(crossings(measured.shape, _moved_alike(moment, first, measured)) - at_rest)
                    suggestion.add(method, "crossings", new, frame)
                done = count + number / len(suggestion.methods)
                yield CHOOSING + (1.0 - CHOOSING) * done / len(frames)
    suggestions[scene.session_uid] = Known(suggestion, choice, basis)


def drop_old(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object]) -> None:
    """Forgets a result that what was recommended since does not belong to."""
    known = suggestions.get(scene.session_uid)
    choice = recommend.choices.get(scene.session_uid)
    if known is not None and (known.choice != choice or known.basis.changes(scene, objects)):
        del suggestions[scene.session_uid]


def forget() -> None:
    suggestions.clear()
    recommend.forget()


def _measured(method: str, moment: live.Moment, choice: Choice) -> Measured:
    """method: or RECOMMENDED"""
    if method == RECOMMENDED:
        return moment.measured(choice.variant.method, choice.variant.stage_values)
    return moment.measured(method)


def _moved_alike(moment: live.Moment, first: Measured, measured: Measured) -> np.ndarray | None:
    """Triangles that a bone moves as a whole, as groups of crossings(): they cross as they do at rest. None
    where stages or neighbours move vertices otherwise.

    first  the shape of the linear blend
    """
    if any(own.stages or len(own.frames) > 1 for own in moment.inputs):
        return None
    bones, surface = moment.pose.skin.sole_bones, measured.shape.surface
    vertices = np.unique(surface.triangles[bones >= 0])
    apart = (measured.shape.points - first.shape.points)[:, vertices]
    is_alike = np.abs(apart).max(initial=0.0) <= MOVED_ALIKE * moment.pose.rest.diagonal
    return bones if is_alike else None


def _add(suggestion: Suggestion, method: str, frame: float, measured: Measured, choice: Choice) -> None:
    is_spread = method == RECOMMENDED and "twist_spread" in choice.variant.stages
    for name, entry in MEASURED.items():
        # A spread twist is not where the bones are that flips are measured against.
        if name != "flips" or not is_spread:
            suggestion.add(method, name, measured.entry(entry), frame)
    if not np.isfinite(measured.shape.points).all():
        suggestion.add(method, LONGEST, np.inf, frame)
