# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects direct delta mush: its moments compared with scipy's sparse solver, its points with the float64
reference, and its effect on a tube."""

from functools import partial

import numpy as np
import pytest
import reference
import scipy.sparse
import scipy.sparse.linalg
import sinew
from rigs import about, random_motion, random_rig, transform, translation
from tube import Tube, numbers, three_bones

if "ddm" not in {method.name for method in sinew.methods()}:
    pytest.skip("built without ddm", allow_module_level=True)

STEPS = 4
VARIANTS = ("0", "2", "4")


def moments(tube, radius, **options):
    return sinew.direct_delta_mush(*tube.mesh, tube.triangles, radius, **options).result()


def cotangents(points, triangles):
    """The Laplacian [vertices, vertices], and the third of the areas about each vertex."""
    count, mass = len(points), np.zeros(len(points))
    weights = scipy.sparse.csr_matrix((count, count))
    for k in range(3):
        a, b, corner = triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3], triangles[:, k]
        to_a, to_b = points[a] - points[corner], points[b] - points[corner]
        area = np.linalg.norm(np.cross(to_a, to_b), axis=1) / 2.0
        half = np.einsum("ij,ij->i", to_a, to_b) / (4.0 * area)
        np.add.at(mass, corner, area / 3.0)
        both = np.concatenate([half, half]), (np.concatenate([a, b]), np.concatenate([b, a]))
        weights = weights + scipy.sparse.csr_matrix(both, shape=(count, count))
    weights.data = np.maximum(weights.data, 0.0)
    return scipy.sparse.diags(np.asarray(weights.sum(axis=1)).ravel()) - weights, mass


def omega(points, triangles, weights, radius):
    """Le and Lewis' Omega, float64 [vertices, bones, 4, 4], by scipy."""
    laplacian, mass = cotangents(points, triangles)
    step = scipy.sparse.diags(mass) + radius**2 / (2.0 * STEPS) * laplacian
    solver = scipy.sparse.linalg.splu(step.tocsc())
    ones = np.column_stack([points, np.ones(len(points))])
    products = np.einsum("ia,ib->iab", ones, ones).reshape(-1, 16)
    columns = (weights[:, :, None] * products[:, None, :]).reshape(len(points), -1)
    for _ in range(STEPS):
        columns = solver.solve(mass[:, None] * columns)
    return columns.reshape(len(points), weights.shape[1], 4, 4)


def omega_of(rows, vertices, bones):
    """The same from rows in the form of Binding's vertex data."""
    rows = rows.astype(np.float64)
    found = np.zeros((vertices, bones, 4, 4))
    for vertex in range(vertices):
        own = rows[slice(*np.searchsorted(rows[:, 0], (vertex, vertex + 1)))]
        centroid = own[:, 3:6].sum(axis=0)
        for row in own:
            found[vertex, int(row[1])] = second_moments(row[2:], centroid)
    return found


def second_moments(row, centroid):
    """The 4x4 matrix that Le and Lewis call Psi."""
    weight, first, (xx, yy, zz, yz, xz, xy) = row[0], row[1:4], row[4:]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shifted = np.outer(first, centroid) + np.outer(centroid, first) - weight * np.outer(centroid, centroid)
    psi = np.empty((4, 4))
    psi[:3, :3], psi[:3, 3], psi[3, :3], psi[3, 3] = about + shifted, first, first, weight
    return psi


def crumpled():
    """Three bones on a mesh with obtuse triangles and uneven density."""
    tube, rng = three_bones(), np.random.default_rng(3)
    tube.points = tube.points + rng.uniform(-0.06, 0.06, tube.points.shape)
    return tube


