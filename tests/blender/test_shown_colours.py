# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps and errors of bakes to bones change the same 3D views and active colour attributes, and restore
them."""

from __future__ import annotations

import bpy
import pytest
import scenes
import whole_file
from sinew_addon import registration
from sinew_addon.attach import attach, properties
from sinew_addon.features.bake import error_map
from sinew_addon.features.heat import heat_nodes, measures

BOTH = ("heat", "error")
NAMES = {"heat": heat_nodes.NAME, "error": error_map.COLOURS}


def shadings() -> list[bpy.types.View3DShading]:
    spaces = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    return [space.shading for space in spaces if space.type == "VIEW_3D"]


def color_types() -> list[str]:
    return [shading.color_type for shading in shadings()]


def colours_of(mesh: bpy.types.Mesh) -> tuple[str, str]:
    return mesh.attributes.active_color_name, mesh.attributes.default_color_name


def painted_arm(name: str) -> bpy.types.Object:
    obj, _armature = scenes.make_arm(name=name)
    for colours in ("First", "Second"):
        obj.data.color_attributes.new(colours, "FLOAT_COLOR", "POINT")
    obj.data.attributes.active_color_name = "Second"
    obj.data.attributes.default_color_name = "First"
    return obj


def baked_arm(name: str = "Baked") -> bpy.types.Object:
    obj = painted_arm(name)
    scenes.add_sinew(obj, "dq")
    assert bpy.ops.sinew.bake(kind="bones", frames="1,6,11", helpers=2) == {"FINISHED"}
    for number, shading in enumerate(shadings()):
        shading.color_type = ("MATERIAL", "RANDOM", "SINGLE", "OBJECT")[number % 4]
    return obj


def make(same: bool) -> dict[str, bpy.types.Object]:
    """The object that shows each; with `same` one shows both."""
    baked = baked_arm()
    heated = baked if same else painted_arm("Heated")
    scenes.add_sinew(heated, "dq")
    bpy.context.scene.frame_set(6)
    return {"heat": heated, "error": baked}


def show(objects: dict[str, bpy.types.Object], what: str, on: bool) -> None:
    if what == "heat":
        properties.of(objects[what]).heat = on
    else:
        error_map.show([objects[what]], "AFTER" if on else "OFF")


@pytest.mark.parametrize("same", [True, False])
@pytest.mark.parametrize("first_on", BOTH)
@pytest.mark.parametrize("first_off", BOTH)
def test_in_any_order_all_is_restored(same, first_on, first_off):
    objects = make(same)
    last_on, last_off = (BOTH[BOTH.index(first) - 1] for first in (first_on, first_off))
    measures.of(bpy.context.scene)  # reading makes them
    whole_file.of_open_file()  # reading an attribute may change how 5.2 stores it
    before, types = whole_file.of_open_file(), color_types()
    assert len(set(types)) > 1
    assert {colours_of(obj.data) for obj in objects.values()} == {("Second", "First")}
    show(objects, first_on, True)
    show(objects, last_on, True)
    assert set(color_types()) == {"VERTEX"}
    # On one mesh, the one that was switched on last.
    wanted = dict.fromkeys(BOTH, NAMES[last_on]) if same else NAMES
    assert {what: colours_of(obj.data) for what, obj in objects.items()} == {
        what: (name, "First") for what, name in wanted.items()
    }
    show(objects, first_off, False)
    assert set(color_types()) == {"VERTEX"}
    assert colours_of(objects[last_off].data) == (NAMES[last_off], "First")
    if not same:
        assert colours_of(objects[first_off].data) == ("Second", "First")
    show(objects, last_off, False)
    bpy.context.view_layer.update()
    assert color_types() == types
    assert whole_file.differences(before, whole_file.of_open_file()) == []


def test_what_the_artist_chooses_meanwhile_stays():
    objects = make(same=True)
    mesh = objects["heat"].data
    for what in BOTH:
        show(objects, what, True)
    mesh.attributes.active_color_name = "First"
    shadings()[0].color_type = "TEXTURE"
    for what in BOTH:
        show(objects, what, False)
        assert mesh.attributes.active_color_name == "First"
    assert color_types()[0] == "TEXTURE"


def test_another_bake_hides_the_errors_of_the_last_one():
    obj = baked_arm()
    types = color_types()
    bpy.ops.sinew.bake_error(errors="AFTER")
    scenes.add_sinew(obj, "cor")
    bpy.ops.sinew.bake(kind="bones", frames="1,6,11", helpers=1)
    assert error_map.shown([obj]) == "OFF"
    assert color_types() == types
    assert colours_of(obj.data) == ("Second", "First")
    assert [mesh.name for mesh in bpy.data.meshes if error_map.COLOURS in mesh.attributes] == []


def test_undo_and_redo_of_the_errors():
    types = baked_arm() and color_types()
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.sinew.bake_error(errors="BEFORE")
    bpy.ops.ed.undo_push(message="errors")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert color_types() == types
    assert colours_of(bpy.data.objects["Baked"].data) == ("Second", "First")
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    obj = bpy.data.objects["Baked"]
    assert set(color_types()) == {"VERTEX"}
    assert error_map.shown([obj]) == "BEFORE"
    bpy.ops.sinew.bake_error(errors="OFF")
    assert color_types() == types
    assert colours_of(obj.data) == ("Second", "First")


def test_a_saved_file_shows_the_errors_and_gives_all_back(tmp_path):
    types = baked_arm() and color_types()
    bpy.ops.sinew.bake_error(errors="AFTER")
    path = str(tmp_path / "errors.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=True)
    obj = bpy.data.objects["Baked"]
    assert set(color_types()) == {"VERTEX"}
    assert error_map.shown([obj]) == "AFTER"
    bpy.ops.sinew.bake_error(errors="OFF")
    assert color_types() == types
    assert colours_of(obj.data) == ("Second", "First")


def test_a_deleted_mesh_gives_the_views_back():
    obj = baked_arm()
    types = color_types()
    bpy.ops.sinew.bake_error(errors="AFTER")
    bpy.data.objects.remove(obj)
    bpy.context.view_layer.update()
    assert color_types() == types


@pytest.mark.parametrize("same", [True, False])
def test_without_the_add_on_all_is_as_before(same):
    objects = make(same)
    types = color_types()
    for what in BOTH:
        show(objects, what, True)
    registration.unregister()
    try:
        assert color_types() == types
        for obj in objects.values():
            assert colours_of(obj.data) == ("Second", "First")
            assert error_map.COLOURS not in obj.data.attributes
    finally:
        registration.register()
    # The object still has its heat map.
    assert set(color_types()) == {"VERTEX"}
    assert colours_of(objects["heat"].data) == (heat_nodes.NAME, "First")
    attach.remove(objects["heat"])
    assert color_types() == types
    assert colours_of(objects["heat"].data) == ("Second", "First")
