# SPDX-License-Identifier: GPL-3.0-or-later
"""How far an exported file plays from what was seen, and why: each cause is put alone into the shape that the
skin has in Blender, and what all of them together do not explain is the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...base.options import option, same_option
from ...base.phrases import Phrase, phrase
from ...skinning.influences import Influences
from ...skinning.vectors import unit
from ..bake.helper_bones import HelperOptions
from .played import Played, blended, padded
from .players import ALL_CLIPS, SHOWN

# Of the diagonal: a smaller distance is rounding.
EXPLAINED = 1e-5

# In degrees; and a cosine.
_SMALL_ANGLE, _SAME_NORMAL = 0.1, 0.9999
# The sine of an angle; how far rounding that a chain of bones amplifies may take their axes.
_NEAR_LIMIT, _ROUNDED = 0.99, 0.01

CAUSES: dict[str, str] = {
    "modifiers": "modifiers behind the armature, which the file leaves out",
    "method": "method and stages, where engines blend linearly",
    "several": "further Armature modifiers, as the file has the first, and method and stages",
    "pose": "a pose without keys, where the file has no animation and plays the rest pose",
    "bendy": "bendy bones",
    "influences": "influences that were cut, or are of envelopes",
    "shape_keys": "shape keys",
    "shear_scale": "bones whose shear, scale or rotation the file can not store exactly",
    "transforms": "transforms of objects that move apart",
    "sampling": "between frames, straight lines from key to key",
    "actions": "other actions, whose values the exporter keeps where this one has no keys",
    "rest": "no cause that is known",
}
# Where names are known: of bones, of the armature object.
NAMED = {
    "shear_scale": "bones that are sheared, which the file has exactly with Inherit Scale Full: {names}",
    "transforms": "its object moves apart from {names}; parent it to that, without keys of its own",
}
NORMALS = "normals, which engines skin as they were at rest"

# The files that can be written and verified, and how many frames are, unless they are chosen.
ENDINGS = (".glb", ".usdc", ".fbx", ".vrm")
FRAMES = 25


@dataclass(frozen=True)
class ExportOptions:
    """frames: to verify; None for some of the scene's"""

    influences: int = same_option(HelperOptions, "influences")
    clips: str = option(
        ALL_CLIPS,
        "Clips",
        "Which animation a .glb or .fbx has",
        choices=(
            (ALL_CLIPS, "All", "A clip for each action"),
            (SHOWN, "Shown", "What is seen now, as a single clip"),
        ),
    )
    verify: bool = option(
        False,
        "Verify",
        "Read the file again, play it as an engine does, and say how far that is from what is seen here, and "
        "why",
    )
    frames: Sequence[float] | None = None


@dataclass(frozen=True)
class SeenFrame:
    """A mesh at one frame, in Blender. Bones are followed by joints of bendy bones and by one that moves
    vertices without influences.

    seen     float64 [vertices, 3], world: the final mesh
    shown    the same, before the modifiers behind the Armature modifier
    rest     float [vertices, 3], object space, with shape keys
    motions  float64 [bones, 4, 4], from object space at rest to the world
    bound    the same, by the object's place at the export
    damaged  float [bones], of damaged_bones()
    influences  of this frame
    normals  float32 [corners, 3], world, of the final mesh; None where it has other corners
    """

    frame: float
    seen: np.ndarray
    shown: np.ndarray
    rest: np.ndarray
    motions: np.ndarray
    bound: np.ndarray
    damaged: np.ndarray
    influences: Influences
    normals: np.ndarray | None = None


@dataclass
class Seen:
    """A mesh over frames, in Blender.

    bones        the names in the file of bones and joints
    constant     the influences that the file should have
    influences   the largest number of a vertex that was exported; 0 for all
    has_envelopes  bones' envelopes have a part in the influences; files do not
    has_keys       it has shape keys
    has_several    more than one Armature modifier deforms it; bones are those of the first
    corners        int [corners], the vertex of each corner of its faces
    normals        float32 [corners, 3], at rest, object space
    names          of what causes it, for those of NAMED
    """

    name: str
    bones: list[str]
    constant: Influences
    influences: int
    has_envelopes: bool
    has_keys: bool
    has_several: bool
    corners: np.ndarray
    normals: np.ndarray
    frames: list[SeenFrame] = field(default_factory=list)
    between: list[SeenFrame] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Distance:
    """Over vertices and frames, in scene units."""

    largest: float
    mean: float

    @classmethod
    def of(cls, found: Sequence[np.ndarray]) -> Distance:
        together = np.concatenate(found) if found else np.zeros(0)
        return cls(float(together.max(initial=0.0)), float(together.mean()) if len(together) else 0.0)


