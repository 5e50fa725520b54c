# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet of a character: an image, and in a window a sheet over the 3D view that one clicks on."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import bpy

from ...attach import variant_settings
from ...attach.feature import Feature
from ...base.errors import SinewError
from ...skinning.variants import Variant
from ...ui import character, stepped
from ...ui.operators import OnSinewObjects
from ...ui.translations import counted, tr
from ..pages import contact_sheet, sheet_picture
from ..pages.sheet import Cell
from ..pages.sheet_layout import Hit, Layout, Panned
from ..variants import keys
from . import look, overlay, rows
from .save import SINEW_OT_save_contact_sheet

IMAGE = "Contact Sheet"
WHEEL = {"WHEELUPMOUSE": 1, "WHEELDOWNMOUSE": -1}
# A turn of the wheel zooms by this factor, or scrolls by so many pixels.
ZOOM, SCROLL = 1.15, 60.0
# Between two redraws: pictures are to come one after the other.
MOST_SECONDS = 0.5
# What moves a view.
NAVIGATION = {
    *("MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"),
    *("MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "NDOF_MOTION"),
}


class SINEW_OT_contact_sheet(OnSinewObjects, bpy.types.Operator):
    bl_label = "Contact Sheet"
    bl_description = (
        "Bend the joints of the character alike under its variants, and show all beside each other: a click "
        "on one uses it and goes there. The image Contact Sheet has it, too"
    )
    bl_options = {"REGISTER"}

    variants: bpy.props.StringProperty(
        name="Variants",
        description="Its rows, divided by commas, as `sinew methods` explains; empty: those of the character",
        options={"SKIP_SAVE"},
    )
    difference: bpy.props.BoolProperty(
        name="Difference",
        description="Colour all rows after the first by how far each place is from the first",
        options={"SKIP_SAVE"},
    )
    size: bpy.props.IntProperty(
        name="Size",
        description="Pixels of each picture in the image; over the view they fit",
        default=contact_sheet.SIZE,
        min=64,
        max=1024,
    )

    def run(self, context: bpy.types.Context) -> None:
        self._prepare(context)
        for cell in self._cells(self.size):
            self.sheet.add(cell)
        self._keep(context, self.size)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        area = context.area
        if bpy.app.background or area is None or area.type != "VIEW_3D" or overlay.shown:
            return self.execute(context)
        try:
            self._prepare(context)
        except SinewError as error:
            return self.failed(error)
        # A button is in the sidebar, and a quad view has several.
        regions = [region for region in (context.region, *area.regions) if region.type == "WINDOW"]
        self.area, self.region, self.view = area, regions[0], regions[0].data
        self.eye, self.gizmos = look.Eye.of(self.view), context.space_data.show_gizmo
        self.posed, self.flight, self.dragged = look.Posed(context.scene), None, None
        context.space_data.show_gizmo = False
        count, room = len(self.rows), overlay.free_box(area, self.region)
        scale = context.preferences.system.ui_scale
        layout = Layout.fitting(count, len(self.joints), room.width, room.height, scale)
        place = Panned(layout, room).moved(0.0, 0.0)
        self.shown = overlay.Shown(self.sheet, place, self.region.as_pointer())
        overlay.shown.append(self.shown)
        self._draw_anew()
        self._refresh(context)
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.area not in list(context.window.screen.areas):
            # The artist has closed it, or the workspace is another one.
            self._close(context)
            return {"CANCELLED"}
        try:
            if event.type == "TIMER":
                return self._go_on(context)
            if self.shown.is_looking:
                return self._while_looking(context, event)
            return self._on_sheet(context, event)
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"RUNNING_MODAL"}
        except BaseException:
            self._close(context)
            raise

    def cancel(self, context: bpy.types.Context) -> None:
        self._close(context)

    # --- The sheet

    def _prepare(self, context: bpy.types.Context) -> None:
        self.rows: Sequence[Variant] = rows.rows(context, self.variants)
        self.of_meshes = rows.of_meshes(context, self.rows)
        self.joints = rows.joints(context)
        self.sheet = rows.sheet(context, self.rows, self.joints, self.difference)

    def _cells(self, size: int) -> Iterator[Cell]:
        return contact_sheet.cells(self.joints, self.of_meshes, size)

    def _draw_anew(self) -> None:
        """Has all cells be drawn in the size in which they are shown."""
        self.size_drawn = self.shown.place.layout.size
        self.left: Iterator[Cell] | None = self._cells(self.size_drawn)
        self.drawn_from = time.perf_counter()

    def _go_on(self, context: bpy.types.Context) -> set[str]:
        """At a timer's tick."""
        if self.flight is not None:
            if not self.flight.step(self.view):
                self.flight = None
            self.area.tag_redraw()
        elif self.left is not None and not self.shown.is_looking:
            now = time.perf_counter()
            until = now + min(stepped.seconds_between_redraws(now - self.drawn_from), MOST_SECONDS)
            while self.left is not None and time.perf_counter() < until:
                self._take(next(self.left, None))
                if len(self.sheet.cells) == len(self.joints):
                    # The first row is seen at once.
                    break
            self.drawn_from = time.perf_counter()
            self._refresh(context)
        return {"RUNNING_MODAL"}

    def _take(self, cell: Cell | None) -> None:
        if cell is None:
            self.left = None
            return
        self.sheet.add(cell)
        self.shown.forget(cell.row, cell.column)

    def _refresh(self, context: bpy.types.Context) -> None:
        """Shows what has changed."""
        lead, shown = character.lead(context), self.shown
        room = overlay.free_box(self.area, self.region)
        if room != shown.place.room:
            # The window has another size.
            shown.place = replace(shown.place, room=room).moved(0.0, 0.0)
        now = variant_settings.read(lead) if lead is not None else None
        of_now = (row for row, each in enumerate(self.rows) if now is not None and each.agrees_with(now))
        shown.used = next(of_now, -1)
        ticks = contact_sheet.ticks(context.scene, self.sheet.scale) if self.sheet.is_difference else ("", "")
        if ticks != shown.ticks:
            shown.ticks = ticks
            shown.forget_all()
        shown.hint = self._hint()
        self.area.tag_redraw()

    def _hint(self) -> str:
        """What keys do."""
        used = self.shown.used
        if not self.shown.is_looking:
            text = (
                "Click: use this variant, and go there \u00b7 1 to 9: use a variant \u00b7 D: difference to "
                "the first \u00b7 wheel: scroll, with Ctrl: zoom \u00b7 Esc: close"
                if self.left is None
                else "Esc: stop drawing \u00b7 click: use this variant, and go there"
            )
            return tr(text)
        joint, pose = map(tr, self.sheet.columns[self.column])
        return tr(
            "{joint}: {pose}, {variant} \u00b7 1 to 9: use a variant \u00b7 Backspace, Esc: to the sheet",
            joint=joint,
            pose=pose,
            variant=self.sheet.rows[used] if used >= 0 else tr("other settings"),
        )

    def _keep(self, context: bpy.types.Context, size: int) -> None:
        """Makes the image of what is drawn."""
        ticks = contact_sheet.ticks(context.scene, self.sheet.scale)
        pixels = sheet_picture.compose(self.sheet, size, ticks)
        height, width = pixels.shape[:2]
        image = bpy.data.images.get(IMAGE)
        # One that the artist has saved as a file stays.
        if image is None or image.packed_file is None:
            image = bpy.data.images.new(IMAGE, width, height)
        image.scale(width, height)
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        image.pack()
        texts = (
            counted(len(self.rows), "{count} variant", "{count} variants"),
            counted(len(self.joints), "{count} joint", "{count} joints"),
        )
        self.report({"INFO"}, tr("{image}: {texts}", image=image.name, texts=", ".join(texts)))

    # --- Events

    def _on_sheet(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        shown, (x, y) = self.shown, self._mouse(event)
        is_press, number = event.value == "PRESS", keys.number_of(event)
        if event.type in ("MOUSEMOVE", "INBETWEEN_MOUSEMOVE"):
            self._on_move(x, y)
        elif event.type == "MIDDLEMOUSE":
            self.dragged = (x, y) if is_press else None
        elif event.type == "ESC" and is_press:
            if self.left is None:
                self._close(context)
                self._keep(context, self.size_drawn)
                return {"FINISHED"}
            self.left = None
        elif event.type == "LEFTMOUSE" and is_press:
            self._click(context, shown.place.hit(x, y))
        elif number is not None:
            self._use(context, number)
        elif event.type == "D" and is_press:
            self.sheet.is_difference = not self.sheet.is_difference
            shown.forget_all()
        elif event.type in WHEEL and is_press:
            if event.ctrl:
                self._zoom(ZOOM ** WHEEL[event.type], x, y)
            else:
                shown.place = shown.place.moved(0.0, SCROLL * WHEEL[event.type])
        self._refresh(context)
        return {"RUNNING_MODAL"}

    def _while_looking(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.value == "PRESS" and event.type in ("ESC", "BACK_SPACE"):
            self._back(context)
        elif (number := keys.number_of(event)) is not None:
            self._use(context, number)
        elif event.type in NAVIGATION or event.type.startswith("NUMPAD"):
            return {"PASS_THROUGH"}
        return {"RUNNING_MODAL"}

    def _mouse(self, event: bpy.types.Event) -> tuple[float, float]:
        """From the left and the top of the view's region."""
        return event.mouse_x - self.region.x, self.region.y + self.region.height - 1 - event.mouse_y

    def _on_move(self, x: float, y: float) -> None:
        shown = self.shown
        if self.dragged is not None:
            shown.place = shown.place.moved(x - self.dragged[0], y - self.dragged[1])
            self.dragged = x, y
        shown.over = shown.place.hit(x, y)

    def _zoom(self, factor: float, x: float, y: float) -> None:
        self.shown.place = self.shown.place.zoomed(factor, x, y)
        if self.shown.place.layout.size != self.size_drawn:
            self._draw_anew()

    def _click(self, context: bpy.types.Context, hit: Hit | None) -> None:
        if hit is None:
            return
        self._use(context, hit.row)
        if hit.column is not None:
            self._look(context, hit.column)

    def _use(self, context: bpy.types.Context, row: int) -> None:
        """One undo step, in which the character has its own pose."""
        if row >= len(self.rows):
            return
        was_looking = self.shown.is_looking
        self.posed.end()
        keys.use(self.rows[row])
        if was_looking:
            self.posed.show(self.joints[self.column])
        self._refresh(context)

    def _look(self, context: bpy.types.Context, column: int) -> None:
        joint, self.column = self.joints[column], column
        self.posed.show(joint)
        room = self.shown.place.room
        end = look.Eye.on(self.view, joint.view, room.width / self.region.width)
        self.flight = look.Flight(self.eye, end)
        self.shown.is_looking = True
        self._refresh(context)

    def _back(self, context: bpy.types.Context) -> None:
        self.flight, self.shown.is_looking = None, False
        self.posed.end()
        self.eye.show(self.view)
        self.drawn_from = time.perf_counter()
        self._refresh(context)

    def _close(self, context: bpy.types.Context) -> None:
        """Gives pose, frame and view back."""
        context.window_manager.event_timer_remove(self._timer)
        overlay.shown.clear()
        self.posed.end()
        self.eye.show(self.view)
        self.area.spaces.active.show_gizmo = self.gizmos
        self.area.tag_redraw()


FEATURE = Feature(
    (SINEW_OT_contact_sheet, SINEW_OT_save_contact_sheet), overlays=(overlay.draw,), end=overlay.shown.clear
)
