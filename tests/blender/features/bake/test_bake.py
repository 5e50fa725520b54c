# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes, opened in a Blender without Sinew, have the shapes that Sinew had."""

from __future__ import annotations

import re
import signal
import struct
import time

import bpy
import numpy as np
import program
import pytest
import scenes
from program import checked, run_sinew, without_sinew
from sinew_addon.attach import attach, properties
from sinew_addon.base.errors import SinewError
from sinew_addon.features.bake import bake, baked_files
from sinew_addon.io import actions

pytestmark = pytest.mark.outer_versions

FRAMES = list(range(1, 12))
TOLERANCE = 1e-6
METHOD = "dq"
# Bakes to bones only approximate the shape: test_bake_bones.py.
# Textures have tests of their own, too.
EXACT = [kind for kind in baked_files.KINDS if kind not in (baked_files.BONES, baked_files.VAT)]
SUFFIXES = baked_files.FILES

READ = """
import sys, bpy, numpy as np
path, frames, result = sys.argv[1], [float(f) for f in sys.argv[2].split(",")], sys.argv[3]
if path.endswith(".blend"):
    bpy.ops.wm.open_mainfile(filepath=path)
else:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if path.endswith(".abc"):
        bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
    else:
        bpy.ops.wm.usd_import(filepath=path)
assert not hasattr(bpy.types.Object, "sinew")
arrays, uvs, materials = {}, [], []
scene = bpy.context.scene
if bpy.context.mode != "OBJECT":
    # As it was saved.
    bpy.ops.object.mode_set(mode="OBJECT")
for obj in [o for o in scene.objects if o.type == "MESH" and len(o.data.vertices) > 50]:
    per_frame = []
    for frame in frames:
        scene.frame_set(int(frame // 1), subframe=frame % 1)
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.empty((len(evaluated.data.vertices), 3), dtype=np.float32)
        evaluated.data.vertices.foreach_get("co", points.ravel())
        matrix = np.array(evaluated.matrix_world)
        per_frame.append(points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3])
    arrays[obj.name] = np.stack(per_frame)
    uvs.append(len(obj.data.uv_layers))
    materials += [slot.material.name for slot in obj.material_slots if slot.material]
# Within an archive Windows takes a name's backslash for a slash.
points = {str(number): array for number, array in enumerate(arrays.values())}
np.savez(result, uvs=np.array(uvs), materials=np.array(materials), names=np.array([*arrays]), **points)
"""


def read_elsewhere(path, frames, tmp_path):
    """World points [frames, vertices, 3] by name, in a process without Sinew."""
    result = tmp_path / "read.npz"
    checked(without_sinew.run(READ, path, ",".join(map(str, frames)), result), 0)
    with np.load(result) as arrays:
        points = {str(name): arrays[str(number)] for number, name in enumerate(arrays["names"])}
        return points | {"uvs": arrays["uvs"], "materials": arrays["materials"]}


def shown(obj, frames, method=METHOD):
    scenes.add_sinew(obj, method)
    return scenes.shapes(obj, frames)


def assert_plays_elsewhere(obj, path, tmp_path, kind, frames=FRAMES, method=METHOD):
    """float32 [frames, vertices, 3]: its shapes by Sinew, which a bake of its file has, too."""
    scenes.save(path)
    expected, before, out = shown(obj, frames, method), path.read_bytes(), tmp_path / "out"
    run_sinew(
        "bake", path, "--method", method, "--to", kind, "--frames", f"{frames[0]}-{frames[-1]}", "--out", out
    )
    assert path.read_bytes() == before
    read = read_elsewhere(out / f"{path.stem}{SUFFIXES.get(kind, '.blend')}", frames, tmp_path)
    (points,) = (read[name] for name in read if name not in ("uvs", "materials"))
    assert scenes.worst(points, expected) <= TOLERANCE * scenes.diagonal(obj)
    assert max(scenes.worst(expected[0], shape) for shape in expected) > 0.1
    return expected


@pytest.mark.parametrize(("kind", "method"), [("shape-keys", "lbs"), ("mdd", "qv"), ("pc2", "dq")])
def test_a_blend_file_plays_the_same_elsewhere(arm, tmp_path, kind, method):
    assert_plays_elsewhere(*arm, tmp_path, kind, method=method)
    names = {p.name for p in (tmp_path / "out").rglob("*") if p.is_file()}
    assert names == ({"arm.blend"} if kind == "shape-keys" else {"arm.blend", f"Arm.{kind}"})


