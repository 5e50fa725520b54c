# SPDX-License-Identifier: GPL-3.0-or-later
"""The page that turns: its data, read by a separate program (shaders/read_page.py), is the character that
`sinew points` computes; the file needs no other. tests/browsers has the page itself."""

from __future__ import annotations

import re

import bpy
import five_meshes
import numpy as np
import pytest
import read_page
import scenes
from bone_buffer import bone_buffer
from conftest import REPOSITORY
from mathutils import Euler
from program import run_sinew
from sinew_addon.attach import variant_settings
from sinew_addon.deform import session
from sinew_addon.features.measure import heat_scale
from sinew_addon.features.pages import viewer_page
from sinew_addon.skinning.influences import Influences
from sinew_addon.skinning.variants import parse

FRAMES = [1, 6, 11]
GROUP = "Painted"


def make_character(bones=3):
    """An arm, moved, rotated and scaled as one, with a scaled bone."""
    obj, armature = scenes.placed_arm(bones)
    obj.location, obj.rotation_euler, obj.scale = (0.1, 0.0, 0.05), Euler((0.0, 0.1, 0.2)), (1.1, 0.9, 1.0)
    scenes.key(armature.pose.bones[1], "scale", [(1, (1.0, 1.0, 1.0)), (11, (1.2, 0.9, 1.1))])
    bpy.context.view_layer.update()
    return obj


def write_page(path, *options):
    page = path.with_suffix(".html")
    run_sinew("compare", path, *options, "--viewer", page)
    return page


def points_of(path, method):
    out = path.with_name(f"{method}.npz")
    run_sinew("points", path, "--method", method, "--frames", ",".join(map(str, FRAMES)), "--out", out)
    return np.load(out)["Arm"]


def assert_has_points(page, expected, method, obj):
    """expected: [frames, vertices, 3], in the object's space."""
    header, meshes = read_page.read(page)
    to_world = np.array(obj.matrix_world)
    for frame, shape in zip(FRAMES, expected, strict=True):
        place = header["frames"].index(frame)
        points = read_page.points(header["parts"][0], meshes[0], method, place)
        world = meshes[0]["worlds"][place].astype(np.float64)
        found = points @ world[:3, :3].T + world[:3, 3]
        wanted = shape @ to_world[:3, :3].T + to_world[:3, 3]
        diagonal = np.linalg.norm(np.ptp(wanted, axis=0))
        assert np.abs(found - wanted).max() <= 1e-5 * diagonal, (method, frame)


@pytest.mark.parametrize("bones", ["straight", "bendy", "vanishing"])
def test_the_data_is_what_points_computes(tmp_path, bones):
    obj = make_character()
    if bones == "bendy":
        obj.parent.data.bones[1].bbone_segments = 4
    if bones == "vanishing":
        scenes.key(obj.parent.pose.bones[1], "scale", [(6, (0.5, 1.0, 0.0)), (11, (0.0, 0.0, 0.0))])
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "blender,lbs,dq,cor", "--frames", "1,6,11")
    for method in ("lbs", "dq", "cor"):
        assert_has_points(page, points_of(path, method), method, obj)


def test_the_painted_mix_is_that_of_the_file(tmp_path):
    obj = make_character()
    scenes.add_sinew(obj, "dq")
    heights = scenes.rest_points(obj)[:, 2]
    scenes.paint(obj, GROUP, (heights - heights.min()) / np.ptp(heights))
    obj.sinew.mix.method, obj.sinew.mix.group = "cor", GROUP
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "lbs,dq", "--frames", "1,6,11")
    header, _meshes = read_page.read(page)
    assert header["methods"] == {"lbs": "Linear Blend", "dq": "Dual Quaternion", "mix": "Painted Mix"}
    look = header["parts"][0]["looks"]["mix"]
    assert (look["method"], look["mix"]) == ("dq", "cor")
    assert_has_points(page, points_of(path, "dq"), "mix", obj)


