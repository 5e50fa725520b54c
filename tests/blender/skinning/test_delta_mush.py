# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage delta_mush: its oracle is Blender's Corrective Smooth after the Armature modifier."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest
import scenes
import whole_file
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session
from sinew_addon.deform.plan import State

pytestmark = pytest.mark.long_term

FRAMES = [1, 6, 11]
GROUP = "smooth here"


def make_rough_arm() -> bpy.types.Object:
    """Polygons of 3 to 12 corners, holes, edges of three faces, edges and a vertex without faces, and
    noise; rigid weights, which crease it."""
    obj, _armature = scenes.make_arm(weights="rigid")
    rng = np.random.default_rng(3)
    made = bmesh.new()
    made.from_mesh(obj.data)
    made.faces.ensure_lookup_table()
    sides = [face for face in made.faces if len(face.verts) == 4]
    chosen = rng.permutation(len(sides))
    bmesh.ops.triangulate(made, faces=[sides[i] for i in chosen[:60]])
    bmesh.ops.delete(made, geom=[sides[i] for i in chosen[60:66]], context="FACES_ONLY")
    faces = [sides[i] for i in chosen[66:100]]
    edges = {edge for face in faces for edge in face.edges if all(f in faces for f in edge.link_faces)}
    bmesh.ops.dissolve_edges(made, edges=list(edges), use_verts=False)
    made.edges.ensure_lookup_table()
    layer = made.verts.layers.deform.active
    for number, (a, b) in enumerate([edge.verts[:] for edge in list(made.edges)[5::60]]):
        c = made.verts.new((a.co + b.co) / 2.0 * 1.1 + 0.1 * (a.co - b.co).cross((1.0, 0.3, 0.2)))
        c[layer][0] = 1.0
        if number % 2:
            made.faces.new((a, b, c))
        else:
            made.edges.new((b, c))
    made.verts.new((0.5, 0.5, 0.5))[layer][1] = 1.0
    for vertex in made.verts:
        vertex.co += type(vertex.co)(rng.normal(0.0, 0.008, 3))
    made.to_mesh(obj.data)
    made.free()
    obj.data.update()
    scenes.paint(obj, GROUP, scenes.rest_points(obj) @ (1.0, 1.0, 0.0) - 0.4)
    return obj


def add_corrective(obj: bpy.types.Object, **settings: object) -> bpy.types.CorrectiveSmoothModifier:
    modifier = obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH")
    for name, value in settings.items():
        setattr(modifier, name, value)
    return modifier


def by_corrective_smooth(
    obj: bpy.types.Object, frames: list[float] = FRAMES, **settings: object
) -> np.ndarray:
    """The shape by Blender; restores the object afterwards."""
    modifier = add_corrective(obj, **settings)
    expected = scenes.shapes(obj, frames)
    obj.modifiers.remove(modifier)
    return expected


def mush(obj: bpy.types.Object, method: str = "lbs", **values: object) -> None:
    scenes.add_sinew(obj, method)
    scenes.set_stage(obj, "delta_mush", **values)


# Settings of Corrective Smooth, and the corresponding ones of the stage.
NAMES = {"vertex_group": "group", "invert_vertex_group": "invert_group", "use_pin_boundary": "pin_boundary"}

CASES = [
    {},
    {"iterations": 30},
    {"iterations": 12, "factor": 0.9, "use_pin_boundary": True},
    {"smooth_type": "LENGTH_WEIGHTED"},
    {"smooth_type": "LENGTH_WEIGHTED", "iterations": 20, "factor": 0.3, "scale": 1.7},
    {"vertex_group": GROUP, "iterations": 10},
    {"vertex_group": GROUP, "invert_vertex_group": True, "smooth_type": "LENGTH_WEIGHTED"},
    {"scale": 0.0, "iterations": 7},
    {"scale": -1.5, "use_pin_boundary": True, "vertex_group": GROUP},
    {"iterations": 0},
]


def as_stage(settings: dict) -> dict:
    return {
        NAMES.get(name, name): value.lower() if name == "smooth_type" else value
        for name, value in settings.items()
    }


