# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of operators for options that commands have, too."""

from collections.abc import Callable
from typing import TypeVar

import bpy

from ..base.options import Shown, options_of

Class = TypeVar("Class", bound=type)


def with_options(*options: type) -> Callable[[Class], Class]:
    """A class decorator: gives an operator a property for each option of dataclasses."""

    def add(cls: Class) -> Class:
        for each in options:
            for name, (default, shown) in options_of(each).items():
                cls.__annotations__[name] = _property(default, shown)
        return cls

    return add


def _property(default: object, shown: Shown) -> object:
    known = {"name": shown.label, "description": shown.text, "default": default}
    if shown.choices:
        return bpy.props.EnumProperty(items=list(shown.choices), **known)
    if isinstance(default, bool):
        return bpy.props.BoolProperty(**known)
    if isinstance(default, str):
        return bpy.props.StringProperty(**known)
    if shown.kind == "percent":
        return bpy.props.FloatProperty(min=0.0, max=100.0, precision=3, subtype="PERCENTAGE", **known)
    most = {} if shown.soft_most is None else {"soft_max": shown.soft_most}
    return bpy.props.IntProperty(min=shown.least, **most, **known)
