# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that deform an object, and what they need of its mesh."""

from __future__ import annotations

import bpy

from ..attach import properties
from ..attach.properties import METHODS
from ..io.animation_paths import animated_paths


def methods_of(obj: bpy.types.Object) -> list[str]:
    """Returns the methods that its settings name now, each once."""
    settings = properties.of(obj)
    own = (replaced.method for replaced in list(settings.replaced_modifiers)[1:])
    named = [settings.method, settings.mixed_method, *own]
    return [name for name in dict.fromkeys(named) if name in METHODS]


def is_method_animated(obj: bpy.types.Object) -> bool:
    """Whether keys or drivers choose one of the methods."""
    return any(path.startswith("sinew.") and path.endswith("method") for path in animated_paths(obj))


def needs_surface(obj: bpy.types.Object) -> bool:
    """Whether one of its methods needs the mesh's triangles. If methods are animated, any could be chosen."""
    return any("topology" in METHODS[name].needs for name in methods_of(obj)) or is_method_animated(obj)
