# SPDX-License-Identifier: GPL-3.0-or-later
"""The lesson: a file with an arm, a hand and a page of text (blend_files/make_lesson.py), for new users."""

from pathlib import Path

import bpy

from ..attach.feature import Feature
from ..base.errors import SinewError
from .operators import Named
from .translations import tr

FILE = Path(__file__).resolve().parent.parent / "lesson.blend"


class SINEW_OT_open_lesson(Named, bpy.types.Operator):
    bl_label = "Open the Lesson"
    bl_description = "Open a file with an arm, a hand and a page that shows in ten minutes what Sinew does"
    bl_options = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        # Blender asks whether to save the open file, unless the user has switched that off.
        if not context.preferences.view.use_save_prompt:
            return self.execute(context)
        return _open("INVOKE_DEFAULT")

    def run(self, _context: bpy.types.Context) -> set[str]:
        if bpy.data.is_dirty:
            raise SinewError(tr("Save this file first: the lesson takes its place"))
        return _open("EXEC_DEFAULT")


def _open(how: str) -> set[str]:
    """Opens it as a new file, without a name, so that it is not saved in the extension's folder."""
    return bpy.ops.wm.read_homefile(how, filepath=str(FILE), load_ui=True)


FEATURE = Feature((SINEW_OT_open_lesson,))
