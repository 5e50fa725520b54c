# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends each joint of a character, and says which pass."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from ...skinning.variants import name_of
from ..measure.character import SAME_PATCH, Character, Place, share_in
from ..measure.limits import Limit
from ..measure.metrics import FrameOfRig
from ..measure.weight_check import WeightCheck
from .measures import Crossings, Region

OWN = "own"
"""The method that a file has."""
# Measures that are values of a limb where nothing else is posed.
_ALONE = ("volume_loss", "volume_gain")
# Faults that others come from, the plainest first; and those of weights, of which one patch may be several.
_CAUSES = ("unweighted", "bleed", "astray", "other_side", "pivot")
_OF_WEIGHTS = ("bleed", "astray", "other_side", "asymmetry")
# Measures of a whole limb, whose place tells nothing.
_OF_LIMBS = ("volume_loss", "volume_gain", "radius")
# A fault's place is at a patch, also, so many edges beside it.
_RINGS = 2
# A limb's fault comes from a patch that has this part of the limb.
_OF_LIMB = 0.02


class Posed(Protocol):
    """A pose of the character: live.Moment, or arrays."""

    @property
    def frame(self) -> FrameOfRig: ...

    def points(self, method: str) -> np.ndarray:
        """float64 [vertices, 3]"""


class Pose(NamedTuple):
    """
    bones  those that are posed
    make   returns the pose
    """

    name: str
    bones: tuple[int, ...]
    make: Callable[[], Posed]


@dataclass(frozen=True)
class Finding:
    """One fault of one joint.

    limit      which measure is beyond its limit
    patch      int, the vertices that are concerned, by the meshes' names; of a pose, those around the worst
    mends      of the methods that were tried, those under which the joint has this fault no more
    caused_by  the joint and the limit of the fault that this one merely comes from; None for one of its own
    """

    limit: Limit
    joint: str
    value: float
    pose: str = ""
    mesh: str = ""
    vertex: int = -1
    point: tuple[float, ...] = ()
    patch: Mapping[str, np.ndarray] = field(default_factory=dict)
    mends: tuple[str, ...] = ()
    caused_by: tuple[str, Limit] | None = None

    @property
    def vertices(self) -> int:
        """How many are concerned."""
        return sum(map(len, self.patch.values()))

    @property
    def text(self) -> str:
        limit = self.limit
        if limit.name == "inert":
            return limit.label
        text = f"{limit.label}: {limit.text(self.value)}, {limit.bound}"
        return f"{text} ({self.pose})" if self.pose else text

    @property
    def place(self) -> str:
        return f"{self.mesh}, vertex {self.vertex}" if self.mesh else ""

    @property
    def advice(self) -> str:
        if self.caused_by is not None:
            joint, limit = self.caused_by
            return f"It comes from a fault of {joint}: {limit.label}. Mend that."
        if self.mends:
            return f"Under {', '.join(map(name_of, self.mends))} it has this fault no more."
        return self.limit.advice

    def to_dict(self) -> dict[str, Any]:
        return {
            "name": self.limit.name,
            "label": self.limit.label,
            "text": self.text,
            "place": self.place,
            "value": _of_json(self.value),
            "limit": self.limit.value,
            "pose": self.pose,
            "mesh": self.mesh,
            "vertex": self.vertex,
            "point": list(self.point),
            "vertices": 0 if self.limit.posed else self.vertices,
            "times": _of_json(self.limit.times(self.value)),
            "meaning": self.limit.meaning,
            "advice": self.advice if self.caused_by is not None else self.limit.advice,
            "mends": list(self.mends),
            "caused_by": self.caused_by and {"joint": self.caused_by[0], "name": self.caused_by[1].name},
        }


def _of_json(value: float) -> float | None:
    """JSON has no infinity, which the edges of a shape that is not finite have."""
    return value if math.isfinite(value) else None


