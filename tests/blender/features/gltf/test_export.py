# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF with Sinew's skinning data, read and skinned by a separate program: shaders/read_glb.py."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import jsonschema
import numpy as np
import pytest
import read_glb
import scenes
import sinew_addon
from conftest import REPOSITORY
from mathutils import Euler
from sinew_addon import cli
from sinew_addon.deform import characters
from sinew_addon.features.gltf import export

pytestmark = pytest.mark.outer_versions

SCHEMA, SKIN_SCHEMA = (
    json.loads((REPOSITORY / "docs" / f"SINEW_skinning{of}schema.json").read_text(encoding="utf-8"))
    for of in (".", ".skin.")
)
FRAMES = [1, 6, 11]
GROUP = "Painted"


@pytest.fixture(autouse=True)
def switched_on(empty_file):
    """Exporters look for extensions among the enabled add-ons."""
    switch_on()
    yield
    addons = bpy.context.preferences.addons
    addons.remove(addons[sinew_addon.__name__])


def switch_on() -> None:
    addons = bpy.context.preferences.addons
    if sinew_addon.__name__ not in addons:
        addons.new().module = sinew_addon.__name__


def make_character(materials: int = 1, bones: int = 3) -> bpy.types.Object:
    """An arm, moved, rotated and scaled; faces with several materials, and vertices with their index as
    an attribute."""
    obj, _armature = scenes.placed_arm(bones)
    obj.location, obj.rotation_euler, obj.scale = (0.1, 0.0, 0.05), Euler((0.0, 0.1, 0.2)), (1.1, 0.9, 1.0)
    numbers = obj.data.attributes.new("_NUMBER", "FLOAT", "POINT")
    numbers.data.foreach_set("value", np.arange(len(obj.data.vertices), dtype=np.float32))
    for number in range(materials):
        obj.data.materials.append(bpy.data.materials.new(f"Skin {number}"))
    for face in obj.data.polygons:
        face.material_index = face.index % materials
    bpy.context.view_layer.update()
    return obj


def paint(obj: bpy.types.Object) -> None:
    scenes.paint(obj, GROUP, np.random.default_rng(1).uniform(-0.5, 1.5, len(obj.data.vertices)))


def use(obj: bpy.types.Object, method: str, mixed: str = "") -> None:
    if mixed:
        paint(obj)
    characters.set_parameters({"mix.method": mixed, "mix.group": GROUP} if mixed else {})
    characters.use_method(obj, method)


def character(method: str, mixed: str = "") -> bpy.types.Object:
    obj = make_character()
    use(obj, method, mixed)
    return obj


def write(path: Path, **options: object) -> read_glb.File:
    bpy.context.scene.sinew_gltf.skinning = True
    bpy.ops.export_scene.gltf(**{"filepath": str(path), "export_attributes": True, **options})
    return read_glb.File(path)


def numbers_in(file: read_glb.File) -> np.ndarray:
    """Values of the vertices in Blender."""
    primitives = file.header["meshes"][0]["primitives"]
    return np.concatenate([file.array(p["attributes"]["_NUMBER"])[:, 0] for p in primitives]).astype(int)


def assert_plays(path: Path, obj: bpy.types.Object, frames: list[int]) -> np.ndarray:
    """Compares to 1e-5 of the diagonal. Returns what was read."""
    expected = scenes.world_shapes(obj, frames)
    times = [frame / bpy.context.scene.render.fps for frame in frames]
    got = read_glb.points_at(path, times)[obj.name]
    diagonal = np.linalg.norm(np.ptp(expected[0], axis=0))
    assert scenes.worst(got, expected[:, numbers_in(read_glb.File(path))]) <= 1e-5 * diagonal
    assert scenes.worst(got[0], got[-1]) > 0.1 * diagonal
    return got


