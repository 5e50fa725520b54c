# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender imports: what it can not read to the end is one sentence, and leaves no objects."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import bpy
import pytest
from sinew_addon.base.errors import SinewError
from sinew_addon.io import files


def write_glb(path, header, binary):
    text = json.dumps({"asset": {"version": "2.0"}, **header}).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


@pytest.mark.outer_versions
@pytest.mark.parametrize("codec", ["Draco", "Meshopt"])
def test_compressed_by_what_bpy_has_no_library_for(empty_file, tmp_path, capfd, codec):
    """A triangle without compression, and a node whose mesh says that it is compressed."""
    if list(Path(bpy.utils.resource_path("LOCAL")).parent.rglob(f"lib*_{codec.lower()}*.so")):
        pytest.skip("this Blender has the library")
    if codec == "Meshopt" and bpy.app.version < (5, 0, 0):
        pytest.skip("Blender refuses it by name")
    name = {"Draco": "KHR_draco_mesh_compression", "Meshopt": "EXT_meshopt_compression"}[codec]
    attributes = {"attributes": {"POSITION": 0}}
    header = {
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "nodes": [{"mesh": 0}, {"mesh": 1}],
        "scenes": [{"nodes": [0, 1]}],
        "buffers": [{"byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteLength": 36, "byteStride": 12}],
        "accessors": [
            {
                "bufferView": k,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0] * 3,
                "max": [0] * 3,
            }
            for k in (0, 1)
        ],
        "meshes": [{"primitives": [attributes]}, {"primitives": [{"attributes": {"POSITION": 1}}]}],
    }
    if codec == "Draco":
        own = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
        header["meshes"][1]["primitives"][0]["extensions"] = own
    else:
        own = {"buffer": 0, "byteLength": 36, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"}
        header["bufferViews"][1]["extensions"] = {name: own}
    write_glb(tmp_path / "a.glb", header, bytes(36))
    with pytest.raises(
        SinewError, match=rf"a\.glb: Blender can not read it: it is compressed by {codec}, for"
    ):
        files.open_file(tmp_path / "a.glb")
    assert not bpy.data.objects
    assert not bpy.data.meshes
    assert "Traceback" not in capfd.readouterr().err
