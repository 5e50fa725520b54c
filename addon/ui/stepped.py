# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that go through frames: in a window in steps, with progress and Esc; otherwise at once."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..base.errors import SinewError
from ..deform import characters, precompute_watch, session
from ..io import pose_io
from .operators import Acting
from .sidebar import redraw
from .translations import tr

# The window redraws in between: rarely enough to cost little, often enough for Esc. A large character without
# a graphics card takes longer to draw than to measure.
SECONDS_BETWEEN_REDRAWS, MOST_SECONDS, TIMES_DRAWING = 0.1, 1.0, 4.0
OVER = [
    ("SCENE", "Scene's Frames", "The scene's frame range, or its preview range where that is on"),
    ("ACTION", "Action's Frames", "From the first to the last key of the armature's action"),
]
# For the property that chooses one of them.
OVER_WHICH = {"name": "Over", "description": "The frames to go through", "items": OVER}


class Stepped(Acting):
    """A base class: subclasses have steps(context), which yields the progress, and run(context), which uses
    the result. Both may raise SinewError, which is reported.

    saying   what it does, in the status bar
    stopped  what Esc reports; closing steps() has to restore everything
    """

    saying = "Sinew goes through frames"
    stopped = "Stopped; nothing has changed"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        precompute_watch.finish(context)
        try:
            for _share in self.steps(context):
                pass
        except SinewError as error:
            return self.failed(error)
        return super().execute(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        precompute_watch.finish(context)
        self._left, self._drawn_from = self.steps(context), time.perf_counter()
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.0, window=context.window)
        manager.progress_begin(0.0, 1.0)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self.cancel(context)
            self.report({"WARNING"}, self.stopped)
            return {"CANCELLED"}
        # Other events are blocked, as changes made meanwhile would affect the result.
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        share = None
        try:
            share = self._advance()
        except SinewError as error:
            return self.failed(error)
        finally:
            if share is None:
                self._end(context)
        if share is None:
            return super().execute(context)
        context.window_manager.progress_update(share)
        _running[type(self).bl_idname] = share
        redraw()
        text = tr("{doing}: {share} (Esc stops)", doing=tr(self.saying), share=f"{share:.0%}")
        show_progress(context.workspace, text, share)
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Called also when the window closes."""
        self._left.close()
        self._end(context)

    def _advance(self) -> float | None:
        """Returns the progress after some steps; None at the end."""
        now, share = time.perf_counter(), 0.0
        until = now + seconds_between_redraws(now - self._drawn_from)
        while share is not None and time.perf_counter() < until:
            share = next(self._left, None)
        self._drawn_from = time.perf_counter()
        return share

    def _end(self, context: bpy.types.Context) -> None:
        manager = context.window_manager
        _running.clear()
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        clear_progress(context.workspace)
        for area in context.screen.areas:
            area.tag_redraw()


def seconds_between_redraws(drawing: float) -> float:
    """drawing: the seconds that the window took last, and all else between two calls"""
    return min(max(SECONDS_BETWEEN_REDRAWS, TIMES_DRAWING * drawing), MOST_SECONDS)


# The width of dialogs without the interface's scale, as Blender has it.
DIALOG = 300


class WithDialog(Stepped):
    """A base class: asks for the settings in a dialog first."""

    in_steps: bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.in_steps:
            self.has_dialog = True
            return context.window_manager.invoke_props_dialog(self, width=DIALOG)
        return super().invoke(context, event)

    def values(self) -> dict[str, object]:
        """Returns the settings of the dialog, as another call takes them."""
        return self.as_keywords(ignore=("in_steps",))

    def cancel(self, context: bpy.types.Context) -> None:
        # The dialog itself has nothing to end.
        if self.in_steps:
            super().cancel(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "has_dialog", False):
            # The operator of a dialog cannot run in steps itself.
            name = type(self).__name__.removeprefix("SINEW_OT_")
            getattr(bpy.ops.sinew, name)("INVOKE_DEFAULT", in_steps=True, **self.values())
            return {"CANCELLED"}
        return super().execute(context)


class IntoFolder:
    """A base class of operators that write files."""

    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where files go; // is beside this file",
        default="//",
        subtype="DIR_PATH",
        # Without it, newer versions warn about "//"; older ones do not know it.
        options={"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5) else set(),
    )
    overwrite: bpy.props.BoolProperty(
        name="Overwrite", description="Replace files that are there already", default=False
    )

    def target(self, suffix: str, is_written: bool = True) -> Path:
        """The file of the open file's name. Raises SinewError where it is to be written and has no folder."""
        name = Path(bpy.data.filepath).stem
        if is_written and self.folder.startswith("//") and not name:
            raise SinewError("Save the file first, or choose a folder that is not beside it")
        return Path(bpy.path.abspath(self.folder)) / f"{name or 'untitled'}{suffix}"


def frames_over(scene: bpy.types.Scene, armatures: Sequence[bpy.types.Object], over: str) -> list[int]:
    """Returns the frames of one of OVER. Raises SinewError where there is no action."""
    if over == "SCENE":
        if scene.use_preview_range:
            return list(range(scene.frame_preview_start, scene.frame_preview_end + 1))
        return list(range(scene.frame_start, scene.frame_end + 1))
    actions = [a.animation_data.action for a in armatures if a.animation_data is not None]
    ranges = [tuple(action.frame_range) for action in actions if action is not None]
    if not ranges:
        names = ", ".join(armature.name for armature in armatures)
        raise SinewError(f"{names}: no action; choose one, or the scene's frames")
    first, last = min(start for start, _end in ranges), max(end for _start, end in ranges)
    return list(range(round(first), round(last) + 1))


@contextmanager
def kept_frame(scene: bpy.types.Scene, armatures: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Context in which any frame can be set; afterwards the scene is at its own frame, and armatures are
    posed as before, keyed or not."""
    poses = [(armature, pose_io.read_channels(armature.pose.bones)) for armature in armatures]
    try:
        with characters.kept_frame(scene):
            yield
    finally:
        moved = [armature for armature, pose in poses if pose_io.write_channels(armature.pose.bones, pose)]
        for armature in moved:
            armature.update_tag()
        if moved:
            bpy.context.view_layer.update()
            session.refresh(bpy.context)


# The share that is done, by the operator's name; Blender runs one at a time.
_running: dict[str, float] = {}


def draw_progress(layout: bpy.types.UILayout, operator: str) -> bool:
    """Draws how far it is, in the place of its button. Returns False where it does not run."""
    if operator not in _running:
        return False
    share = _running[operator]
    layout.progress(factor=share, text=f"{share:.0%}", translate=False)
    return True


# In units of a button's width.
WIDTH = 24


def show_progress(workspace: bpy.types.WorkSpace, text: str, share: float) -> None:
    """Shows a bar filled to `share`, 0 to 1, until clear(); `text` is translated already."""

    def draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        row.progress(factor=share, text=text, translate=False)

    workspace.status_text_set(draw)


def clear_progress(workspace: bpy.types.WorkSpace) -> None:
    """Shows again what Blender shows by itself."""
    workspace.status_text_set(None)
