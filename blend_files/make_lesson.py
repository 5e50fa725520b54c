# SPDX-License-Identifier: GPL-3.0-or-later
"""Make addon/lesson.blend, the lesson that a newcomer opens from Blender's Help menu.

    python blend_files/make_lesson.py [--out FILE]

needs `bpy` 4.2 as a module, as later versions save files that 4.2 may not open. The arm and the hand are
those of elbow.blend and wrist.blend; nothing of Sinew is in the file: the lesson is to add it.
"""

import argparse
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
ARM, HAND = HERE / "elbow.blend", HERE / "wrist.blend"
# The frame that is open: the arm is bent by 100 degrees, the hand twisted by 120.
FRAME, LAST = 16, 24
# Names of buttons, panels and methods are in quotes.
LESSON = """\
A LESSON IN SINEW, in ten minutes

Ctrl Z takes each click back. This file has no name yet: save it under one of your own.

1  LOOK
Press Space to play, and Esc to end. At frame 16 the wrist is pinched and the elbow flat: the Armature \
modifier blends the bones' matrices linearly.

2  ADD SINEW
Click the hand. Choose the tab "Sinew" in the sidebar (N shows it). Click "Add Sinew". Nothing moves: \
Sinew starts with what the modifier did.

3  CHOOSE A METHOD
In the menu of methods take "Dual Quaternion". The wrist is round again.

4  WHAT IT COSTS AT AN ELBOW
Click the arm, "Add Sinew", "Dual Quaternion". The elbow is not flat any more, but it bulges. Open \
"Stages and Scale" and switch "Limit Bulge" on: the bulge is all but gone.

5  SEE WHERE
Open the panel "Heat Map" and click its first button: nearly white is as at rest, blue is shorter, \
orange longer. "Numbers" below has numbers, beside those at rest and those of another method. Click the \
button once more to end it.

6  SEE BOTH
Click "Compare\u2026" in the tab, choose "Linear Blend" and OK: a copy stands beside. Alt Shift F flips \
between the two. In the panel "Compare" that is there now, "End Comparison" takes it away.

7  LET IT CHOOSE
Click "Suggest": every method is measured over the frames. A panel recommends one, and says why.

8  TAKE IT ALONG
"Bake\u2026" in the panel "Bake and Export" writes what you see for a Blender or an engine without Sinew, \
as caches or as helper bones. With "Motion" on "Pose", helper bones follow any animation.

Every button has a tooltip, and "Online Manual" in its right-click menu.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the lesson.")
    parser.add_argument("--out", type=Path, default=HERE.parent / "addon" / "lesson.blend")
    out = parser.parse_args().out.resolve()
    bpy.ops.wm.open_mainfile(filepath=str(ARM), load_ui=False)
    bpy.context.preferences.filepaths.save_version = 0
    add_hand()
    scene = bpy.context.scene
    scene.frame_end = LAST
    scene.camera.data.ortho_scale = 0.8
    scene.camera.rotation_euler, scene.camera.location = (np.pi / 2, 0.0, 0.0), (0.34, -2.0, 0.02)
    for obj in scene.objects:
        obj.select_set(False)
        # Renders have them.
        obj.hide_set(obj.type in ("CAMERA", "LIGHT"))
    bpy.context.view_layer.objects.active = None
    lay_out(bpy.data.texts.new("Lesson"))
    scene.frame_set(FRAME)
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(out), compress=True)


def add_hand() -> None:
    """Beside the arm, below its fist."""
    with bpy.data.libraries.load(str(HAND)) as (there, here):
        here.objects = [name for name in there.objects if name.startswith("Wrist")]
    for obj in here.objects:
        bpy.context.scene.collection.objects.link(obj)
        if obj.parent is None:
            obj.location = (0.55, 0.0, -0.22)


def lay_out(text: bpy.types.Text) -> None:
    """The lesson on the left, the 3D view beside it; no other workspace."""
    text.write(LESSON)
    text.cursor_set(0)
    window = bpy.context.window_manager.windows[0]
    workspace = bpy.data.workspaces["Layout"]
    window.workspace = workspace
    bpy.data.batch_remove([each for each in bpy.data.workspaces if each != workspace])
    screen = workspace.screens[0]
    view = next(area for area in screen.areas if area.type == "VIEW_3D")
    before = set(screen.areas)
    with bpy.context.temp_override(window=window, screen=screen, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.36)
    (reading,) = set(screen.areas) - before
    reading.type = "TEXT_EDITOR"
    space = reading.spaces.active
    space.text, space.show_word_wrap, space.show_line_numbers = text, True, False
    space.show_syntax_highlight, space.font_size, space.top = False, 13, 0
    space.show_region_footer = False
    space = view.spaces.active
    space.show_region_ui, space.shading.type = True, "SOLID"
    space.overlay.show_cursor = False
    space.region_3d.view_perspective = "ORTHO"
    space.region_3d.view_rotation = (0.7071068, 0.7071068, 0.0, 0.0)
    space.region_3d.view_location, space.region_3d.view_distance = (0.34, 0.0, 0.02), 0.85


if __name__ == "__main__":
    main()
