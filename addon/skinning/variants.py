# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants: whole choices of how a character is deformed, a method with its stages; as text, and back."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import sinew

from ..base.errors import WrongUse
from ..base.phrases import Phrase, phrase
from . import parameters
from .engines import METHODS
from .parameters import OFF, PRESETS, Value
from .scale_rule import SCALE_RULES
from .stages import StageValues

BLENDER = "blender"
"""In the place of a method: the Armature modifier as it is in the file."""
FILE = "file"
"""In the place of a method: what the file has, Sinew with its settings or the Armature modifier."""

WHOLE = {
    BLENDER: "Armature modifier",
    FILE: "As in the File",
    **{name: name.title() for name in PRESETS},
}
"""What stands for a whole variant, with its label: no stage may follow."""

SETTINGS: Mapping[str, tuple[str, ...]] = {
    "scale_rule": tuple(rule.name for rule in SCALE_RULES),
    "normals": ("BY_SINEW", "SKINNED", "LEAVE"),
}
"""Settings of a mesh beside method and stages, with their values."""

_STAGES = {stage.name: stage for stage in sinew.stages()}
_GROUPS = {name for name, each in parameters.by_full_name().items() if each.kind == "vertex_group"}

USUAL = "dq, cor, dq+twist_spread+bulge_limit, dq+twist_spread+delta_mush"
"""What a character is compared under that has no variants of its own."""

SYNTAX = (
    "METHOD[+STAGE]..., such as dq+twist_spread+delta_mush:iterations=10, and mix=METHOD for the mix; "
    "+scale_rule=RULE, +normals=WHO; blender, file or recommended alone; NAME= in front names it"
)


@dataclass(frozen=True)
class Variant:
    """
    method   of METHODS or WHOLE
    stages   that are on, in the library's order
    values   of parameters that differ from their defaults, and of SETTINGS that it sets, by full names; never
             vertex groups, whose names belong to a mesh
    name     for people; may be empty
    """

    method: str
    stages: tuple[str, ...] = ()
    values: tuple[tuple[str, Value], ...] = ()
    name: str = ""

    @classmethod
    def of(
        cls,
        method: str,
        stages: Iterable[str] = (),
        values: Mapping[str, Value] | None = None,
        name: str = "",
    ) -> Variant:
        """values: any of parameters and SETTINGS; those that say nothing new are left out."""
        on, known = set(stages), parameters.by_full_name()
        order = [stage for stage in _STAGES if stage in on]
        kept = {}
        for full_name, value in (values or {}).items():
            owner = full_name.partition(".")[0]
            is_switch = owner != "mix" and full_name == _switch_of(owner)
            if full_name in _GROUPS or is_switch or not (owner in SETTINGS or owner == method or owner in on):
                continue
            if owner in SETTINGS or value != known[full_name].default:
                kept[full_name] = value
        return cls(method, tuple(order), tuple(sorted(kept.items())), name)

    @classmethod
    def of_values(cls, method: str, values: Mapping[str, Value]) -> Variant:
        """Of all values of stages, which say what is on."""
        on = [name for name in _STAGES if values.get(_switch_of(name), False) not in (False, OFF)]
        return cls.of(method, on, values)

    @property
    def text(self) -> str:
        """What parse() reads, without the name."""
        own = dict(self.values)
        parts = [self.method + self._written(self.method, own)]
        for stage in self.stages:
            first = f"={own.pop('mix.method', OFF)}" if stage == "mix" else ""
            parts.append(stage + first + self._written(stage, own))
        parts += [f"{name}={own[name]}" for name in SETTINGS if name in own]
        return "+".join(parts)

    @property
    def key(self) -> str:
        """The text with the name, which no method's name equals."""
        return f"{self.name}={self.text}"

    @staticmethod
    def _written(owner: str, values: Mapping[str, Value]) -> str:
        own = {name: value for name, value in values.items() if name.startswith(f"{owner}.")}
        return "".join(f":{text.removeprefix(f'{owner}.')}" for text in parameters.as_texts(own))

    @property
    def settings(self) -> dict[str, str]:
        """Those of SETTINGS that it sets."""
        return {name: str(value) for name, value in self.values if name in SETTINGS}

    @property
    def all_values(self) -> dict[str, Value]:
        """Every parameter of its method and of every stage but vertex groups, by its full name."""
        if self.method in WHOLE:
            return {}
        own, found = dict(self.values), {}
        for name, parameter in parameters.by_full_name().items():
            owner = name.partition(".")[0]
            if owner not in (self.method, *_STAGES) or name in _GROUPS:
                continue
            default = OFF if parameter.default is None else parameter.default
            found[name] = own.get(name, default)
            if owner in _STAGES and owner != "mix" and name == _switch_of(owner):
                found[name] = owner in self.stages
        return found

    @property
    def assignments(self) -> dict[str, Value]:
        """All that using it sets: all_values, and those of SETTINGS that it sets."""
        return self.all_values | self.settings

    @property
    def stage_values(self) -> StageValues:
        """Of the stages that follow the blend; lengths as they are written."""
        found: dict[str, dict[str, Value]] = {name: {} for name in self.stages if name != "mix"}
        for name, value in self.all_values.items():
            stage, _dot, own = name.partition(".")
            if stage in found:
                found[stage][own] = value
        return found

    @property
    def mix(self) -> str:
        """The second method of the mix; empty without one."""
        return str(dict(self.values).get("mix.method", ""))

    def agrees_with(self, other: Variant) -> bool:
        """Whether another has all that this one sets."""
        own, others = dict(self.values), dict(other.values)
        settings = {name: others[name] for name in own if name in SETTINGS and name in others}
        others = {name: value for name, value in others.items() if name not in SETTINGS} | settings
        return (self.method, self.stages, own) == (other.method, other.stages, others)

    @property
    def label(self) -> Phrase:
        """Method and stages, as "Centres of Rotation with Twist Spread and Limit Bulge"."""
        text = _label(self.method)
        stages = [
            phrase("Mix of {method}", method=_label(self.mix))
            if name == "mix"
            else phrase(_STAGES[name].label)
            for name in self.stages
        ]
        if not stages:
            return text
        joined = stages[0]
        for label in stages[1:-1]:
            joined = phrase("{first}, {second}", first=joined, second=label)
        if len(stages) > 1:
            joined = phrase("{first} and {second}", first=joined, second=stages[-1])
        return phrase("{method} with {stages}", method=text, stages=joined)

    @property
    def title(self) -> Phrase:
        """The name, where it has one, with the label."""
        if not self.name:
            return self.label
        return phrase("{name}: {label}", name=self.name, label=self.label)


