# SPDX-License-Identifier: GPL-3.0-or-later
"""Exporters and tools of others give the same with Sinew as without it (the table of docs/parity.md): each
row calls what the tool calls, or the tool itself where Blender has it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
import sinew_addon
from conftest import halved
from five_meshes import select as make_active
from sinew_addon.attach import layout, other_tools, properties
from sinew_addon.deform import safe_mode
from sinew_addon.jobs.tasks import preflight

FBX = "Switch Sinew off before an export to FBX, or the file has no shape keys"
SECOND_USER = "Switch Sinew off before a script applies its modifiers: Sinew also uses its mesh meanwhile"
Seen = dict[str, object]
"""What a tool has made: points, weights, shape keys, modifiers, files."""


# --- Meshes


def plain(obj: bpy.types.Object) -> None:
    pass


def with_keys(obj: bpy.types.Object) -> None:
    scenes.key_shape(obj)
    obj.data.shape_keys.animation_data_clear()
    obj.data.shape_keys.key_blocks["Key"].value = 0.5


def with_front(obj: bpy.types.Object) -> None:
    scenes.put_in_front(obj, "MIRROR").use_axis = (False, True, False)


def with_behind(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Behind", "SUBSURF").levels = 1


def with_front_and_keys(obj: bpy.types.Object) -> None:
    with_keys(obj)
    with_front(obj)


MESHES = (plain, with_keys, with_front, with_front_and_keys, with_behind)


def make(prepare: Callable, has_sinew: bool) -> bpy.types.Object:
    """A posed arm under linear blending, which Sinew computes as Blender does."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, armature = scenes.make_arm(bones=3, sides=8, rings=13)
    obj.parent = armature
    prepare(obj)
    if has_sinew:
        scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(9)
    make_active(obj)
    return obj


# --- What is seen of a mesh


def keys_of(obj: bpy.types.Object) -> Sequence[bpy.types.ShapeKey]:
    return obj.data.shape_keys.key_blocks if obj.data.shape_keys is not None else ()


def seen_of(obj: bpy.types.Object, name: str = "") -> Seen:
    """The mesh itself, its shape in this pose, weights, shape keys and modifiers but for Sinew's."""
    bpy.context.view_layer.update()
    keys = keys_of(obj)
    own = [obj.modifiers[name] for name in layout.read(obj).own] if properties.has_sinew(obj) else []
    left = [m for m in obj.modifiers if m not in own]
    weights = [[round(group.weight, 4) for group in vertex.groups] for vertex in obj.data.vertices]
    return {
        f"{name} rest": scenes.points_of(obj.data.vertices),
        f"{name} posed": scenes.final_points(obj),
        f"{name} weights": weights,
        **{f"{name} key {key.name}": scenes.points_of(key.data) for key in keys},
        f"{name} keys": [key.name for key in keys],
        f"{name} modifiers": [(m.type, m.name, m.show_viewport, m.show_render) for m in left],
        f"{name} armatures": [m.object.name for m in left if m.type == "ARMATURE"],
    }


def evaluated(obj: bpy.types.Object) -> np.ndarray:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown = obj.evaluated_get(depsgraph)
    points = scenes.points_of(shown.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph).vertices)
    shown.to_mesh_clear()
    return points


def skins_of(obj: bpy.types.Object) -> list[bpy.types.ArmatureModifier]:
    return [m for m in obj.modifiers if m.type == "ARMATURE" and m.show_viewport]


@contextmanager
def hidden(modifiers: list[bpy.types.Modifier]) -> Iterator[None]:
    for modifier in modifiers:
        modifier.show_viewport = False
    yield
    for modifier in modifiers:
        modifier.show_viewport = True


def shown_keys(obj: bpy.types.Object) -> Seen:
    """The evaluated mesh, and with each of its shape keys pinned."""
    bpy.context.view_layer.update()
    found: Seen = {"shown": evaluated(obj)}
    keys = keys_of(obj)
    obj.show_only_shape_key = True
    for number, key in enumerate(keys):
        value, key.value, obj.active_shape_key_index = key.value, 1.0, number
        bpy.context.view_layer.update()
        found[f"shown {key.name}"] = evaluated(obj)
        key.value = value
    obj.show_only_shape_key, obj.active_shape_key_index = False, 0
    return found


# --- Exporters: the file, read again, and what they leave


