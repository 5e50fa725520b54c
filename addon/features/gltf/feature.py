# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF export: a check box in the exporter, stored in the scene."""

from collections.abc import Callable
from typing import Any

import bpy

from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from . import export


class SinewGltf(bpy.types.PropertyGroup):
    """What the glTF exporter writes in addition."""

    skinning: bpy.props.BoolProperty(
        name="Skinning Data",
        description="Write for engines how Sinew deforms each mesh: its method and stages, with what these "
        "keep of its vertices and bones",
        default=False,
        options=set(),
    )


_ADDON = __package__.rpartition(".features")[0]


def draw(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    """Draws in the exporter's sidebar."""
    header, body = layout.panel("GLTF_sinew", default_closed=False)
    header.label(text="Sinew", translate=False)
    if body is not None:
        body.use_property_split = True
        body.prop(context.scene.sinew_gltf, "skinning")


def before_export(settings: dict[str, Any]) -> None:
    """settings: the exporter's own."""
    context = bpy.context
    found, left_out = export.collect(context) if context.scene.sinew_gltf.skinning else ([], [])
    export.begin(found, left_out, settings)


def _exporters_panels() -> dict[str, Callable]:
    """Returns the functions that draw in the exporter's sidebar, by the names of extensions. Blender 4.2
    finds an extension's draw_export() by itself, and stores it here; newer ones expect it here."""
    try:
        import io_scene_gltf2
    except ImportError:
        # Blender can be built without the exporter.
        return {}
    return getattr(io_scene_gltf2, "exporter_extension_layout_draw", {})


def _begin() -> None:
    _exporters_panels()[_ADDON] = draw


def _end() -> None:
    export.end()
    _exporters_panels().pop(_ADDON, None)


FEATURE = Feature(
    (SinewGltf,),
    {"Scene.sinew_gltf": bpy.props.PointerProperty(type=SinewGltf)},
    subscriptions=((subscribers.saving, export.end), (subscribers.deformed, export.end_if_failed)),
    begin=_begin,
    end=_end,
)