@dataclass
class Joint:
    """
    poses   how many it was bent to
    values  the worst by method and measure, with the pose of each
    """

    name: str
    armature: str
    role: str
    poses: int = 0
    values: dict[str, dict[str, tuple[float, str]]] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    @property
    def is_good(self) -> bool:
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        return {
            "joint": self.name,
            "armature": self.armature,
            "role": self.role,
            "passed": self.is_good,
            "poses": self.poses,
            "values": {
                method: {
                    name: {"value": _of_json(value), "pose": pose} for name, (value, pose) in values.items()
                }
                for method, values in self.values.items()
            },
            "findings": [finding.to_dict() for finding in self.findings],
        }


@dataclass(frozen=True)
class Verdict:
    """joints: those that move vertices, and others that have findings."""

    joints: Sequence[Joint]

    @property
    def is_good(self) -> bool:
        return all(joint.is_good for joint in self.joints)

    def to_dict(self) -> dict[str, Any]:
        return {"joints": [joint.to_dict() for joint in self.joints]}

    @property
    def findings(self) -> list[Finding]:
        return [finding for joint in self.joints for finding in joint.findings]

    def by_cause(self) -> list[tuple[Finding, list[Finding]]]:
        """The faults of their own, the worst first, each with those that come from it."""
        return by_cause(
            self.findings,
            lambda each: (each.joint, each.limit.name),
            lambda each: each.caused_by and (each.caused_by[0], each.caused_by[1].name),
            lambda each: each.limit.times(each.value),
        )


_Fault = TypeVar("_Fault")
_Key = tuple[str, str]


def by_cause(
    faults: Sequence[_Fault],
    key: Callable[[_Fault], _Key],
    cause: Callable[[_Fault], _Key | None],
    times: Callable[[_Fault], float],
) -> list[tuple[_Fault, list[_Fault]]]:
    """As of Verdict.by_cause().

    key    of a fault: its joint and its limit
    cause  the key of what it comes from
    times  how far it is beyond its limit
    """
    own: dict[_Key, tuple[_Fault, list[_Fault]]] = {
        key(each): (each, []) for each in faults if not cause(each)
    }
    for each in faults:
        above = cause(each)
        if above is not None and above in own:
            own[above][1].append(each)
    return sorted(own.values(), key=lambda each: (not each[1], -times(each[0])))


def judge(
    character: Character,
    poses: Sequence[Pose],
    methods: Sequence[str],
    limits: Mapping[str, Limit],
    crossings: Crossings,
) -> Generator[float, None, Verdict]:
    """Yields the progress; returns the verdict on the first of the methods, and which of the others mend
    what it finds."""
    judging = _Judging(character, methods, limits, crossings)
    for number, pose in enumerate(poses):
        judging.add_pose(pose)
        yield (number + 1) / len(poses)
    return judging.verdict()


class _Worst(NamedTuple):
    """The worst value of one measure of one joint under one method; vertices: int [n], those concerned."""

    value: float
    pose: str = ""
    place: Place | None = None
    vertices: np.ndarray = np.zeros(0, int)