@dataclass(frozen=True)
class Check:
    """What an engine plays, compared with what was seen.

    rounding  a distance that is not larger is that of the numbers in the file
    total     between the file and what was seen
    causes    of each of CAUSES alone
    normals   between skinned normals and those seen, in degrees; None where they were not compared
    names     of Seen
    """

    mesh: str
    diagonal: float
    rounding: float
    total: Distance
    causes: dict[str, Distance]
    normals: Distance | None = None
    names: dict[str, str] = field(default_factory=dict)

    @property
    def is_explained(self) -> bool:
        return self.causes["rest"].largest <= self.rounding

    @classmethod
    def of_json(cls, said: dict[str, Any]) -> Check:
        """said: by dataclasses.asdict()"""
        causes = {name: Distance(**each) for name, each in said["causes"].items()}
        normals = said["normals"] and Distance(**said["normals"])
        return cls(**{**said, "total": Distance(**said["total"]), "causes": causes, "normals": normals})

    def without_actions(self, alone: Check) -> Check:
        """alone: of the same file without other actions. What it lacks of the rest is theirs."""
        return replace(self, causes={**alone.causes, "actions": self.causes["rest"]})

    @property
    def share(self) -> float:
        """Of the diagonal, how far it is at most."""
        return self.total.largest / (self.diagonal or 1.0)

    def sentences(self, unit: str) -> list[Phrase]:
        """The whole difference, then a line for each cause. unit: the name of a scene unit."""
        said = [
            phrase(
                "the file plays {distance} from what was seen ({share}% of the diagonal)",
                distance=self._said(self.total, unit),
                share=f"{100.0 * self.share:.2g}",
            ),
            *(
                self._caused(distance, unit, self._cause(name))
                for name, distance in self.causes.items()
                if distance.largest > self.rounding
            ),
        ]
        if self.normals is not None and self.normals.largest > _SMALL_ANGLE:
            said.append(self._caused(self.normals, "degrees", phrase(NORMALS)))
        return said

    def _cause(self, name: str) -> Phrase:
        return phrase(NAMED[name], names=self.names[name]) if name in self.names else phrase(CAUSES[name])

    def _caused(self, distance: Distance, unit: str, cause: Phrase) -> Phrase:
        return phrase("{distance}: {cause}", distance=self._said(distance, unit), cause=cause)

    @staticmethod
    def _said(distance: Distance, unit: str) -> Phrase:
        largest, mean = (f"{v:.0f}" if v >= 100.0 else f"{v:.2g}" for v in (distance.largest, distance.mean))
        return phrase("{largest} {unit} at most, {mean} on average", largest=largest, mean=mean, unit=unit)


def plain(name: str) -> str:
    """A bone's name as all formats can have it: USD has letters, digits and underscores."""
    return "".join(each if each.isalnum() and each.isascii() else "_" for each in name)


