# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew reskin`, then `sinew restore`: every property of every datablock has its old value."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import bpy
import pytest
import scenes
import whole_file
from conftest import REPOSITORY
from program import run_sinew
from sinew_addon.attach import properties
from sinew_addon.io import files

pytestmark = pytest.mark.outer_versions

FRAMES = [1, 6, 11]


def content(path: Path) -> dict[str, object]:
    files.open_file(path, load_ui=True)
    # Reading an attribute with a single value makes Blender 5.2 expand it.
    whole_file.of_open_file("meshes")
    found = whole_file.of_open_file()
    # Last, because going to a frame writes animated values.
    return found | whole_file.evaluated(FRAMES)


def full_scene(folder: Path) -> Path:
    """A file with something of everything that Sinew touches."""
    bpy.data.workspaces[0].name = "Animator's own"
    obj, armature = scenes.make_arm(sides=6, rings=9)
    mesh = obj.data
    mesh.uv_layers.new(name="UV")
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    mesh.attributes.new("sinew_notes", "FLOAT", "POINT")
    mesh.attributes.active_index = 1
    mesh["made by"] = {"who": "an artist", "when": [1, 2, 3]}
    obj["price"] = 3.5
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 1
    obj.modifiers.new("Second", "ARMATURE").object = armature
    obj.modifiers["Second"].show_viewport = obj.modifiers["Second"].show_render = False
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    obj.modifiers["Armature"].show_on_cage = True
    obj.modifiers["Armature"].use_pin_to_last = False
    obj.modifiers.active = obj.modifiers["Subdivision"]
    driver = obj.driver_add('modifiers["Subdivision"].render_levels').driver
    driver.expression = "1 + 1"
    obj.keyframe_insert('modifiers["Armature"].show_in_editmode', frame=3)

    keyed, _ = scenes.make_arm(sides=6, rings=9, name="Keyed")
    scenes.key_shape(keyed, (1.3, 1.3, 1.3))
    keyed.active_shape_key_index = 1
    keyed.modifiers.active = None

    # Empty animation data, which unlinking an action leaves behind.
    bare, _ = scenes.make_arm(sides=6, rings=9, name="Bare")
    bare.animation_data_create()
    layered, _ = scenes.make_arm(sides=6, rings=9, name="Layered")
    layered.keyframe_insert("location", frame=1)
    track = layered.animation_data.nla_tracks.new()
    track.strips.new("strip", 1, layered.animation_data.action)
    layered.animation_data.action = None

    add_what_takes_helpers()
    add_what_is_shown_elsewhere(obj)

    # Posed by hand, in addition to its keys: nothing may change the frame before saving.
    armature.pose.bones[0].rotation_quaternion = (math.cos(0.2), 0.0, math.sin(0.2), 0.0)
    bpy.context.scene.frame_current = 4
    path = scenes.save(folder / "full.blend")
    library = folder / "library" / "props.blend"
    library.parent.mkdir()
    shutil.copy(path, library)
    with bpy.data.libraries.load(str(library), link=True, relative=True) as (_, to):
        to.materials, to.objects = ["Material"], ["Bare"]
    mesh.materials.append(to.materials[0])
    hero = to.objects[0]
    bpy.context.scene.collection.objects.link(hero)
    hero.override_create(remap_local_usages=True).name = "Override"
    return scenes.save(path)


def add_what_takes_helpers() -> None:
    # Objects for which Sinew needs helper objects: an upstream modifier, chained modifiers, a deforming
    # parent.
    mirrored, _ = scenes.make_arm(sides=6, rings=9, name="Mirrored")
    scenes.put_in_front(mirrored, "MIRROR", "Mirror").use_axis = (False, False, True)
    chained, chain = scenes.make_arm(sides=6, rings=9, name="Chained")
    second = chained.modifiers.new("Multi", "ARMATURE")
    second.object, second.use_multi_modifier, second.vertex_group = chain, True, "bone.1"
    chained.keyframe_insert('modifiers["Multi"].show_viewport', frame=2)
    child, parent = scenes.make_arm(sides=6, rings=9, name="Child")
    scenes.deform_by_parent(child, parent)


def add_what_is_shown_elsewhere(obj: bpy.types.Object) -> None:
    # Two objects of one mesh; one that is only rendered; one that no armature deforms.
    scenes.copied(obj, "Twin", linked=True)
    shadow, _ = scenes.make_arm(sides=6, rings=9, name="Render Only")
    shadow.modifiers["Armature"].show_viewport = False
    shadow.modifiers["Armature"].show_expanded = False
    shadow.hide_viewport = True
    off, _ = scenes.make_arm(sides=6, rings=9, name="Off")
    off.modifiers["Armature"].show_viewport = off.modifiers["Armature"].show_render = False
    other = bpy.data.scenes.new("Other Scene")
    elsewhere, rig = scenes.make_arm(sides=6, rings=9, name="Elsewhere")
    scenes.move_to(other.collection, elsewhere, rig)
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True
    excluded, _ = scenes.make_arm(sides=6, rings=9, name="Excluded")
    scenes.move_to(hidden, excluded)


def test_everything_comes_back(tmp_path):
    """A full scene and two samples, saved by this Blender, since it adds what older files lack."""
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    paths = [full_scene(tmp_path / "input")]
    for sample in (REPOSITORY / "blend_files" / name for name in ("tentacle.blend", "wrist.blend")):
        files.open_file(sample, load_ui=True)
        paths.append(scenes.save(tmp_path / "input" / sample.name))
    bytes_before = [path.read_bytes() for path in paths]
    run_sinew("reskin", *paths, "--method", "dq", "--out", tmp_path / "reskinned", "--no-pictures")
    run_sinew("restore", tmp_path / "reskinned", "--out", tmp_path / "restored")
    assert [path.read_bytes() for path in paths] == bytes_before
    for path in paths:
        files.open_file(tmp_path / "reskinned" / path.name)
        assert [obj for obj in bpy.data.objects if properties.has_sinew(obj)], path.name
        before = content(path)
        assert whole_file.differences(before, content(tmp_path / "restored" / path.name)) == [], path.name


def test_what_sinew_is_not_on_is_a_sentence(tmp_path):
    scenes.make_arm()
    path = scenes.save(tmp_path / "plain.blend")
    result = run_sinew("restore", path, "--out", tmp_path / "out", status=1)
    assert "no mesh is deformed by Sinew" in result.stderr
    assert not (tmp_path / "out" / "plain.blend").exists()
