# SPDX-License-Identifier: GPL-3.0-or-later
"""A page with a character that turns: one HTML file in which the browser skins and draws it by the shaders
for engines (web/).

Its arrays are zlib-compressed, in base64, at the offsets that the header says: docs/viewer.md.
"""

import base64
import json
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import sinew

from ...base.errors import SinewError
from ...skinning.influences import Influences
from ...skinning.twist_spread import NOT_TOLD, TwistInputs, blend_of
from ...skinning.twists import Twists
from ...skinning.vectors import rotations_of, transformed
from ..measure.heat_scale import HeatScale
from ..measure.metrics import METRICS
from .bone_buffer import (
    add_segments,
    add_turns,
    add_twists,
    along_chain,
    of_motions,
    quaternions,
    twist_angles,
)
from .page import legend_texts
from .sheet_layout import Box, Layout
from .views import View

# Steps of recorded offsets, as a part of the diagonal at rest; more where 16 bits hold too few of them.
OFFSET_STEP = 2e-6
MOST_STEPS = 32767
# Methods that the shaders have, in the order of the page's lists.
METHODS = ("lbs", "dq", "cor")
Form: TypeAlias = Literal["continuous", "kim_han"]
BLENDER, MIX = "blender", "mix"
FOLDER = Path(__file__).parent / "web"
_SHADERS = (".glsl", ".vert", ".frag", ".wgsl")
_COMMENTS = re.compile("^ *//.*\n", re.MULTILINE)
_SCRIPTS = ("gl.js", "gpu.js", "viewer.js")
_RAMP_STOPS = 64
_TEXTS = {"distance": "The distance of each vertex from where Blender's Armature modifier takes it."}


@dataclass(frozen=True)
class Look:
    """How a mesh is deformed under a name of the page, of what the shaders have.

    method        one of METHODS; BLENDER for that of the Armature modifier
    mix           the second method of the painted mix; empty without one
    by_hierarchy  of these, those whose signs are from the hierarchy
    strengths     of Twist Spread and of Limit Bulge, 0 to 1; 0 where it is off
    form          of Limit Bulge
    """

    method: str
    mix: str = ""
    by_hierarchy: Sequence[str] = ()
    strengths: tuple[float, float] = (0.0, 0.0)
    form: Form = "continuous"


@dataclass
class Stages:
    """The stages of a mesh after the blend that the shaders have.

    look      of the file: which are on, and how
    masks     float32 [vertices, 2], the weights of the vertex groups of Twist Spread and of Limit Bulge
    twists    of the bones
    segments  float32 [bones, 3] each: heads and tails at rest, armature space
    """

    look: Look
    masks: np.ndarray
    twists: Twists
    segments: tuple[np.ndarray, np.ndarray]
    _made: dict[tuple[float, float], tuple[sinew.TwistSpread, sinew.BulgeLimit]] = field(default_factory=dict)

    def bind(
        self, binding: sinew.Binding, rest_bones: np.ndarray, mix: np.ndarray | None, looks: Iterable[Look]
    ) -> None:
        of = self.twists
        for strengths in {self.look.strengths, *(look.strengths for look in looks)}:
            spread, limited = (self.masks * np.array(strengths, np.float32)).clip(0.0, 1.0).T
            twist = sinew.TwistSpread(
                binding, of.rows, of.heads, of.tails, rest_bones, parents=of.parents, weights=spread, mix=mix
            )
            self._made[strengths] = twist, sinew.BulgeLimit(binding, *self.segments, weights=limited)

    def of(self, look: Look) -> tuple[sinew.TwistSpread, sinew.BulgeLimit]:
        """Those of the library, after bind()."""
        return self._made[look.strengths]

    def set_rest_points(self, points: np.ndarray) -> None:
        for twist, bulge in self._made.values():
            twist.set_rest_points(points)
            bulge.set_rest_points(points)


