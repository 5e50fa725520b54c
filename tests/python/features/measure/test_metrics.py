# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects metrics: on shapes whose measures are known in closed form, and compared with trimesh."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import rigs
import trimesh
from closed_tube import IDENTITY, LENGTH, RADIUS, RINGS, SIDES, Tube, influences_of
from program import ran
from rigs import about, random_motion, transform
from sinew_addon.features.measure.limits import LIMITS
from sinew_addon.features.measure.metrics import METRICS, FrameOfRig, Gauge, Measured, Shape
from sinew_addon.skinning.surface import Parts, Surface, coincident_vertices, joined


def surface_of(mesh):
    return Surface(len(mesh.vertices), mesh.faces.astype(np.int32), mesh.edges_unique.astype(np.int32))


@pytest.fixture(scope="module")
def tube():
    return Tube()


def test_linear_blend_of_a_half_twist_leaves_two_cones(tube):
    """At weight w the cross-section is scaled by |1 - 2 w|: a third of the volume remains."""
    measured = tube.measure("lbs", about([1, 0, 0], 180)).summary()
    assert measured.volume_change == pytest.approx(-2 / 3, abs=1e-5)
    assert measured.bulge_min == pytest.approx(-RADIUS, rel=1e-5)
    assert measured.bulge_max == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("degrees", [30, 90, 150])
def test_linear_blend_of_a_twist_shrinks_cross_sections(tube, degrees):
    """Radius at weight w: |1 - w + w exp(i a)| = sqrt(1 - 4 w (1 - w) sin^2(a / 2))."""
    measured = tube.measure("lbs", about([1, 0, 0], degrees))
    w = tube.second[: SIDES * RINGS]
    shrunk = RADIUS * np.sqrt(1 - 4 * w * (1 - w) * np.sin(np.radians(degrees) / 2) ** 2)
    np.testing.assert_allclose(measured.field("bulge")[: SIDES * RINGS], shrunk - RADIUS, atol=1e-6)
    # The mean squared radius over the length. Rings are flat polygons that rotate against each other, so the
    # triangles between them are slightly inside.
    expected = 1 - 2 / 3 * np.sin(np.radians(degrees) / 2) ** 2
    assert measured.summary().volume_change == pytest.approx(expected - 1, abs=1e-3)


def test_dual_quaternions_keep_a_twisted_tube_round(tube):
    measured = tube.measure("dq", about([1, 0, 0], 180))
    assert abs(measured.summary().volume_change) < 0.01
    np.testing.assert_allclose(measured.field("bulge"), 0.0, atol=1e-6)
    # A blend of no rotation and a rotation by 180 degrees rotates by 2 atan(w / (1 - w)) (Kavan et al. 2008,
    # DLB).
    angles = 2 * np.arctan2(tube.second, 1 - tube.second)[: SIDES * RINGS].reshape(RINGS, SIDES)[:, 0]
    step, chords = LENGTH / (RINGS - 1), 2 * RADIUS * np.sin(np.diff(angles) / 2)
    longest = np.hypot(step, chords.max()) / step
    assert measured.summary().stretch_max == pytest.approx(longest, rel=1e-4)
    assert measured.summary().flipped_faces == 0


@pytest.mark.parametrize("degrees", [60, 120])
def test_dual_quaternions_bulge_where_a_tube_bends(tube, degrees):
    """Each vertex rotates about the joint: on the outer side of the bend its distance is sqrt(x^2 + r^2)."""
    measured = tube.measure("dq", about([0, 0, 1], -degrees))
    bend, w = np.radians(degrees), tube.second
    rotation = 2 * np.arctan2(w * np.sin(bend / 2), 1 - w + w * np.cos(bend / 2))
    # In the space of the heaviest bone, whose joint is at 0 and which points along -X.
    x, y, z = tube.rest.T
    second = w > 0.5
    x, rotation = np.where(second, -x, x), np.where(second, bend - rotation, rotation)
    along, across = x * np.cos(rotation) + y * np.sin(rotation), -x * np.sin(rotation) + y * np.cos(rotation)
    from_axis = np.hypot(across, z)
    expected = np.where(along > 0.0, np.hypot(from_axis, along), from_axis)
    expected = np.where(along < -LENGTH / 2, np.hypot(from_axis, along + LENGTH / 2), expected)
    np.testing.assert_allclose(measured.field("bulge"), expected - np.hypot(y, z), atol=2e-6)
    summary = measured.summary()
    assert summary.bulge_max > 0.25 * RADIUS
    assert summary.bulge_max == pytest.approx((expected - np.hypot(y, z)).max(), abs=2e-6)


