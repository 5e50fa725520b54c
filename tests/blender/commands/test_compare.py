# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew compare` and `sinew render`: their numbers, findings and pictures, for files with known results."""

from __future__ import annotations

import json
import re
from html import unescape

import bpy
import numpy as np
import pytest
import scenes
import test_recommended
import trimesh
from conftest import REPOSITORY
from program import run_sinew
from sinew_addon.attach import properties

pytestmark = pytest.mark.outer_versions

# Pictures take a third of a second each, and are almost the same in all versions.
newest_only = pytest.mark.skipif(bpy.app.version < (5, 2), reason="drawn with the newest Blender only")


def compared(path, *options):
    """What `sinew compare` measures, beside the file."""
    run_sinew("compare", path, *options, "--pictures", 0, "--out", path.parent)
    return json.loads((path.with_suffix("") / "metrics.json").read_text(encoding="utf-8"))


def test_recommended_is_one_of_the_methods(tmp_path):
    """Its numbers are those of what it chooses, and every other method has the file's own stages."""
    obj, _armature = test_recommended.arm(149.0, axis=1, sides=16, rings=41)
    properties.of(obj).delta_mush.enabled = True
    path = scenes.save(tmp_path / "arm.blend")
    options = ("--frames", "11", "--pictures", 0, "--out", tmp_path)

    def summaries(methods, *words):
        done = run_sinew("compare", path, "--methods", methods, *options, *words)
        found = json.loads((tmp_path / "arm" / "metrics.json").read_text(encoding="utf-8"))
        return found["summaries"], done

    found, done = summaries("recommended,lbs,blender")
    assert "with Twist Spread" in done.stdout + done.stderr
    method = "dq" if "Dual Quaternion" in done.stdout + done.stderr else "lbs"
    own, _done = summaries("lbs,blender")
    assert (found["lbs"], found["blender"]) == (own["lbs"], own["blender"])
    alone, _done = summaries(method, "--set", "twist_spread=on", "--set", "delta_mush=off")
    assert found["recommended"] == alone[method]
    scenes.key(properties.of(obj).delta_mush, "factor", ((1, 0.0), (11, 1.0)))
    scenes.save(path)
    done = run_sinew("compare", path, "--methods", "recommended", *options, status=1)
    assert "delta_mush.factor is keyed" in done.stderr


def test_variants_are_whole_choices(tmp_path):
    """Each has its own stages, whatever the file has, and `file` what that has."""
    obj, _armature = test_recommended.arm(149.0, axis=1, sides=16, rings=41)
    properties.of(obj).method = "cor"
    properties.of(obj).delta_mush.enabled, properties.of(obj).delta_mush.iterations = True, 12
    path = scenes.save(tmp_path / "arm.blend")
    options = ("--frames", "11", "--pictures", 0, "--out", tmp_path)

    def summaries(*words):
        run_sinew("compare", path, *words, *options)
        return json.loads((tmp_path / "arm" / "metrics.json").read_text(encoding="utf-8"))

    named = "dq, soft=dq+twist_spread, file, blender, cor+delta_mush:iterations=12"
    found = summaries("--variants", named)
    assert list(found["methods"].values())[:2] == [
        "Dual Quaternion",
        "soft: Dual Quaternion with Twist Spread",
    ]
    rows = list(found["summaries"].values())
    assert rows[2] == rows[4], "as in the file"
    off = ("--set", "delta_mush=off")
    alone = summaries("--methods", "dq,blender", *off)["summaries"]
    assert (rows[0], rows[3]) == (alone["dq"], alone["blender"])
    assert rows[1] == summaries("--methods", "dq", *off, "--set", "twist_spread=on")["summaries"]["dq"]
    assert len({str(row) for row in rows}) == 4
    wrong = run_sinew("compare", path, "--variants", "dq", "--methods", "lbs", *options, status=2)
    assert "--methods does not take" in wrong.stderr
    wrong = run_sinew("compare", path, "--variants", "dq+foo", *options, status=2)
    assert "expected one of mix, twist_spread" in wrong.stderr


