# SPDX-License-Identifier: GPL-3.0-or-later
"""What a part of Sinew adds to Blender, and takes away again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import bpy


@dataclass(frozen=True)
class Feature:
    """
    classes        operators, panels, menus and groups of properties
    properties     what types of Blender's get: "Scene.sinew_NAME"
    subscriptions  lists of functions, each with the function that is added
    menus          functions that draw at the end of Blender's menus
    overlays       functions that draw over 3D views
    begin, end     called after everything else is there, and before any of it goes
    """

    classes: tuple[type, ...] = ()
    properties: Mapping[str, object] = field(default_factory=dict)
    subscriptions: tuple[tuple[list, Callable], ...] = ()
    menus: Mapping[str, Callable] = field(default_factory=dict)
    overlays: tuple[Callable[[], None], ...] = ()
    begin: Callable[[], None] | None = None
    end: Callable[[], None] | None = None

    def register(self) -> None:
        """Requires that the classes are registered."""
        for name, prop in self.properties.items():
            owner, _dot, attribute = name.partition(".")
            setattr(getattr(bpy.types, owner), attribute, prop)
        for functions, function in self.subscriptions:
            functions.append(function)
        for menu, draw in self.menus.items():
            getattr(bpy.types, menu).append(draw)
        for draw in self.overlays:
            _overlays[draw] = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")
        if self.begin is not None:
            self.begin()

    def unregister(self) -> None:
        """Reverses register()."""
        if self.end is not None:
            self.end()
        for draw in self.overlays:
            bpy.types.SpaceView3D.draw_handler_remove(_overlays.pop(draw), "WINDOW")
        for menu, draw in self.menus.items():
            getattr(bpy.types, menu).remove(draw)
        for functions, function in self.subscriptions:
            functions.remove(function)
        for name in self.properties:
            owner, _dot, attribute = name.partition(".")
            delattr(getattr(bpy.types, owner), attribute)


_overlays: dict[Callable[[], None], object] = {}
