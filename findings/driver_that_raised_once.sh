#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A Python driver that raises in one frame is not evaluated again in later frames, nor after the file was saved and
# opened, though its expression would be right there: until somebody edits the driver.
#
# A driver of an object's location calls a function of bpy.app.driver_namespace that raises at frame 5 alone. Which
# values have frames 4, 5, 6, 7?
#
#   expected: 4, whatever at 5, then 6 and 7 again: an error on the console for one frame
#   seen on 2026-11-29, bpy 5.3.0 (Python 3.13): 4, 0, 0, 0; opened again 0, 0; its expression assigned to itself:
#   6, 7. 4.2.23 the same
#
# For rigs with scripted drivers: catch errors in the function, and give a value. Needs python3.13 and a registry of
# Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.13 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==5.3.0
cat >"$folder/shown.py" <<'PYTHON'
import tempfile
from pathlib import Path

import bpy


def number(frame: float) -> float:
    if frame == 5:
        raise ValueError("not here")
    return frame


def values(*frames: int) -> list[float]:
    bpy.app.driver_namespace["number"] = number
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        yield bpy.data.objects["driven"].location.x


driven = bpy.data.objects.new("driven", None)
bpy.context.scene.collection.objects.link(driven)
driven.driver_add("location", 0).driver.expression = "number(frame)"
seen = {"first": list(values(4, 5, 6, 7))}
path = str(Path(tempfile.mkdtemp(), "driven.blend"))
bpy.ops.wm.save_as_mainfile(filepath=path)
bpy.ops.wm.open_mainfile(filepath=path)
seen["opened again"] = list(values(6, 7))
driver = bpy.data.objects["driven"].animation_data.drivers[0].driver
driver.expression = driver.expression
seen["assigned"] = list(values(6, 7))
bpy.app.driver_namespace.clear()
print(bpy.app.version_string, seen)
raise SystemExit(seen != {"first": [4, 0, 0, 0], "opened again": [0, 0], "assigned": [6, 7]})
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-29"