def test_numbers_are_those_of_the_shapes(tmp_path):
    """Compared with Blender's modifier, in both modes, and with trimesh; a later modifier changes
    nothing."""
    obj, armature = scenes.make_arm()
    armature.location, armature.rotation_euler = (3.0, -2.0, 1.0), (0.3, 0.2, 0.1)
    obj.location = (0.0, 0.0, 0.5)
    obj.scale = (2.0, 2.0, 2.0)
    frames = [1, 6, 11]
    linear = scenes.modifier_shapes(obj, frames, preserve_volume=False)
    dual = scenes.modifier_shapes(obj, frames, preserve_volume=True)
    rest, triangles = scenes.rest_points(obj), scenes.triangles_of(obj)
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 1
    path = scenes.save(tmp_path / "arm.blend")
    found = compared(path, "--methods", "blender,lbs,dq", "--frames", "1,6,11")
    assert (list(found["methods"]), found["frames"]) == (["blender", "lbs", "dq"], frames)
    rows = {
        (method, frame): {**row, "milliseconds": taken}
        for method in found["methods"]
        for frame, row, taken in zip(
            frames, found["summaries"][method], found["milliseconds"][method], strict=True
        )
    }
    world = 2.0
    at_rest = trimesh.Trimesh(world * rest, triangles, process=False)
    for index, frame in enumerate(frames):
        for method, shape in (("blender", linear[index]), ("lbs", linear[index]), ("dq", dual[index])):
            row = rows[method, frame]
            mesh = trimesh.Trimesh(world * shape.astype(np.float64), triangles, process=False)
            apart = world * np.linalg.norm(shape.astype(np.float64) - linear[index], axis=1)
            assert row["volume"] == pytest.approx(mesh.volume, rel=1e-4)
            assert row["volume_change"] == pytest.approx(mesh.volume / at_rest.volume - 1, abs=1e-4)
            assert row["area"] == pytest.approx(mesh.area, rel=1e-4)
            assert row["distance_max"] == pytest.approx(apart.max(), abs=2e-5)
            assert row["milliseconds"] > 0.0
            if frame == 1:
                assert abs(row["bulge_max"]) + abs(row["bulge_min"]) + abs(row["stretch_rms"]) < 1e-4
                assert row["flipped_faces"] == 0
    assert rows["dq", 11]["distance_max"] > 0.05
    assert rows["dq", 11]["bulge_max"] > rows["lbs", 11]["bulge_max"]
    assert "<img" not in (tmp_path / "arm.html").read_text(encoding="utf-8")


def test_several_meshes_and_modifiers_in_front_are_measured_as_one(tmp_path):
    """Also a mesh that its parent deforms, without a modifier."""
    first, _armature = scenes.make_arm()
    scenes.put_in_front(first)
    second, armature = scenes.make_arm(name="Leg")
    scenes.deform_by_parent(second, armature)
    second.location = (0.0, 3.0, 0.0)
    bpy.context.scene.frame_set(11)
    counts = [len(scenes.final_points(obj)) for obj in (first, second)]
    assert counts[0] > 2 * counts[1]
    path = scenes.save(tmp_path / "two.blend")
    found = compared(path, "--methods", "lbs,dq", "--frames", "1,11")
    assert found["meshes"] == ["Arm", "Leg"]
    assert found["rest"]["vertices"] == sum(counts)
    assert (found["rest"]["holes"], found["rest"]["clashes"]) == (0, 0)
    at_rest, linear = found["summaries"]["lbs"]
    _dual_at_rest, dual = found["summaries"]["dq"]
    assert abs(at_rest["volume_change"]) + at_rest["stretch_rms"] + at_rest["bulge_max"] < 1e-4
    assert linear["distance_max"] < 1e-4
    assert dual["distance_max"] > 0.02
    assert linear["bulge_min"] < -0.02


@newest_only
def test_close_ups_are_of_one_character(tmp_path):
    """However far apart several characters are."""
    scenes.make_arm()
    second, rig = scenes.make_arm(name="Far")
    rig.location = second.location = (0.0, 50.0, 0.0)
    path = scenes.save(tmp_path / "two.blend")
    run_sinew(
        *("compare", path, "--methods", "lbs", "--frames", "11", "--pictures", 1, "--size", 64),
        *("--engine", "cycles", "--out", tmp_path),
    )
    assert len(opaque_pixels(tmp_path / "two" / "pictures" / "lbs-bulge-11-close.png")) > 400