@pytest.mark.parametrize("tube", [Tube(41, 16), crumpled()], ids=["two bones", "three bones"])
@pytest.mark.parametrize("radius", [0.05, 0.3, 1.0])
def test_moments_are_those_of_a_sparse_solve(tube, radius):
    points = tube.points.astype(np.float32).astype(np.float64)
    shares = tube.weights.astype(np.float32).astype(np.float64)
    expected = omega(points, tube.triangles, shares / shares.sum(axis=1, keepdims=True), radius)
    count, bones = expected.shape[:2]
    # Errors are relative to the tube's length of 4, to the power to which an entry contains lengths.
    lengths = np.array([4.0, 4.0, 4.0, 1.0])
    error = np.abs(omega_of(moments(tube, radius, exact=True), count, bones) - expected)
    assert (error / np.outer(lengths, lengths)).max() < 1e-6
    rows = moments(tube, radius)
    error = np.abs(omega_of(rows, count, bones) - expected)
    assert (error / np.outer(lengths, lengths)).max() < 3e-6
    assert len(rows) < len(moments(tube, radius, exact=True)) or radius > 0.05


def near_rig(seed, scaled=False, most_influences=6):
    """Bones that differ by at most 120 degrees, and vertices whose neighbourhoods have an extent."""
    rig, rng = random_rig(seed, most_influences=most_influences, scaled=scaled), np.random.default_rng(seed)
    motions = rig.transforms.astype(np.float64)
    for bone, motion in enumerate(motions):
        if bone % 2 == 0 or not scaled:
            motion[:3, :3] = about(rng.normal(size=3), rng.uniform(-60.0, 60.0))[:3, :3]
    rows = rig.moments.astype(np.float64)
    extents = rng.normal(size=(len(rows), 3, 3)) * 0.1 + 0.3 * np.eye(3)
    seconds = rows[:, 2, None, None] * np.einsum("nij,nkj->nik", extents, extents)
    rows[:, 6:] = seconds.reshape(-1, 9)[:, [0, 4, 8, 5, 2, 1]]
    # First moments about the centroid have sum 0.
    offsets = rows[:, 2:3] * rng.uniform(-0.1, 0.1, (len(rows), 3))
    for vertex in range(len(rig.rest_points)):
        own = rows[:, 0] == vertex
        offsets[own] -= rows[own, 2:3] * offsets[own].sum(axis=0) / rows[own, 2].sum()
    rows[:, 3:6] += offsets
    return rig.with_motions(motions), rows.astype(np.float32)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
@pytest.mark.parametrize("most_influences", [1, 3, 12])
def test_each_variant_agrees_with_its_definition(variant, scaled, most_influences):
    rig, rows = near_rig(most_influences, scaled, most_influences)
    parameters, data = {"ddm.variant": variant}, {"ddm": rows}
    deformer = sinew.Deformer(*rig.mesh, "ddm", rig.rest_bones, data)
    points = deformer.deform(rig.transforms, parameters=parameters)
    expected, margins = reference.deform("ddm", *rig.mesh, rig.transforms, rig.rest_bones, data, parameters)
    sure = margins > 1e-3
    assert sure.mean() > 0.7
    assert np.linalg.norm(points - expected, axis=1)[sure].max() < 1e-5
    if variant == "0":
        np.testing.assert_array_equal(deformer.deform(rig.transforms), points)


def test_rest_and_rigid_motions_are_exact():
    tube = Tube()
    deformer = sinew.Deformer(*tube.mesh, "ddm", vertex_data={"ddm": moments(tube, 0.3)})
    rest = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    for variant in VARIANTS:
        parameters = {"ddm.variant": variant}
        np.testing.assert_array_equal(deformer.deform(rest, parameters=parameters), tube.mesh[0])
        motion = random_motion(np.random.default_rng(1), 5.0)
        moved = deformer.deform(np.float32([motion, motion]), parameters=parameters)
        np.testing.assert_allclose(moved, transform(motion, tube.points), atol=5e-6)


def posed(tube, radius, axis, degrees, variant="0"):
    bones = tube.bones(axis, degrees)
    deformer = sinew.Deformer(*tube.mesh, "ddm", vertex_data={"ddm": moments(tube, radius)})
    points = deformer.deform(bones.astype(np.float32), parameters={"ddm.variant": variant})
    return points.astype(np.float64), bones


