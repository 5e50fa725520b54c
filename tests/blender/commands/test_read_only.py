# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands only read their inputs: whatever a file could have written, and whatever mode it was saved in."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from program import run_sinew
from sinew_addon.base.errors import SinewError
from sinew_addon.deform import characters
from sinew_addon.io import files

pytestmark = pytest.mark.outer_versions

SIMULATED = {"cloth": "CLOTH", "soft": "SOFT_BODY", "hair": "PARTICLE_SYSTEM", "paint": "DYNAMIC_PAINT"}
EDITED = "Arm: saved in Edit Mode, and used as in Object Mode"


def _simulate(folder):
    """Makes objects whose caches are on the disk and not baked, with three frames of them."""
    scene = bpy.context.scene
    for name, kind in SIMULATED.items():
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(x, y, 0.0) for x in range(2) for y in range(2)], [], [(0, 1, 3, 2)])
        obj = scenes.added(name, mesh)
        simulated = obj.modifiers.new(kind, kind)
        if kind == "DYNAMIC_PAINT":
            with bpy.context.temp_override(object=obj, active_object=obj):
                bpy.ops.dpaint.type_toggle(type="CANVAS")
            simulated = simulated.canvas_settings.canvas_surfaces[0]
            simulated.surface_type = "WEIGHT"
        elif kind == "PARTICLE_SYSTEM":
            simulated = obj.particle_systems[0]
        simulated.point_cache.use_disk_cache = True
    for frame in (1, 2, 3, 2):
        scene.frame_set(frame)
    assert len(list(folder.glob("blendcache_sim/*.bphys"))) == 3 * len(SIMULATED)


def _add_fluid(folder):
    """Off, as Mantaflow can abort a Blender that ends with a domain."""
    domain = scenes.added("fluid", bpy.data.meshes.new("fluid"))
    fluid = domain.modifiers.new("fluid", "FLUID")
    fluid.show_viewport = fluid.show_render = False
    fluid.fluid_type = "DOMAIN"
    fluid.domain_settings.cache_type = "REPLAY"
    fluid.domain_settings.cache_directory = str(folder / "fluid")
    (folder / "fluid" / "config").mkdir(parents=True)
    (folder / "fluid" / "config" / "config_0001.uni").write_bytes(b"an artist's own")


def _add_file_outputs(folder):
    """One in the scene's nodes, one in a group there."""
    scene = bpy.context.scene
    group = bpy.data.node_groups.new("outputs", "CompositorNodeTree")
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("all", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    tree.nodes.new("CompositorNodeGroup").node_tree = group
    layers = tree.nodes.new("CompositorNodeRLayers")
    for number, nodes in enumerate((tree.nodes, group.nodes)):
        output = nodes.new("CompositorNodeOutputFile")
        if hasattr(output, "directory"):
            output.directory = str(folder)
            output.file_output_items.new("RGBA", f"written{number}")
        else:
            output.base_path = str(folder)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_FILE")
    tree.links.new(layers.outputs["Image"], output.inputs[0])


def _content(folder):
    files_there = (path for path in folder.rglob("*") if path.is_file())
    return {str(path): (path.stat().st_mtime_ns, path.read_bytes()) for path in files_there}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A file that tries to write beside itself, saved in Edit Mode."""
    folder = tmp_path_factory.mktemp("read_only") / "in"
    folder.mkdir()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    arm, _armature = scenes.make_arm(sides=6, rings=5)
    scene = bpy.context.scene
    scene.frame_end = 4
    file = scenes.save(folder / "sim.blend")
    _simulate(folder)
    _add_fluid(folder)
    _add_file_outputs(folder)
    scene.camera = scenes.added("Camera", bpy.data.cameras.new("Camera"))
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 64
    scenes.enter(arm, "EDIT")
    scenes.save(file)
    (folder / "sim.blend1").unlink()
    return file, _content(folder)


@pytest.mark.parametrize(
    "command",
    [
        ("info",),
        ("points", "--method", "dq", "--frames", "1,4,3"),
        ("compare", "--frames", "1,4", "--pictures", "1", "--size", "64"),
        ("render", "--method", "dq", "--frames", "1,4", "--own-look"),
        ("reskin", "--method", "dq", "--frames", "1,4"),
        ("bake", "--method", "dq", "--to", "alembic", "--frames", "1-2"),
    ],
    ids=lambda command: command[0],
)
def test_commands_write_nothing_beside_their_input(written, command, tmp_path):
    file, before = written
    out = tmp_path / ("o.npz" if command[0] == "points" else "out")
    said = run_sinew(command[0], file, *command[1:], *(("--out", out) if command[0] != "info" else ()))
    assert _content(file.parent) == before
    texts = [said.stdout, said.stderr, *(path.read_text() for path in tmp_path.rglob("*report.json"))]
    assert any(EDITED in text for text in texts)
    assert any("cloth: its simulation is read from the cache" in text for text in texts)


def test_caches_in_a_copy_are_the_artist_s(written, tmp_path):
    """They play in the copy as in the file: not as baked, which they are while Sinew works."""
    file, before = written
    files.open_file(file)
    soft = bpy.data.objects["soft"].modifiers[0]
    domain = bpy.data.objects["fluid"].modifiers[0].domain_settings
    moved = str(Path(bpy.app.tempdir, "fluid0"))
    assert (soft.point_cache.is_baked, domain.cache_directory) == (True, moved)
    files.save_copy(file, tmp_path / "copy.blend")
    assert (soft.point_cache.is_baked, domain.cache_directory) == (True, moved)
    assert _content(file.parent) == before
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copy.blend"))
    soft = bpy.data.objects["soft"].modifiers[0]
    assert (soft.point_cache.is_baked, soft.point_cache.use_disk_cache) == (False, True)
    assert bpy.data.objects["fluid"].modifiers[0].domain_settings.cache_directory == str(
        file.parent / "fluid"
    )


def test_the_reason_why_a_file_can_not_be_read(tmp_path):
    file = tmp_path / "arm.fbx"
    file.write_text("; FBX 7.4.0 project file")
    with pytest.raises(SinewError, match=r"can not read it: ASCII FBX files are not supported$"):
        files.open_file(file)


@pytest.mark.parametrize(
    ("which", "mode"),
    [("arm", "EDIT"), ("arm", "SCULPT"), ("arm", "WEIGHT_PAINT"), ("armature", "EDIT"), ("armature", "POSE")],
)
def test_commands_leave_modes(which, mode, tmp_path):
    arm, armature = scenes.make_arm(sides=6, rings=5)
    bpy.context.scene.frame_set(11)
    expected = scenes.final_points(arm)
    bpy.context.view_layer.objects.active = arm if which == "arm" else armature
    bpy.ops.object.mode_set(mode=mode)
    file = scenes.save(tmp_path / "arm.blend")
    assert len(files.open_file(file)) == (mode != "POSE")
    assert all(obj.mode in ("OBJECT", "POSE") for obj in bpy.data.objects)
    (mesh,) = characters.deformed_meshes(bpy.context.scene)
    characters.use_method(mesh, "lbs")
    characters.set_frame(bpy.context.scene, 11)
    np.testing.assert_allclose(characters.final_points(mesh), expected, atol=1e-5)
