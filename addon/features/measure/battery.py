# SPDX-License-Identifier: GPL-3.0-or-later
"""A battery of poses that bends every joint of a rig: bones in, matrices out. No action, control or driver
takes part.

A bone is posed within its limits where it has some; else by what its name says that it is, in the figure's
own directions; else by a swing about both axes and a twist.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import sinew

from ...skinning.limbs import ARM, LEG, LOWER, OWN_TWIST, UPPER, words_of
from ...skinning.rig import Bones

Limits = Mapping[str, np.ndarray]
"""By the name of a bone: float [3, 2], least and most rotation about each of its axes, in radians; NaN where
it is free."""


class Pose(NamedTuple):
    """rotations  float64 [3, 3] by bone, in armature space: how it is rotated about its head, after what
    carries it"""

    name: str
    rotations: dict[int, np.ndarray]


class Move(NamedTuple):
    """One line of the table.

    role     which bones
    action   "bend": as the limb bends, an elbow, a knee or a finger that is bent at rest to `degrees` in all;
             "aim": to `degrees` from hanging down; "twist": about its own axis; "turn": about the figure's
             upright axis; "open": against "bend"
    toward   where "aim" and "bend" lead: "out", "in", "across", "front", "back", "up" or "down"
    shared   the bones of a chain share the degrees
    """

    role: str
    action: str
    degrees: float
    toward: str = "front"
    shared: bool = False


FIGURE: dict[str, tuple[Move, ...]] = {
    "Elbows bent": (Move("forearm", "bend", 130.0),),
    "Wrists twisted": (Move("hand", "twist", 150.0),),
    "Wrists bent": (Move("hand", "bend", 70.0, "in"),),
    "Arms raised": (Move("upper_arm", "aim", 150.0, "out"),),
    "Arms crossed": (Move("upper_arm", "aim", 90.0, "across"), Move("forearm", "bend", 60.0)),
    "Arms twisted": (Move("upper_arm", "twist", 70.0),),
    "Shoulders raised": (Move("shoulder", "bend", 30.0, "up"),),
    "Fists": (Move("finger", "bend", 75.0, "in"), Move("thumb", "bend", 35.0)),
    "Squat": (
        Move("thigh", "aim", 100.0, "front"),
        Move("shin", "bend", 120.0, "back"),
        Move("foot", "bend", 25.0, "up"),
    ),
    "Legs apart": (Move("thigh", "aim", 60.0, "out"),),
    "Legs twisted": (Move("thigh", "twist", 40.0),),
    "Feet stretched": (Move("foot", "open", 45.0, "up"), Move("toe", "bend", 40.0, "up")),
    "Neck turned": (Move("neck", "turn", 80.0, shared=True),),
    "Neck bowed": (Move("neck", "bend", 60.0, shared=True),),
    "Back bent": (Move("spine", "bend", 60.0, shared=True),),
    "Back turned": (Move("spine", "turn", 60.0, shared=True),),
    "Jaw open": (Move("jaw", "bend", 25.0, "down"),),
}
"""What a figure that stands upright can do."""

JOINTS: dict[str, tuple[Move, ...]] = {
    role: tuple(Move(role, *move) for move in moves)
    for role, moves in {
        "forearm": (("bend", 100.0),),
        "hand": (("bend", 60.0, "in"), ("open", 60.0, "in"), ("twist", 80.0), ("twist", -80.0)),
        "upper_arm": (
            ("aim", 130.0, "out"),
            ("aim", 80.0, "front"),
            ("aim", 15.0, "out"),
            ("twist", 60.0),
            ("twist", -60.0),
        ),
        "shoulder": (("bend", 25.0, "up"), ("bend", 20.0, "front")),
        "finger": (("bend", 75.0, "in"),),
        "thumb": (("bend", 35.0),),
        "thigh": (("aim", 90.0, "front"), ("aim", 50.0, "out"), ("aim", 30.0, "back"), ("twist", 40.0)),
        "shin": (("bend", 110.0, "back"),),
        "foot": (("bend", 25.0, "up"), ("open", 40.0, "up")),
        "toe": (("bend", 40.0, "up"),),
        "neck": (("turn", 70.0, "", True), ("bend", 50.0, "front", True), ("bend", 40.0, "back", True)),
        "spine": (
            ("turn", 50.0, "", True),
            ("bend", 60.0, "front", True),
            ("bend", 30.0, "back", True),
            ("bend", 40.0, "left", True),
        ),
        "jaw": (("bend", 25.0, "down"),),
        "face": (("swing", 10.0),),
        "still": (),
        "other": (("swing", 30.0), ("twist", 30.0)),
    }.items()
}
"""What one joint can do by itself. "face" is what the head carries, "other" what nothing is known of;
"swing" is about both axes that are perpendicular to a bone, to and fro."""

SWING, TWIST = 60.0, 90.0
"""Degrees of a joint that nothing else is known of."""

# The most that a limit counts for: a bone that may go round and round is not tested so.
MOST = 150.0
LEAST = 5.0

# Fewer knuckles are no line; the sine of the mean angle by which fingers that are bent at rest bend.
FEWEST_FINGERS, RELAXED = 3, 0.03

# The sine of an angle between a bone and its limb that is rounding.
SAME = 1e-6

_OTHERS = (
    ("thumb", r"thumb|finger_?1-"),
    ("finger", r"index|middle|ring|pinky|little|finger(?!_?base)"),
    ("hand", r"hand|wrist"),
    ("toe", r"toe|(?<![a-z])ball(?![a-z])"),
    ("foot", r"foot|ankle"),
    ("shoulder", r"shoulder|clavicle|collar"),
    ("jaw", r"jaw"),
    ("neck", r"neck|(?<![a-z])head(?![a-z])"),
    ("spine", r"spine|chest|abdomen|waist|torso"),
    ("still", r"pelvis|hips?(?![a-z])|root|master|tongue|eye|carpal|palm|finger_?base"),
)
_LEFT, _RIGHT = r"left|(?<![a-z])l(?![a-z])", r"right|(?<![a-z])r(?![a-z])"


COMBINED = ("Arms crossed", "Squat", "Back bent", "Back turned", "Neck turned")
"""Figures in which joints that depend on each other bend at once."""


def sides(names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Returns int [bones], 1 for left, -1 for right, 0 for neither; and int [bones], the bone that has the
    same name but for its side, -1 for none."""
    words = [words_of(name) for name in names]
    side = np.array([_side_of(word) for word in words], int).reshape(-1)
    mirror = np.full(len(words), -1)
    # Some exporters number all bones.
    for pattern in (r"$^", r"_\d+$"):
        by_word: dict[tuple[str, int], list[int]] = {}
        for bone, word in enumerate(words):
            if side[bone]:
                key = re.sub(f"{_LEFT}|{_RIGHT}", "*", re.sub(pattern, "", word))
                by_word.setdefault((key, int(side[bone])), []).append(bone)
        for (key, sign), found in by_word.items():
            others = by_word.get((key, -sign), [])
            if len(found) == len(others) == 1 and mirror[found[0]] < 0:
                mirror[found[0]] = others[0]
    return side, mirror