def test_each_mesh_as_the_file_has_it(arm, tmp_path):
    """Without --method; one without Sinew is left out."""
    obj, path = arm
    scenes.make_arm(name="Plain")
    expected = shown(obj, FRAMES, "qv")
    scenes.save(path)
    command = ("bake", path, "--to", "mdd", "--frames", "1-11", "--out", tmp_path / "out")
    said = run_sinew(*command, status=1)
    assert "Plain is not deformed by Sinew; choose a method by --method" in said.stderr
    read = read_elsewhere(tmp_path / "out" / "arm.blend", FRAMES, tmp_path)["Arm"]
    assert scenes.worst(read, expected) <= TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("kind", ["shape-keys", "mdd", "pc2"])
def test_chosen_frames_and_straight_lines_between(arm, tmp_path, kind):
    obj, path = arm
    chosen = [2, 4.5, 9]
    at = shown(obj, chosen)
    frames = "2,4.5,9"
    run_sinew("bake", path, "--method", METHOD, "--to", kind, "--frames", frames, "--out", tmp_path / "out")
    asked = [1, 2, 3.25, 4.5, 9, 11]
    read = read_elsewhere(tmp_path / "out" / "arm.blend", asked, tmp_path)["Arm"]
    expected = np.stack([at[0], at[0], (at[0] + at[1]) / 2, at[1], at[2], at[2]])
    assert scenes.worst(read, expected) <= TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize(
    "frames", [[4, 5, 6, 7, 8], [4, 6, 8, 10], [3, 4.5, 9]], ids=["each", "second", "some"]
)
@pytest.mark.parametrize("kind", ["mdd", "pc2"])
def test_caches_play_in_another_file_as_the_command_says(arm, tmp_path, kind, frames):
    obj, path = arm
    expected = shown(obj, frames)
    scenes.save(path)
    words = (
        "--method",
        METHOD,
        "--to",
        kind,
        "--frames",
        ",".join(map(str, frames)),
        "--out",
        tmp_path / "out",
    )
    said = run_sinew("bake", path, *words).stderr
    attach.remove(obj)
    obj.modifiers.clear()
    cache = obj.modifiers.new("Cache", "MESH_CACHE")
    cache.cache_format, cache.filepath = kind.upper(), str(tmp_path / "out" / "arm_cache" / f"Arm.{kind}")
    if "Time Mode to Time" in said:
        cache.time_mode = "TIME"
    elif "key Mesh Cache's Evaluation Frame" in said:
        cache.play_mode = "CUSTOM"
        scenes.key(cache, "eval_frame", [(frame, number) for number, frame in enumerate(frames)])
    else:
        cache.frame_start = float(re.search(r"Start Frame to ([\d.]+)", said)[1])
        scale = re.search(r"Frame Scale to ([\d.]+)", said)
        cache.frame_scale = float(scale[1]) if scale else 1.0
    assert scenes.worst(scenes.shapes(obj, frames), expected) <= TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("kind", ["alembic", "usd"])
def test_exports_are_the_final_meshes(arm, tmp_path, kind):
    obj, path = arm
    expected = shown(obj, FRAMES)
    out = tmp_path / "out"
    run_sinew("bake", path, "--method", METHOD, "--to", kind, "--out", out)
    (written,) = out.iterdir()
    read = read_elsewhere(written, FRAMES, tmp_path)
    assert all(read.pop("uvs") == 1)
    assert list(read.pop("materials")) == ["Skin"]
    (points,) = read.values()
    assert scenes.worst(points, expected) <= TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("kind", ["mdd", "pc2"])
def test_caches_follow_what_stands_in_front_and_behind(arm, tmp_path, kind):
    obj, path = arm
    mirror = scenes.put_in_front(obj, "MIRROR", "Mirror")
    mirror.use_axis, mirror.use_mirror_merge = (False, False, True), False
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 1
    scenes.key_shape(obj)
    assert_plays_elsewhere(obj, path, tmp_path, kind)
    refused = run_sinew(
        "bake", path, "--method", METHOD, "--to", "shape-keys", "--out", tmp_path / "keys", status=1
    )
    assert "Mirror changes the mesh ahead of the armature" in refused.stderr
    assert not (tmp_path / "keys").exists()