class Comparison:
    """A mesh of a file beside the same in Blender.

    object_from_file  float64 [4, 4], from the space of the file's rest points
    vertices          int [file's vertices]: which of Blender's vertices each is
    """

    def __init__(
        self, seen: Seen, played: Played, object_from_file: np.ndarray, vertices: np.ndarray
    ) -> None:
        self._seen, self._played, self._vertices = seen, played, vertices
        self._object_from_file = object_from_file
        self._file_from_object = np.linalg.inv(object_from_file)
        numbers = {plain(name): number for number, name in enumerate(seen.bones) if name}
        self._none = len(seen.bones)
        # What exporters add for vertices without weights is none of the armature's bones.
        self._bone_of = np.array([numbers.get(plain(name), self._none) for name in played.joints], dtype=int)
        self._own = self._bone_of[played.slots], played.weights
        self._constant = self._rows(seen.constant)

    def _rows(self, influences: Influences) -> tuple[np.ndarray, np.ndarray]:
        slots, weights = padded(influences, self._none)
        return slots[self._vertices], weights[self._vertices]

    def _motions(self, seen: SeenFrame) -> np.ndarray:
        """The file's, by the numbers of Blender's bones, from object space."""
        motions = seen.bound.copy()
        motions[self._bone_of] = self._played.motions(seen.frame) @ self._file_from_object
        motions[self._none] = seen.bound[self._none]
        return motions

    def _expected(self, seen: SeenFrame) -> np.ndarray:
        """What the file should have of them: without an animation the rest pose."""
        bound = seen.bound
        return bound if self._played.is_animated else np.broadcast_to(bound[-1], bound.shape)

    def _damaged(self, seen: SeenFrame, motions: np.ndarray) -> np.ndarray:
        """bool [bones, 1, 1]: those whose motions may be different in the file."""
        if not self._played.is_animated:
            return np.zeros((len(motions), 1, 1), dtype=bool)
        axes = seen.bound[:, :3, :3]
        apart = np.abs(motions[:, :3, :3] - axes).max(axis=(1, 2))
        return (apart <= seen.damaged * np.abs(axes).max())[:, None, None]

    def _rest(self, seen: SeenFrame) -> np.ndarray:
        """The file's rest points, in object space."""
        points, matrix = self._played.rest_at(seen.frame), self._object_from_file
        return points @ matrix[:3, :3].T + matrix[:3, 3]

    @property
    def _cut(self) -> tuple[np.ndarray, np.ndarray]:
        """The constant influences; those of the file where they are more than it was to have, or have
        envelopes."""
        (slots, weights), most = self._constant, self._seen.influences
        if self._seen.has_envelopes:
            return self._own
        if not most:
            return slots, weights
        own_slots, own_weights = self._own
        width = max(slots.shape[1], own_slots.shape[1])
        is_cut = (weights > 0.0).sum(axis=1) > most
        chosen = []
        for mine, theirs in ((slots, own_slots), (weights, own_weights)):
            wide, narrow = np.zeros((2, len(mine), width), mine.dtype)
            wide[:, : mine.shape[1]], narrow[:, : theirs.shape[1]] = mine, theirs
            chosen.append(np.where(is_cut[:, None], narrow, wide))
        return chosen[0], chosen[1]

    def played(self, seen: SeenFrame) -> np.ndarray:
        """float64 [file's vertices, 3], world: what an engine plays."""
        return blended(
            self._played.slots,
            self._played.weights,
            self._played.motions(seen.frame),
            self._played.rest_at(seen.frame),
        )

    def check(self) -> Check:
        seen, at = self._seen, self._vertices
        pairs: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {name: [] for name in (*CAUSES, "total")}
        cut = self._cut
        for each in seen.frames:
            own, rest = self._rows(each.influences), each.rest[at]
            linear = blended(*own, each.motions, rest)
            motions = self._motions(each)
            points = self._rest(each) if seen.has_keys else rest
            damaged, expected = self._damaged(each, motions), self._expected(each)
            constant = blended(*self._constant, each.motions, rest)
            played = self.played(each)
            bound = blended(*own, each.bound, rest)
            pairs["total"].append((played, each.seen[at]))
            pairs["modifiers"].append((each.seen[at], each.shown[at]))
            pairs["several" if seen.has_several else "method"].append((each.shown[at], linear))
            pairs["pose"].append((blended(*own, expected, rest), bound))
            pairs["bendy"].append((constant, linear))
            pairs["influences"].append((blended(*cut, each.motions, rest), constant))
            pairs["shape_keys"].append((blended(*own, each.motions, points), linear))
            of_damaged = np.where(damaged, motions, each.bound)
            pairs["shear_scale"].append((blended(*own, of_damaged, rest), bound))
            pairs["transforms"].append((bound, linear))
            pairs["rest"].append((blended(*cut, np.where(damaged, motions, expected), points), played))
        for each in seen.between if self._played.is_animated else ():
            own, rest = self._rows(each.influences), each.rest[at]
            motions = np.where(each.damaged[:, None, None] > 0.0, each.bound, self._motions(each))
            pairs["sampling"].append((blended(*own, motions, rest), blended(*own, each.bound, rest)))
        found = {
            name: Distance.of([np.linalg.norm(a - b, axis=1) for a, b in own]) for name, own in pairs.items()
        }
        points = seen.frames[0].seen
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
        rounding = EXPLAINED * max(diagonal, 0.1 * float(np.abs(points).max(initial=0.0)))
        return Check(seen.name, diagonal, rounding, found.pop("total"), found, self._angles(), seen.names)

    def _angles(self) -> Distance | None:
        """Between the normals that an engine skins, without the inverse of scale, and those seen."""
        seen, normals = self._seen, self._played.normals
        seen_frames = [each for each in seen.frames if each.normals is not None]
        if normals is None or not seen_frames or not len(seen.corners):
            return None
        corners = self._corners(normals)
        rows, found = corners >= 0, []
        for each in seen_frames:
            assert each.normals is not None
            motions = self._played.motions(each.frame).copy()
            motions[:, :3, 3] = 0.0
            skinned = unit(blended(self._played.slots, self._played.weights, motions, normals)[rows])
            shown = unit(each.normals[corners[rows]].astype(np.float64))
            sines = np.linalg.norm(np.cross(skinned, shown), axis=1)
            found.append(np.degrees(np.arctan2(sines, (skinned * shown).sum(axis=1))))
        return Distance.of(found) if rows.any() else None

    def _corners(self, normals: np.ndarray) -> np.ndarray:
        """int [file's vertices]: the corner that each was split from, by its normal; -1 for none."""
        seen = self._seen
        order = np.argsort(seen.corners, kind="stable")
        counts = np.bincount(seen.corners, minlength=int(self._vertices.max(initial=0)) + 1)
        starts = np.cumsum(counts) - counts
        own = unit(normals @ np.linalg.inv(self._object_from_file[:3, :3]))
        best, found = np.full(len(own), -np.inf), np.full(len(own), -1)
        for slot in range(int(counts.max(initial=0))):
            rows = np.flatnonzero(counts[self._vertices] > slot)
            corners = order[starts[self._vertices[rows]] + slot]
            likeness = (own[rows] * seen.normals[corners]).sum(axis=1)
            better = likeness > best[rows]
            best[rows[better]], found[rows[better]] = likeness[better], corners[better]
        # Of vertices at one place that move alike, another may have been taken.
        return np.where(best > _SAME_NORMAL, found, -1)


