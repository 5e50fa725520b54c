# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: exports glTF with the file browser, whose side bar has a check box."""

from __future__ import annotations

import json
import struct
from collections.abc import Generator, Iterator
from pathlib import Path

import bpy
import five_meshes
import window

_ZIP, FOLDER = window.arguments()
# In a picture of a window of 1280 x 800.
CHECK_BOX, EXPORT = (1145, 307), (1207, 757)


def header(path: Path) -> dict:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])


def export(path: Path, clicked: tuple[tuple[int, int], ...]) -> Iterator[None]:
    with window.in_view3d("WINDOW"):
        bpy.ops.export_scene.gltf("INVOKE_DEFAULT", filepath=str(path))
    yield from window.wait()
    for place in clicked:
        yield from window.click(place)
    yield from window.click(EXPORT)
    for _tick in range(20):
        if any(area.type == "VIEW_3D" for area in bpy.context.window_manager.windows[0].screen.areas):
            break
        yield


def of_sinew(path: Path) -> dict[str, object]:
    return {
        mesh["name"]: [
            mesh.get("extensions", {}).get("SINEW_skinning", {}).get("method"),
            "_SINEW_CENTRE" in mesh["primitives"][0]["attributes"],
        ]
        for mesh in header(path)["meshes"]
    }


def steps() -> Generator[None, None, dict]:
    # In the main window, so that a picture of the screen shows it.
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    five_meshes.make(vertices=2000)
    with window.in_view3d():
        bpy.ops.sinew.add()
    for obj in bpy.data.objects:
        if obj.type == "MESH":
            obj.sinew.method = "cor"
    yield from window.wait()
    yield from export(FOLDER / "without.glb", ())
    yield from export(FOLDER / "with.glb", (CHECK_BOX,))
    facts = {name: of_sinew(FOLDER / f"{name}.glb") for name in ("without", "with")}
    facts["attributes"] = [
        a.name for mesh in bpy.data.meshes for a in mesh.attributes if a.name.startswith("_SINEW")
    ]
    facts["on"] = [obj.sinew.enabled for obj in bpy.data.objects if obj.sinew.replaced_modifiers]
    return facts