def test_planted_faults_are_found(tmp_path):
    obj, armature = scenes.make_arm()
    scenes.forget_keys(armature)
    for group in obj.vertex_groups:
        group.remove([0, 1, 2])
        group.add([40, 41], 0.001, "REPLACE")
    obj.vertex_groups.new(name="nobody").add([9], 1.0, "REPLACE")
    for bone in armature.data.bones:
        obj.vertex_groups.new(name=f"old {bone.name}")
    path = scenes.save(tmp_path / "faulty.blend")
    found = compared(path, "--frames", "1-2", "--influences", 2)["findings"]["Arm"]
    assert {finding["name"]: finding["vertices"] for finding in found} == {
        "no_weights": [0, 1, 2],
        "small_sums": [40, 41],
        "boneless_groups": [9],
    }
    assert found[-1]["groups"] == ["nobody", "old bone.0", "old bone.1"]
    page = unescape((tmp_path / "faulty.html").read_text(encoding="utf-8"))
    for finding in found:
        assert finding["advice"] in page


def opaque_pixels(path):
    """float64 [n, 3], sRGB in 0..255."""
    from PIL import Image

    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGBA"), dtype=np.float64)
    return pixels[pixels[:, :, 3] == 255][:, :3]


@newest_only
def test_a_page_holds_its_pictures(tmp_path):
    path = REPOSITORY / "blend_files" / "wrist.blend"
    run_sinew(
        *("compare", path, "--methods", "lbs,dq", "--frames", "1,12,24", "--pictures", 2, "--size", 128),
        *("--out", tmp_path),
    )
    page = (tmp_path / "wrist.html").read_text(encoding="utf-8")
    # Nothing is fetched; a plot's marks refer to shapes within the page.
    assert re.findall(r'(?:src|href)="(?!data:image/png;base64,|#)', page) == []
    assert len(re.findall(r'<div class="plot"><svg ', page)) == 7
    drawn = sorted((tmp_path / "wrist" / "pictures").glob("*.png"))
    assert page.count("<img") == len(drawn)
    # Every measure is worst at 180 degrees.
    assert {p.name for p in drawn if p.stem.count("-") == 1} == {"lbs-24.png", "dq-24.png"}
    for picture in drawn:
        assert len(opaque_pixels(picture)) > 500, picture
    # The file's own modifier is linear blend: distance 0, so all of it has the first colour, a violet.
    red, green, blue = opaque_pixels(tmp_path / "wrist" / "pictures" / "lbs-distance-24-close.png").mean(
        axis=0
    )
    assert green < 0.4 * red < 0.4 * blue
    colours = opaque_pixels(tmp_path / "wrist" / "pictures" / "dq-distance-24-close.png")
    yellow = (colours[:, 0] > 150) & (colours[:, 1] > 150) & (colours[:, 2] < 110)
    assert yellow.mean() > 0.02


def test_golden_pictures(tmp_path):
    _obj, armature = scenes.make_arm()
    path = scenes.save(tmp_path / "arm.blend")
    run_sinew(
        "render", path, "--method", "dq", "--frames", "1,11", "--size", 128, "--out", tmp_path / "golden"
    )
    assert {p.name for p in (tmp_path / "golden").iterdir()} == {"0001.png", "0011.png", "render.json"}
    # All methods keep the rest pose; frame 11 is bent.
    result = run_sinew(
        *("render", path, "--method", "lbs", "--against", tmp_path / "golden", "--out", tmp_path / "now"),
        status=1,
    )
    assert "1 of 2 pictures within" in result.stdout
    assert {p.name for p in (tmp_path / "now").glob("*.difference.png")} == {"0011.difference.png"}
    assert re.search(r"\b1\b.*0\.000 %.*as before", result.stdout)
    percent = float(re.search(r"\b11\b.*?(\d+\.\d+) %", result.stdout).group(1))
    assert 0.5 < percent < 50.0
    # The golden camera is used: larger motion at one frame does not change the framing of others.
    scenes.key(armature.pose.bones[1], "scale", ((1, (1.0, 1.0, 1.0)), (11, (3.0, 3.0, 3.0))))
    scenes.save(path)
    result = run_sinew("render", path, "--against", tmp_path / "golden", "--out", tmp_path / "now", status=1)
    assert re.search(r"\b1\b.*0\.000 %.*as before", result.stdout)
    assert "1 of 2 pictures within" in result.stdout
    (tmp_path / "golden" / "0011.png").write_bytes(b"no picture")
    result = run_sinew("render", path, "--against", tmp_path / "golden", "--out", tmp_path / "now", status=1)
    assert "0011.png: can not be read as a picture" in result.stderr
