# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that show what engines make of a skin: linear blending by fewer and rounded weights, of bones that
do not bend and have no shear. docs/engines.md has the rules with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sinew

from .influences import Influences

ENGINE_GROUP = "As in Engines"


@dataclass(frozen=True)
class Number:
    """A whole number that a method takes, with the facts of a sinew.Parameter."""

    id: str
    label: str
    description: str
    default: int
    min: int
    max: int
    kind: str = "int"
    unit: str = ""
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Engine:
    """Has the facts of a sinew.Method.

    influences  that it keeps of a vertex, the heaviest first and of equal ones the first
    least       lighter influences are dropped
    levels      weights are whole parts of 1 / levels; 0: they are not rounded
    """

    number: int
    name: str
    label: str
    description: str
    influences: int
    least: float = 0.0
    levels: int = 0
    parameters: tuple[Number, ...] = ()
    source: str = "docs/engines.md"
    group: str = ENGINE_GROUP
    needs: tuple[str, ...] = ()
    vertex_floats: int = 0
    rows_by_bone: bool = False


_BONES = Number("influences", "Bones", "How many bones move a vertex at most: the heaviest", 4, 1, 32)
_ALL = (
    Engine(101, "gltf", "glTF and VRM", "Four bones a vertex, as players of glTF and VRM show it", 4),
    Engine(102, "unity", "Unity", "Four bones a vertex, none below 0.001, as Unity shows it", 4, 0.001),
    Engine(103, "unreal", "Unreal Engine", "Eight bones a vertex, in 8 bits, as Unreal shows it", 8, 0, 255),
    Engine(104, "godot", "Godot", "Four bones a vertex, in 16 bits, as Godot shows it", 4, 0, 65535),
    Engine(105, "limited", "Fewer Bones", "Linear blend by the heaviest bones", 4, parameters=(_BONES,)),
)
ENGINES = {engine.name: engine for engine in _ALL}
METHODS: dict[str, sinew.Method | Engine] = {method.name: method for method in sinew.methods()} | ENGINES
"""All that a mesh can be deformed by, by name."""


def influences_kept(method: str, values: Mapping[str, float | str]) -> int:
    """Returns how many of a vertex an engine keeps.

    values  of parameters, by full names
    """
    return int(values.get(f"{method}.influences", ENGINES[method].influences))


def imported(influences: Influences, engine: Engine, most: int) -> Influences:
    """Returns what an engine's importer keeps; weights have the sum 1.

    most  from influences_kept()
    """
    bones, weights = influences.padded()
    weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)
    bones, weights = bones[:, :most], weights[:, :most]
    kept = (bones >= 0) & (weights >= engine.least)
    # The heaviest stays, however light.
    kept[:, 0] = bones[:, 0] >= 0
    weights = np.where(kept, weights, 0.0)
    weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)
    if engine.levels:
        weights = np.round(weights * engine.levels)
        # What rounding leaves over is the heaviest's.
        weights[:, 0] += np.where(kept[:, 0], engine.levels - weights.sum(axis=1), 0.0)
        weights /= engine.levels
        kept &= weights > 0.0
    return Influences.of_padded(bones, weights, kept)