def test_distance_is_to_the_other_shape(tube):
    motion = about([1, 0, 0], 90)
    points = tube.deform("lbs", motion)
    measured = tube.measure("dq", motion, points)
    apart = np.linalg.norm(tube.deform("dq", motion).astype(np.float64) - points, axis=1)
    np.testing.assert_allclose(measured.field("distance"), apart, atol=1e-12)
    summary = measured.summary()
    assert summary.distance_max == pytest.approx(apart.max())
    assert summary.distance_rms == pytest.approx(np.sqrt((apart**2).mean()))


def test_a_rigid_motion_changes_nothing(tube):
    motion = random_motion(np.random.default_rng(1))
    axes = np.array([[[-1, 0, 0], [0, 0, 0]], [[0, 0, 0], [1, 0, 0]]], np.float64)
    gauge = Gauge(tube.surface, tube.influences)
    gauge.set_frame(FrameOfRig(tube.rest, axes, transform(motion, axes), np.tile(motion[:3, :3], (2, 1, 1))))
    measured = gauge.measure(transform(motion, tube.rest))
    summary = measured.summary()
    assert summary.flipped_faces == 0
    for entry in ("volume_change", "area_change", "area_rms", "stretch_rms", "bulge_min", "bulge_max"):
        assert abs(getattr(summary, entry)) < 1e-12, entry
    for name, metric in METRICS.items():
        neutral = 1.0 if metric.scale == "log" else 0.0
        np.testing.assert_allclose(measured.field(name), neutral, atol=1e-12)


MESHES = {
    "torus": trimesh.creation.torus(1.0, 0.3, major_sections=40, minor_sections=20),
    "ball": trimesh.creation.icosphere(3, 0.7),
    "capsule": trimesh.creation.capsule(1.0, 0.4),
    "box": trimesh.creation.box((1, 2, 3)),
}


@pytest.mark.parametrize("name", MESHES)
def test_volume_and_area_are_those_of_trimesh(name):
    mesh = MESHES[name]
    rng = np.random.default_rng(2)
    # Bent out of shape, and far from the origin.
    matrix = rng.normal(size=(3, 3)) + 2 * np.eye(3)
    points = np.sin(1.3 * mesh.vertices) @ matrix.T + np.array([100, -50, 30])
    bent = trimesh.Trimesh(points, mesh.faces, process=False)
    surface = surface_of(mesh)
    assert (surface.caps.count, surface.clash_count) == (0, 0)
    assert Shape(surface, points).volume == pytest.approx(bent.volume, rel=1e-9)
    assert Shape(surface, points).area == pytest.approx(bent.area, rel=1e-9)


@pytest.mark.parametrize("name", ["ball", "capsule", "torus"])
def test_holes_are_closed_by_fans_to_their_middle(name):
    mesh = MESHES[name]
    seeds = [int(np.argmax(mesh.vertices[:, 0])), int(np.argmin(mesh.vertices[:, 0]))]
    open_faces = mesh.faces[~np.isin(mesh.faces, seeds).any(axis=1)]
    points = mesh.vertices + np.array([5, 0, 0])
    surface = Surface(len(points), open_faces.astype(np.int32), np.empty((0, 2), np.int32))
    assert surface.caps.count == 2
    assert len(surface.caps.starts) == sum(len(mesh.vertex_neighbors[seed]) for seed in seeds)
    # The same with trimesh: the vertex that was moved, put back to the middle of its neighbours.
    closed = points.copy()
    for seed in seeds:
        closed[seed] = points[mesh.vertex_neighbors[seed]].mean(axis=0)
    expected = trimesh.Trimesh(closed, mesh.faces, process=False).volume
    assert Shape(surface, points).volume == pytest.approx(expected, rel=1e-9)


def test_seams_are_no_holes():
    """Gives every triangle its own vertices, as game files have at hard edges."""
    mesh = MESHES["torus"]
    points = mesh.vertices[mesh.faces.ravel()]
    triangles = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    no_edges = np.empty((0, 2), np.int32)
    assert Surface(len(points), triangles, no_edges).caps.count == len(triangles)
    surface = Surface(len(points), triangles, no_edges, coincident_vertices(points))
    assert (surface.caps.count, len(surface.caps.starts)) == (0, 0)
    assert Shape(surface, points).volume == pytest.approx(mesh.volume, rel=1e-9)


def test_faces_that_wind_against_each_other_are_counted():
    mesh = MESHES["ball"]
    faces = mesh.faces.astype(np.int32).copy()
    faces[7] = faces[7, ::-1]
    surface = Surface(len(mesh.vertices), faces, np.empty((0, 2), np.int32))
    assert surface.clash_count == 3