def title_of(variant: Variant, chosen: Iterable[Variant]) -> Phrase:
    """Returns its title; of a preset and of FILE with what they are.

    chosen  what it is for each mesh
    """
    found = list(dict.fromkeys(replace(each, name="") for each in chosen))
    if variant.method not in (FILE, *PRESETS) or len(found) != 1:
        return variant.title
    return phrase("{name}: {label}", name=variant.title, label=found[0].label)


def parse(text: str) -> Variant:
    """Reads one variant. Raises WrongUse."""
    text = re.sub(r"\s*([=+:])\s*", r"\1", text.strip())
    matched = re.fullmatch(r"(?:([^=+:,]*)=)?([^+:]*)(.*)", text, re.DOTALL)
    assert matched is not None, "any text matches"
    name, method, rest = matched[1] or "", matched[2], matched[3]
    if method not in METHODS and method not in WHOLE:
        known = ", ".join((*METHODS, *WHOLE))
        raise WrongUse(f"variant {text!r}: expected one of {known}, got {method!r}")
    if method in WHOLE and rest:
        raise WrongUse(f"variant {text!r}: nothing may follow {method}")
    own, *parts = rest.split("+")
    try:
        stages, values = [], dict(_parameters_of(method, own))
        for part in parts:
            head, colon, after = part.partition(":")
            owner, _equals, value = head.partition("=")
            if owner in SETTINGS:
                values[owner] = _setting(owner, value, colon + after)
                continue
            stages.append(_stage(owner, value))
            if owner == "mix":
                values |= parameters.parse([f"mix={value}"])
            values |= _parameters_of(owner, colon + after)
    except WrongUse as error:
        raise WrongUse(f"variant {text!r}: {error}") from None
    return Variant.of(method, stages, values, name)


def parse_list(text: str) -> list[Variant]:
    """Reads variants that commas divide, each once. Raises WrongUse."""
    return list(dict.fromkeys(parse(each) for each in text.split(",")))


def is_key(name: str) -> bool:
    """Whether it is the key of a variant, and no method's name."""
    return "=" in name


def name_of(name: str) -> str:
    """Of a variant's key its name, or its text where it has none; a method's name as it is."""
    if not is_key(name):
        return name
    variant = parse(name)
    return variant.name or variant.text


def named(variant: Variant, name: str) -> Variant:
    """The same under another name. Raises WrongUse for one that the text could not have."""
    if re.search(r"[=+:,\n]", name):
        raise WrongUse(f"name {name!r}: has one of = + : ,")
    return replace(variant, name=name.strip())


def pattern() -> str:
    """A regular expression that every variant's text matches, for schemas of other programs."""
    value = r"[^=+:,\s]+"
    own = rf"(:[a-z_]+={value})*"
    stages = "|".join(name for name in _STAGES if name != "mix")
    settings = "|".join(rf"{name}=({'|'.join(map(re.escape, of))})" for name, of in SETTINGS.items())
    return (
        rf"^([^=+:,]*=)?({'|'.join(WHOLE)}|({'|'.join(METHODS)}){own}"
        rf"(\+(({stages}|mix={value}){own}|{settings}))*)$"
    )


def _label(method: str) -> Phrase:
    if method in WHOLE:
        return phrase(WHOLE[method])
    return phrase(METHODS[method].label)


def _switch_of(owner: str) -> str:
    return f"{owner}.{_STAGES[owner].parameters[0].id}" if owner in _STAGES else ""


def _parameters_of(owner: str, text: str) -> dict[str, Value]:
    """text: empty, or :NAME=VALUE for each"""
    first, *texts = text.split(":")
    if first:
        raise WrongUse(f"expected + or : before {first!r}")
    values = parameters.parse(f"{owner}.{each}" for each in texts)
    group = next((name for name in values if name in _GROUPS), None)
    if group is not None:
        raise WrongUse(f"{group}: a vertex group belongs to a mesh, and is chosen there")
    if _switch_of(owner) in values:
        raise WrongUse(f"{owner}: is on where it is named, and has no other switch")
    return values


def _setting(name: str, value: str, after: str) -> str:
    found = next((each for each in SETTINGS[name] if each.lower() == value.lower()), None)
    if found is None or after:
        raise WrongUse(f"{name}: expected one of {', '.join(SETTINGS[name])}, got {value + after!r}")
    return found


def _stage(owner: str, value: str) -> str:
    if owner not in _STAGES:
        raise WrongUse(f"expected one of {', '.join((*_STAGES, *SETTINGS))}, got {owner!r}")
    if (owner == "mix") != bool(value) or (owner == "mix" and value == OFF):
        wanted = "mix=METHOD" if owner == "mix" else f"{owner} alone"
        raise WrongUse(f"expected {wanted}, got {owner}{f'={value}' if value else ''}")
    return owner
