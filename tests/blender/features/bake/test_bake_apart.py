# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports in a second Blender, as in the window: the result is the same as in this one, and stopped
exports leave nothing behind. Here the second one is a Python with bpy, in the window another process of
the same Blender."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import program
import pytest
import scenes
from sinew_addon.base.errors import SinewError
from sinew_addon.features.bake import bake, bake_apart
from sinew_addon.features.bake.baked_files import EXPORTS
from test_bake import FRAMES, METHOD, read_elsewhere

pytestmark = pytest.mark.outer_versions

KINDS = list(EXPORTS)


def below(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def bake_to(folder, kind, apart, **more):
    options = dict(kind=kind, frames="1-11", folder=str(folder), **more)
    if apart:
        # What the dialog starts; without a window it runs to its end.
        return bpy.ops.sinew.bake("INVOKE_DEFAULT", in_steps=True, **options)
    return bpy.ops.sinew.bake(**options)


def shape_of_scene():
    scene = bpy.context.scene
    return (
        scene.frame_current,
        scene.frame_start,
        scene.frame_end,
        sorted(obj.name for obj in bpy.data.objects),
        sorted(obj.name for obj in bpy.context.selected_objects),
        sorted(image.name for image in bpy.data.images),
        bpy.data.filepath,
    )


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_same_as_in_this_blender(arm, tmp_path, kind):
    """With unsaved data: a pose, an object's position, another scene with its own view layer."""
    obj, _path = arm
    scenes.add_sinew(obj, METHOD)
    armature = bpy.data.objects["Arm Rig"]
    scenes.key_pose(armature, degrees=60.0)
    obj.location = (1.0, 2.0, 3.0)
    other, _rig = scenes.make_arm(name="Left Alone")
    scene = bpy.data.scenes.new("Second Scene")
    layer = scene.view_layers.new("Second Layer")
    for each in (obj, armature, other):
        scene.collection.objects.link(each)
    window = bpy.context.window
    window.scene, window.view_layer = scene, layer
    for each in bpy.context.view_layer.objects:
        each.select_set(each == obj)
    bpy.context.view_layer.objects.active = obj
    before = shape_of_scene()
    read = []
    for apart in (False, True):
        out = tmp_path / f"out {apart}"
        assert bake_to(out, kind, apart) == {"FINISHED"}
        (written,) = out.iterdir()
        read.append(read_elsewhere(written, FRAMES, tmp_path))
    assert shape_of_scene() == before
    here, there = read
    assert here.keys() == there.keys()
    for name, values in here.items():
        np.testing.assert_array_equal(there[name], values)
    names = set(here) - {"uvs", "materials"}
    assert len(names) == 1
    assert len(here[names.pop()]) == len(FRAMES)


def test_one_that_crashes_is_told(arm, tmp_path):
    obj, path = arm
    scenes.add_sinew(obj, METHOD)
    before = below(path.parent)
    started = bake.start([obj], "alembic", list(range(1, 2000)), path.with_suffix(".abc"), overwrite=False)
    shares = bake_apart.sample(started)
    assert next(share for share in shares if share > 0.0) < 1.0
    (child,) = program.own_children()
    child.kill()
    with pytest.raises(SinewError, match=r"arm\.abc: can not be written: Blender .*\) while exporting it"):
        list(shares)
    assert below(path.parent) == before


def test_painted_textures_are_saved_first(arm, tmp_path):
    obj, path = arm
    scenes.add_sinew(obj, METHOD)
    image = bpy.data.images.new("Skin Colour", 4, 4)
    image.use_fake_user = True
    image.pixels[0] = 1.0
    with pytest.raises(RuntimeError, match="Skin Colour: painted and not saved; save or pack it first"):
        bake_to(path.parent, "usd", apart=True)
    image.pack()
    assert bake_to(path.parent, "usd", apart=True) == {"FINISHED"}


@pytest.mark.slow
@pytest.mark.parametrize("links", [True, False])
def test_simulations_keep_their_caches_on_disk(arm, tmp_path, links, monkeypatch):
    """Without its cache, a cloth is simulated again, here with another gravity. On Windows few users may
    create links."""

    def refused(*_arguments, **_named):
        raise OSError(1314, "A required privilege is not held by the client")

    if not links:
        monkeypatch.setattr(Path, "symlink_to", refused)
    obj, path = arm
    scenes.add_sinew(obj, METHOD)
    bpy.context.scene.frame_set(1)
    cloth = obj.modifiers.new("Cloth", "CLOTH")
    cloth.point_cache.frame_end = 11
    cloth.point_cache.use_disk_cache = True
    scenes.save(path)
    with bpy.context.temp_override(
        scene=bpy.context.scene, active_object=obj, object=obj, point_cache=cloth.point_cache
    ):
        bpy.ops.ptcache.bake(bake=True)
    assert cloth.point_cache.is_baked
    expected = scenes.shapes(obj, FRAMES)
    cached = below(path.parent)
    assert [name for name in cached if name.endswith(".bphys")]
    bpy.context.scene.gravity = (0.0, 0.0, 40.0)
    scenes.save(path)
    out = tmp_path / "out"
    assert bake_to(out, "alembic", apart=True) == {"FINISHED"}
    assert below(path.parent) == cached
    read = read_elsewhere(out / "arm.abc", FRAMES, tmp_path)
    assert scenes.worst(read["Arm"], expected) <= 1e-6
    assert [p.name for p in out.iterdir()] == ["arm.abc"]