@pytest.mark.parametrize("is_cut", [False, True])
def test_parts_are_slices(tube, is_cut):
    """Of a tube, whose rings, and so the fans, are flat. Also where triangles share no vertices."""
    points, triangles = tube.rest + np.array([7, 8, 9]), tube.surface.triangles
    middles = tube.rest[triangles][:, :, 0].mean(axis=1)
    numbers = np.where(middles < -0.5, 4, np.where(middles < 0.75, 9, -1))
    if is_cut:
        points, triangles = (
            points[triangles.ravel()],
            np.arange(triangles.size, dtype=np.int32).reshape(-1, 3),
        )
    surface = Surface(len(points), triangles, np.empty((0, 2), np.int32), coincident_vertices(points))
    area = SIDES / 2 * RADIUS**2 * np.sin(2 * np.pi / SIDES)
    shape = Shape(surface, points)
    volumes = Parts.of(surface, numbers).volumes(shape.points, shape.normals)
    np.testing.assert_allclose(volumes, [0.5 * area, 1.25 * area], rtol=1e-9)
    nothing = Parts.of(surface, np.full(len(triangles), -1))
    assert nothing.volumes(shape.points, shape.normals).size == 0


def test_what_one_limb_gains_does_not_make_up_for_another(tube):
    """One half of a tube is made thicker by what the other loses."""
    measured = tube.measure("lbs", IDENTITY)
    assert measured.limb_change == pytest.approx(0.0, abs=1e-7)
    points = tube.rest.copy()
    points[:, 1:] *= np.where(points[:, :1] < 0.0, np.sqrt(0.8), np.sqrt(1.2))
    measured = Measured(measured.pose, Shape(tube.surface, points), None)
    assert abs(measured.entry("volume_change")) < 0.01
    assert measured.entry("limb_change") == pytest.approx(0.2, rel=0.03)


def test_a_ring_of_a_joint_that_collapses_is_pinched(tube):
    """At weight w the cross-section of a half twist is scaled by |1 - 2 w|; in the middle ring w is .4 to
    .6."""
    by_limb = tube.measure("lbs", about([1, 0, 0], 180)).by_limb()
    np.testing.assert_allclose(by_limb["pinch"], 0.8 - 0.2 / np.sqrt(3), atol=0.02)
    np.testing.assert_array_equal(tube.measure("dq", about([1, 0, 0], 179)).by_limb()["pinch"], 0.0)
    # A bend is narrow across the plane in which it bends.
    bent = tube.measure("lbs", about([0, 0, 1], 120)).by_limb()["pinch"]
    np.testing.assert_allclose(bent, 0.8 - 0.5, atol=0.05)


def test_a_bend_that_few_edges_take_is_a_crease(tube):
    """A step of weights bends at one ring, by the whole angle; smooth weights spread the same bend."""
    bend = about([0, 0, 1], 60)
    smooth = tube.measure("lbs", bend).by_limb()["crease"]
    measured = tube.measure("lbs", IDENTITY)
    points = tube.rest.copy()
    behind = points[:, 0] > 0.0
    points[behind] = points[behind] @ bend[:3, :3].T
    moved = tube.measure("lbs", bend).pose
    step = Measured(moved, Shape(tube.surface, points), None).by_limb()["crease"]
    assert (smooth < 0.25).all()
    assert (step > 0.5).all()
    np.testing.assert_array_equal(np.nan_to_num(measured.by_limb()["crease"]), 0.0)


def test_several_meshes_are_measured_as_one():
    a, b = MESHES["ball"], MESHES["box"]
    both = joined([surface_of(a), surface_of(b)])
    points = np.concatenate([a.vertices, b.vertices + np.array([9, 0, 0])])
    assert Shape(both, points).volume == pytest.approx(a.volume + b.volume, rel=1e-9)
    assert both.caps.count == 0


def test_flipped_faces_are_those_turned_against_their_bone():
    mesh = MESHES["ball"]
    rng = np.random.default_rng(3)
    motion = random_motion(rng)
    weights = np.ones((len(mesh.vertices), 1))
    gauge = Gauge(surface_of(mesh), influences_of(weights))
    axes = np.array([[[0, 0, 0], [0, 0, 1]]], np.float64)
    gauge.set_frame(FrameOfRig(mesh.vertices, axes, transform(motion, axes), motion[None, :3, :3]))
    # A cap pushed through to the other side, and noise that flips triangles.
    pushed = mesh.vertices[:, 2] > 0.5
    local = mesh.vertices.copy()
    local[pushed, 2] = 1.0 - local[pushed, 2]
    local += rng.normal(scale=0.05, size=local.shape)
    points = transform(motion, local)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a) @ motion[:3, :3].T
    a, b, c = (points[mesh.faces[:, k]] for k in range(3))
    expected = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) < 0.0
    measured = gauge.measure(points)
    assert np.array_equal(measured.flipped, expected)
    assert 20 < expected.sum() < len(expected) / 2
    assert measured.summary().flipped_faces == expected.sum()
    counts = np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices))
    flipped = np.bincount(mesh.faces[expected].ravel(), minlength=len(mesh.vertices))
    np.testing.assert_allclose(measured.field("flips"), flipped / counts)


