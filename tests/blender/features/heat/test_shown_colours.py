# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps, also those of the error of a bake, change 3D views and active colour attributes, and restore
them."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import test_heat_map
import whole_file
from sinew_addon import registration
from sinew_addon.attach import attach
from sinew_addon.deform import session
from sinew_addon.features.heat import bake_error, measures
from sinew_addon.features.heat.heat_nodes import NAME


def shadings() -> list[bpy.types.View3DShading]:
    spaces = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    return [space.shading for space in spaces if space.type == "VIEW_3D"]


def color_types() -> list[str]:
    return [shading.color_type for shading in shadings()]


def colours_of(mesh: bpy.types.Mesh) -> tuple[str, str]:
    return mesh.attributes.active_color_name, mesh.attributes.default_color_name


def assert_restored(obj: bpy.types.Object, types: list[str]) -> None:
    assert color_types() == types
    assert colours_of(obj.data) == ("Second", "First")


def painted_arm(name: str) -> bpy.types.Object:
    obj, _armature = scenes.make_arm(name=name)
    for colours in ("First", "Second"):
        obj.data.color_attributes.new(colours, "FLOAT_COLOR", "POINT")
    obj.data.attributes.active_color_name = "Second"
    obj.data.attributes.default_color_name = "First"
    return obj


def baked_arm() -> bpy.types.Object:
    obj = painted_arm("Baked")
    scenes.add_sinew(obj, "dq")
    assert bpy.ops.sinew.bake(kind="bones", frames="1,6,11", helpers=2) == {"FINISHED"}
    return obj


@pytest.fixture(params=["heat", "error"])
def what(request) -> str:
    return request.param


def shown_arm(what: str) -> bpy.types.Object:
    """An arm that can show a measure of the deformation, or the error of a bake."""
    obj = baked_arm() if what == "error" else painted_arm("Heated")
    if what == "heat":
        scenes.add_sinew(obj, "dq")
    for number, shading in enumerate(shadings()):
        shading.color_type = ("MATERIAL", "RANDOM", "SINGLE", "OBJECT")[number % 4]
    bpy.context.scene.frame_set(6)
    return obj


def show(what: str) -> None:
    """Switches it on, or off."""
    assert bpy.ops.sinew.heat_map(quantity="bake_error" if what == "error" else "stretch") == {"FINISHED"}


def test_all_is_restored(what):
    obj = shown_arm(what)
    measures.of(bpy.context.scene).quantity = "bake_error" if what == "error" else "stretch"
    before, types = whole_file.content(), color_types()
    assert len(set(types)) > 1
    assert colours_of(obj.data) == ("Second", "First")
    show(what)
    assert set(color_types()) == {"VERTEX"}
    assert colours_of(obj.data) == (NAME, "First")
    show(what)
    bpy.context.view_layer.update()
    assert color_types() == types
    whole_file.assert_same(before)


def test_another_measure_hides_the_errors_of_a_bake():
    obj = shown_arm("error")
    types = color_types()
    show("error")
    measures.of(bpy.context.scene).quantity = "stretch"
    assert_restored(obj, types)
    assert NAME not in obj.data.attributes
    measures.of(bpy.context.scene).quantity = "bake_error_before"
    assert colours_of(obj.data) == (NAME, "First")


def test_a_baked_mesh_that_sinew_deforms_again_shows_its_errors():
    obj = shown_arm("error")
    scenes.add_sinew(obj, "dq")
    show("error")
    colours = test_heat_map.shown_colours(obj)
    assert np.ptp(colours, axis=0).max() > 0.1
    errors = bake_error.errors_of(obj.data, "bake_error", len(obj.data.vertices))
    assert np.argmax(errors) == np.argmax(colours[:, 0] + colours[:, 1])


def test_what_the_artist_chooses_meanwhile_stays(what):
    obj = shown_arm(what)
    show(what)
    obj.data.attributes.active_color_name = "First"
    shadings()[0].color_type = "TEXTURE"
    show(what)
    assert obj.data.attributes.active_color_name == "First"
    assert color_types()[0] == "TEXTURE"


def test_another_bake_hides_the_errors_of_the_last_one():
    obj = baked_arm()
    types = color_types()
    bpy.ops.sinew.heat_map(quantity="bake_error")
    scenes.add_sinew(obj, "cor")
    bpy.ops.sinew.bake(kind="bones", frames="1,6,11", helpers=1)
    assert bake_error.shown(bpy.context.scene) == []
    assert_restored(obj, types)
    assert [mesh.name for mesh in bpy.data.meshes if NAME in mesh.attributes] == []


def test_undo_and_redo(what):
    obj = shown_arm(what)
    types, name = color_types(), obj.name
    bpy.ops.ed.undo_push(message="before")
    show(what)
    colours = test_heat_map.shown_colours(obj)
    bpy.ops.ed.undo_push(message="shown")
    bpy.ops.ed.undo()
    session.refresh(bpy.context)
    assert_restored(bpy.data.objects[name], types)
    bpy.ops.ed.redo()
    session.refresh(bpy.context)
    obj = bpy.data.objects[name]
    assert set(color_types()) == {"VERTEX"}
    np.testing.assert_allclose(test_heat_map.shown_colours(obj), colours, atol=1e-6)
    show(what)
    assert_restored(obj, types)


def test_a_saved_file_shows_it_and_gives_all_back(what, tmp_path):
    obj = shown_arm(what)
    types, name, path = color_types(), obj.name, str(tmp_path / "shown.blend")
    show(what)
    colours = test_heat_map.shown_colours(obj)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=True)
    obj = bpy.data.objects[name]
    assert set(color_types()) == {"VERTEX"}
    np.testing.assert_allclose(test_heat_map.shown_colours(obj), colours, atol=1e-6)
    assert what == "heat" or bake_error.shown(bpy.context.scene) == [obj]
    show(what)
    assert_restored(obj, types)


def test_a_deleted_mesh_gives_the_views_back(what):
    obj = shown_arm(what)
    types = color_types()
    show(what)
    bpy.data.objects.remove(obj)
    bpy.context.view_layer.update()
    assert color_types() == types


def test_without_the_add_on_all_is_as_before(what):
    obj = shown_arm(what)
    types = color_types()
    show(what)
    registration.unregister()
    try:
        assert_restored(obj, types)
        assert NAME not in obj.data.attributes
    finally:
        registration.register()
    if what == "heat":
        # The object still has its heat map.
        assert set(color_types()) == {"VERTEX"}
        assert colours_of(obj.data) == (NAME, "First")
        attach.remove(obj)
    assert_restored(obj, types)