def make_limb(angle=150.0, mode="QUATERNION"):
    """An arm that spreads twists of the hand and of the upper arm, twisted more from frame to frame, with a
    scaled bone and a vertex group."""
    obj = make_character(bones=4)
    names = ["shoulder.L", "upper_arm.L", "forearm.L", "hand.L"]
    for bone, name in zip(obj.parent.data.bones, names, strict=True):
        bone.name = name
    for name, share in (("upper_arm.L", 0.4), ("forearm.L", 0.0), ("hand.L", 1.0)):
        bone = obj.parent.pose.bones[name]
        bone.rotation_mode = mode
        last = Euler((0.5, np.radians(share * angle), 0.7 - 0.7 * share))
        if mode == "XYZ":
            scenes.key(bone, "rotation_euler", [(1, (0.0, 0.0, 0.0)), (11, last)])
        else:
            scenes.key(bone, "rotation_quaternion", [(1, (1.0, 0.0, 0.0, 0.0)), (11, last.to_quaternion())])
    obj.parent.pose.bones["forearm.L"].sinew_twist_curve = 0.5
    obj.parent.pose.bones["upper_arm.L"].sinew_twist_amount = 0.7
    scenes.paint(obj, GROUP, np.arange(len(obj.data.vertices)) % 5 / 4)
    scenes.add_sinew(obj, "dq")
    obj.sinew.mix.method, obj.sinew.mix.group = "lbs", GROUP
    return obj


@pytest.mark.parametrize("form", ["continuous", "kim_han"])
def test_stages_and_signs_are_those_of_the_file(tmp_path, form):
    obj = make_limb(150.0)
    scenes.set_stage(obj, "twist_spread", amount=0.9)
    scenes.set_stage(obj, "bulge_limit", strength=0.8, group=GROUP, form=form)
    obj.sinew.dq.signs = "hierarchy"
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "blender,lbs,dq,cor", "--frames", "1,6,11")
    header, (arrays,) = read_page.read(page)
    assert header["parts"][0]["stages"] == ["Twist Spread", "Limit Bulge"]
    assert header["parts"][0]["looks"]["dq"]["by_hierarchy"] == ["dq"]
    assert len(np.unique(arrays["palettes"][2, :, 6, 2])) == 3
    assert_has_points(page, points_of(path, "dq"), "mix", obj)
    obj.sinew.mix.method = "OFF"
    scenes.save(path)
    for method in ("lbs", "dq", "cor"):
        expected = points_of(path, method)
        assert_has_points(page, expected, method, obj)
        plain = read_page.points(header["parts"][0], {**arrays, "masks": 0 * arrays["masks"]}, method, 2)
        assert np.abs(plain - read_page.points(header["parts"][0], arrays, method, 2)).max() > 0.05
    assert_has_points(page, points_of(path, "blender"), "blender", obj)


VARIANTS = (
    "Soft=dq:signs=hierarchy+twist_spread:amount=0.6+bulge_limit:form=kim_han:strength=0.8",
    "=dq+bulge_limit",
    "Half=lbs+mix=cor",
    "Plain=cor+scale_rule=4.0",
    "As Blender=blender",
)
# Shapes that the shaders lack.
RECORDED = ("Mush=dq+twist_spread+delta_mush:iterations=7", "=qv", "=lbs+mix=qv", "Stiff=lbs+scale_rule=none")


@pytest.mark.parametrize("way", ["command", "panel"])
def test_variants_are_those_that_blender_shows(tmp_path, way):
    """Each with stages of its own, whatever the file has, by the weights of the same vertex groups."""
    obj = make_limb(150.0)
    scenes.set_stage(obj, "twist_spread", amount=0.3)
    obj.sinew.bulge_limit.group = GROUP
    path = scenes.save(tmp_path / "arm.blend")
    shown = ", ".join([*VARIANTS, "file", *RECORDED])
    page = tmp_path / "arm.html"
    if way == "command":
        run_sinew("compare", path, "--variants", shown, "--frames", "1,6,11", "--viewer", page)
    else:
        five_meshes.select(obj)
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 11
        variants = ", ".join([*VARIANTS[:4], *RECORDED])
        assert bpy.ops.sinew.compare(methods={"dq"}, variants=variants) == {"FINISHED"}
        assert bpy.ops.sinew.save_comparison(filepath=str(page)) == {"FINISHED"}
        bpy.ops.sinew.end_comparison()
    header, _meshes = read_page.read(page)
    looks = header["parts"][0]["looks"]
    assert {name for name, look in looks.items() if look["recorded"]} == set(RECORDED)
    if way == "command":
        assert list(header["methods"]) == [*VARIANTS, "=file", *RECORDED]
        assert header["methods"]["Soft=" + VARIANTS[0][5:]].startswith(
            "Soft: Dual Quaternion with Twist Spread"
        )
        assert_has_points(page, scenes.shapes(obj, FRAMES), "=file", obj)
    else:
        assert list(header["methods"]) == ["dq", *VARIANTS[:4], *RECORDED, "mix"]
    for key in [*VARIANTS[: 5 if way == "command" else 4], *RECORDED]:
        with session.changing(bpy.context):
            variant_settings.use([obj], parse(key))
        assert_has_points(page, scenes.shapes(obj, FRAMES), key, obj)


