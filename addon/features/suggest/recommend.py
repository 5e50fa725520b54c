# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a character in the frames in which its joints bend most, or in a battery of poses."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import NamedTuple

import bpy
import numpy as np

from ...attach import properties
from ...base.errors import SinewError
from ...base.phrases import phrase
from ...base.steps import as_part, result_of
from ...deform import characters
from ...skinning.variants import Variant
from ...ui import stepped
from ..measure import battery, live
from ..measure.crossings import crossing_triangles
from ..measure.measured_on import MeasuredOn, armatures_of
from ..measure.rigs import posed, rigs_of
from ..measure.worst_frames import check_measurable, measure_at
from . import recommendation
from .recommendation import Choice

# The frames that Recommended takes by itself.
OVER = "ACTION"
# Frames of an action that are looked at, and most of them that are measured.
LOOKED_AT, MEASURED = 100, 12
# The share of the time that this takes.
LOOKING = 0.3
# A joint that bends less says nothing.
BENDS = np.radians(30.0)
# Crossings take longest, and only strong bends have some.
MOST_CROSSINGS = 6

# What was recommended last, and what was measured for it, by the session_uid of the scene.
choices: dict[int, Choice] = {}
bases: dict[int, MeasuredOn] = {}


def keep(scene: bpy.types.Scene, choice: Choice, basis: MeasuredOn) -> None:
    choices[scene.session_uid], bases[scene.session_uid] = choice, basis


def forget() -> None:
    choices.clear()
    bases.clear()


class Judged(NamedTuple):
    """A frame or a pose, with its crossings at rest; None where they are not counted."""

    name: str
    moment: live.Moment
    at_rest: set[tuple[int, int]] | None


def search(
    scene: bpy.types.Scene,
    objects: Sequence[bpy.types.Object],
    over: str = OVER,
    read: dict[float, live.Moment] | None = None,
) -> Generator[float, None, Choice]:
    """Yields the progress; returns the choice. Objects, actions and the scene's frame are as before.

    over  the frames, as for stepped.frames_over()
    read  gets the frames that were looked at

    Raises SinewError where an object cannot be measured.
    """
    check_measurable(objects)
    named = yield from _in_frames(scene, objects, over, {} if read is None else read)
    if not named:
        now = live.measure_now(objects, properties.BLENDER, "measure")
        named = _in_battery(live.Moment.of(now))
    moments = [_with_crossings(name, moment, k, len(named)) for k, (name, moment) in enumerate(named)]
    if not moments:
        return Choice(Variant.of("lbs"))

    def measure(variant: Variant, number: int) -> recommendation.Values:
        _name, moment, at_rest = moments[number]
        measured = moment.measured(variant.method, variant.stage_values)
        crossing = None
        if at_rest is not None and np.isfinite(measured.shape.points).all():
            crossing = _new_crossings(moment, measured.shape.points.T, at_rest)
        return recommendation.values_of(measured, crossing)

    names = [(each.name, np.sqrt(each.moment.pose.bent_areas)) for each in moments]
    diagonal = moments[0].moment.pose.rest.diagonal
    steps = recommendation.search(measure, names, diagonal)
    return (yield from as_part(steps, LOOKING, 1.0 - LOOKING))


def _new_crossings(moment: live.Moment, points: np.ndarray, at_rest: set[tuple[int, int]]) -> np.ndarray:
    """Returns the triangles that cross others, each as often as it does."""
    pairs = np.array(list(_crossings(moment, points) - at_rest), np.int64).reshape(-1, 2)
    return np.flatnonzero(moment.pose.bent_triangles)[pairs].ravel()


def _with_crossings(name: str, moment: live.Moment, number: int, count: int) -> Judged:
    step = max(1, -(-count // MOST_CROSSINGS))
    at_rest = _crossings(moment, moment.pose.rest.points.T) if number % step == 0 else None
    return Judged(name, moment, at_rest)


def _crossings(moment: live.Moment, points: np.ndarray) -> set[tuple[int, int]]:
    """Those of triangles that are bent, by their numbers among these."""
    return crossing_triangles(points, moment.subject.gauge.surface.triangles[moment.pose.bent_triangles])


def _in_battery(now: live.Moment) -> list[tuple[str, live.Moment]]:
    """Returns the poses of the battery, by their names. Several armatures are posed at the same time."""
    found = {rig.bones.names: rig.battery.poses() for rig in rigs_of(now)}
    longest = max(found.values(), key=len, default=[])
    return [
        (name, posed(now, {names: own[number] for names, own in found.items() if number < len(own)}))
        for number, (name, _rotations) in enumerate(longest)
    ]


def _in_frames(
    scene: bpy.types.Scene,
    objects: Sequence[bpy.types.Object],
    over: str,
    read: dict[float, live.Moment],
) -> Generator[float, None, list[tuple[str, live.Moment]]]:
    """Returns the frames in which joints bend most; none without an action, or where none bends by much.
    `read` gets all that were looked at."""
    armatures = armatures_of(objects)
    try:
        frames = stepped.frames_over(scene, armatures, over)
    except SinewError:
        return []
    places = np.linspace(0, len(frames) - 1, min(len(frames), LOOKED_AT)).round().astype(int)
    angles = []
    with stepped.kept_frame(scene, armatures):
        for place in places:
            moment = live.Moment.of(measure_at(scene, objects, properties.BLENDER, frames[place]))
            read[frames[place]] = moment
            angles.append(_angles(moment))
            yield LOOKING * len(angles) / len(places)
    of_bones = np.array(angles)
    chosen: list[int] = []
    for bone in np.argsort(-of_bones.max(axis=0)):
        frame = int(of_bones[:, bone].argmax())
        if of_bones[frame, bone] >= BENDS and frame not in chosen and len(chosen) < MEASURED:
            chosen.append(frame)
    taken = [frames[places[number]] for number in sorted(chosen)]
    return [(phrase("frame {frame}", frame=frame), read[frame]) for frame in taken]


def _angles(moment: live.Moment) -> np.ndarray:
    """float64: by how much bones that move vertices are bent, in all parts."""
    found = []
    for own in moment.inputs:
        deformer, frame = own.part.bound.first_deformer, own.frames[0]
        moving = np.isin(deformer.bones.names, deformer.moving_bones)
        angles = np.zeros(len(moving)) if frame is None else battery.bend_angles(deformer.bones, frame.pose)
        found.append(np.where(moving, angles, 0.0))
    return np.concatenate(found)


def choose(objects: Sequence[bpy.types.Object]) -> characters.Chosen:
    """See characters.choosers."""
    choice = result_of(search(bpy.context.scene, objects))
    return choice.variant.method, choice.values, choice.text
