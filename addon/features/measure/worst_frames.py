# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through frames to find those where a measure is worst, and the range of all its values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy

from ...attach import properties
from ...base.errors import SinewError
from ...deform import characters
from ...ui import stepped
from . import live
from .comparison import LENGTHS, ROUNDING, peaks
from .heat_scale import HeatScale
from .measured_on import OWN, MeasuredOn, armatures_of
from .metrics import METRICS, Metric

SHOWN = 5


@dataclass(frozen=True)
class Scan:
    """The result of going through frames.

    frames   each with its badness, by the entry `metric.worst` of a summary
    scale    a range that covers all of them
    methods  the objects' methods
    basis    what was measured
    """

    metric: Metric
    frames: list[tuple[float, float]]
    scale: HeatScale
    methods: tuple[str, ...]
    diagonal: float
    basis: MeasuredOn

    def worst(self, count: int = SHOWN) -> list[tuple[float, float]]:
        """Returns at most `count` frames and values, the worst first, without rounding errors."""
        least = ROUNDING * (self.diagonal if self.metric.worst in LENGTHS else 1.0)
        chosen = peaks([value for _frame, value in self.frames], count)
        return [self.frames[place] for place in chosen if self.frames[place][1] > least]


# By the session_uid of the scene. Quickly computed again, so not stored in the file.
scans: dict[int, Scan] = {}


def check_measurable(objects: Sequence[bpy.types.Object]) -> None:
    """Raises SinewError for an object that Sinew does not deform now."""
    for obj in objects:
        if not properties.of(obj).enabled or obj.mode == "EDIT":
            raise SinewError(
                f"{obj.name} is switched off or in edit mode: switch Sinew on in object mode first"
            )


def measure_at(
    scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], other: str, frame: float
) -> live.Subject:
    """Goes to the frame and measures there. Raises SinewError where there is nothing to measure."""
    characters.set_frame(scene, frame)
    return live.measure_now(objects, other, f"measure at frame {frame}")


def scan(
    scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], quantity: str, other: str, over: str
) -> Iterator[float]:
    """Yields the progress; then scans[scene.session_uid] has the result.

    Raises SinewError where an object cannot be measured.
    """
    if quantity not in METRICS:
        raise SinewError("The errors of a bake are those over all of its frames: choose another measure")
    check_measurable(objects)
    armatures, metric, found = armatures_of(objects), METRICS[quantity], []
    extremes: list[float] = []
    basis = MeasuredOn.of(scene, objects, OWN, over)
    frames = stepped.frames_over(scene, armatures, over)
    with stepped.kept_frame(scene, armatures):
        for number, frame in enumerate(frames):
            measured = measure_at(scene, objects, other, frame).measured
            values = measured.field(quantity)
            if len(values):
                extremes += [float(values.min()), float(values.max())]
            found.append((frame, measured.entry(metric.worst)))
            yield (number + 1) / len(frames)
    diagonal = measured.rest.diagonal
    methods = tuple(dict.fromkeys(properties.of(obj).method for obj in objects))
    scale = HeatScale.over_values(metric, min(extremes, default=0.0), max(extremes, default=0.0), diagonal)
    scans[scene.session_uid] = Scan(metric, found, scale, methods, diagonal, basis)
