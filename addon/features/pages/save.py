# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators that save a page that turns have in common."""

from collections.abc import Generator, Iterator
from pathlib import Path

import bpy

from ...base.output import file_to_write, write_text
from ...ui import stepped
from ...ui.translations import tr

ENDING = ".html"


class SavesPage(stepped.WithDialog):
    """A base class: subclasses have page(context), which yields the progress and returns the text.

    usual_name  of the page of a file that was never saved
    """

    usual_name = "page"
    stopped = "Stopped; no page was written"

    filepath: bpy.props.StringProperty(name="File", description="The page to write", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(
        name="Filter", description="The files that are shown", default="*.html", options={"HIDDEN"}
    )
    check_existing: bpy.props.BoolProperty(
        name="Check", description="Warn of a file of that name", default=True, options={"HIDDEN"}
    )

    def page(self, context: bpy.types.Context, title: str) -> Generator[float, None, str]:
        raise NotImplementedError

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.in_steps:
            return super().invoke(context, event)
        self.has_dialog = True
        if not self.filepath:
            self.filepath = str(Path(bpy.data.filepath or self.usual_name).with_suffix(ENDING))
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
        self._text = yield from self.page(context, self._target.stem)

    def run(self, _context: bpy.types.Context) -> None:
        write_text(self._target, self._text)
        self.report({"INFO"}, tr("Saved {path}", path=self._target.name))