def test_alembic_has_no_groups_of_stages(arm, tmp_path):
    """Blender's exporter writes all that the mesh has from 5.3 on; the stage's shape is in the file."""
    obj, path = arm
    obj.vertex_groups.new(name="of artist").add([0, 1], 0.5, "REPLACE")
    obj.vertex_groups.new(name="of stage").add(range(40), 1.0, "REPLACE")
    scenes.add_sinew(obj, METHOD)
    stage = properties.of(obj).delta_mush
    stage.enabled, stage.group = True, "of stage"
    expected = scenes.shapes(obj, FRAMES)
    scenes.save(path)
    run_sinew("bake", path, "--to", "alembic", "--frames", "1-11", "--out", tmp_path / "out")
    data = (tmp_path / "out" / "arm.abc").read_bytes()
    assert b"of stage" not in data.replace(b"_", b" ")
    assert (b"of artist" in data.replace(b"_", b" ")) == (bpy.app.version >= (5, 3, 0))
    read = read_elsewhere(tmp_path / "out" / "arm.abc", FRAMES, tmp_path)
    (points,) = (read[name] for name in read if name not in ("uvs", "materials"))
    assert scenes.worst(points, expected) <= TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("kind", ["mdd"])
def test_a_number_of_vertices_that_changes_is_refused(arm, tmp_path, kind):
    obj, path = arm
    scenes.key(scenes.put_in_front(obj, "WELD"), "merge_threshold", ((1, 0.0), (5, 0.2)))
    scenes.save(path)
    out = tmp_path / "out"
    refused = run_sinew("bake", path, "--method", METHOD, "--to", kind, "--out", out, status=1)
    assert "one number, bake to alembic or usd" in refused.stderr
    assert not list(out.rglob("*"))


def with_a_shape_key(obj):
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Fat")
    key.points[30].co.z += 0.2
    key.value = 0.5


def with_a_parent_that_deforms(obj):
    scenes.deform_by_parent(obj, obj.modifiers[0].object)


@pytest.mark.parametrize(
    ("set_up", "kind"), [(with_a_shape_key, "shape-keys"), (with_a_parent_that_deforms, "pc2")]
)
def test_what_deforms_besides_is_in_the_bake_once(arm, tmp_path, set_up, kind):
    set_up(arm[0])
    assert_plays_elsewhere(*arm, tmp_path, kind)


def test_the_armature_modifier_stays_for_the_way_back(arm, tmp_path):
    """What is hidden stays hidden."""
    obj, path = arm
    obj.hide_viewport = obj.hide_render = True
    scenes.save(path)
    run_sinew("bake", path, "--method", METHOD, "--to", "mdd", "--out", tmp_path / "out")
    obj = scenes.opened(tmp_path / "out" / "arm.blend")
    assert (obj.hide_viewport, obj.hide_render) == (True, True)
    assert not properties.has_sinew(obj)
    assert [m.type for m in obj.modifiers] == ["MESH_CACHE", "ARMATURE"]
    assert obj.modifiers[0].filepath.replace("\\", "/") == "//arm_cache/Arm.mdd"
    armature = obj.modifiers[1]
    assert (armature.object.name, armature.show_viewport, armature.show_render) == ("Arm Rig", False, False)
    assert not [group for group in bpy.data.node_groups if group.name.startswith("Sinew")]


@pytest.fixture
def small_disk(tmp_path):
    with program.disk(tmp_path / "small", "size=64k") as folder:
        yield folder


def test_a_disk_that_fills_up_meanwhile(small_disk):
    cache = baked_files.PointCache(small_disk / "a.mdd", "mdd", [1], 100_000, 24.0)
    with pytest.raises(SinewError, match=r"a\.mdd: can not be written: No space left on device"):
        cache.write(np.zeros((100_000, 3), dtype=np.float32))
    cache.discard()
    assert not list(small_disk.iterdir())