# Computed independently of this code in numpy, for each radius: volume, bulge and longest edge of a bend by
# 90 degrees; volume and least radius of a twist by 170 degrees.
TABLE = {0.26: (0.932, 1.012, 1.531, 0.833, 0.201), 0.91: (0.860, 1.318, 1.084, 0.878, 0.772)}


@pytest.mark.parametrize("radius", TABLE)
def test_the_table_of_the_tube(radius):
    tube = Tube()
    volume, bulge, _far, *others = numbers(tube, partial(posed, tube, radius))
    np.testing.assert_allclose((volume, bulge, *others), TABLE[radius], atol=0.01)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("radius", [0.2, 0.5])
def test_the_shape_does_not_depend_on_the_density(radius, variant):
    volumes = []
    for tube in (Tube(81, 32), Tube(161, 64)):
        points, _ = posed(tube, radius, (1, 0, 0), 90, variant)
        volumes.append(tube.volume(points) / tube.volume(tube.points))
    assert abs(volumes[0] - volumes[1]) < 0.005


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("degrees", [150, 179.999, 180, 180.001, 360])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 0, 1), (1, 2, 3)])
def test_half_turns_are_finite_and_near(variant, degrees, axis):
    tube = three_bones()
    first = translation([0, 0, 1.4]) @ about(axis, degrees) @ translation([0, 0, -1.4])
    motions = np.array([np.eye(4), first, first @ about(axis, degrees)], np.float32)
    deformer = sinew.Deformer(*tube.mesh, "ddm", vertex_data={"ddm": moments(tube, 0.3)})
    points = deformer.deform(motions, parameters={"ddm.variant": variant})
    assert np.isfinite(points).all()
    assert np.abs(points).max() < 10.0


def test_without_radius_or_triangles_vertices_are_their_own_neighbourhoods():
    tube = Tube(21, 12)
    linear, bones = tube.deformed("lbs", (1, 0, 0), 90)
    no_triangles = sinew.direct_delta_mush(*tube.mesh, np.empty((0, 3), np.int32), 0.3)
    for rows in (moments(tube, 0.0), no_triangles.result()):
        assert np.abs(rows[:, 6:]).max() < 1e-6
        points = sinew.Deformer(*tube.mesh, "ddm", vertex_data={"ddm": rows}).deform(bones.astype(np.float32))
        np.testing.assert_allclose(points, linear, atol=5e-6)


def test_degenerate_triangles_are_no_harm():
    tube = Tube(21, 12)
    expected = moments(tube, 0.3)
    tube.triangles = np.vstack([tube.triangles, [[0, 0, 1], [5, 5, 5], [0, 12, 0]]]).astype(np.int32)
    np.testing.assert_allclose(moments(tube, 0.3), expected, atol=1e-6)


def test_vertices_without_weight_count_nowhere_and_stay():
    tube = Tube(21, 12)
    tube.weights[:12] = 0.0
    rows = moments(tube, 0.3)
    assert rows[:, 0].min() == 12.0
    sums = np.bincount(rows[:, 0].astype(int), rows[:, 2])[12:]
    np.testing.assert_allclose(sums, 1.0, atol=1e-6)
    motions = np.float32([about((1, 0, 0), 40), about((1, 0, 0), 80)])
    points = sinew.Deformer(*tube.mesh, "ddm", vertex_data={"ddm": rows}).deform(motions)
    np.testing.assert_array_equal(points[:12], tube.mesh[0][:12])


def test_the_moments_say_which_bones_move_a_vertex():
    """Weights that depend on positions may name other bones in a frame."""
    tube = Tube(21, 12)
    data = {"ddm": moments(tube, 0.3)}
    points, offsets, bones, weights = tube.mesh
    motions = np.array(tube.bones((1, 0, 0), 90), np.float32)
    expected = sinew.Deformer(*tube.mesh, "ddm", vertex_data=data).deform(motions)
    others = sinew.Deformer(points, offsets, np.zeros_like(bones), weights, "ddm", vertex_data=data)
    assert np.abs(others.deform(motions) - expected).max() < 1e-6
    with pytest.raises(ValueError, match="bone_transforms"):
        others.deform(motions[:1])