def read_again(operator: Callable, path: Path, **options: object) -> Seen:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    operator(filepath=str(path), **options)
    bpy.context.scene.frame_set(9)
    found: Seen = {"objects": sorted(f"{each.type} {each.name}" for each in bpy.data.objects)}
    for each in [obj for obj in bpy.data.objects if obj.type == "MESH"]:
        found |= seen_of(each, f"read {each.name}")
    return found


def exported(
    export: Callable, read: Callable, kind: str, reading: dict[str, object] | None = None, **options: object
) -> Callable:
    """reading  options of the importer"""

    def tool(obj: bpy.types.Object, folder: Path) -> Seen:
        path = folder / f"arm.{kind}"
        export(filepath=str(path), **options)
        left = seen_of(obj, "left")
        return left | read_again(read, path, **(reading or {}))

    return tool


# --- Tools that hide, apply, copy and join


def vrm_0(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Skins are modifiers that are on; the mesh at rest is what is shown where these are hidden."""
    found = skins_of(obj)
    with hidden(found):
        bpy.context.view_layer.update()
        rest = evaluated(obj)
    return {"skins": [m.object.name for m in found], "rest": rest, **seen_of(obj)}


def vrm_1(obj: bpy.types.Object, folder: Path) -> Seen:
    """The same on a copy, which Blender's glTF exporter then writes."""
    new = scenes.copied(obj)
    found: Seen = {"skins": [m.object.name for m in skins_of(new)]}
    make_active(new)
    path = folder / "arm.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True, export_apply=True)
    bpy.data.objects.remove(new)
    return found | seen_of(obj, "left") | read_again(bpy.ops.import_scene.gltf, path)


def cgcookie(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Apply Modifiers with Shape Keys: each key on a copy, with the chosen modifiers applied."""
    chosen = [m.name for m in obj.modifiers if m.type in ("MIRROR", "SUBSURF")]
    names = [key.name for key in keys_of(obj)]
    with hidden(skins_of(obj)):
        copies = [scenes.copied(obj) for _name in names[1:]]
        for number, each in enumerate((obj, *copies)):
            make_active(each)
            _keep_key(each, number)
            for name in chosen:
                bpy.ops.object.modifier_apply(modifier=name)
        _join_as_keys(obj, copies, names)
    return seen_of(obj)


def _keep_key(obj: bpy.types.Object, number: int) -> None:
    """Makes a key the mesh's shape."""
    if obj.data.shape_keys is None:
        return
    points = scenes.points_of(obj.data.shape_keys.key_blocks[number].data)
    obj.shape_key_clear()
    obj.data.vertices.foreach_set("co", points.ravel())
    obj.data.update()


def _join_as_keys(obj: bpy.types.Object, copies: list[bpy.types.Object], names: list[str]) -> None:
    if copies:
        make_active(*copies)
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.join_shapes()
    for name, each in zip(names[1:], copies, strict=True):
        obj.data.shape_keys.key_blocks[-1].name = name
        mesh = each.data
        bpy.data.objects.remove(each)
        bpy.data.meshes.remove(mesh)


def gret(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Apply Modifiers with Shape Keys: those that are on are applied, others removed, on copies in no
    scene."""
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    shapes = [(key.name, scenes.points_of(key.data)) for key in keys_of(obj)]
    copies = []
    for _name, points in shapes:
        new = obj.copy()
        new.data = obj.data.copy()
        new.shape_key_clear()
        new.data.vertices.foreach_set("co", points.ravel())
        copies.append(new)
    obj.shape_key_clear()
    for name in [m.name for m in obj.modifiers]:
        for each in (obj, *copies):
            if name not in each.modifiers:
                continue
            with bpy.context.temp_override(object=each, active_object=each):
                if each.modifiers[name].show_viewport:
                    bpy.ops.object.modifier_apply(modifier=name)
                else:
                    bpy.ops.object.modifier_remove(modifier=name)
    for (name, _points), each in zip(shapes, copies, strict=True):
        obj.shape_key_add(name=name).data.foreach_set("co", scenes.points_of(each.data.vertices).ravel())
        bpy.data.objects.remove(each)
    return seen_of(obj)


def skkeeper(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Apply All Modifiers (Keep Shapekeys): each key on a copy, which is converted."""
    names = [key.name for key in keys_of(obj)] or ["Basis"]
    copies = [scenes.copied(obj) for _name in names]
    for number, each in enumerate(copies):
        _keep_key(each, number)
        make_active(each)
        bpy.ops.object.convert(target="MESH")
    _join_as_keys(copies[0], copies[1:], names)
    return seen_of(copies[0])


def apply_all(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Goes through a list of the modifiers: Blender crashes if another of them goes meanwhile."""
    obj.shape_key_clear()
    make_active(obj)
    names = [modifier.name for modifier in obj.modifiers]
    for modifier, name in zip(list(obj.modifiers), names, strict=True):
        assert modifier.name == name
        with suppress(RuntimeError):
            bpy.ops.object.modifier_apply(modifier=name)
    bpy.context.scene.frame_set(9)
    return seen_of(obj)


def rest_position(obj: bpy.types.Object, _folder: Path) -> Seen:
    """godot-blender-exporter, iqm: the armature shows its rest position meanwhile."""
    obj.parent.data.pose_position = "REST"
    found = shown_keys(obj)
    obj.parent.data.pose_position = "POSE"
    return found | seen_of(obj)


def hidden_in_rest_position(obj: bpy.types.Object, _folder: Path) -> Seen:
    """collada-exporter, mmd_tools: the Armature modifiers are hidden, too."""
    with hidden(skins_of(obj)):
        return {**shown_keys(obj), **rest_position(obj, _folder)}


def convert(obj: bpy.types.Object, _folder: Path) -> Seen:
    make_active(obj)
    bpy.ops.object.convert(target="MESH")
    return seen_of(obj)


def convert_hidden(obj: bpy.types.Object, _folder: Path) -> Seen:
    """A copy at rest: its Armature modifiers are hidden, and it is converted."""
    new = scenes.copied(obj)
    for modifier in skins_of(new):
        modifier.show_viewport = False
    make_active(new)
    bpy.ops.object.convert(target="MESH")
    return seen_of(new, "copy") | seen_of(obj, "left")


def _apply_pose(armature: bpy.types.Object) -> None:
    scenes.enter(armature, "POSE")
    bpy.ops.pose.armature_apply()
    bpy.ops.object.mode_set(mode="OBJECT")


def apply_armature(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Pose as rest pose: the modifier is applied, the pose too, and the modifier made again."""
    armature, keys = obj.parent, obj.data.shape_keys
    if keys is None:
        make_active(obj)
        for name in [m.name for m in skins_of(obj)]:
            bpy.ops.object.modifier_apply(modifier=name, single_user=True)
        _apply_pose(armature)
        obj.modifiers.new("Armature", "ARMATURE").object = armature
    return seen_of(obj)


def cats(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Apply as Rest Pose: an Armature modifier of its own is applied, or shown alone over each shape key."""
    armature, keys = obj.parent, obj.data.shape_keys
    make_active(obj)
    if keys is None:
        obj.modifiers.new("Apply", "ARMATURE").object = armature
        bpy.ops.object.modifier_move_to_index(modifier="Apply", index=0)
        bpy.ops.object.modifier_apply(modifier="Apply")
    else:
        with hidden([m for m in obj.modifiers if m.show_viewport]):
            obj.modifiers.new("Apply", "ARMATURE").object = armature
            shapes = shown_keys(obj)
            obj.modifiers.remove(obj.modifiers["Apply"])
        obj.data.vertices.foreach_set("co", shapes["shown Basis"].ravel())
        for key in keys.key_blocks:
            key.data.foreach_set("co", shapes[f"shown {key.name}"].ravel())
    _apply_pose(armature)
    return seen_of(obj)


def join(obj: bpy.types.Object, _folder: Path) -> Seen:
    other = scenes.added("Other", obj.data.copy())
    other.location.y = 3.0
    make_active(obj)
    other.select_set(True)
    bpy.ops.object.join()
    return seen_of(obj)


def data_transfer(obj: bpy.types.Object, _folder: Path) -> Seen:
    """Weights from the shown mesh to a plane of points in it."""
    bpy.ops.mesh.primitive_grid_add(size=3.0)
    other = bpy.context.object
    make_active(obj)
    other.select_set(True)
    bpy.ops.object.data_transfer(
        data_type="VGROUP_WEIGHTS",
        vert_mapping="NEAREST",
        layers_select_src="ALL",
        layers_select_dst="NAME",
    )
    return seen_of(other, "other") | seen_of(obj)


def rigify(obj: bpy.types.Object, folder: Path) -> Seen:
    """Game rigs: the mesh gets another armature, and is exported."""
    armature = obj.parent
    other = scenes.copied(armature, "Game Rig")
    for modifier in skins_of(obj):
        modifier.object = other
    obj.parent = other
    return exported(*GLTF)(obj, folder)


def auto_rig_pro(obj: bpy.types.Object, folder: Path) -> Seen:
    """Exports copies, with other names of bones: all modifiers but the Armature modifier are applied, where
    there are no shape keys."""
    new, armature = scenes.copied(obj), scenes.copied(obj.parent)
    new.parent = armature
    for modifier in skins_of(new):
        modifier.object = armature
    for bone in armature.data.bones:
        bone.name = f"Game {bone.name}"
    make_active(new)
    if new.data.shape_keys is None:
        for modifier in list(new.modifiers):
            if modifier.type != "ARMATURE" and modifier.show_viewport:
                bpy.ops.object.modifier_apply(modifier=modifier.name)
    armature.select_set(True)
    bpy.ops.export_scene.fbx(filepath=str(folder / "arm.fbx"), use_selection=True)
    bpy.data.batch_remove([new, armature])
    return seen_of(obj, "left") | read_again(bpy.ops.import_scene.fbx, folder / "arm.fbx")


GLTF = (bpy.ops.export_scene.gltf, bpy.ops.import_scene.gltf, "glb")
AT_ONCE = {"as_background_job": False}
TOOLS = {
    "glTF": exported(*GLTF),
    "glTF, modifiers applied": exported(*GLTF, export_apply=True),
    "FBX": exported(bpy.ops.export_scene.fbx, bpy.ops.import_scene.fbx, "fbx"),
    "USD": exported(bpy.ops.wm.usd_export, bpy.ops.wm.usd_import, "usda"),
    "Alembic": exported(*(bpy.ops.wm.alembic_export, bpy.ops.wm.alembic_import, "abc", AT_ONCE), **AT_ONCE),
    "OBJ": exported(bpy.ops.wm.obj_export, bpy.ops.wm.obj_import, "obj"),
    "VRM 0": vrm_0,
    "VRM 1": vrm_1,
    "CGCookie": cgcookie,
    "gret": gret,
    "SKkeeper": skkeeper,
    "Apply All": apply_all,
    "Convert": convert,
    "Convert, hidden": convert_hidden,
    "Rest position": rest_position,
    "Rest position, hidden": hidden_in_rest_position,
    "Apply the Armature modifier": apply_armature,
    "Cats": cats,
    "Join": join,
    "Data Transfer": data_transfer,
    "Rigify": rigify,
    "Auto-Rig Pro": auto_rig_pro,
}
if bpy.app.version < (5, 0):
    collada = bpy.ops.wm.collada_export, bpy.ops.wm.collada_import, "dae"
    TOOLS["Collada"] = exported(*collada, apply_modifiers=True)


def differences(got: Seen, expected: Seen) -> list[str]:
    found = sorted(got.keys() ^ expected.keys())
    for name in got.keys() & expected.keys():
        mine, its = got[name], expected[name]
        if isinstance(mine, np.ndarray):
            if mine.shape != its.shape or (len(mine) and scenes.worst(mine, its) > 1e-4):
                found.append(name)
        elif mine != its:
            found.append(f"{name}: {mine} not {its}"[:200])
    return found


SAID = {
    ("FBX", with_keys): FBX,
    **{
        ("Auto-Rig Pro", prepare): other_tools.APPLYING
        for prepare in MESHES
        if prepare is not with_front_and_keys
    },
}
"""What differs, with the sentence that says so before."""


def outcome(tool: Callable, obj: bpy.types.Object, folder: Path) -> Seen:
    try:
        return tool(obj, folder)
    except RuntimeError as error:
        return {"error": str(error)}


@pytest.mark.parametrize(("tool", "prepare"), halved((tool, prepare) for tool in TOOLS for prepare in MESHES))
def test_a_tool(tool, prepare, tmp_path):
    if (tool, prepare) == ("Collada", with_front_and_keys):
        pytest.skip("Blender's exporter then leaves another shape, without Sinew, too (4.2, 4.5)")
    expected = TOOLS[tool](make(prepare, has_sinew=False), tmp_path)
    obj = make(prepare, has_sinew=True)
    said = SAID.get((tool, prepare))
    if said is not None:
        assert said in (*other_tools.notes(obj), other_tools.APPLYING)
        assert differences(outcome(TOOLS[tool], obj, tmp_path), expected) != []
        # It helps to do what the sentence says.
        obj = make(prepare, has_sinew=True)
        properties.of(obj).enabled = False
        bpy.context.view_layer.update()
    assert differences(TOOLS[tool](obj, tmp_path), expected) == []


def with_multires(obj: bpy.types.Object) -> None:
    """Sinew uses the mesh, as no script can compare what this modifier reads from it."""
    scenes.put_in_front(obj, "MULTIRES")


def test_it_is_said_before(tmp_path):
    """In the list of meshes and by `sinew check`; where Blender deforms a small mesh, nothing differs."""
    obj = make(with_keys, has_sinew=True)
    assert other_tools.notes(obj) == [FBX]
    obj.modifiers.new("Behind", "SUBSURF")
    assert other_tools.notes(obj) == []
    obj.modifiers.remove(obj.modifiers["Behind"])
    path = scenes.save(tmp_path / "arm.blend")
    notes = preflight.check({"source": str(path)}, lambda *_stage: None)["notes"]
    # Its weights do not sum to 1, either.
    assert [notes[0], notes[-1]] == [f"Arm: {FBX}", other_tools.APPLYING]
    obj = make(with_multires, has_sinew=True)
    assert other_tools.notes(obj) == [SECOND_USER]
    obj.sinew.enabled = False
    assert other_tools.notes(obj) == []


def test_tools_find_the_armature_modifier_also_after_the_update(monkeypatch, tmp_path):
    monkeypatch.setattr(safe_mode, "_forced", True)
    obj = make(plain, has_sinew=True)
    assert len(skins_of(obj)) == 1
    assert other_tools.notes(obj) == []
    # A tool that hides all modifiers and adds its own gets that one's shape all the same.
    expected = cats(make(with_keys, has_sinew=False), tmp_path)
    got = cats(make(with_keys, has_sinew=True), tmp_path)
    assert scenes.worst(got[" key Key"], expected[" key Key"]) <= 1e-5


# --- Files as a whole, with what exporters leave out by default


def _all_on(operator: object) -> dict[str, bool]:
    """The options that write more than an exporter does by itself."""
    wanted = {
        *("export_extras", "export_attributes", "export_custom_properties", "author_blender_name"),
        *("use_custom_props", "use_custom_properties", "export_custom_normals", "vcolors", "orcos"),
    }
    return dict.fromkeys(wanted & {*operator.get_rna_type().properties.keys()}, True)


WHOLE_FILES = {
    ".gltf": lambda: bpy.ops.export_scene.gltf,
    ".usda": lambda: bpy.ops.wm.usd_export,
    ".fbx": lambda: bpy.ops.export_scene.fbx,
    ".abc": lambda: bpy.ops.wm.alembic_export,
    ".obj": lambda: bpy.ops.wm.obj_export,
    ".ply": lambda: bpy.ops.wm.ply_export,
    ".dae": lambda: bpy.ops.wm.collada_export,
}


@pytest.mark.parametrize("prepare", [plain, with_front_and_keys])
@pytest.mark.parametrize("ending", WHOLE_FILES)
def test_nothing_of_sinews_is_in_a_file(ending, prepare, tmp_path):
    """Whole files, with custom properties and attributes; of a character without Sinew, too. What is readable
    is the same but for the rounding of points."""
    operator = WHOLE_FILES[ending]()
    try:
        options = _all_on(operator) | ({"export_format": "GLTF_SEPARATE"} if ending == ".gltf" else {})
    except (AttributeError, KeyError):
        pytest.skip("this Blender has no Collada")
    addons = bpy.context.preferences.addons
    contents = []
    for is_enabled, has_sinew in ((False, False), (True, False), (True, True)):
        obj = make(prepare, has_sinew)
        obj["mine"] = obj.data["mine"] = bpy.context.scene["mine"] = 2
        if is_enabled:
            addons.new().module = sinew_addon.__name__
            # Reading settings stores them, as drawing panels does.
            for name in (each for each in dir(bpy.types.Scene) if each.startswith("sinew")):
                getattr(bpy.context.scene, name)
        path = tmp_path / f"{is_enabled}{has_sinew}" / f"arm{ending}"
        path.parent.mkdir()
        operator(filepath=str(path), **options)
        contents.append(path.read_bytes())
        if is_enabled:
            addons.remove(addons[sinew_addon.__name__])
    for content in contents:
        assert b"sinew" not in content.lower()
    if ending in (".gltf", ".usda", ".dae"):
        without, *others = (_without_numbers(content) for content in contents)
        assert others == [without, without]


def _without_numbers(content: bytes) -> list[str]:
    text = re.sub(r"-?\d+(\.\d+)?(e-?\d+)?", "0", content.decode())
    # Times, and points as glTF stores them.
    return [
        line for line in text.splitlines() if not re.search(r"data:application|<created>|<modified>", line)
    ]