def test_headers(tmp_path):
    points = np.arange(6, dtype=np.float32).reshape(2, 3)
    for kind in ("mdd", "pc2"):
        cache = baked_files.PointCache(tmp_path / f"a.{kind}", kind, [12, 14], 2, 24.0)
        cache.write(points)
        cache.write(points + 1)
        cache.close()
        baked_files.publish(cache.unfinished, cache.path)
    mdd = (tmp_path / "a.mdd").read_bytes()
    assert struct.unpack(">iiff12f", mdd) == (2, 2, 0.5, np.float32(14 / 24), *range(6), *range(1, 7))
    pc2 = (tmp_path / "a.pc2").read_bytes()
    assert struct.unpack("<12siiffi12f", pc2) == (
        b"POINTCACHE2\0", 1, 2, 12.0, 2.0, 2, *range(6), *range(1, 7)
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["shape-keys", "mdd", "pc2", "alembic", "usd"])
def test_the_operator(arm, tmp_path, kind):
    obj, path = arm
    expected = shown(obj, FRAMES)
    objects = set(bpy.data.objects)
    assert bpy.ops.sinew.bake(kind=kind, frames="1-11") == {"FINISHED"}
    in_file = kind in ("shape-keys", "mdd", "pc2")
    assert properties.has_sinew(obj) == (not in_file)
    assert set(bpy.data.objects) == objects if in_file else len(bpy.data.objects) == len(objects)
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= TOLERANCE * scenes.diagonal(obj)
    if kind != "shape-keys":
        assert len([p for p in path.parent.rglob("*") if p.is_file() and p.name != "arm.blend"]) == 1
    if not in_file:
        with pytest.raises(RuntimeError, match="is there already; choose to overwrite it"):
            bpy.ops.sinew.bake(kind=kind, frames="1-11")
        assert bpy.ops.sinew.bake(kind=kind, frames="1-11", overwrite=True) == {"FINISHED"}


def test_names_of_objects_and_files(arm, tmp_path):
    """Objects whose names become the same after cleaning, in any alphabet, and a folder that already has
    such files."""
    _obj, path = arm
    names = ["a/b", "a\\b", "A_b", "имя", "名前", "..", " "]
    for name in names:
        scenes.make_arm(sides=6, rings=11, name=name)
    expected = {}
    for obj in [o for o in bpy.context.scene.objects if o.type == "MESH"]:
        expected[obj.name] = shown(obj, [1, 11])
        bpy.data.objects[obj.name].sinew.enabled = True
    bpy.ops.wm.open_mainfile(filepath=str(path))
    for name in names:
        scenes.make_arm(sides=6, rings=11, name=name)
    scenes.save(path)
    out = tmp_path / "out"
    options = ("--method", METHOD, "--to", "pc2", "--frames", "1,11", "--out", out)
    run_sinew("bake", path, *options)
    read = read_elsewhere(out / "arm.blend", [1, 11], tmp_path)
    assert len(list((out / "arm_cache").iterdir())) == 1 + len(names)
    for name in ("Arm", *names):
        assert scenes.worst(read[name], expected[name]) <= 1e-5
    (out / "arm.blend").unlink()
    mine = (out / "arm_cache" / "Arm.pc2").read_bytes()
    refused = run_sinew("bake", path, *options, status=1)
    assert "Arm.pc2: is there already" in refused.stderr
    assert (out / "arm_cache" / "Arm.pc2").read_bytes() == mine
    assert not (out / "arm.blend").exists()


@pytest.mark.parametrize("in_strip", [False, True])
@pytest.mark.parametrize("kind", ["mdd", "usd"])
def test_keyed_visibility(arm, tmp_path, kind, in_strip):
    """A modifier that keys switch off halfway: the bake has the rest shape from there on."""
    obj, path = arm
    modifier = obj.modifiers["Armature"]
    for flag in ("show_viewport", "show_render"):
        scenes.key(modifier, flag, ((1, True), (6, False)))
    if in_strip:
        obj.animation_data.nla_tracks.new().strips.new("Strip", 1, obj.animation_data.action)
        obj.animation_data.action = None
    rest = scenes.rest_points(obj)
    expected = assert_plays_elsewhere(obj, path, tmp_path, kind)
    assert scenes.worst(expected[-1], rest) <= TOLERANCE < scenes.worst(expected[4], rest)