@pytest.mark.parametrize(
    ("method", "mixed"), [("lbs", ""), ("dq", ""), ("cor", ""), ("lbs", "dq"), ("dq", "cor"), ("cor", "lbs")]
)
def test_it_plays_elsewhere_as_here(tmp_path, method, mixed):
    obj = character(method, mixed)
    file = write(tmp_path / "a.glb")
    (mesh,) = file.header["meshes"]
    signs = {f"{name}.signs": "blender" for name in (method, mixed) if name in ("dq", "cor")}
    assert file.header["extensionsUsed"] == ["SINEW_skinning"]
    assert "extensionsRequired" not in file.header
    jsonschema.validate(mesh["extensions"]["SINEW_skinning"], SCHEMA)
    assert mesh["extensions"]["SINEW_skinning"] == {
        "version": 1,
        "method": method,
        **({"mix": mixed} if mixed else {}),
        **({"parameters": signs} if signs else {}),
    }
    (primitive,) = mesh["primitives"]
    assert ("_SINEW_CENTRE" in primitive["attributes"]) == ("cor" in (method, mixed))
    assert ("_SINEW_MIX" in primitive["attributes"]) == bool(mixed)
    assert_plays(tmp_path / "a.glb", obj, FRAMES)


def make_limb() -> bpy.types.Object:
    """An arm whose hand and upper arm are twisted more from frame to frame, and spread that unequally."""
    obj = make_character(bones=4)
    bones = obj.parent.pose.bones
    for bone, name in zip(bones, ("shoulder.L", "upper_arm.L", "forearm.L", "hand.L"), strict=True):
        bone.name = name
    for name, twist in (("upper_arm.L", 60.0), ("hand.L", 140.0)):
        last = Euler((0.3, np.radians(twist), 0.4)).to_quaternion()
        scenes.key(bones[name], "rotation_quaternion", [(1, (1.0, 0.0, 0.0, 0.0)), (11, last)])
    scenes.key(bones["forearm.L"], "scale", [(1, (1.0, 1.0, 1.0)), (11, (1.2, 1.2, 1.2))])
    bones["forearm.L"].sinew_twist_curve = 0.5
    bones["upper_arm.L"].sinew_twist_amount = 0.7
    return obj


@pytest.mark.parametrize("form", ["continuous", "kim_han"])
@pytest.mark.parametrize(("method", "mixed"), [("lbs", ""), ("dq", ""), ("cor", "lbs")])
def test_stages_play_elsewhere_as_here(tmp_path, method, mixed, form):
    obj = make_limb()
    use(obj, method, mixed)
    if not mixed:
        paint(obj)
    settings = obj.sinew
    scenes.set_stage(obj, "twist_spread", amount=0.9, group=GROUP)
    scenes.set_stage(obj, "bulge_limit", strength=0.8, form=form)
    settings.dq.signs = settings.cor.signs = "hierarchy"
    file = write(tmp_path / "a.glb")
    content = file.header["meshes"][0]["extensions"]["SINEW_skinning"]
    of_skin = file.header["skins"][0]["extensions"]["SINEW_skinning"]
    jsonschema.validate(content, SCHEMA)
    jsonschema.validate(of_skin, SKIN_SCHEMA)
    assert content["stages"] == ["twist_spread", "bulge_limit"]
    own = {
        name for name in file.header["meshes"][0]["primitives"][0]["attributes"] if name.startswith("_SINEW")
    }
    assert own - {"_SINEW_CENTRE", "_SINEW_MIX"} == {"_SINEW_TWIST_SPREAD"}
    assert [twist["from"] for twist in of_skin["twists"]] == ["parent", "child"]
    got = assert_plays(tmp_path / "a.glb", obj, FRAMES)
    settings.twist_spread.enabled = settings.bulge_limit.enabled = False
    assert scenes.worst(got[-1], scenes.world_shapes(obj, FRAMES)[-1][numbers_in(file)]) > 0.05


@pytest.mark.parametrize("seed", [None, 1])
def test_bones_across_their_limbs_play_elsewhere_as_here(tmp_path, seed):
    obj = make_limb()
    scenes.stand_across(obj.parent, seed)
    use(obj, "dq")
    for stage in ("twist_spread", "bulge_limit"):
        scenes.set_stage(obj, stage)
    file = write(tmp_path / "a.glb")
    of_skin = file.header["skins"][0]["extensions"]["SINEW_skinning"]
    jsonschema.validate(of_skin, SKIN_SCHEMA)
    assert of_skin["version"] == 2
    assert [twist["from"] for twist in of_skin["twists"]] == ["parent", "child"]
    assert_plays(tmp_path / "a.glb", obj, FRAMES)