def posed(bones: Bones, pose: Pose) -> np.ndarray:
    """Returns float32 [bones + joints, 4, 4], armature space: what a bone carries goes with it, and bendy
    bones stay as they are at rest."""
    rest = bones.rest.astype(np.float64)
    motions = np.tile(np.identity(4), (len(rest), 1, 1))
    for bone in bones.from_the_root:
        above = bones.deforming_parents[bone]
        if above >= 0:
            motions[bone] = motions[above]
        rotation = pose.rotations.get(bone)
        if rotation is not None:
            own = np.identity(4)
            own[:3, :3] = rotation
            own[:3, 3] = rest[bone, :3, 3] - rotation @ rest[bone, :3, 3]
            motions[bone] = motions[bone] @ own
    for bone, segments in bones.bending:
        first = bones.first_joints[bone]
        motions[first : first + segments + 1] = motions[bone]
    return (motions @ rest).astype(np.float32)


def bend_angles(bones: Bones, pose: np.ndarray) -> np.ndarray:
    """float64 [bones]: how far each bone is rotated against what carries it, in radians.

    pose  float32 [bones + joints, 4, 4]
    """
    count = len(bones.names)
    motions = pose[:count, :3, :3].astype(np.float64) @ np.linalg.pinv(
        bones.rest[:count, :3, :3].astype(np.float64)
    )
    relative = np.swapaxes(motions[bones.deforming_parents], 1, 2) @ motions
    cosines = (np.trace(relative, axis1=1, axis2=2) - 1.0) / 2.0
    return np.where(bones.deforming_parents >= 0, np.arccos(cosines.clip(-1.0, 1.0)), 0.0)