@pytest.mark.parametrize(
    "settings", CASES, ids=lambda s: "-".join(f"{k}={v}" for k, v in s.items()) or "default"
)
@pytest.mark.parametrize("method", ["lbs", "dq"])
def test_it_is_corrective_smooth_behind_the_armature_modifier(method, settings):
    obj = make_rough_arm()
    obj.modifiers["Armature"].use_deform_preserve_volume = method == "dq"
    plain = scenes.shapes(obj, FRAMES)
    expected = by_corrective_smooth(obj, **settings)
    if settings.get("iterations") != 0:
        assert scenes.worst(plain, expected) > 1e-3
    mush(obj, method, **as_stage(settings))
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    assert session.skinned_of(obj).plan.state is State.IN_DEPSGRAPH


def test_keys_change_it_from_frame_to_frame():
    obj = make_rough_arm()
    plain = scenes.shapes(obj, [10])[0]
    expected = {
        3: by_corrective_smooth(obj, [3], iterations=5, factor=0.2)[0],
        8: by_corrective_smooth(obj, [8], iterations=20, factor=0.8, scale=0.5)[0],
    }
    mush(obj, iterations=5, factor=0.2)
    stage = properties.of(obj).delta_mush
    for name in ("iterations", "factor", "scale", "enabled"):
        stage.keyframe_insert(name, frame=3)
    stage.iterations, stage.factor, stage.scale = 20, 0.8, 0.5
    for name in ("iterations", "factor", "scale", "enabled"):
        stage.keyframe_insert(name, frame=8)
    stage.enabled = False
    stage.keyframe_insert("enabled", frame=10)
    for frame in (8, 3, 8):
        got = scenes.shapes(obj, [frame])[0]
        assert scenes.worst(got, expected[frame]) <= scenes.TOLERANCE * scenes.diagonal(obj)
    assert scenes.worst(scenes.shapes(obj, [10])[0], plain) < 1e-5


def narrowest(obj: bpy.types.Object, rings: int, sides: int) -> float:
    """The smallest radius of the tube's rings at frame 11, relative to that at rest."""
    points = scenes.shapes(obj, [11])[0][: rings * sides].reshape(rings, sides, 3)
    middle = points[rings // 4 : -rings // 4]
    return (
        float(np.linalg.norm(middle - middle.mean(axis=1, keepdims=True), axis=2).mean(axis=1).min()) / 0.25
    )


def test_a_radius_gives_the_same_shape_at_two_densities():
    found, by_iterations = [], []
    for density in (1, 2):
        rings, sides = 40 * density + 1, 16 * density
        obj, armature = scenes.make_arm(sides=sides, rings=rings, name=f"Arm {density}")
        armature.animation_data_clear()
        armature.pose.bones[1].rotation_mode = "XYZ"
        armature.pose.bones[1].rotation_euler.y = np.radians(170.0)
        mush(obj, radius=0.15)
        found.append(narrowest(obj, rings, sides))
        stage = properties.of(obj).delta_mush
        stage.radius, stage.iterations = 0.0, 20
        by_iterations.append(narrowest(obj, rings, sides))
    assert abs(found[0] - found[1]) < 0.01
    assert abs(by_iterations[0] - by_iterations[1]) > 0.05


def taken_over(**settings: object) -> tuple[bpy.types.Object, np.ndarray]:
    """A rough arm whose Corrective Smooth was replaced, and the shapes before."""
    obj = make_rough_arm()
    add_corrective(obj, **settings)
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj)
    assert bpy.ops.sinew.take_over_smooth(name=obj.name) == {"FINISHED"}
    return obj, expected