def test_centres_matter_and_are_of_each_primitive(tmp_path):
    obj = make_character(materials=3)
    use(obj, "cor")
    file = write(tmp_path / "a.glb")
    assert len(file.header["meshes"][0]["primitives"]) == 3
    got = assert_plays(tmp_path / "a.glb", obj, FRAMES)
    use(obj, "dq")
    assert scenes.worst(got[-1], scenes.world_shapes(obj, FRAMES)[-1][numbers_in(file)]) > 0.01


def test_modifiers_applied(tmp_path):
    obj = character("cor")
    write(tmp_path / "a.glb", export_apply=True)
    assert_plays(tmp_path / "a.glb", obj, FRAMES)


def test_z_up(tmp_path):
    obj = character("cor")
    file = write(tmp_path / "a.glb", export_yup=False)
    times = [frame / bpy.context.scene.render.fps for frame in FRAMES]
    # The reader takes this direction for Y up.
    x, y, z = np.moveaxis(read_glb.points_at(tmp_path / "a.glb", times)[obj.name], 2, 0)
    expected = scenes.world_shapes(obj, FRAMES)[:, numbers_in(file)]
    assert scenes.worst(np.stack([x, z, -y], axis=2), expected) <= 1e-5 * np.linalg.norm(
        np.ptp(expected[0], axis=0)
    )


def test_without_the_check_box_the_file_is_as_before(tmp_path):
    character("cor")
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.glb"), export_attributes=True)
    header = read_glb.File(tmp_path / "a.glb").header
    assert "SINEW_skinning" not in str(header)
    assert {"_NUMBER"} == {n for n in header["meshes"][0]["primitives"][0]["attributes"] if n.startswith("_")}


def test_other_attributes_are_the_artists_choice(tmp_path):
    obj = character("cor")
    names = [attribute.name for attribute in obj.data.attributes]
    active = obj.data.attributes.active_index
    file = write(tmp_path / "a.glb", export_attributes=False)
    attributes = file.header["meshes"][0]["primitives"][0]["attributes"]
    assert {name for name in attributes if name.startswith("_")} == {"_SINEW_CENTRE"}
    assert [attribute.name for attribute in obj.data.attributes] == names
    assert obj.data.attributes.active_index == active


def test_an_export_that_fails_ends_as_one_that_does_not(tmp_path):
    obj = character("cor")
    before = scenes.world_shapes(obj, FRAMES)
    (tmp_path / "file").touch()
    with pytest.raises(RuntimeError):
        write(tmp_path / "file" / "a.glb")
    assert "_SINEW_CENTRE" not in obj.data.attributes
    assert obj.modifiers["Sinew"].show_viewport
    assert np.array_equal(scenes.world_shapes(obj, FRAMES), before)


def test_after_an_export_that_nobody_ended(tmp_path):
    """As where the exporter fails while it reads. The next evaluation ends it, or saving, or the next export,
    which finds that meshes were removed or added."""
    obj = character("cor")
    found, left_out = export.collect(bpy.context)
    assert left_out == []
    export.begin(found, [], {"gltf_attributes": True, "gltf_yup": True})
    assert "_SINEW_CENTRE" in obj.data.attributes
    write(tmp_path / "a.glb")
    assert "_SINEW_CENTRE" not in obj.data.attributes
    for react in (
        lambda: bpy.context.scene.frame_set(4),
        lambda: scenes.save(tmp_path / "a.blend"),
    ):
        export.begin(found, [], {"gltf_attributes": True, "gltf_yup": True})
        assert "_SINEW_CENTRE" in obj.data.attributes
        react()
        assert "_SINEW_CENTRE" not in obj.data.attributes
    export.begin(found, [], {"gltf_attributes": True, "gltf_yup": True})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    switch_on()
    obj = character("cor")
    write(tmp_path / "b.glb")
    assert_plays(tmp_path / "b.glb", obj, FRAMES)


def test_custom_properties_stay(tmp_path):
    obj = character("cor")
    obj.data["tailor"] = "Ann"
    # Saved files store centres in the mesh.
    scenes.save(tmp_path / "a.blend")
    mesh = write(tmp_path / "a.glb", export_extras=True).header["meshes"][0]
    content = {"version": 1, "method": "cor", "parameters": {"cor.signs": "blender"}}
    assert mesh["extensions"] == {"SINEW_skinning": content}
    assert mesh["extras"]["tailor"] == "Ann"


def test_off_is_not_exported(tmp_path):
    obj = character("cor")
    obj.sinew.enabled = False
    file = write(tmp_path / "a.glb")
    assert "SINEW_skinning" not in str(file.header)
    assert export.current.left_out == []