def test_what_the_shaders_lack_of_the_file_is_recorded(tmp_path):
    """Delta Mush with the painted mix, another rule for scale, two Armature modifiers of which one has a
    vertex group."""
    obj = make_limb(150.0)
    scenes.set_stage(obj, "delta_mush", iterations=5)
    path = scenes.save(tmp_path / "arm.blend")

    def assert_shown(*names):
        page = write_page(path, "--methods", "blender,lbs,dq,cor,qv", "--frames", "1,6,11")
        header, (arrays,) = read_page.read(page)
        assert header["parts"][0]["looks"]["dq"]["recorded"]
        for name in names:
            mixed = "dq" if name == "mix" else name
            assert_has_points(page, points_of(path, mixed), name, obj)
        return header, arrays

    header, _arrays = assert_shown("mix", "blender")
    assert header["parts"][0]["stages"] == ["Delta Mush"]
    obj.sinew.mix.method, obj.sinew.delta_mush.enabled, obj.sinew.scale_rule = "OFF", False, "none"
    scenes.save(path)
    assert_shown("lbs", "dq", "cor", "qv", "blender")
    obj.sinew.scale_rule = "4.0"
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.vertex_group, second.use_multi_modifier = obj.parent, GROUP, True
    scenes.save(path)
    _header, arrays = assert_shown("lbs", "dq", "cor", "qv", "blender")
    assert len([name for name in arrays if name.startswith("recorded_")]) == 5


def test_a_corrective_smooth_that_sinew_takes_over_is_seen_under_the_armature_modifier(tmp_path):
    obj = make_character()
    smooth = obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH")
    smooth.iterations = 12
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj, "dq")
    five_meshes.select(obj)
    assert bpy.ops.sinew.take_over_smooth() == {"FINISHED"}
    path = scenes.save(tmp_path / "arm.blend")
    for words in (("--methods", "blender,dq"), ("--variants", "blender, dq")):
        page = write_page(path, *words, "--frames", "1,6,11")
        header, _meshes = read_page.read(page)
        name = next(iter(header["methods"]))
        assert_has_points(page, expected, name, obj)
        assert header["parts"][0]["looks"][name]["recorded"]


def test_recommended_is_a_method_with_its_stages(tmp_path):
    obj = make_character(bones=2)
    scenes.forget_keys(obj.parent)
    bone = obj.parent.pose.bones[1]
    bone.rotation_mode = "XYZ"
    scenes.key(bone, "rotation_euler", [(1, (0.0, 0.0, 0.0)), (11, (0.0, np.radians(150.0), 0.0))])
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "blender,recommended", "--frames", "1,6,11")
    run_sinew("points", path, "--preset", "recommended", "--frames", "1,6,11", "--out", tmp_path / "own.npz")
    header, _meshes = read_page.read(page)
    blender, method = header["methods"]
    assert (blender, header["parts"][0]["stages"]) == ("blender", ["Twist Spread"])
    assert_has_points(page, np.load(tmp_path / "own.npz")["Arm"], method, obj)


