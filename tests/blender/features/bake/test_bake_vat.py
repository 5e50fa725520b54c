# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex animation textures: a reader of glTF and Blender's of pictures find in them the shapes that Sinew
had, as an engine's shader would."""

from __future__ import annotations

import json

import addon_utils
import bpy
import numpy as np
import pytest
import read_glb
import scenes
from program import run_sinew
from sinew_addon.base.errors import SinewError
from sinew_addon.features.bake import bake, vat
from whole_file import assert_same, content

FRAMES = [1, 4, 6, 11]
# From Blender's axes, as the engines' importers take .glb files: Unreal has centimetres.
ENGINES = {
    "unreal": lambda x, y, z: (100.0 * x, -100.0 * y, 100.0 * z),
    "unity": lambda x, y, z: (-x, z, -y),
    "gltf": lambda x, y, z: (x, z, -y),
}


@pytest.fixture
def character():
    """An arm with a UV map, moved and scaled as one, and an eye on a bone, which has none."""
    obj, armature = scenes.make_arm(bones=3)
    armature.location, armature.scale = (0.3, -0.4, 0.2), (1.3, 1.3, 1.3)
    obj.parent, obj.scale = armature, (1.1, 0.9, 1.0)
    obj.data.uv_layers.new(name="Skin")
    scenes.add_sinew(obj, "dq")
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6, radius=0.2)
    eye = bpy.context.object
    bpy.ops.object.shade_smooth()
    eye.parent, eye.parent_type, eye.parent_bone = armature, "BONE", "bone.2"
    return obj, eye


def texels(path):
    """[height, width, 3], from the top."""
    return scenes.pixels_of(path, are_numbers=True)[::-1, :, :3]


class Played:
    """What a shader has: [frames, corners of the file, 3]."""

    def __init__(self, path):
        self.about = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        file, self.rest, places = read_glb.File(path), [], []
        self.names = [node["name"] for node in file.header["nodes"]]
        for node in file.header["nodes"]:
            assert not {"matrix", "translation", "rotation", "scale"} & set(node)
            (primitive,) = file.header["meshes"][node["mesh"]]["primitives"]
            attributes = primitive["attributes"]
            self.rest.append(file.array(attributes["POSITION"]).astype(np.float64))
            places.append(file.array(attributes[f"TEXCOORD_{self.about['uv_map']}"]))
        size = self.about["width"], self.about["height"]
        self.columns, self.rows = (np.concatenate(places) * size).astype(int).T
        # The middle of a texel, so that no rounding chooses another.
        assert np.abs(np.concatenate(places) * size % 1.0 - 0.5).max() < 1e-2
        self.vertices = self.rows * self.about["width"] + self.columns
        # From glTF's axes to Blender's.
        self.rest = np.concatenate(self.rest) @ np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
        self.positions, self.normals = (
            self._read(path.parent, self.about[each]) for each in ("positions", "normals")
        )

    def _read(self, folder, texture):
        found = texels(folder / texture["file"]) * texture["scale"] + texture["bias"]
        assert found.shape == (self.about["height"], self.about["width"], 3)
        rows = self.about["rows"] * np.arange(len(self.about["frames"]))[:, None] + self.rows
        return found[rows, self.columns]


def world_of(objects):
    """Points and normals, [vertices, 3], in the world."""
    points, normals = [], []
    for obj in objects:
        evaluated = scenes.evaluated(obj)
        world, mesh = np.array(evaluated.matrix_world), evaluated.data
        points.append(scenes.world_points(obj))
        own = np.array([normal.vector[:] for normal in mesh.vertex_normals]) @ np.linalg.inv(world[:3, :3])
        normals.append(own / np.linalg.norm(own, axis=1, keepdims=True))
    return np.concatenate(points), np.concatenate(normals)


def baked(character, path, options=vat.DEFAULT_VAT, frames=FRAMES):
    started = bake.start([character[0]], "vat", frames, path, overwrite=False, vat=options)
    shares = list(started.sample())
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    started.place()
    started.publish()
    return Played(path)


