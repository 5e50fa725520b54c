# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves the contact sheet as a page in which the character turns."""

from __future__ import annotations

from collections.abc import Generator

import bpy

from ...ui.operators import OnSinewObjects
from ..pages import contact_sheet, motion_page
from ..pages.save import SavesPage
from . import rows


class SINEW_OT_save_contact_sheet(OnSinewObjects, SavesPage, bpy.types.Operator):
    bl_label = "Save Sheet as Page"
    bl_description = (
        "Save one HTML file for any browser: the contact sheet, and the character that turns in its range of "
        "motion. A click on a picture goes there"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew draws the sheet and reads the poses of the page"
    usual_name = "sheet"

    def page(self, context: bpy.types.Context, _title: str) -> Generator[float, None, str]:
        variants = rows.rows(context, "")
        of_meshes = rows.of_meshes(context, variants)
        with rows.switched_on(context):
            joints = rows.joints(context)
            sheet = rows.sheet(context, variants, joints)
            keys = dict(zip([each.key for each in variants], of_meshes, strict=True))
            return (yield from motion_page.page(context.scene, sheet, joints, keys, contact_sheet.SIZE))