def test_of_objects_with_one_mesh_the_first_has_it(tmp_path):
    obj = make_character()
    other = scenes.copied(obj, "Other", linked=True)
    other.location.x += 2.0
    use(obj, "cor")
    use(other, "cor")
    file = write(tmp_path / "a.glb")
    (sentence,) = export.current.left_out
    assert sentence.startswith("Other: exported without Sinew's skinning data: another object has its mesh")
    nodes = {
        node["name"]: file.header["meshes"][node["mesh"]] for node in file.header["nodes"] if "mesh" in node
    }
    assert "_SINEW_CENTRE" in nodes["Arm"]["primitives"][0]["attributes"]
    assert "_SINEW_CENTRE" not in nodes["Other"]["primitives"][0]["attributes"]
    assert "extensions" not in nodes["Other"]


def test_a_preview_of_an_engine_is_linear(tmp_path):
    character("unreal", "dq")
    mesh = write(tmp_path / "a.glb").header["meshes"][0]
    assert mesh["extensions"]["SINEW_skinning"] == {"version": 1, "method": "lbs"}


def test_parameters_and_stages_are_named(tmp_path):
    obj = make_character()
    characters.set_parameters({"ddm.variant": "2", "ddm.radius": 0.25, "bulge_limit.enabled": True})
    characters.use_method(obj, "ddm")
    content = write(tmp_path / "a.glb").header["meshes"][0]["extensions"]["SINEW_skinning"]
    jsonschema.validate(content, SCHEMA)
    assert content == {
        "version": 1,
        "method": "ddm",
        "parameters": {
            "ddm.variant": "2",
            "ddm.radius": 0.25,
            "ddm.weld": True,
            "bulge_limit.strength": 1.0,
            "bulge_limit.form": "continuous",
        },
        "stages": ["bulge_limit"],
    }


@pytest.mark.slow
def test_the_example_of_the_documentation(tmp_path, monkeypatch, capfd):
    text = (REPOSITORY / "docs" / "engines.md").read_text(encoding="utf-8")
    example = text[text.index("### An example") :]
    shutil.copy(REPOSITORY / "blend_files" / "wrist.blend", tmp_path / "human.blend")
    monkeypatch.chdir(tmp_path)
    # The folder where Blender looks.
    monkeypatch.setenv("PWD", str(tmp_path))
    for line in re.findall(r"^    (sinew .*)$", example, re.MULTILINE):
        program, *words = shlex.split(line)
        subprocess.run([Path(sys.executable).with_name(program), *words], check=True, timeout=120)
    exec(re.search(r"```python\n(.*?)```", example, re.DOTALL)[1], {})
    assert "of the diagonal" in capfd.readouterr().out


def test_command_errors(tmp_path, capfd):
    make_character()
    file = scenes.save(tmp_path / "arm.blend")
    assert cli.main(["export", str(file), "--out", str(tmp_path / "a.glb")]) == 1
    assert "no mesh has Sinew; choose a method by --method" in capfd.readouterr().err
    assert cli.main(["export", str(file), "--method", "magic", "--out", str(tmp_path / "a.glb")]) == 2
    assert not (tmp_path / "a.glb").exists()


@pytest.mark.parametrize("chosen", ["cor", "recommended"])
def test_human(tmp_path, real_rig, chosen):
    file, glb = real_rig("human.blend"), tmp_path / "human.glb"
    bpy.ops.wm.open_mainfile(filepath=str(file))
    obj = max((o for o in bpy.data.objects if o.type == "MESH"), key=lambda o: len(o.data.vertices))
    numbers = obj.data.attributes.new("_NUMBER", "FLOAT", "POINT")
    numbers.data.foreach_set("value", np.arange(len(obj.data.vertices), dtype=np.float32))
    use(obj, chosen)
    if chosen == "recommended":
        # It chooses this one where joints bend more than in these frames, and one that no player has.
        obj.sinew.bulge_limit.enabled, obj.sinew.delta_mush.enabled = True, False
    file = write(glb, export_all_influences=True)
    content = file.header["meshes"][0]["extensions"]["SINEW_skinning"]
    assert content.get("stages") == (None if chosen == "cor" else ["twist_spread", "bulge_limit"])
    assert_plays(glb, obj, [1, 16, 32])