@pytest.mark.parametrize(
    ("axes", "kind", "tolerance", "columns"),
    [("unreal", vat.EXR, 1e-6, 4096), ("unity", vat.EXR_HALF, 1e-3, 100), ("gltf", vat.PNG, 2e-5, 37)],
)
def test_an_engine_has_the_shapes(character, tmp_path, monkeypatch, axes, kind, tolerance, columns):
    """In several rows a frame, too. What is written is all that changes."""
    monkeypatch.setattr(vat, "MOST_COLUMNS", columns)
    bpy.context.scene.frame_set(5)
    before = content()
    played = baked(character, tmp_path / "arm.glb", vat.VatOptions(axes, kind))
    assert_same(before)
    assert played.names == ["Arm_VAT", f"{character[1].name}_VAT"]
    count = sum(len(obj.data.vertices) for obj in character)
    assert set(played.vertices) == set(range(count))
    assert (played.about["rows"] > 1) == (columns < count)
    assert played.about["width"] <= columns
    engine, worst_normal, shapes = ENGINES[axes], 0.0, []
    for number, frame in enumerate(FRAMES):
        bpy.context.scene.frame_set(frame)
        points, normals = world_of(character)
        found = np.stack(engine(*played.rest.T), axis=1) + played.positions[number]
        expected = np.stack(engine(*points.T), axis=1)
        size = np.linalg.norm(np.ptp(expected, axis=0))
        assert np.abs(found - expected[played.vertices]).max() <= tolerance * size, frame
        shapes.append(expected)
        lengths = np.linalg.norm(played.normals[number], axis=1)
        np.testing.assert_allclose(lengths, 1.0, atol=2e-3)
        unit = np.stack(engine(*normals.T), axis=1) / (100.0 if axes == "unreal" else 1.0)
        worst_normal = max(worst_normal, np.abs(played.normals[number] - unit[played.vertices]).max())
    assert worst_normal < 2e-3
    assert np.abs(shapes[0] - shapes[-1]).max() > 0.1
    np.testing.assert_allclose(played.about["low"], np.min(shapes, axis=(0, 1)), rtol=1e-5)
    np.testing.assert_allclose(played.about["high"], np.max(shapes, axis=(0, 1)), rtol=1e-5)


def test_the_command_writes_it(character, tmp_path):
    path, out = tmp_path / "arm.blend", tmp_path / "out"
    scenes.save(path)
    words = "bake", path, "--to", "vat", "--frames", "1-11", "--step", 2, "--texels", "png", "--out", out
    before = path.read_bytes()
    run_sinew(*words)
    assert path.read_bytes() == before
    names = ["arm.glb", "arm.json", "arm_normals.png", "arm_positions.png"]
    assert sorted(each.name for each in out.iterdir()) == names
    played = Played(out / "arm.glb")
    assert played.about["frames"] == [1, 3, 5, 7, 9, 11]
    assert played.about["rate"] == bpy.context.scene.render.fps / 2
    assert "is there already" in run_sinew(*words, status=1).stderr
    run_sinew(*words, "--overwrite")


def test_what_can_not_be_a_texture_is_said(character, tmp_path, monkeypatch):
    obj, _eye = character
    addon_utils.disable("io_scene_gltf2")
    try:
        with pytest.raises(SinewError, match=r"Switch on the add-on glTF 2\.0 format"):
            baked(character, tmp_path / "arm.glb")
    finally:
        addon_utils.enable("io_scene_gltf2")
    monkeypatch.setattr(vat, "MOST_ROWS", 3)
    with pytest.raises(SinewError, match="3 are the most; bake fewer frames"):
        baked(character, tmp_path / "arm.glb")
    monkeypatch.undo()
    decimate = obj.modifiers.new("Decimate", "DECIMATE")
    scenes.key(decimate, "ratio", [(1, 1.0), (11, 0.3)])
    with pytest.raises(SinewError, match="textures need one number"):
        baked(character, tmp_path / "arm.glb")
    assert list(tmp_path.iterdir()) == []