@dataclass
class _Judging:
    _character: Character
    _methods: Sequence[str]
    _limits: Mapping[str, Limit]
    _crossings: Crossings
    _worst: dict[tuple[int, str, str], _Worst] = field(default_factory=dict)
    _regions: dict[int, tuple[Region, set[tuple[int, int]]]] = field(default_factory=dict)
    _poses: Counter[int] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        own = self._methods[0]
        for each in WeightCheck(self._character).values():
            self._add(each.bone, own, each.name, _Worst(each.value, "", each.place, each.vertices))

    def add_pose(self, pose: Pose) -> None:
        self._poses.update(pose.bones)
        bent = [bone for bone in pose.bones if not self._region(bone)[0].is_empty]
        if not bent:
            return
        posed = pose.make()
        for method in self._methods:
            points = posed.points(method)
            for bone in bent:
                region, at_rest = self._region(bone)
                found = region.measure(posed.frame, points, self._crossings, at_rest)
                for name, (value, place) in found.items():
                    if len(pose.bones) == 1 or name not in _ALONE:
                        self._add(bone, method, name, _Worst(value, pose.name, place))

    def verdict(self) -> Verdict:
        skeleton = self._character.skeleton
        own = self._methods[0]
        beyond = {key for key, worst in self._worst.items() if self._limits[key[2]].is_beyond(worst.value)}
        bones = {int(bone) for bone in np.flatnonzero(self._character.moving)}
        bones |= {bone for bone, method, _name in beyond if method == own}
        joints = {
            bone: Joint(
                skeleton.names[bone],
                skeleton.rigs[skeleton.rig[bone]],
                skeleton.roles[bone],
                self._poses[bone],
            )
            for bone in sorted(bones)
        }
        causes = self._causes({key for key in beyond if key[1] == own})
        for key, worst in self._worst.items():
            bone, method, name = key
            if bone in joints:
                joints[bone].values.setdefault(method, {})[name] = worst.value, worst.pose
                if method == own and key in beyond:
                    found = self._finding(bone, name, worst)
                    if key in causes:
                        above, _own, limit = causes[key]
                        found = replace(found, caused_by=(skeleton.names[above], self._limits[limit]))
                    joints[bone].findings.append(found)
        return Verdict(list(joints.values()))

    def _causes(self, faults: set[tuple[int, str, str]]) -> dict[tuple[int, str, str], tuple[int, str, str]]:
        """For each of the faults that merely comes from another, which."""
        found: dict[tuple[int, str, str], tuple[int, str, str]] = {}
        causes = [each for each in faults if each[2] in _CAUSES]
        causes.sort(key=lambda each: (_CAUSES.index(each[2]), -len(self._worst[each].vertices), each[0]))
        for number, cause in enumerate(causes):
            if cause in found:
                continue
            around = self._character.around(self._worst[cause].vertices, _RINGS)
            for fault in faults.difference(causes[: number + 1], found):
                if self._comes_from(fault, cause, around):
                    found[fault] = cause
        return found

    def _comes_from(
        self, fault: tuple[int, str, str], cause: tuple[int, str, str], around: np.ndarray
    ) -> bool:
        """around: bool [vertices], those of the cause and beside it"""
        bone, name, worst, is_posed = fault[0], fault[2], self._worst[fault], self._limits[fault[2]].posed
        is_own = bone == cause[0]
        if cause[2] == "pivot":
            return is_own and is_posed
        if name == "pivot":
            return is_own and not self._limits[name].is_beyond(self._region(bone)[0].pivot(around))
        if name in _OF_WEIGHTS:
            return (is_own or name == "asymmetry") and share_in(around, worst.vertices) >= SAME_PATCH
        if name in _OF_LIMBS:
            return share_in(around, self._region(bone)[0].vertices) > (0.0 if is_own else _OF_LIMB)
        return is_posed and worst.place is not None and bool(around[worst.place.vertex])

    def _finding(self, bone: int, name: str, worst: _Worst) -> Finding:
        limit, mends = self._limits[name], []
        for method in self._methods[1:] if limit.posed else ():
            under = self._worst.get((bone, method, name))
            if under is not None and not limit.is_beyond(under.value):
                mends.append(method)
        joint = self._character.skeleton.names[bone]
        vertices = worst.vertices
        if not len(vertices) and worst.place is not None:
            vertices = np.flatnonzero(self._character.around(np.array([worst.place.vertex]), _RINGS))
        patch = self._character.by_mesh(vertices)
        found = Finding(limit, joint, worst.value, worst.pose, patch=patch, mends=tuple(mends))
        if worst.place is None:
            return found
        mesh, vertex = self._character.mesh_of(worst.place.vertex)
        x, y, z = worst.place.point.tolist()
        return replace(found, mesh=mesh, vertex=vertex, point=(x, y, z))

    def _region(self, bone: int) -> tuple[Region, set[tuple[int, int]]]:
        """A region, with its crossings at rest."""
        if bone not in self._regions:
            region = Region(self._character, bone)
            at_rest = set()
            if not region.is_empty:
                at_rest = region.crossing(region.rest.points.T, self._crossings)
                self._add(bone, self._methods[0], "pivot", _Worst(region.pivot(), "", region.middle))
            self._regions[bone] = region, at_rest
        return self._regions[bone]

    def _add(self, bone: int, method: str, name: str, worst: _Worst) -> None:
        known = self._worst.get((bone, method, name))
        sign = -1.0 if self._limits[name].least else 1.0
        if known is None or sign * worst.value > sign * known.value:
            self._worst[bone, method, name] = worst