@dataclass
class Part:
    """A mesh of the character and its motion, in armature space.

    rest        float32 [vertices, 3], of the first frame
    rest_bones  float32 [bones, 4, 4], from each bone's own axes
    blender     the method of its Armature modifier, one of METHODS
    centres     float32 [vertices, 3], for `cor`; None without it
    mix         the two methods of the file's painted mix; None without it
    by_hierarchy  the methods whose signs are from the hierarchy in the file
    parents       int32 [bones], -1 for none; given where there are such methods, or a variant has some
    stages        None without any
    stage_names   labels of those that are on, in the file
    shares        float32 [vertices], of the second method of a mix; None without a mix
    variants      by their keys
    """

    name: str
    rest: np.ndarray
    influences: Influences
    triangles: np.ndarray
    edges: np.ndarray
    rest_bones: np.ndarray
    blender: str
    centres: np.ndarray | None = None
    mix: tuple[str, str] | None = None
    by_hierarchy: Sequence[str] = ()
    parents: np.ndarray | None = None
    stages: Stages | None = None
    stage_names: Sequence[str] = ()
    shares: np.ndarray | None = None
    variants: Mapping[str, Look] = field(default_factory=dict)
    _offsets: dict[str, list[np.ndarray]] = field(default_factory=dict)
    _palettes: list[np.ndarray] = field(default_factory=list)
    _worlds: list[np.ndarray] = field(default_factory=list)
    _rests: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        # Only bones that move a vertex are in the page.
        self._used, bones = np.unique(self.influences.bones, return_inverse=True)
        self._bones = bones.reshape(-1).astype(np.uint16)
        self._rest_inverses = np.linalg.inv(self.rest_bones.astype(np.float64))
        data = {} if self.centres is None else {"cor": self.centres}
        self._binding = sinew.Binding(
            self.rest,
            self.influences.offsets,
            self.influences.bones,
            self.influences.weights,
            rest_bones=self.rest_bones,
            vertex_data=data,
        )
        self._deformers: dict[str, sinew.Deformer] = {}
        if self.stages is not None:
            self.stages.bind(self._binding, self.rest_bones, self.shares, self.variants.values())

    def look(self, name: str) -> Look:
        """Returns BLENDER's where it lacks what it needs.

        name  a method, BLENDER, MIX or the key of a variant
        """
        if name in self.variants:
            own = self.variants[name]
            has_centres = self.centres is not None or "cor" not in (own.method, own.mix)
            return own if has_centres else replace(own, method=BLENDER, mix="")
        lacks = {MIX: self.mix is None, "cor": self.centres is None}
        if name not in (*METHODS, MIX) or lacks.get(name):
            return Look(BLENDER)
        first, second = self.mix if name == MIX and self.mix is not None else (name, "")
        own = Look(first, second, self.by_hierarchy)
        of_file = None if self.stages is None else self.stages.look
        return own if of_file is None else replace(own, strengths=of_file.strengths, form=of_file.form)

    def add_frame(
        self,
        posed: np.ndarray,
        world: np.ndarray,
        rest: np.ndarray | None = None,
        twists: TwistInputs = (),
        turns: np.ndarray | None = None,
    ) -> None:
        """
        posed   float32 [bones, 4, 4], in armature space
        world   [4, 4], from armature space
        rest    as that of the first frame, which it is where it is None
        twists  of those of the bones
        turns   as sinew.Deformer.deform takes them
        """
        self._rests.append(self.rest if rest is None else rest)
        for each in self._deformers.values():
            each.set_rest_points(self._rests[-1])
        if self.stages is not None:
            self.stages.set_rest_points(self._rests[-1])
        # Not with numpy's product: see vectors.transformed().
        motions = np.einsum("bij,bjk->bik", posed.astype(np.float64), self._rest_inverses)
        split = sinew.affine.split_scale(motions, self.rest_bones.astype(np.float64))
        rotations = np.roll(rotations_of(split.rigid[:, :3, :3]), -1, axis=0).T
        if self.parents is not None:
            rotations = self._signed(rotations, motions, turns)
        buffer = of_motions(motions, rotations)
        if self.stages is not None:
            add_segments(buffer, *self.stages.segments)
            self._add_twists(self.stages, buffer, motions.astype(np.float32), twists)
        self._palettes.append(buffer[self._used])
        self._posed, self._turns = posed, turns
        self._worlds.append(np.asarray(world, dtype=np.float64))

    def _signed(self, rotations: np.ndarray, motions: np.ndarray, turns: np.ndarray | None) -> np.ndarray:
        """Returns quaternions [bones, 4] with the signs of the library's, which takes them from the axes as
        they are where a bone is sheared."""
        assert self.parents is not None
        mirrors = np.linalg.det(motions[:, :3, :3]) < 0.0
        lengths = np.linalg.norm(motions[:, :3, :3], axis=1, keepdims=True)
        of_axes = quaternions(motions[:, :3, :3] / np.where(lengths > 0.0, lengths, 1.0))
        of_axes[mirrors] = rotations[mirrors]
        along = along_chain(of_axes, self.parents, mirrors, turns)
        return np.where((along * rotations).sum(axis=1, keepdims=True) < 0.0, -rotations, rotations)

    def _add_twists(
        self, stages: Stages, buffer: np.ndarray, motions: np.ndarray, twists: TwistInputs
    ) -> None:
        inputs = np.array(twists, np.float32).reshape(-1, 2 + len(NOT_TOLD))
        amounts, curves, channels = inputs[:, 0], inputs[:, 1], inputs[:, 2:]
        of, angles = stages.twists, stages.of(stages.look)[0].angles(motions, channels)
        add_twists(buffer, of.rows, amounts * angles, curves)
        rest, (heads, tails) = self.rest_bones.astype(np.float64), stages.segments
        shorter, _swings = twist_angles(motions.astype(np.float64), rest, of.rows, tails - heads)
        # What fades leave of an angle, if it is so many turns beyond the shorter way: the most is right.
        turns = np.arange(-2, 3)[:, None]
        parts = angles / np.where(angles == 0.0, 1.0, shorter + 2.0 * np.pi * turns)
        parts[parts > 1.0 + 1e-3] = 0.0
        around = turns[parts.argmax(axis=0), 0] * (angles != 0.0)
        if around.any():
            add_turns(buffer, of.rows, around, amounts * parts.max(axis=0, initial=0.0), of.parents)
        self._motions, self._inputs = motions, (amounts, curves, channels)

    def record(self, name: str, points: np.ndarray) -> None:
        """Has a name of the page show a shape that the shaders lack: once for each frame, after it is added.

        points  float64 [vertices, 3], in the world
        """
        offsets = transformed(points - self._skinned(name), np.linalg.pinv(_linear(self._worlds[-1])))
        self._offsets.setdefault(name, []).append(offsets.astype(np.float32))

    def world_points(self, name: str) -> np.ndarray:
        """float64 [vertices, 3], of the frame that was added last.

        name  as look() takes it, or recorded
        """
        points = self._skinned(name)
        if name in self._offsets:
            points += transformed(self._offsets[name][-1], _linear(self._worlds[-1]))
        return points

    def _skinned(self, name: str) -> np.ndarray:
        """As world_points(), without what is recorded."""
        look = self.look(name)
        is_own = look.method != BLENDER
        first = look.method if is_own else self.blender
        shares = self.shares if is_own and look.mix else None
        second = "" if shares is None else look.mix
        if name not in self._deformers:
            mix = None if shares is None else (second, shares)
            self._deformers[name] = sinew.Deformer(self._binding, first, mix=mix)
            self._deformers[name].set_rest_points(self._rests[-1])
        signs = {f"{each}.signs": "hierarchy" for each in look.by_hierarchy if each in (first, second)}
        points = self._deformers[name].deform(
            self._posed,
            rest_inverses=self._rest_inverses,
            parameters=signs if is_own else None,
            parents=self.parents,
            turns=self._turns,
        )
        if is_own and self.stages is not None:
            twist, bulge = self.stages.of(look)
            amounts, curves, channels = self._inputs
            twist.apply(
                points,
                self._motions,
                points,
                amounts=amounts,
                curves=curves,
                channels=channels,
                blend=blend_of(first),
                mix_blend=blend_of(second or first),
            )
            bulge.apply(points, self._motions, points, form=look.form)
        return transformed(points, self._worlds[-1])

    def world_rest(self) -> np.ndarray:
        """float64 [vertices, 3], where the frame that was added last has the mesh without its bones."""
        return transformed(self._rests[-1], self._worlds[-1])

    def looks(self, names: Iterable[str]) -> dict[str, dict[str, Any]]:
        """What the header has of each name."""
        places = {name: f"recorded_{number}" for number, name in enumerate(self._offsets)}
        return {
            name: asdict(self.look(name))
            | ({"recorded": places[name], "step": self._step(name)} if name in places else {"recorded": ""})
            for name in names
        }

    def _step(self, name: str) -> float:
        """Of recorded offsets, in armature space."""
        most = max(float(np.abs(own).max(initial=0.0)) for own in self._offsets[name])
        diagonal = float(np.linalg.norm(np.ptp(self.rest, axis=0))) if len(self.rest) else 0.0
        return max(OFFSET_STEP * diagonal, most / MOST_STEPS) or 1.0

    def arrays(self) -> dict[str, np.ndarray]:
        """What the page has of it."""
        found = {
            "rest": self.rest,
            "offsets": self.influences.offsets,
            "bones": self._bones,
            "weights": self.influences.weights,
            "triangles": self.triangles.astype(np.uint32),
            "edges": self.edges.astype(np.uint32),
            "palettes": np.array(self._palettes),
            "worlds": np.array(self._worlds, dtype=np.float32),
        }
        if self.centres is not None:
            found["centres"] = self.centres
        if self.shares is not None:
            found["shares"] = self.shares
        if self.stages is not None:
            found["masks"] = self.stages.masks
        for number, (name, offsets) in enumerate(self._offsets.items()):
            steps = np.rint(np.array(offsets) / self._step(name)).astype(np.int16)
            # Axis by axis they compress better.
            found[f"recorded_{number}"] = steps.transpose(0, 2, 1)
        has_moved = np.zeros(len(self.rest), dtype=bool)
        for rest in self._rests:
            if rest is not self.rest:
                has_moved |= (rest != self.rest).any(axis=1)
        if has_moved.any():
            found["moving"] = np.flatnonzero(has_moved).astype(np.uint32)
            found["moved"] = np.array([rest[has_moved] for rest in self._rests])
        return found


