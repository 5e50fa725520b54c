# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender imports: what it can not read to the end is one sentence, and leaves no objects."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.base.errors import SinewError
from sinew_addon.io import files, usd


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


def usd_with(tmp_path, change):
    """An arm that Blender exported, whose skeleton's animation is then changed. Returns the file."""
    scenes.placed_arm()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 11
    path = tmp_path / "arm.usdc"
    bpy.ops.wm.usd_export(filepath=str(path), export_animation=True, export_armatures=True)
    usd_module, skel = usd.pxr("Usd", "UsdSkel")
    stage = usd_module.Stage.Open(str(path))
    (prim,) = [each for each in stage.Traverse() if each.IsA(skel.Animation)]
    own = skel.Animation(prim)
    change(own.GetTranslationsAttr(), own.GetRotationsAttr(), own.GetScalesAttr())
    stage.GetRootLayer().Save()
    return path


def rewrite(attribute, times):
    """Leaves samples at these times alone; None: the value of the last one, without a time."""
    values = [(time, attribute.Get(11.0 if time is None else time)) for time in times]
    attribute.Clear()
    for time, value in values:
        attribute.Set(value) if time is None else attribute.Set(value, time)


def as_it_is(*_channels):
    pass


def without_times(*channels):
    for channel in channels:
        rewrite(channel, [None])


def apart(translations, rotations, scales):
    rewrite(translations, [1.0, 6.0, 11.0])
    rewrite(rotations, [1.0, 11.0])
    rewrite(scales, [None])


def together(translations, rotations, scales):
    rewrite(translations, [1.0, 6.0, 11.0])
    rewrite(rotations, [1.0, 6.0, 11.0])
    rewrite(scales, [None])


def off(path):
    """How far Blender has vertices from what UsdSkel plays, at most."""
    import other_usd

    frames = [3.0, 6.0, 9.0]
    _rest, expected = other_usd.points_at(path, frames)
    (obj,) = [each for each in bpy.context.scene.objects if each.type == "MESH"]
    most = 0.0
    for frame, points in zip(frames, expected, strict=True):
        bpy.context.scene.frame_set(int(frame))
        shown = scenes.world_points(obj)
        most = max(most, float(np.abs(shown - points).max()))
    return most


@pytest.mark.outer_versions
@pytest.mark.skipif(not usd.has_pxr(), reason="Blender lends USD's modules from 4.4 on")
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (as_it_is, None),
        (together, None),
        (without_times, "its pose has no time sample, and Blender's importer leaves it out; give it one"),
        (apart, "its rotations have no samples at some times of other channels, and Blender's importer does"),
    ],
)
def test_what_the_importer_of_usd_leaves_out(empty_file, tmp_path, change, said):
    path = usd_with(tmp_path, change)
    sentences = files.open_file(path)
    assert (off(path) > 0.1) == (said is not None)
    if said is None:
        assert sentences == []
    else:
        (sentence,) = sentences
        assert said in sentence


@pytest.mark.outer_versions
def test_a_usd_file_that_is_cut_off(empty_file, tmp_path, capfd):
    path = tmp_path / "cut.usdc"
    path.write_bytes(b"PXR-USDC" + bytes(100))
    with pytest.raises(SinewError, match=r"cut\.usdc: Blender can not read it: "):
        files.open_file(path)
    assert not bpy.data.objects
