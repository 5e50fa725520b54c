# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of methods, with sdef's interpolation: keyed, saved, copied, compared, and used in commands."""

from __future__ import annotations

import json

import bpy
import numpy as np
import pytest
import scenes
import sinew
from program import run_sinew
from sinew_addon.attach import properties, stage_settings
from sinew_addon.skinning.engines import ENGINE_GROUP, METHODS
from test_sdef import make_model

pytestmark = pytest.mark.long_term

FRAME = 9
CHOICES = ("nlerp", "slerp")


def skinned_model() -> bpy.types.Object:
    obj, _armature = make_model()
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(FRAME)
    return obj


def shape_of_each(obj: bpy.types.Object) -> dict[str, np.ndarray]:
    found = {}
    for choice in CHOICES:
        obj.sinew.sdef.interpolation = choice
        bpy.context.view_layer.update()
        found[choice] = scenes.final_points(obj)
    obj.sinew.sdef.interpolation = CHOICES[0]
    bpy.context.view_layer.update()
    assert scenes.worst(*found.values()) > 1e-3
    return found


def test_the_library_decides_what_there_is():
    for method in METHODS.values():
        group = getattr(properties.SinewSettings.bl_rna.properties.get(method.name), "fixed_type", None)
        assert (group is not None) == bool(method.parameters), method.name
        for parameter in method.parameters:
            assert group.properties[parameter.id].is_overridable
            assert group.properties[parameter.id].name == parameter.label
    obj, _armature = scenes.make_arm()
    values = stage_settings.method_values(properties.of(obj), ("sdef", "lbs", ""))
    (sdef,) = (method for method in sinew.methods() if method.name == "sdef")
    assert values == {"sdef.interpolation": sdef.parameters[0].default}


def test_the_menu_has_three_columns_at_most():
    """Blender makes a column of each heading; in front of the first is another one."""
    items = stage_settings.method_items()
    headings = [label for name, label, _text, _number in items if not name]
    assert headings == ["Experimental", ENGINE_GROUP]
    shown = properties.SinewSettings.bl_rna.properties["method"].enum_items
    assert [i.identifier for i in shown if i.identifier] == list(METHODS)
    assert [i.description for i in shown if i.identifier] == [m.description for m in METHODS.values()]
    # Values as files store them.
    assert {i.identifier: i.value for i in shown if i.identifier} == {
        m.name: m.number for m in METHODS.values()
    }
    obj, _armature = scenes.make_arm()
    assert properties.of(obj).method == "lbs"
    assert properties.of(obj).mix.method == properties.OFF


def test_keys_and_drivers_set_it(route):
    obj = skinned_model()
    found = shape_of_each(obj)
    scenes.key(
        obj.sinew.sdef, "interpolation", ((FRAME - 1, "nlerp"), (FRAME, "slerp"), (FRAME + 1, "nlerp"))
    )
    for frame in (FRAME - 1, FRAME + 1, FRAME):
        bpy.context.scene.frame_set(frame)
    assert scenes.worst(scenes.final_points(obj), found["slerp"]) == 0.0
    obj.animation_data.action = None
    obj.sinew.sdef.driver_add("interpolation").driver.expression = "0"
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(FRAME)
    assert scenes.worst(scenes.final_points(obj), found["nlerp"]) == 0.0


def test_it_is_mixed_in_with_its_parameters(route):
    obj = skinned_model()
    found = shape_of_each(obj)
    obj.vertex_groups.new(name="All").add(range(len(obj.data.vertices)), 1.0, "REPLACE")
    obj.sinew.method, obj.sinew.mix.group, obj.sinew.mix.method = "dq", "All", "sdef"
    for choice in CHOICES:
        obj.sinew.sdef.interpolation = choice
        bpy.context.view_layer.update()
        tolerance = scenes.TOLERANCE * scenes.diagonal(obj)
        assert scenes.worst(scenes.final_points(obj), found[choice]) <= tolerance


def test_a_comparison_has_it():
    obj = skinned_model()
    found = shape_of_each(obj)
    obj.sinew.sdef.interpolation = "slerp"
    bpy.ops.sinew.compare(methods={"lbs", "sdef"})
    bpy.context.view_layer.update()
    copy = next(each for each in bpy.context.scene.objects if properties.of(each).identity.method == "sdef")
    tolerance = scenes.TOLERANCE * scenes.diagonal(obj)
    # It is next to the original.
    moved = scenes.final_points(copy) - found["slerp"]
    assert scenes.worst(moved, np.broadcast_to(moved[0], moved.shape)) <= tolerance
    bpy.ops.sinew.end_comparison()


def test_commands_take_it_by_its_full_name(tmp_path):
    listed = json.loads(run_sinew("methods", "--json").stdout)["methods"]
    (name,) = next(row["parameters"] for row in listed if row["name"] == "sdef")
    assert name == "sdef.interpolation"
    obj, _armature = make_model()
    path = scenes.save(tmp_path / "model.blend")
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(FRAME)
    found = shape_of_each(obj)
    for choice in CHOICES:
        run_sinew(
            *("points", path, "--method", "sdef", "--frames", FRAME, "--set", f"{name}={choice}"),
            *("--out", tmp_path / "points.npz"),
        )
        assert scenes.worst(np.load(tmp_path / "points.npz")["Arm"][0], found[choice]) == 0.0
    (tmp_path / "job.toml").write_text(f'method = "sdef"\nset = "{name}=slerp"\n')
    run_sinew("reskin", path, "--job", tmp_path / "job.toml", "--frames", "none", "--out", tmp_path / "out")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "model.blend"))
    bpy.context.scene.frame_set(FRAME)
    obj = bpy.data.objects["Arm"]
    assert obj.sinew.sdef.interpolation == "slerp"
    assert scenes.worst(scenes.final_points(obj), found["slerp"]) == 0.0
    run_sinew(
        "points", path, "--method", "sdef", "--frames", 1, "--set", f"{name}=x", "--out", path, status=2
    )
