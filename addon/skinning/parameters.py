# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of methods and stages, by the names that commands and job files use, such as mix.group."""

import math
from collections.abc import Iterable, Mapping
from typing import TypeAlias

import sinew

from ..base.errors import WrongUse
from .engines import METHODS, Number

Value: TypeAlias = float | int | bool | str

OFF = "off"
"""The value "none" of a parameter that names a method."""

PRESETS = {
    "recommended": "Method, Twist Spread, Limit Bulge and Delta Mush, each where it helps: measured on "
    "the character, in the frames in which its joints bend most, or without an action in a battery of poses"
}
"""What chooses a method and stages, by its name."""

SWITCHES = {"on": True, "off": False, "true": True, "false": False}


def by_full_name() -> dict[str, sinew.Parameter | Number]:
    """Every parameter by its full name."""
    owners = [*METHODS.values(), *sinew.stages()]
    return {f"{owner.name}.{each.id}": each for owner in owners for each in owner.parameters}


def parse(texts: Iterable[str]) -> dict[str, Value]:
    """Returns the values of NAME=VALUE texts by full names; later ones override earlier ones. A stage's name
    alone stands for its first parameter.

    Raises WrongUse.
    """
    parameters = by_full_name()
    short = {stage.name: f"{stage.name}.{stage.parameters[0].id}" for stage in sinew.stages()}
    values: dict[str, Value] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise WrongUse(f"expected NAME=VALUE, got {text!r}")
        full_name = short.get(name, name)
        if full_name not in parameters:
            raise WrongUse(f"expected one of {', '.join((*short, *parameters))}, got {name!r}")
        values[full_name] = _read(name, parameters[full_name], value)
    return values


def _read(name: str, parameter: sinew.Parameter | Number, text: str) -> Value:
    if parameter.kind in ("float", "int"):
        return _read_number(name, parameter, text)
    if parameter.kind == "bool":
        if text not in SWITCHES:
            raise WrongUse(f"{name}: expected on or off, got {text!r}")
        return SWITCHES[text]
    if parameter.kind == "vertex_group":
        return text
    choices = [OFF, *(m.name for m in sinew.methods())] if parameter.kind == "method" else parameter.choices
    if text not in choices:
        raise WrongUse(f"{name}: expected one of {', '.join(choices)}, got {text!r}")
    return text


def _read_number(name: str, parameter: sinew.Parameter | Number, text: str) -> float | int:
    try:
        number = int(text) if parameter.kind == "int" else float(text)
    except ValueError:
        number = math.nan
    least = -math.inf if parameter.min is None else parameter.min
    most = math.inf if parameter.max is None else parameter.max
    if not (math.isfinite(number) and least <= number <= most):
        wanted = "a whole number" if parameter.kind == "int" else "a number"
        raise WrongUse(f"{name}: expected {wanted} from {least:g} to {most:g}, got {text!r}")
    return number


def as_texts(values: Mapping[str, Value]) -> list[str]:
    """The inverse of parse()."""
    words = {True: "on", False: "off"}
    return [f"{name}={words[value] if isinstance(value, bool) else value}" for name, value in values.items()]
