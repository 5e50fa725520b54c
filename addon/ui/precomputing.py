# SPDX-License-Identifier: GPL-3.0-or-later
"""The progress of precomputations, in the panel and the status bar; Esc and buttons that stop and continue
them."""

from collections.abc import Sequence

import bpy

from ..attach.feature import Feature
from ..attach.subscribers import subscribers
from ..deform import precompute_watch, precomputing
from ..deform.skinned_object import SkinnedObject
from ..skinning.precompute import precomputations
from . import operators, sidebar, stepped
from .translations import tr

# Seconds between checks whether there is still something to stop.
INTERVAL = 0.2


class SINEW_OT_watch_precomputation(bpy.types.Operator):
    bl_idname = "sinew.watch_precomputation"
    bl_label = "Watch Precomputation"
    bl_description = "Show in the status bar how far precomputations are; Esc stops them"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self._timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not precomputations.running:
            self._end(context)
            return {"FINISHED", "PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            precompute_watch.stop()
            self.report({"WARNING"}, "Stopped; the Sinew tab has a button to go on")
            return {"CANCELLED"}
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Called when the window closes, or another file is loaded."""
        self._end(context)

    def _end(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        stepped.clear_progress(context.workspace)


class SINEW_OT_stop_precomputation(operators.Named, bpy.types.Operator):
    bl_label = "Stop"
    bl_description = "Stop computing what the method needs; the Armature modifier's shape stays"
    bl_options = {"INTERNAL"}

    def run(self, _context: bpy.types.Context) -> None:
        precompute_watch.stop()


class SINEW_OT_precompute(operators.Named, bpy.types.Operator):
    bl_label = "Compute"
    bl_description = "Compute what the method needs of this mesh"
    bl_options = {"INTERNAL"}

    def run(self, _context: bpy.types.Context) -> None:
        precompute_watch.resume()


def draw(layout: bpy.types.UILayout, pairs: Sequence[tuple[bpy.types.Object, SkinnedObject | None]]) -> None:
    """Draws, for all meshes of a character together, the progress with a button that stops it, or a button
    that starts it again."""
    known = [(obj, skinned) for obj, skinned in pairs if skinned is not None]
    runs: dict[str, list[float]] = {}
    for obj, skinned in known:
        for what, run in precomputing.running(obj, skinned).items():
            runs.setdefault(what, []).append(run.progress)
    for what, shares in runs.items():
        share = sum(shares) / len(shares)
        found, done = tr(what), f"{share:.0%}"
        text = tr("Finding {what}: {share}", what=found, share=done)
        if len(shares) > 1:
            text = tr("Finding {what} of {count} meshes: {share}", what=found, count=len(shares), share=done)
        row = layout.row(align=True)
        row.progress(factor=share, text=text, translate=False)
        row.operator("sinew.stop_precomputation", text="", icon="X")
    stopped = (what for obj, skinned in known for what in precomputing.stopped(obj, skinned))
    for what in dict.fromkeys(stopped):
        layout.operator("sinew.precompute", text=tr("Find {what}", what=tr(what)), icon="PLAY")


def _show() -> None:
    """Redraws the panels, and starts an operator in the window that reacts to Esc."""
    runs = precomputations.running
    if runs:
        _watch()
    share = min((run.progress for run in runs), default=1.0)
    for window in bpy.context.window_manager.windows:
        if _watcher_of(window) is not None:
            if runs:
                text = tr("Sinew computes what its methods need: {share} (Esc stops)", share=f"{share:.0%}")
                stepped.show_progress(window.workspace, text, share)
            else:
                stepped.clear_progress(window.workspace)
    sidebar.redraw()


def _watch() -> None:
    # One in a window such as a render's would end with it.
    windows = [each for each in bpy.context.window_manager.windows if not each.screen.is_temporary]
    if bpy.app.background or not windows or any(map(_watcher_of, bpy.context.window_manager.windows)):
        return
    with bpy.context.temp_override(window=windows[0], area=None, region=None):
        bpy.ops.sinew.watch_precomputation("INVOKE_DEFAULT")


def _watcher_of(window: bpy.types.Window) -> bpy.types.Operator | None:
    own = SINEW_OT_watch_precomputation.__name__
    return next((each for each in window.modal_operators if each.bl_idname == own), None)


FEATURE = Feature(
    (SINEW_OT_watch_precomputation, SINEW_OT_stop_precomputation, SINEW_OT_precompute),
    subscriptions=((subscribers.precomputation_shown, _show),),
)