class Battery:
    """Makes the poses of a rig.

    moving  bool [bones], those that move vertices
    """

    def __init__(self, bones: Bones, limits: Limits, moving: np.ndarray) -> None:
        self._bones, self._limits = bones, limits
        count = len(bones.names)
        self._heads = bones.rest[:count, :3, 3].astype(np.float64)
        self._own_axes = bones.rest[:count, :3, :3].astype(np.float64)
        self._axes = _along(self._own_axes, bones.limbs.vectors)
        self._along = self._axes[:, :, 1]
        self._joints = [int(bone) for bone in np.flatnonzero(moving) if bones.deforming_parents[bone] >= 0]
        self._words = [words_of(name) for name in bones.names]

    def poses(self, figure: Mapping[str, tuple[Move, ...]] = FIGURE) -> list[Pose]:
        """figure: what a figure that stands upright does"""
        limited = [bone for bone in self._joints if self._bones.names[bone] in self._limits]
        free = [bone for bone in self._joints if bone not in limited]
        found = [*self._within_limits(limited)]
        if self._directions is not None:
            for name, moves in figure.items():
                found.append(Pose(name, dict(self._moved(moves, free))))
            # Faces and hair keep still.
            face = {bone for bone in free if any(self._roles[above] == "neck" for above in self._above(bone))}
            free = [bone for bone in free if not self._roles[bone] and bone not in face]
        found += self._general(free)
        return [pose for pose in found if pose.rotations]

    def pose_of(self, name: str, moves: Sequence[Move]) -> Pose:
        """One that a figure does, by all joints, whatever their limits are."""
        return Pose(name, dict(self._moved(moves, self._joints)))

    def combined(self) -> list[Pose]:
        """Those poses of figures that bend several joints at once."""
        return [pose for pose in self.poses() if pose.name in COMBINED]

    def of_joints(self, table: Mapping[str, tuple[Move, ...]] = JOINTS) -> Iterator[tuple[int, Pose]]:
        """The poses of single joints, each with its bone. `table` is by role."""
        for bone in self._joints:
            if self._bones.names[bone] in self._limits:
                found = list(self._within_limits([bone]))
            else:
                role = self.role_of(bone) if self.is_figure else "other"
                moves = table.get(self._bones.names[bone], table.get(role or "other", ()))
                found = [pose for move in moves for pose in self._of_move(move, bone)]
            for pose in found:
                if pose.rotations:
                    yield bone, pose

    @property
    def is_figure(self) -> bool:
        return self._directions is not None

    def roles(self) -> list[str]:
        """The role of each bone; "" for all in a rig that is no figure that stands upright."""
        return [self.role_of(bone) if self.is_figure else "" for bone in range(len(self._words))]

    def role_of(self, bone: int) -> str:
        above = any(self._roles[each] == "neck" for each in self._above(bone)[1:])
        return self._roles[bone] or ("face" if above else "")

    def _of_move(self, move: Move, bone: int) -> Iterator[Pose]:
        angle = math.radians(move.degrees)
        if move.action == "swing":
            for axis, letter in ((0, "X"), (2, "Z")):
                for sign in (1, -1):
                    name = f"{letter} {sign * move.degrees:g}"
                    yield Pose(name, {bone: _about(self._axes[bone][:, axis], sign * angle)})
            return
        if move.action == "twist":
            rotation: np.ndarray | None = _about(self._along[bone], angle)
        elif self.is_figure:
            chain = self._chain(bone, self._of_role(move.role)) if move.shared else 1
            angle /= chain
            rotation = self._rotation(move, bone, angle)
        else:
            rotation = None
        if rotation is not None:
            toward = f" {move.toward}" if move.action in ("aim", "bend", "open") else ""
            yield Pose(f"{move.action} {math.degrees(angle):.3g}{toward}", {bone: rotation})

    def _within_limits(self, bones: Sequence[int]) -> Iterator[Pose]:
        for axis, letter in enumerate("XYZ"):
            for end, word in enumerate(("least", "most")):
                rotations = {}
                for bone in bones:
                    angle = float(self._limits[self._bones.names[bone]][axis, end])
                    if math.isnan(angle):
                        is_along = np.abs(self._along[bone] @ self._own_axes[bone]).argmax() == axis
                        angle = math.radians(TWIST if is_along else SWING) * (2 * end - 1)
                    angle = min(max(angle, -math.radians(MOST)), math.radians(MOST))
                    if abs(angle) >= math.radians(LEAST):
                        rotations[bone] = _about(self._own_axes[bone][:, axis], angle)
                yield Pose(f"{letter} {word}", rotations)

    def _general(self, bones: Sequence[int]) -> Iterator[Pose]:
        """Every second bone of a chain at once, so that a long one does not roll up."""
        for name, axis, degrees in (("Swing X", 0, SWING), ("Swing Z", 2, SWING), ("Twist", 1, TWIST)):
            for odd in (0, 1):
                chosen = [bone for bone in bones if len(self._above(bone)) % 2 == odd]
                angle = math.radians(degrees)
                yield Pose(f"{name} {odd + 1}", {b: _about(self._axes[b][:, axis], angle) for b in chosen})

    # --- Figures

    @cached_property
    def _roles(self) -> list[str]:
        roles = [""] * len(self._words)
        for bone in self._bones.from_the_root:
            above = int(self._bones.deforming_parents[bone])
            roles[bone] = self._role(self._words[bone], roles[above] if above >= 0 else "")
        arms = [bone for bone, role in enumerate(roles) if role in ("shoulder", "upper_arm")]
        trunk = {above for arm in arms for above in self._above(arm)}
        for bone, role in enumerate(roles):
            # Rigify's neck and head are bones of the spine.
            if role == "spine" and bone not in trunk and trunk & set(self._above(bone)):
                roles[bone] = "neck"
        return roles

    @staticmethod
    def _role(word: str, above: str) -> str:
        if re.search(OWN_TWIST, word):
            return "still"
        is_leg = bool(re.search(r"leg|shin|calf|thigh|femur|tibia|knee", word))
        if re.search(f"{LOWER}|elbow|knee", word):
            role = "shin" if is_leg else "forearm"
        elif re.search(UPPER, word):
            role = "thigh" if is_leg else "upper_arm"
        elif re.search(ARM, word):
            role = "forearm" if above == "upper_arm" else "upper_arm"
        elif re.search(LEG, word):
            role = "shin" if above == "thigh" else "thigh"
        else:
            role = next((role for role, words in _OTHERS if re.search(words, word)), "")
        # A limb of several bones bends at the first: Rigify's upper_arm.L.001 goes on.
        return (
            "still" if role == above and role in ("upper_arm", "forearm", "thigh", "shin", "hand") else role
        )

    def _side(self, bone: int) -> int:
        """1 for left, -1 for right, 0 for neither."""
        return _side_of(self._words[bone])

    def _of_role(self, *roles: str) -> list[int]:
        return [bone for bone, role in enumerate(self._roles) if role in roles]

    @cached_property
    def _directions(self) -> dict[str, np.ndarray] | None:
        """The figure's own, unit; None where the rig is no figure that stands upright."""
        limbs = self._of_role("upper_arm", "thigh")
        sides = [[self._heads[bone] for bone in limbs if self._side(bone) == side] for side in (1, -1)]
        above, below = self._of_role("neck"), self._of_role("foot", "shin")
        hips = self._of_role("thigh")
        if not (all(sides) and above and below and hips):
            return None
        left = np.mean(sides[0], axis=0) - np.mean(sides[1], axis=0)
        top, hip, bottom = (np.mean(self._heads[of], axis=0) for of in (above, hips, below))
        up = _without(top - bottom, left)
        straight = _unit(top - hip) @ _unit(hip - bottom)
        if not (np.linalg.norm(left) > 0.0 and np.linalg.norm(up) > 0.0 and straight > 0.7):
            return None
        left, up = _unit(left), _unit(up)
        return {"left": left, "up": up, "down": -up, "front": np.cross(left, up), "middle": hip}

    def _toward(self, name: str, bone: int) -> np.ndarray:
        directions = self._directions
        assert directions is not None
        out = directions["left"] * np.sign((self._heads[bone] - directions["middle"]) @ directions["left"])
        return {
            "out": out,
            "in": -out - directions["up"],
            "across": 0.5 * directions["front"] - 0.5 * out,
            "back": -directions["front"],
        }.get(name, directions.get(name, out))

    def _moved(self, moves: Sequence[Move], bones: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
        for move in moves:
            chosen = [bone for bone in bones if self._roles[bone] == move.role]
            for bone in chosen:
                degrees = move.degrees / (self._chain(bone, chosen) if move.shared else 1)
                rotation = self._rotation(move, bone, math.radians(degrees))
                if rotation is not None:
                    yield bone, rotation

    def _chain(self, bone: int, chosen: Sequence[int]) -> int:
        """How many of the chosen bones are in the longest chain that goes through a bone."""
        chains = [[above for above in self._above(other) if above in chosen] for other in chosen]
        return max(len(chain) for chain in chains if bone in chain)

    def _above(self, bone: int) -> list[int]:
        """The bone and those that carry it."""
        found: list[int] = []
        while bone >= 0 and bone not in found:
            found.append(bone)
            bone = int(self._bones.deforming_parents[bone])
        return found

    def _rotation(self, move: Move, bone: int, angle: float) -> np.ndarray | None:
        directions, along = self._directions, self._along[bone]
        assert directions is not None
        mirrored = -1.0 if self._side(bone) < 0 else 1.0
        if move.action == "twist":
            return _about(along, mirrored * angle)
        if move.action == "turn":
            return _about(directions["up"], angle)
        toward = self._toward(move.toward, bone)
        if move.action == "aim":
            # From hanging down, in the plane of down and that direction.
            out = _unit(_without(toward, directions["up"]))
            aim = -math.cos(angle) * directions["up"] + math.sin(angle) * out
            axis = np.cross(along, aim)
            sine, cosine = float(np.linalg.norm(axis)), float(along @ aim)
            return _about(axis / sine, math.atan2(sine, cosine)) if sine > 1e-6 else None
        hinge, at_rest = self._hinge(bone, toward)
        if hinge is None:
            return None
        return _about(hinge, -angle if move.action == "open" else max(angle - at_rest, 0.0))

    def _hinge(self, bone: int, toward: np.ndarray) -> tuple[np.ndarray | None, float]:
        """The axis that a limb bends about: as it is bent at rest, else toward a direction; and the angle by
        which it is bent at rest, in radians."""
        along, above = self._along[bone], int(self._bones.deforming_parents[bone])
        knuckles = self._knuckles(bone, toward) if self._roles[bone] == "finger" else None
        if knuckles is not None:
            return _unit(_without(knuckles, along)), 0.0
        bent = np.cross(self._along[above], along)
        is_limb = self._roles[bone] in ("forearm", "shin", "finger", "thumb")
        if is_limb and self._roles[above] != "hand" and np.linalg.norm(bent) > math.sin(math.radians(8.0)):
            return _unit(bent), math.atan2(np.linalg.norm(bent), self._along[above] @ along)
        axis = np.cross(along, _unit(toward))
        return (_unit(axis) if np.linalg.norm(axis) > 0.1 else None), 0.0

    def _knuckles(self, bone: int, toward: np.ndarray) -> np.ndarray | None:
        """The line of a hand's knuckles, which all of its fingers bend about: as they are bent at rest, else
        toward a direction; None where there are too few."""
        hand = self._hand_of(bone)
        fingers = [each for each in self._of_role("finger") if self._hand_of(each) == hand]
        above = self._bones.deforming_parents
        first = [each for each in fingers if self._roles[int(above[each])] != "finger"]
        if len(first) < FEWEST_FINGERS:
            return None
        heads = self._heads[first] - self._heads[first].mean(axis=0)
        line = np.linalg.svd(heads)[2][0]
        bent = [
            np.cross(self._along[int(above[each])], self._along[each])
            for each in fingers
            if each not in first
        ]
        at_rest = float(np.sum(bent, axis=0) @ line) if bent else 0.0
        if abs(at_rest) < RELAXED * len(bent):
            at_rest = float(np.cross(self._along[fingers], _unit(toward)).sum(axis=0) @ line)
        return line if at_rest > 0.0 else -line

    def _hand_of(self, bone: int) -> int:
        """What carries the bone's finger."""
        return next((each for each in self._above(bone) if self._roles[each] != "finger"), -1)


def _side_of(word: str) -> int:
    return int(bool(re.search(_LEFT, word))) - int(bool(re.search(_RIGHT, word)))


def _along(axes: np.ndarray, limbs: np.ndarray) -> np.ndarray:
    """float64 [bones, 3, 3]: the axes, rotated the shortest way to have Y along limbs [bones, 3]."""
    found = axes.copy()
    for bone, limb in enumerate(limbs):
        y, wanted = _unit(axes[bone][:, 1]), _unit(limb)
        normal = np.cross(y, wanted)
        sine = float(np.linalg.norm(normal))
        if sine > SAME and wanted.any():
            found[bone] = _about(normal / sine, math.atan2(sine, float(y @ wanted))) @ axes[bone]
        elif y @ wanted < 0.0:
            found[bone][:, :2] *= -1.0
    return found


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """float64 [3, 3]"""
    return sinew.affine.from_axis_angle(axis, angle)[:3, :3]


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector


def _without(vector: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The part of a vector that is perpendicular to a direction."""
    unit = _unit(direction)
    return vector - (vector @ unit) * unit