@pytest.mark.parametrize("angle", [175.0, 180.0, -300.0, 540.0])
def test_turns_that_euler_angles_tell(tmp_path, angle):
    obj = make_limb(angle, "XYZ")
    obj.sinew.mix.method, obj.sinew.twist_spread.enabled = "OFF", True
    obj.sinew.cor.signs = "hierarchy"
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "dq,cor", "--frames", "1,6,11")
    palettes = read_page.read(page)[1][0]["palettes"]
    assert palettes[:, :, 7, 3].any() or abs(angle) <= 180.0
    for method in ("dq", "cor"):
        assert_has_points(page, points_of(path, method), method, obj)


def test_a_modifier_in_front_gives_the_mesh(tmp_path):
    obj = make_character()
    scenes.put_in_front(obj)
    path = scenes.save(tmp_path / "arm.blend")
    expected = points_of(path, "dq")
    assert expected.shape[1] > len(obj.data.vertices)
    assert_has_points(write_page(path, "--methods", "dq", "--frames", "1,6,11"), expected, "dq", obj)


def test_shape_keys_move_it(tmp_path):
    """Those that move some vertices, and only these are in the page for each frame."""
    obj = make_character()
    scenes.key_shape(obj)
    keys = obj.data.shape_keys.key_blocks
    for vertex in range(100):
        keys["Key"].data[vertex].co = keys["Basis"].data[vertex].co
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "lbs,dq,cor", "--frames", "1,6,11")
    _header, (arrays,) = read_page.read(page)
    assert arrays["moving"].tolist() == list(range(100, len(arrays["rest"])))
    for method in ("lbs", "dq", "cor"):
        assert_has_points(page, points_of(path, method), method, obj)


def test_a_mesh_that_moves_against_its_armature_is_said(tmp_path):
    obj = make_character()
    scenes.key(obj, "location", [(1, (0.1, 0.0, 0.05)), (11, (0.1, 0.5, 0.05))])
    page = write_page(scenes.save(tmp_path / "arm.blend"), "--methods", "dq", "--frames", "1,6,11")
    assert any("moves against its armature" in note for note in read_page.read(page)[0]["notes"])


def test_what_hangs_on_bones_goes_with_them(tmp_path):
    obj = make_character()
    bpy.ops.mesh.primitive_cube_add(size=0.2)
    eye = bpy.context.object
    eye.parent, eye.parent_type, eye.parent_bone = obj.parent, "BONE", "bone.2"
    path = scenes.save(tmp_path / "arm.blend")
    worlds = scenes.world_shapes(eye, FRAMES)
    assert np.abs(worlds[2] - worlds[0]).max() > 0.1
    header, meshes = read_page.read(write_page(path, "--methods", "lbs,cor", "--frames", "1,6,11"))
    assert [part["name"] for part in header["parts"]] == ["Arm", eye.name]
    for frame, expected in enumerate(worlds):
        points = read_page.points(header["parts"][1], meshes[1], "lbs", frame)
        world = meshes[1]["worlds"][frame].astype(np.float64)
        np.testing.assert_allclose(points @ world[:3, :3].T + world[:3, 3], expected, atol=1e-5)


def test_the_page_is_one_file_that_says_what_it_lacks(tmp_path):
    make_character()
    _second, flat = scenes.make_arm(name="Flat</script>")
    flat.scale.z = 0.0
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--methods", "lbs,qv,dq", "--frames", "1,6,11")
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"(src|href)\s*=|url\(|@import|https?://", text)
    header, _meshes = read_page.read(page)
    assert list(header["methods"]) == ["lbs", "qv", "dq"]
    assert [part["name"] for part in header["parts"]] == ["Arm"]
    assert "Flat</script>: left out: " in "\n".join(header["notes"])
    for measure in header["measures"]:
        assert measure["low"] < measure["high"]
        assert len(measure["ticks"]) == 5
    # Where the methods differ most.
    assert header["frames"][header["start"]] == 11


