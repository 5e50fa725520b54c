# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: Sinew's texts in German, and after a change of language."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import five_meshes
import window

_ZIP, FOLDER = window.arguments()
ADDON = "bl_ext.user_default.sinew"


def texts() -> dict[str, str]:
    """A text of each kind, as Blender shows it now."""
    from bl_ext.user_default.sinew.ui import character_operators, state_text
    from bl_ext.user_default.sinew.ui.translations import counted

    translations = bpy.app.translations
    body = bpy.data.objects["Body"]
    given = type("Given", (), {"method": "dq"})
    return {
        "panel": translations.pgettext_iface("Stages and Scale"),
        "operator": translations.pgettext_iface("Rebind", "Operator"),
        "tooltip": translations.pgettext_tip(bpy.ops.sinew.rebind.get_rna_type().description),
        "own tooltip": character_operators.SINEW_OT_use_method.description(bpy.context, given),
        "choice": bpy.types.UILayout.enum_item_name(body.sinew, "method", "dq"),
        "put together": counted(4, "{count} mesh", "{count} meshes"),
        "state": state_text.sentence_of(body),
        # Blender's own translation is used where it has one.
        "blender's": translations.pgettext_iface("Vertex Group"),
    }


def steps() -> Generator[None, None, dict]:
    view = bpy.context.preferences.view
    view.language = "de_DE"
    view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    five_meshes.make(vertices=6000)
    bpy.context.scene.frame_set(12)
    with window.in_view3d():
        bpy.ops.sinew.add()
    window.open_sidebar()
    yield from window.wait()
    window.choose_tab()
    yield from window.wait()
    facts = {"german": texts()}
    view.language = "en_US"
    yield
    facts["english"] = texts()
    view.language = "de_DE"
    bpy.ops.preferences.addon_disable(module=ADDON)
    facts["without"] = bpy.app.translations.pgettext_iface("Stages and Scale")
    yield
    view.language = "en_US"
    bpy.ops.preferences.addon_enable(module=ADDON)
    return facts
