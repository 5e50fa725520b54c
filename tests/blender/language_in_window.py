# SPDX-License-Identifier: GPL-3.0-or-later
"""In Blender's window, with Sinew's zip: its texts in German, and after a change of language.

Prints "FACTS" and a line of JSON, and saves a picture of the panel in the folder.

    blender --factory-startup --enable-event-simulate --python language_in_window.py -- sinew.zip FOLDER
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import five_meshes
import window

ZIP, FOLDER = window.arguments()
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


def steps() -> Iterator[None]:
    view = bpy.context.preferences.view
    view.language = "de_DE"
    view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True
    window.install(ZIP)
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
    window.photograph(FOLDER / "german.png")
    view.language = "en_US"
    yield
    facts["english"] = texts()
    view.language = "de_DE"
    bpy.ops.preferences.addon_disable(module=ADDON)
    facts["without"] = bpy.app.translations.pgettext_iface("Stages and Scale")
    yield
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps())