@pytest.mark.parametrize(
    "settings",
    [
        {"iterations": 12, "factor": 0.9, "use_pin_boundary": True, "scale": 0.8},
        {"vertex_group": GROUP, "invert_vertex_group": True, "smooth_type": "LENGTH_WEIGHTED"},
        {"use_only_smooth": True},
    ],
)
def test_a_corrective_smooth_is_taken_over(settings):
    obj, expected = taken_over(**settings)
    tolerance = scenes.TOLERANCE * scenes.diagonal(obj)
    modifier = obj.modifiers["Smooth"]
    assert (modifier.show_viewport, modifier.show_render) == (False, False)
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= tolerance
    # When Sinew is off, it is Blender's again.
    properties.of(obj).enabled = False
    assert modifier.show_viewport
    assert modifier.show_render
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) < 1e-6
    properties.of(obj).enabled = True
    assert not modifier.show_viewport
    modifier.name = "Renamed"
    attach.remove(obj)
    assert modifier.show_viewport
    assert modifier.show_render
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) < 1e-6


def test_a_saved_file_has_corrective_smooth_on(tmp_path):
    _obj, expected = taken_over(iterations=9)
    path = tmp_path / "taken over.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    assert not bpy.data.objects["Arm"].modifiers["Smooth"].show_viewport
    with bpy.data.libraries.load(str(path)) as (_source, target):
        target.objects = ["Arm"]
    saved = target.objects[0]
    assert saved.modifiers["Smooth"].show_viewport
    assert saved.modifiers["Smooth"].show_render
    obj = scenes.opened(path)
    assert not obj.modifiers["Smooth"].show_viewport
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    attach.remove(obj)
    assert obj.modifiers["Smooth"].show_viewport
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) < 1e-6


def test_it_is_measured_against_the_modifier_that_was_taken_over():
    obj, _expected = taken_over(iterations=9)
    bpy.context.scene.frame_set(11)

    def distance() -> float:
        return scenes.measure(obj).measured.entry("distance_max")

    assert distance() < 1e-5
    properties.of(obj).delta_mush.iterations = 30
    assert distance() > 1e-3


def test_nothing_of_what_was_taken_over_stays():
    obj = make_rough_arm()
    add_corrective(obj, iterations=9)
    before = whole_file.content()
    scenes.add_sinew(obj)
    bpy.ops.sinew.take_over_smooth(name=obj.name)
    attach.remove(obj)
    whole_file.assert_same(before)


def put_cast_between(obj: bpy.types.Object, modifier: bpy.types.Modifier) -> None:
    obj.modifiers.new("Cast", "CAST")
    obj.modifiers.move(len(obj.modifiers) - 1, list(obj.modifiers).index(modifier))


# By what is said of each.
NOT_EXACT = {
    "Rest Source": lambda obj, modifier: setattr(modifier, "rest_source", "BIND"),
    "Cast between it": put_cast_between,
    "in renders alone": lambda obj, modifier: setattr(modifier, "show_viewport", False),
    "animated": lambda obj, modifier: modifier.keyframe_insert("scale", frame=1),
    "Iterations beyond": lambda obj, modifier: setattr(modifier, "iterations", 1001),
    "on already": lambda obj, modifier: scenes.set_stage(obj, "delta_mush"),
}


@pytest.mark.parametrize("reason", NOT_EXACT)
def test_one_that_can_not_be_taken_over_exactly_says_why(reason):
    obj = make_rough_arm()
    modifier = add_corrective(obj)
    scenes.add_sinew(obj)
    NOT_EXACT[reason](obj, modifier)
    flags = (modifier.show_viewport, modifier.show_render)
    with pytest.raises(RuntimeError, match=reason):
        bpy.ops.sinew.take_over_smooth(name=obj.name)
    assert (modifier.show_viewport, modifier.show_render) == flags


def test_a_grey_button_says_why_nothing_can_be_taken_over():
    obj = make_rough_arm()
    scenes.add_sinew(obj)
    take_over = bpy.ops.sinew.take_over_smooth
    for on, reason in ((True, f"{obj.name}: no Corrective Smooth"), (False, "Switch Sinew on first")):
        properties.of(obj).enabled = on
        assert not take_over.poll()
        with pytest.raises(RuntimeError, match=f"poll.* {reason}"):
            take_over()
    properties.of(obj).enabled = True
    add_corrective(obj)
    assert take_over.poll()
