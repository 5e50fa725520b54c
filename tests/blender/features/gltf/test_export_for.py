# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew export --for`: a file has what its player plays best, unless options say otherwise; and what is said
of the player, in German, too."""

from __future__ import annotations

import bpy
import pytest
import read_glb
import scenes
from program import run_sinew
from sinew_addon.base.phrases import Phrase
from sinew_addon.features.gltf import players
from sinew_addon.ui import translations

pytestmark = pytest.mark.outer_versions


@pytest.fixture
def file(empty_file, tmp_path):
    """An arm of eight bones, all of which move each vertex, and of two clips."""
    obj, rig = scenes.placed_arm(8)
    for number, bone in enumerate(rig.data.bones):
        group = obj.vertex_groups.get(bone.name) or obj.vertex_groups.new(name=bone.name)
        group.add(range(len(obj.data.vertices)), 0.2 + 0.1 * number, "REPLACE")
    data = rig.animation_data
    first, other = data.action, data.action.copy()
    other.name = "Other"
    track = data.nla_tracks.new()
    track.strips.new("Other", 1, other)
    track.mute = True
    assert data.action == first
    scenes.save(tmp_path / "arm.blend")
    return tmp_path / "arm.blend"


def header(path):
    return read_glb.File(path).header


def sets_and_clips(path):
    """How many sets of four influences a file has, and how many animations."""
    found = header(path)
    (primitive,) = found["meshes"][0]["primitives"]
    return sum(name.startswith("JOINTS_") for name in primitive["attributes"]), len(found["animations"])


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), (1, 2)),
        (("--for", "three.js"), (1, 2)),
        (("--for", "viser"), (1, 1)),
        (("--for", "blender"), (2, 2)),
        (("--for", "viser", "--influences", "8", "--clips", "all"), (2, 2)),
        (("--for", "blender", "--influences", "4", "--clips", "shown"), (1, 1)),
    ],
)
def test_a_file_has_what_its_player_plays_best(file, tmp_path, options, expected):
    out = tmp_path / "a.glb"
    said = run_sinew("export", file, "--method", "lbs", "--out", out, "--verify", *options)
    assert sets_and_clips(out) == expected
    assert "no cause that is known" not in said.stdout
    assert ("viser plays all clips of a file at once" in said.stdout) == ("viser" in options)
    assert ("Blender 5" in said.stdout) == ("blender" in options)


def test_one_clip_in_fbx(file, tmp_path):
    for clips, count in (("all", 2), ("shown", 1)):
        out = tmp_path / f"{clips}.fbx"
        run_sinew("export", file, "--method", "lbs", "--out", out, "--clips", clips)
        before = set(bpy.data.actions)
        bpy.ops.import_scene.fbx(filepath=str(out))
        assert len(set(bpy.data.actions) - before) == count


def test_a_file_that_the_player_does_not_read(file, tmp_path):
    words = "export", file, "--method", "lbs", "--for", "panda3d", "--out"
    assert (
        "panda3d reads no .fbx; write a .glb for it" in run_sinew(*words, tmp_path / "a.fbx", status=2).stderr
    )
    assert not (tmp_path / "a.fbx").exists()


def test_a_player_without_skins_is_a_warning(file, tmp_path):
    words = "export", file, "--method", "lbs", "--for", "trimesh", "--out", tmp_path / "a.glb"
    assert "trimesh does not skin: it shows the rest pose" in run_sinew(*words).stderr


def test_the_panel_exports_for_a_player(file, tmp_path):
    scenes.add_sinew(bpy.context.scene.objects["Arm"], "lbs")
    bpy.ops.wm.save_mainfile()
    export = bpy.ops.sinew.export
    offered = export.get_rna_type().properties["player"].enum_items.keys()
    assert offered == ["any", *(name for name, its in players.PLAYERS.items() if its.endings)]
    assert export(kind=".glb", player="three.js") == {"FINISHED"}
    assert sets_and_clips(file.with_suffix(".glb")) == (1, 2)
    assert export(kind=".glb", player="blender", overwrite=True) == {"FINISHED"}
    assert sets_and_clips(file.with_suffix(".glb")) == (2, 2)
    assert export(kind=".glb", player="blender", influences=4, clips="shown", overwrite=True) == {"FINISHED"}
    assert sets_and_clips(file.with_suffix(".glb")) == (1, 1)
    with pytest.raises(RuntimeError, match=r"viser reads no \.fbx; write a \.glb for it"):
        export(kind=".fbx", player="viser")


def templates(text):
    """Of a phrase, and of the phrases in it."""
    if isinstance(text, Phrase):
        yield text.template
        for value in text.values.values():
            yield from templates(value)


def test_sentences_are_translated():
    german, count = translations.LANGUAGES["de"], 0
    for name, its in players.PLAYERS.items():
        for ending in its.endings:
            for sentence in players.sentences(name, ending, 8):
                for template in templates(sentence):
                    count += 1
                    assert template in german or template == "{first}, {second}"
    assert count > 30