def shears(poses: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """float [bones]: the largest cosine between two axes of each, relative to its parent. As of
    damaged_bones()."""
    axes = relative(poses, parents)[:, :3, :3]
    sizes = np.linalg.norm(axes, axis=1)
    products = axes.transpose(0, 2, 1) @ axes / np.maximum(sizes[:, :, None] * sizes[:, None], 1e-30)
    return np.abs(products * (1.0 - np.identity(3))).max(axis=(1, 2), initial=0.0)


def relative(poses: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """float64 [bones, 4, 4], relative to their parents. As of damaged_bones()."""
    above = np.where(parents[:, None, None] >= 0, poses[parents], np.identity(4))
    return np.linalg.pinv(above) @ poses


def damaged_bones(poses: np.ndarray, parents: np.ndarray, kind: str) -> np.ndarray:
    """float [bones]: how far their axes in the file may be from those seen, as a part of their length: above
    0 for those that location, rotation and scale relative to their parents, as a file stores them, do not
    pose exactly, and for all below them.

    poses    float64 [bones, 4, 4]
    parents  int [bones], -1 for none
    kind     the ending of the file
    """
    axes = relative(poses, parents)[:, :3, :3]
    sizes = np.linalg.norm(axes, axis=1)
    sheared = (shears(poses, parents) > 1e-5) | (sizes < 1e-6).any(axis=1)
    rounded = np.zeros(len(poses), dtype=bool)
    if kind == ".usdc":
        # Scales are half floats.
        rounded = (np.abs(sizes - sizes.astype(np.float16)) > 2e-6).any(axis=1)
    elif kind == ".fbx":
        # Angles about X and Z are not exact where that about Y is near 90 degrees.
        rounded = np.abs(axes[:, 2, 0]) > _NEAR_LIMIT * sizes[:, 0]
    damaged = np.where(sheared, np.inf, np.where(rounded, _ROUNDED, 0.0))
    for _level in range(len(parents)):
        below = np.maximum(damaged, np.where(parents >= 0, damaged[parents], 0.0))
        if (below == damaged).all():
            break
        damaged = below
    return damaged


def spread_frames(first: int, last: int, most: int) -> tuple[list[float], list[float]]:
    """Returns at most so many of the frames, evenly, and the middles between frames beside them."""
    count = min(most, last - first + 1)
    frames = np.unique(np.round(np.linspace(first, last, count))).tolist()
    return frames, [frame + 0.5 for frame in frames[:-1]]
