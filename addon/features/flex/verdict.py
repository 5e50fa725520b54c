# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends each joint of a character, and says which pass."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..measure.metrics import FrameOfRig
from .character import Character
from .limits import Limit
from .measures import Crossings, Place, Region
from .weights import WeightCheck

OWN = "own"
"""The method that a file has."""
# Measures that are values of a limb where nothing else is posed.
_ALONE = ("volume_loss", "volume_gain")


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

    limit     which measure is beyond its limit
    vertices  how many are concerned; 0 for a measure of the whole joint
    mends     of the methods that were tried, those under which the joint has this fault no more
    """

    limit: Limit
    joint: str
    value: float
    pose: str = ""
    mesh: str = ""
    vertex: int = -1
    point: tuple[float, ...] = ()
    vertices: int = 0
    mends: tuple[str, ...] = ()

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
        if self.mends:
            return f"Under {', '.join(self.mends)} it has this fault no more."
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
            "vertices": self.vertices,
            "meaning": self.limit.meaning,
            "advice": self.limit.advice,
            "mends": list(self.mends),
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
    """The worst value of one measure of one joint under one method; vertices: how many are concerned."""

    value: float
    pose: str = ""
    place: Place | None = None
    vertices: int = 0


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
        for key, worst in self._worst.items():
            bone, method, name = key
            if bone in joints:
                joints[bone].values.setdefault(method, {})[name] = worst.value, worst.pose
                if method == own and key in beyond:
                    joints[bone].findings.append(self._finding(bone, name, worst))
        return Verdict(list(joints.values()))

    def _finding(self, bone: int, name: str, worst: _Worst) -> Finding:
        limit, mends = self._limits[name], []
        for method in self._methods[1:] if limit.posed else ():
            under = self._worst.get((bone, method, name))
            if under is not None and not limit.is_beyond(under.value):
                mends.append(method)
        joint = self._character.skeleton.names[bone]
        found = Finding(limit, joint, worst.value, worst.pose, vertices=worst.vertices, mends=tuple(mends))
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
                self._add(bone, self._methods[0], "pivot", _Worst(region.pivot, "", region.middle))
            self._regions[bone] = region, at_rest
        return self._regions[bone]

    def _add(self, bone: int, method: str, name: str, worst: _Worst) -> None:
        known = self._worst.get((bone, method, name))
        sign = -1.0 if self._limits[name].least else 1.0
        if known is None or sign * worst.value > sign * known.value:
            self._worst[bone, method, name] = worst