@pytest.mark.parametrize(("kind", "stretched"), [*((kind, True) for kind in EXACT), ("usd", False)])
def test_several_moving_objects(arm, tmp_path, kind, stretched):
    """Children of a rig that moves as an object, rotated and scaled along their own axes; the scene's
    time remapped or not."""
    first, path = arm
    second, rig = scenes.make_arm(name="Brother")
    second.location = (0.0, 8.0, 0.0)
    for obj, parent in ((first, first.modifiers["Armature"].object), (second, rig)):
        obj.parent, obj.rotation_euler, obj.scale = parent, (0.3, 0.2, 0.1), (1.0, 2.0, 0.5)
        scenes.key(parent, "location", ((1, (0.0, 0.0, 0.0)), (11, (3.0, 0.0, 0.0))))
        scenes.key(parent, "rotation_euler", ((11, (0.0, 0.0, 1.0)),))
    scene = bpy.context.scene
    if stretched:
        scene.render.frame_map_new = 200
    scene.frame_start, scene.frame_end = 3, 9
    scenes.save(path)
    frames = [3, 4, 6, 9]
    for obj in (first, second):
        scenes.add_sinew(obj, METHOD)
    wanted = [scenes.world_shapes(obj, frames) for obj in (first, second)]
    run_sinew("bake", path, "--method", METHOD, "--to", kind, "--out", tmp_path / "out")
    read = read_elsewhere(tmp_path / "out" / f"arm{SUFFIXES.get(kind, '.blend')}", frames, tmp_path)
    shapes = [read[name] for name in sorted(read) if name not in ("uvs", "materials")]
    assert len(shapes) == 2
    for points, expected in zip(shapes, wanted, strict=True):
        assert scenes.worst(expected[0], expected[-1]) > 0.5
        # World points of float32 matrices, a few units from the origin.
        assert scenes.worst(points, expected) <= 3e-6 * scenes.diagonal(first)


@pytest.mark.parametrize("kind", baked_files.EXPORTS)
def test_what_hangs_on_bones_goes_along(arm, tmp_path, kind):
    """A hat on a bone and a feather on the hat; not objects parented to the armature itself, nor hidden
    ones."""
    obj, path = arm
    armature, hung = obj.modifiers["Armature"].object, {}
    for name in ("hat", "feather", "beside", "hidden"):
        mesh = bpy.data.meshes.new(name)
        points = np.random.default_rng(len(hung)).normal(size=(60, 3))
        mesh.from_pydata(points.tolist(), [], np.arange(60).reshape(15, 4).tolist())
        hung[name] = scenes.added(name, mesh)
        hung[name].parent = hung["hat"] if name == "feather" else armature
        if name not in ("feather", "beside"):
            hung[name].parent_type, hung[name].parent_bone = "BONE", armature.data.bones[-1].name
    hung["hidden"].hide_set(True)
    scenes.save(path)
    frames = [1, 5, 11]
    scenes.add_sinew(obj, METHOD)
    run_sinew("bake", path, "--method", METHOD, "--to", kind, "--frames", "1-11", "--out", tmp_path / "out")
    read = read_elsewhere(tmp_path / "out" / f"arm{SUFFIXES[kind]}", frames, tmp_path)
    shapes = {name.lower(): points for name, points in read.items() if name not in ("uvs", "materials")}
    assert len(shapes) == 3, list(shapes)
    for name in ("feather", "hat"):
        wanted = scenes.world_shapes(hung[name], frames)
        assert scenes.worst(wanted[0], wanted[-1]) > 0.5
        (points,) = (found for known, found in shapes.items() if name in known)
        nearest = np.linalg.norm(points[0][:, None] - wanted[0][None], axis=2).argmin(axis=1)
        assert set(nearest) == set(range(60))
        assert scenes.worst(points, wanted[:, nearest]) <= 3e-6 * scenes.diagonal(obj)


@pytest.mark.parametrize("kind", EXACT)
def test_frames_before_zero(arm, tmp_path, kind):
    obj, path = arm
    animation = obj.modifiers["Armature"].object.animation_data
    for curve in actions.all_curves(animation.action, actions.slot_of(animation)):
        for key in curve.keyframe_points:
            key.co_ui.x -= 11.0
    scenes.save(path)
    command = ("bake", path, "--method", METHOD, "--to", kind, "--frames", "-5--1", "--out", tmp_path / "out")
    if kind == "usd":
        assert "Blender exports no frames before 0" in run_sinew(*command, status=1).stderr
        gaps = run_sinew(*command, "--frames", "1,5", status=1)
        assert "Blender exports every frame of a range" in gaps.stderr
        assert not (tmp_path / "out").exists()
    else:
        assert_plays_elsewhere(obj, path, tmp_path, kind, range(-5, 0))