def test_fields_of_edges_and_areas_are_those_of_a_plain_loop():
    mesh = MESHES["capsule"]
    rng = np.random.default_rng(4)
    points = mesh.vertices + rng.normal(scale=0.05, size=mesh.vertices.shape)
    gauge = Gauge(surface_of(mesh), influences_of(np.zeros((len(points), 1))))
    axes = np.zeros((1, 2, 3))
    gauge.set_frame(FrameOfRig(mesh.vertices, axes, axes, np.eye(3)[None]))
    measured = gauge.measure(points)
    stretch, area = np.ones(len(points)), np.zeros((2, len(points)))
    for edge in mesh.edges_unique:
        lengths = [np.linalg.norm(np.subtract(*shape[edge])) for shape in (points, mesh.vertices)]
        ratio = lengths[0] / lengths[1]
        for vertex in edge:
            if abs(np.log(ratio)) > abs(np.log(stretch[vertex])):
                stretch[vertex] = ratio
    for triangle in mesh.faces:
        for row, shape in enumerate((points, mesh.vertices)):
            a, b, c = shape[triangle]
            area[row, triangle] += np.linalg.norm(np.cross(b - a, c - a)) / 2
    np.testing.assert_allclose(measured.field("stretch"), stretch, rtol=1e-9)
    np.testing.assert_allclose(measured.field("area"), area[0] / area[1], rtol=1e-9)
    # No bone influences these, so none swells.
    assert not measured.field("bulge").any()


def test_an_unknown_field_is_refused(tube):
    with pytest.raises(ValueError, match="expected one of distance"):
        tube.measure("lbs", IDENTITY).field("beauty")


def test_an_empty_mesh_measures_nothing():
    surface = Surface(0, np.empty((0, 3), np.int32), np.empty((0, 2), np.int32))
    gauge = Gauge(surface, influences_of(np.zeros((0, 1))))
    axes = np.zeros((1, 2, 3))
    gauge.set_frame(FrameOfRig(np.empty((0, 3)), axes, axes, np.eye(3)[None]))
    summary = gauge.measure(np.empty((0, 3))).summary()
    assert (summary.area, summary.volume, summary.flipped_faces) == (0.0, 0.0, 0)


DOCUMENTED = """
import json, sys
sys.modules["bpy"] = None  # so that importing it fails
import numpy as np
from closed_tube import LENGTH, Tube
from rigs import about
tube, motion = Tube(), about([1, 0, 0], 180)
rest, posed = tube.rest, tube.deform("lbs", motion)
triangles, edges = tube.surface.triangles, tube.surface.edges
offsets, bones, weights = tube.influences.offsets, tube.influences.bones, tube.influences.weights
other, lengths, parents = tube.deform("dq", motion), np.full(2, LENGTH / 2), np.array([-1, 0])
rest_bones = np.tile(np.eye(4), (2, 1, 1))
rest_bones[:, :3, :3] = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
rest_bones[0, 0, 3] = -LENGTH / 2
posed_bones = np.stack([np.eye(4), motion]) @ rest_bones
exec(sys.stdin.read())
print(json.dumps([summary.volume_change, summary.bulge_min, summary.distance_max, worst]))
assert all(each.shape == (len(rest),) for each in maps.values())
"""


def test_the_documented_code_runs_without_blender():
    root = Path(__file__).resolve().parents[4]
    blocks = re.findall(
        r"```python\n(.*?)```", (root / "docs" / "metrics.md").read_text(encoding="utf-8"), re.S
    )
    words = sys.executable, "-c", DOCUMENTED
    done = ran(*words, input="\n".join(blocks), cwd=Path(rigs.__file__).parent)
    assert done.returncode == 0, done.stderr
    volume_change, bulge, distance, worst = json.loads(done.stdout)
    assert volume_change == pytest.approx(-2 / 3, abs=1e-5)
    assert bulge == pytest.approx(-RADIUS, rel=1e-5)
    assert distance == pytest.approx(RADIUS, rel=1e-2)
    assert worst["radius"][0] < 0.5
    assert worst["volume_loss"][0] == pytest.approx(2 / 3, abs=0.05)
    assert worst["pivot"][0] == pytest.approx(0.0, abs=1e-6)
    assert {limit.name for limit in LIMITS.values() if limit.posed} <= set(worst)