class _Range:
    """The least and the largest value of a measure."""

    def __init__(self, neutral: float) -> None:
        self.least = self.most = neutral

    def add(self, values: np.ndarray) -> None:
        self.least = min(self.least, float(values.min(initial=self.least)))
        self.most = max(self.most, float(values.max(initial=self.most)))


@dataclass(frozen=True)
class Found:
    """What the page lists of Flex.

    verdict   one sentence
    findings  each as the page has it: docs/viewer.md
    """

    verdict: str
    findings: Sequence[Mapping[str, Any]]


class Place(NamedTuple):
    """What a column of a contact sheet shows: a frame of the page, by its place, and from where."""

    frame: int
    view: View


@dataclass(frozen=True)
class PageSheet:
    """A contact sheet on which one clicks.

    picture  of the whole sheet, a WebP
    layout   of the picture
    rows     names of the page
    places   of the columns
    titles   of the columns, for readers
    """

    picture: bytes
    layout: Layout
    rows: Sequence[str]
    places: Sequence[Place]
    titles: Sequence[str]

    def header(self) -> dict[str, Any]:
        """What the page has of it; boxes are shares of the picture: left, top, width, height."""
        layout = self.layout
        whole = (layout.width, layout.height)

        def shares(box: Box) -> list[float]:
            return [value / of for value, of in zip(box, (*whole, *whole), strict=True)]

        return {
            "picture": "data:image/webp;base64," + base64.b64encode(self.picture).decode("ascii"),
            "width": layout.width,
            "rows": [
                {
                    "name": name,
                    "label": shares(layout.label(row)),
                    "cells": [shares(layout.picture(row, column)) for column in range(layout.columns)],
                }
                for row, name in enumerate(self.rows)
            ],
            "columns": [
                {
                    "title": title,
                    "frame": place.frame,
                    "direction": place.view.direction.tolist(),
                    "target": place.view.target.tolist(),
                    "width": place.view.width,
                }
                for place, title in zip(self.places, self.titles, strict=True)
            ],
        }