def test_a_copy_has_its_name_last(arm, tmp_path):
    """If a cache can not get its name, no copy plays one that does not exist."""
    _obj, path = arm
    out = tmp_path / "out"
    (out / "arm_cache" / "Arm.mdd" / "mine").mkdir(parents=True)
    command = ("bake", path, "--method", METHOD, "--to", "mdd", "--frames", "1-2", "--out", out)
    assert "Arm.mdd: can not be written" in run_sinew(*command, "--overwrite", status=1).stderr
    assert sorted(p.name for p in out.rglob("*")) == ["Arm.mdd", "arm_cache", "mine"]


@pytest.mark.parametrize("kind", ["mdd", "alembic"])
def test_a_library_override_whose_library_keys_visibility(arm, tmp_path, kind):
    """Keys that can not be muted here do not switch the Armature modifier on again on top of the bake. The
    file also has the linked original of the override."""
    obj, path = arm
    for flag in ("show_viewport", "show_render"):
        obj.keyframe_insert(f'modifiers["Armature"].{flag}', frame=1)
    scenes.save(path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    shot = scenes.save(path.with_name("shot.blend"))
    for linked in list(scenes.link_here(path, "Arm", "Arm Rig", relative=True)):
        linked.override_create(remap_local_usages=True)
    obj = next(o for o in bpy.data.objects if o.override_library and o.type == "MESH")
    obj.modifiers["Armature"].object = next(
        o for o in bpy.data.objects if o.override_library and o.type == "ARMATURE"
    )
    assert obj.animation_data.action.library is not None
    assert_plays_elsewhere(obj, shot, tmp_path, kind)
    out = tmp_path / "out"
    refused = run_sinew("bake", shot, "--method", METHOD, "--to", "shape-keys", "--out", out / "k", status=1)
    assert "a library override can not have shape keys of its own" in refused.stderr


@pytest.mark.parametrize("kind", baked_files.KINDS)
def test_the_scene_stays_at_its_frame(arm, tmp_path, kind):
    obj, _path = arm
    scene = bpy.context.scene
    scene.render.frame_map_new = 200
    scenes.add_sinew(obj, METHOD)
    scene.frame_set(6, subframe=0.5)
    started = bake.start([obj], kind, [2, 3, 4], tmp_path / f"arm{SUFFIXES.get(kind, '')}", overwrite=False)
    assert scene.frame_float == 6.5
    list(started.sample())
    started.place()
    assert scene.frame_float == 6.5
    assert (scene.render.frame_map_old, scene.render.frame_map_new) == (100, 200)
    started.discard()


def test_what_is_in_another_scene_is_named(arm, tmp_path):
    _obj, path = arm
    away, rig = scenes.make_arm(name="Away")
    other = bpy.data.scenes.new("Other")
    scenes.move_to(other.collection, away, rig)
    scenes.save(path)
    out = tmp_path / "out"
    result = run_sinew("bake", path, "--method", METHOD, "--to", "mdd", "--out", out, status=1)
    assert "left as it was: Away is not in the scene Scene" in result.stderr
    assert [p.name for p in (out / "arm_cache").iterdir()] == ["Arm.mdd"]


# Long enough to be stopped in between.
LONG = 3000


@pytest.mark.slow
@program.needs_interrupts
@pytest.mark.parametrize("kind", baked_files.KINDS)
def test_ctrl_c_leaves_nothing_behind(arm, tmp_path, kind):
    """Also within an exporter's single call for all frames."""
    _obj, path = arm
    out = tmp_path / "out"
    out.mkdir()
    command = ("bake", path, "--method", METHOD, "--to", kind, "--frames", f"1-{LONG}", "--out", out)
    process = program.start_sinew(*command)
    assert f"({LONG})" in process.stderr.readline()
    if kind in ("mdd", "pc2", "alembic", "usd"):
        while not [p for p in out.rglob("*") if p.is_file()]:
            assert process.poll() is None
            time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _output, errors = process.communicate(timeout=120)
    assert process.returncode == 130, errors
    assert errors == "sinew: stopped\n"
    assert not [p for p in out.rglob("*") if p.is_file()]