def test_a_page_alone_needs_no_folder_and_has_one_file(tmp_path):
    make_character()
    path = scenes.save(tmp_path / "arm.blend")
    page = write_page(path, "--frames", "1")
    assert list(read_page.read(page)[0]["methods"]) == ["lbs", "dq", "cor"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["arm.blend", "arm.html"]
    assert len(page.read_bytes()) < 110_000
    for words, text in (
        ((path,), "expected --out, --viewer or both"),
        ((path, path, "--viewer", page), "a single file"),
        ((path, "--viewer", tmp_path / "page.txt"), "expected a name ending in .html"),
    ):
        assert text in run_sinew("compare", *words, status=2).stderr


def test_a_comparison_is_saved_as_a_page(tmp_path):
    """Sinew is on the copies alone. The scene stays at its frame, with a pose that differs from its keys."""
    obj = make_character()
    path = scenes.save(tmp_path / "arm.blend")
    expected = {method: points_of(path, method) for method in ("lbs", "cor", "log")}
    assert not bpy.ops.sinew.save_comparison.poll()
    assert bpy.ops.sinew.compare(methods={"lbs", "cor", "log"}) == {"FINISHED"}
    bpy.context.scene.frame_set(6)
    scenes.bend(obj.parent, 40.0)
    before = scenes.final_points(obj)
    page = tmp_path / "saved.html"
    assert bpy.ops.sinew.save_comparison(filepath=str(page)) == {"FINISHED"}
    assert bpy.context.scene.frame_current == 6
    assert np.array_equal(scenes.final_points(obj), before)
    header, _meshes = read_page.read(page)
    assert (header["title"], header["frames"]) == ("saved", list(range(1, 12)))
    assert list(header["methods"]) == ["lbs", "cor", "log"]
    for method, points in expected.items():
        assert_has_points(page, points, method, obj)
    with pytest.raises(RuntimeError, match=r"ending in \.html"):
        bpy.ops.sinew.save_comparison(filepath=str(tmp_path / "saved.txt"))


def test_bones_are_as_the_shaders_read_them():
    """Of bones that are scaled and sheared, where these have a rotation."""
    rng = np.random.default_rng(1)
    posed, rest = (np.tile(np.eye(4), (200, 1, 1)) for _ in range(2))
    for bones in (posed, rest):
        bones[:, :3, :3] = [Euler(angles).to_matrix() for angles in rng.normal(size=(200, 3))]
        bones[:, :3, 3] = rng.normal(size=(200, 3))
    posed[:, :3, :3] *= rng.uniform(0.5, 1.5, size=(200, 1, 3))
    posed[:, :3, :3] += rng.uniform(-0.1, 0.1, size=(200, 3, 3))
    nothing, none = np.empty((0, 3), np.float32), np.empty((0, 2), np.int32)
    each = np.arange(201, dtype=np.int32)
    influences = Influences(each, each[:-1], np.ones(200, np.float32))
    part = viewer_page.Part("", np.zeros((200, 3), np.float32), influences, nothing, none, rest, "lbs")
    part.add_frame(posed, np.eye(4))
    mine, its = part.arrays()["palettes"][0], bone_buffer(posed, rest)
    np.testing.assert_allclose(mine[:, :3], its[:, :3], atol=1e-5)
    same = (mine[:, 3] * its[:, 3]).sum(axis=1)
    np.testing.assert_allclose(np.abs(same), 1.0, atol=1e-5)
    clear = np.abs(its[:, 3, 3]) > 1e-3
    np.testing.assert_allclose(mine[clear, 3], its[clear, 3], atol=1e-4)


def luminance(colour):
    digits = colour * 2 if len(colour) == 3 else colour
    shares = np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0
    return heat_scale.linear(shares) @ (0.2126, 0.7152, 0.0722)


def test_texts_have_contrast():
    """At least 4.5 to 1 (WCAG 2.2, 1.4.3), light and dark."""
    style = (viewer_page.FOLDER / "style.css").read_text(encoding="utf-8")
    themes = re.findall(r":root \{(.*?)\}", style, re.DOTALL)
    assert len(themes) == 2
    for theme in themes:
        colours = dict(re.findall(r"--(\w+): #(\w{3}|\w{6})\b", theme))
        for text in ("text", "faint", "accent"):
            for back in ("back", "panel", "stage"):
                dark, light = sorted([luminance(colours[text]), luminance(colours[back])])
                assert (light + 0.05) / (dark + 0.05) >= 4.5, (text, back)


@pytest.mark.parametrize("name", ["sinew.glsl", "sinew.wgsl"])
def test_the_shader_is_that_of_engines(name):
    assert (viewer_page.FOLDER / name).read_bytes() == (REPOSITORY / "shaders" / name).read_bytes()
