# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves a comparison as a page that turns."""

from collections.abc import Iterator
from pathlib import Path

import bpy

from ...attach import attach, properties
from ...core.output import file_to_write, write_text
from ...ui import stepped
from ...ui.translations import tr
from ..pages import viewer
from . import comparison, comparison_state

ENDING = ".html"


class SINEW_OT_save_comparison(stepped.WithDialog, bpy.types.Operator):
    bl_label = "Save as Page"
    bl_description = (
        "Save one HTML file in which the character turns and plays in any browser, under the methods that "
        "are compared"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew reads the frames of the page"
    stopped = "Stopped; no page was written"

    filepath: bpy.props.StringProperty(name="File", description="The page to write", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(
        name="Filter", description="The files that are shown", default="*.html", options={"HIDDEN"}
    )
    check_existing: bpy.props.BoolProperty(
        name="Check", description="Warn of a file of that name", default=True, options={"HIDDEN"}
    )
    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        state = comparison_state.of_scene(context.scene)
        is_any = state is not None and comparison.originals(state)
        return "" if is_any else "Compare methods first"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.in_steps:
            return super().invoke(context, event)
        self.has_dialog = True
        if not self.filepath:
            self.filepath = str(Path(bpy.data.filepath or "comparison").with_suffix(ENDING))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def check(self, _context: bpy.types.Context) -> bool:
        """Has the name end as a page's does."""
        path = Path(self.filepath)
        if not path.name or path.suffix.lower() == ENDING:
            return False
        self.filepath = str(path.with_name(path.name + ENDING))
        return True

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        self._target = file_to_write(bpy.path.abspath(self.filepath), (ENDING,))
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
            for step in viewer.page(scene, self._target.stem, of_each, attached, methods, frames):
                if isinstance(step, str):
                    self._text = step
                else:
                    yield step

    def finish(self, _context: bpy.types.Context) -> set[str]:
        write_text(self._target, self._text)
        self.report({"INFO"}, tr("Saved {path}", path=self._target.name))
        return {"FINISHED"}
