# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab, and its content where the native library does not load."""

import textwrap
from collections.abc import Sequence

import bpy

from .. import native
from .translations import tr

# Characters of the interface font per pixel of sidebar at scale 1; Blender does not wrap labels.
CHARACTERS_PER_PIXEL = 0.14
# For a name among others.
NAME_LENGTH = 24


class Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Sinew"


class SINEW_PT_unavailable(Sidebar, bpy.types.Panel):
    bl_label = "Sinew"

    def draw(self, _context: bpy.types.Context) -> None:
        draw_text(self.layout, native.load_error() or "Restart Blender to use Sinew", icon="ERROR")


def redraw() -> None:
    """Has Blender draw the sidebars of all 3D views again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "UI":
                    region.tag_redraw()


def uncovered(area: bpy.types.Area, region: bpy.types.Region) -> tuple[float, float]:
    """Returns the range, in pixels from the left edge of a view's region, that neither toolbar nor sidebar
    covers. Artists flip both to the other edge."""
    left, right = 0.0, float(region.width)
    for other in area.regions:
        begin, width = other.x - region.x, other.width
        # Those that do not overlap the view lie beside it.
        if other.type not in ("TOOLS", "UI") or width <= 1 or not -width < begin < region.width:
            continue
        if 2 * begin + width < region.width:
            left = max(left, begin + width)
        else:
            right = min(right, begin)
    return left, right


def characters(pixels: int | None = None) -> int:
    """The number of characters that fit this width without the interface's scale, or that of the region that
    is drawn."""
    context = bpy.context
    pixels = pixels or context.region.width / context.preferences.system.ui_scale
    return int(pixels * CHARACTERS_PER_PIXEL)


def shortened(name: str, most: int = NAME_LENGTH) -> str:
    """Returns a long name without its middle, as both ends distinguish names: "Character_…_low.003"."""
    if len(name) <= most:
        return name
    ahead = most // 2
    return f"{name[:ahead]}…{name[len(name) - (most - ahead - 1) :]}"


def names_text(names: Sequence[str], most: int = 3) -> str:
    """Returns the first names as one text, with the number of the others."""
    text = ", ".join(shortened(name) for name in names[:most])
    more = len(names) - most
    return tr("{names} and {count} more", names=text, count=more) if more > 0 else text


def draw_text(
    layout: bpy.types.UILayout,
    text: str,
    icon: str = "NONE",
    alert: bool = False,
    pixels: int | None = None,
    **values: object,
) -> None:
    """Draws text in the user's language, wrapped into as many labels as the width needs.

    pixels  of a dialog, without the interface's scale; None: the region's width
    values  as tr() takes them
    """
    width = max(20, characters(pixels) - (4 if icon != "NONE" else 0))
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    # A name may be longer than a line; wrapped, it would look like two.
    text = " ".join(shortened(word, width) for word in tr(text, **values).split())
    for number, line in enumerate(textwrap.wrap(text, width, break_on_hyphens=False)):
        shown = icon if number == 0 or icon == "NONE" else "BLANK1"
        column.label(text=line, icon=shown, translate=False)