class Viewer:
    """The parts and frames of a page.

    methods  the names of those to choose from, of METHODS, MIX, BLENDER and keys of variants, with their
             labels
    rate     frames a second
    unit     of lengths: "m", or "units"
    notes    sentences on what the page leaves out
    beside   where frames are poses: what the page lists or shows of them
    """

    def __init__(
        self,
        title: str,
        parts: Sequence[Part],
        methods: dict[str, str],
        rate: float,
        unit: str,
        notes: Sequence[str] = (),
        beside: Found | PageSheet | None = None,
    ) -> None:
        self.title, self.parts, self.methods, self.rate, self.unit = title, parts, methods, rate, unit
        self.notes = list(notes)
        self.found = beside if isinstance(beside, Found) else None
        self.sheet = beside if isinstance(beside, PageSheet) else None
        self.frames: list[float | str] = []
        self._distance, self._stretch = _Range(0.0), _Range(1.0)
        self._worst, self._start = -1.0, 0
        self._boxes: list[np.ndarray] = []
        self._diagonal = 0.0

    def add_frame(self, frame: float | str) -> None:
        """Call it when all parts have it. frame: its number, or the name of a pose"""
        rest = [part.world_rest() for part in self.parts]
        self._diagonal = self._diagonal or float(np.linalg.norm(np.ptp(np.concatenate(rest), axis=0)))
        references = [part.world_points(BLENDER) for part in self.parts]
        shape = np.concatenate(references)
        self._boxes.append(np.array([shape.min(axis=0), shape.max(axis=0)]))
        worst = 0.0
        for method in self.methods:
            for part, at_rest, reference in zip(self.parts, rest, references, strict=True):
                points = part.world_points(method)
                if not np.isfinite(points).all():
                    raise SinewError(f"{part.name}: its shape under {method} is not finite at frame {frame}")
                distances = np.linalg.norm(points - reference, axis=1)
                self._distance.add(distances)
                worst = max(worst, float(distances.max(initial=0.0)))
                self._stretch.add(_stretches(part.edges, points, at_rest))
        if worst > self._worst:
            self._worst, self._start = worst, len(self.frames)
        self.frames.append(frame)

    def page(self) -> str:
        """The text of the file."""
        blob, places = bytearray(), []
        for part in self.parts:
            of_part = {}
            for name, array in part.arrays().items():
                array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
                of_part[name] = {"type": array.dtype.name, "shape": array.shape, "offset": len(blob)}
                blob += array.tobytes()
                # Each begins where the browser can look at it as numbers.
                blob += bytes(-len(blob) % 4)
            places.append(of_part)
        data = base64.b64encode(zlib.compress(bytes(blob), 9)).decode("ascii")
        texts = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir()}
        shaders = {name: _COMMENTS.sub("", text) for name, text in texts.items() if name.endswith(_SHADERS)}
        values = {
            "TITLE": escape(self.title),
            "STYLE": texts["style.css"],
            "HEADER": _in_script(self._header(places)),
            "ARRAYS": data,
            "SHADERS": _in_script(shaders),
            "SCRIPT": "\n".join(texts[name] for name in _SCRIPTS),
        }
        return re.sub("%([A-Z]+)%", lambda match: values[match[1]], texts["viewer.html"])

    def _header(self, places: list[dict[str, Any]]) -> dict[str, Any]:
        scales = [
            HeatScale.over_values(METRICS[name], own.least, own.most, self._diagonal)
            for name, own in (("distance", self._distance), ("stretch", self._stretch))
        ]
        boxes = np.array(self._boxes)
        return {
            "title": self.title,
            "methods": self.methods,
            "frames": self.frames,
            # Flex begins at rest.
            "start": 0 if self.found else self._start,
            "rate": self.rate,
            "low": boxes[:, 0].tolist(),
            "high": boxes[:, 1].tolist(),
            "notes": self.notes,
            "isOfPoses": isinstance(self.frames[0], str),
            "flex": asdict(self.found) if self.found else None,
            "sheet": self.sheet.header() if self.sheet else None,
            "measures": [self._measure(scale) for scale in scales],
            "parts": [
                {
                    "name": part.name,
                    "blender": part.blender,
                    "looks": part.looks({**self.methods, BLENDER: ""}),
                    "stages": part.stage_names,
                    "arrays": arrays,
                }
                for part, arrays in zip(self.parts, places, strict=True)
            ],
        }

    def _measure(self, scale: HeatScale) -> dict[str, Any]:
        stops = np.round(255 * scale.ramp(np.linspace(0.0, 1.0, _RAMP_STOPS))).astype(int)
        return {
            "name": scale.metric.name,
            "label": scale.metric.label,
            "text": _TEXTS.get(scale.metric.name, scale.metric.text),
            "low": scale.low,
            "high": scale.high,
            "isLogarithmic": scale.metric.scale == "log",
            "ramp": stops.ravel().tolist(),
            "ticks": legend_texts(scale, self.unit),
        }


def _linear(matrix: np.ndarray) -> np.ndarray:
    """A matrix [4, 4] without its translation."""
    linear = matrix.copy()
    linear[:3, 3] = 0.0
    return linear


def _stretches(edges: np.ndarray, points: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """[edges]: length / length at rest, 1 where that is 0."""
    now, before = (np.linalg.norm(of[edges[:, 0]] - of[edges[:, 1]], axis=1) for of in (points, rest))
    return np.divide(now, before, out=np.ones_like(now), where=before > 0.0)


def _in_script(value: object) -> str:
    """JSON that can not end a <script>."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
