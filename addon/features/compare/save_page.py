# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves a comparison as a page that turns."""

from collections.abc import Generator

import bpy

from ...attach import attach, properties
from ...ui import stepped
from ..pages import viewer
from ..pages.save import SavesPage
from . import comparison, comparison_state


class SINEW_OT_save_comparison(SavesPage, bpy.types.Operator):
    bl_label = "Save as Page"
    bl_description = (
        "Save one HTML file in which the character turns and plays in any browser, under the methods that "
        "are compared"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew reads the frames of the page"
    usual_name = "comparison"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        state = comparison_state.of_scene(context.scene)
        is_any = state is not None and comparison.originals(state)
        return "" if is_any else "Compare methods first"

    def page(self, context: bpy.types.Context, title: str) -> Generator[float, None, str]:
        scene = context.scene
        state = comparison_state.of_scene(scene)
        assert state is not None, "refusal() says so"
        meshes = comparison.originals(state)
        # A copy that is shown is evaluated.
        copies = sorted(comparison_state.copies_of(state), key=lambda copy: copy.hide_get())
        of_each = {
            obj: [copy for copy in copies if properties.of(copy).identity.copied == obj]
            for obj in meshes
            if attach.armature_of(obj) is not None
        }
        attached = [obj for obj in meshes if obj not in of_each]
        armatures = list(dict.fromkeys(attach.armature_of(obj) for obj in of_each))
        frames = stepped.frames_over(scene, armatures, self.over)
        methods = comparison_state.methods_of(state)
        with stepped.kept_frame(scene, armatures):
            return (yield from viewer.page(scene, title, of_each, attached, methods, frames))
