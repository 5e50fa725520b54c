# SPDX-License-Identifier: GPL-3.0-or-later
"""What counts as a fault: one table, which a TOML file can override. docs/flex.md says where values come
from."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...base.errors import WrongUse
from .battery import JOINTS, Move


@dataclass(frozen=True)
class Limit:
    """A measure of a joint, and the value beyond which it is a fault.

    name     for programs and files
    label    for people
    value    of the fault that is just none
    unit     "%" of values that are shares, or a word behind the number
    least    values below are faults, not those above
    posed    it depends on the pose
    meaning  what is wrong, one sentence
    advice   what to do
    """

    name: str
    label: str
    value: float
    unit: str
    meaning: str
    advice: str
    least: bool = False
    posed: bool = False

    def is_beyond(self, value: float) -> bool:
        return value < self.value if self.least else value > self.value

    def times(self, value: float) -> float:
        """How far a value is beyond: 1 at the limit; infinite where none is allowed."""
        over, under = (self.value, value) if self.least else (value, self.value)
        return over / under if under > 0.0 else math.inf

    def number(self, value: float) -> str:
        """Without its unit."""
        if self.unit == "%":
            return f"{100.0 * value:.0f}"
        return f"{value:.0f}" if self.unit in ("vertices", "degrees") else f"{value:.2f}"

    def text(self, value: float) -> str:
        return f"{self.number(value)} {self.unit}"

    @property
    def bound(self) -> str:
        return f"at {'least' if self.least else 'most'} {self.text(self.value)}"


LIMITS: dict[str, Limit] = {
    limit.name: limit
    for limit in (
        Limit(
            "unweighted",
            "Unweighted",
            0.0,
            "vertices",
            "No bone moves these vertices: they stay behind.",
            "Diagnostics > Vertices without weights > From Neighbours, or From Other Side.",
        ),
        Limit(
            "inert",
            "Inert bone",
            0.5,
            "bones",
            "This bone moves nothing, though its other side does.",
            "Name its vertex group as the bone; Diagnostics lists groups without a bone; else paint it, or "
            "mirror its weights.",
        ),
        Limit(
            "bleed",
            "Bleeding weights",
            2.0,
            "sizes of the bone",
            "The bone moves vertices that it is far from over the surface.",
            "Diagnostics > Bleeding weights > Remove Influence.",
        ),
        Limit(
            "astray",
            "Astray",
            3.0,
            "girths",
            "Vertices follow this bone most, though others are much nearer.",
            "Diagnostics > Astray > Remove Influence, or Smooth.",
        ),
        Limit(
            "other_side",
            "Weights of the other side",
            0.02,
            "%",
            "The bone moves vertices of the figure's other side.",
            "Diagnostics > Weights of the other side > Remove Influence, or From Other Side.",
        ),
        Limit(
            "asymmetry",
            "Asymmetry",
            0.25,
            "%",
            "The mesh is the same on both sides, and the weights are not.",
            "Mirror the weights from the good side (Weights > Mirror).",
        ),
        Limit(
            "roll",
            "Roll",
            20.0,
            "degrees",
            "The bone is rolled otherwise than its other side: mirrored poses bend it about another axis.",
            "In Edit Mode: Armature > Bone Roll > Recalculate, or Symmetrize from the good side.",
        ),
        Limit(
            "pivot",
            "Pivot outside",
            2.4,
            "spreads",
            "The bone's head is outside of what it bends, which is stretched instead of bent.",
            "In Edit Mode, move the bone's head into the middle of the limb.",
        ),
        Limit(
            "volume_loss",
            "Volume lost",
            0.5,
            "%",
            "The limb collapses at the bend.",
            "Methods dq and cor keep volume; or widen the blend between the two bones.",
            posed=True,
        ),
        Limit(
            "volume_gain",
            "Volume gained",
            0.4,
            "%",
            "The limb swells at the bend.",
            "Use method lbs or cor, or the stage Limit Bulge; check the weights and the bone's head.",
            posed=True,
        ),
        Limit(
            "radius",
            "Radius",
            0.5,
            "of that at rest",
            "The limb is squeezed, as a wrapper that is twisted.",
            "Use method dq or cor, the stage Twist Spread, or twist bones.",
            least=True,
            posed=True,
        ),
        Limit(
            "stretch",
            "Longest edge",
            4.5,
            "times",
            "The surface is torn between vertices that follow different bones.",
            "Smooth the weights there (Weights > Smooth), or use the stage Delta Mush.",
            posed=True,
        ),
        Limit(
            "bulge",
            "Bulge",
            0.9,
            "girths",
            "The surface leaves the bone's axis.",
            "Use method cor or the stage Limit Bulge; check the weights there.",
            posed=True,
        ),
        Limit(
            "flips",
            "Flipped faces",
            0.35,
            "%",
            "The surface is folded inside out.",
            "Smooth the weights there, or use method dq or cor.",
            posed=True,
        ),
        Limit(
            "crossings",
            "New crossings",
            0.5,
            "%",
            "The surface goes through itself, and does not at rest.",
            "Widen the blend between the two bones, or bend the joint less.",
            posed=True,
        ),
    )
}


@dataclass(frozen=True)
class Table:
    """Limits, and the poses of each role."""

    limits: Mapping[str, Limit] = field(default_factory=lambda: LIMITS)
    joints: Mapping[str, tuple[Move, ...]] = field(default_factory=lambda: JOINTS)


_ACTIONS = ("bend", "open", "aim", "twist", "turn", "swing")
_TOWARD = ("", "out", "in", "across", "front", "back", "up", "down", "left")


def read_table(path: Path, table: Table) -> Table:
    """Returns the table with what a file overrides: [limits] by name, [joints] by role or by a bone's name,
    each a list such as ["bend 90 up", "twist 45"]. Raises WrongUse."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise WrongUse(f"{path}: {error}") from None
    except OSError as error:
        raise WrongUse(f"{path}: can not be read: {error.strerror or error}") from None
    limits, joints = dict(table.limits), dict(table.joints)
    for name, values in content.items():
        if name not in ("limits", "joints") or not isinstance(values, dict):
            raise WrongUse(f"{path}: expected the tables [limits] and [joints], got {name}")
        for key, value in values.items():
            try:
                if name == "limits":
                    limits[key] = _limit(limits, key, value)
                else:
                    joints[key] = _moves(key, value)
            except ValueError as error:
                raise WrongUse(f"{path}: {name}.{key}: {error}") from None
    return Table(limits, joints)


def _limit(limits: Mapping[str, Limit], name: str, value: object) -> Limit:
    if name not in limits:
        raise ValueError(f"expected one of {', '.join(limits)}")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"expected a number, got {value!r}")
    return replace(limits[name], value=float(value))


def _moves(key: str, value: object) -> tuple[Move, ...]:
    if not isinstance(value, list):
        raise ValueError('expected a list such as ["bend 90 up", "twist 45"]')
    return tuple(_move(key, each) for each in value)


def _move(key: str, text: object) -> Move:
    action, degrees, toward, *more = [*str(text).split(), "", "", ""][:4]
    try:
        number = float(degrees)
    except ValueError:
        number = float("nan")
    if action not in _ACTIONS or not abs(number) <= 180.0 or toward not in _TOWARD or any(more):
        raise ValueError(
            f"expected one of {', '.join(_ACTIONS)}, degrees, and for bend, open and aim a direction "
            f"({', '.join(_TOWARD[1:])}), got {text!r}"
        )
    return Move(key, action, number, toward or "front", action == "turn" or key in ("neck", "spine"))
