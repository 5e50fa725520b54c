# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the shares of Auto-Mix: its functional's solution, smooth, between 0 and 1, equal at seams."""

import numpy as np
import pytest
from sinew_addon.base.steps import result_of
from sinew_addon.features.auto_mix import shares as auto_mix
from sinew_addon.features.auto_mix.shares import VertexErrors
from sinew_addon.features.measure.metrics import FrameOfRig, Gauge
from sinew_addon.skinning.influences import Influences
from sinew_addon.skinning.surface import Surface
from tube import Tube

SMOOTHING, RADIUS = 0.8, 0.5


def errors(first, second, thickness=RADIUS, apart=1.0):
    found = VertexErrors(np.full(len(first), thickness))
    found.errors[:] = np.square([first, second])
    found.apart[:] = apart
    return found


def run(points, triangles, found, smoothing=SMOOTHING):
    progress = []
    shares = result_of(auto_mix.shares(points, triangles, found, smoothing), progress.append)
    assert set(progress) <= {1.0}
    return shares


def by_gradients(points, triangles, found, smoothing):
    """The minimum by a dense solution, from the gradients of linear functions in each triangle."""
    count = len(points)
    first, second = np.sqrt(found.errors)
    visible = found.apart / (found.apart + auto_mix.ALIKE * found.thickness)
    differ = np.abs(first - second)
    sure = visible * differ / (differ + auto_mix.SURE)
    to_first = auto_mix.TO_FIRST * (1.0 - visible) + auto_mix.LEAST
    matrix, side = np.zeros((count, count)), np.zeros(count)
    for triangle in triangles:
        a, b, c = points[triangle]
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal) / 2.0
        normal /= 2.0 * area
        gradients = np.array([np.cross(normal, each) for each in (c - b, a - c, b - a)]) / (2.0 * area)
        length = smoothing * found.thickness[triangle[0]]
        matrix[np.ix_(triangle, triangle)] += length**2 * area * gradients @ gradients.T
        matrix[triangle, triangle] += area / 3.0 * (sure + to_first)[triangle]
        side[triangle] += area / 3.0 * (sure * (second < first))[triangle]
    return np.linalg.solve(matrix, side)


@pytest.fixture(scope="module")
def tube():
    return Tube(25, 16)


@pytest.fixture(scope="module")
def found(tube):
    """The second method is better beyond the middle; at the start both give the same points."""
    along = tube.points[:, 2]
    values = np.random.default_rng(5).random((2, len(along)))
    result = errors(0.1 * values[0] + 0.2 * (along > 2.0), 0.1 * values[1] + 0.2 * (along < 1.5))
    result.apart[:] = np.clip(along - 0.5, 0.0, 1.0)
    return result


def test_they_minimise_the_functional(tube, found):
    expected = by_gradients(tube.points, tube.triangles, found, SMOOTHING)
    assert np.ptp(expected) > 0.9
    np.testing.assert_allclose(run(tube.points, tube.triangles, found), expected, atol=1e-3)


@pytest.mark.parametrize("smoothing", [0.6, 1.2, 3.0])
def test_a_change_takes_twice_the_length_of_smoothing(tube, smoothing):
    """However rough the errors are, no edge changes by more than its share of two lengths of smoothing."""
    values = np.random.default_rng(7).random((2, len(tube.points))) ** 3
    got = run(tube.points, tube.triangles, errors(*values), smoothing)
    starts, stops = tube.triangles.ravel(), np.roll(tube.triangles, 1, axis=1).ravel()
    lengths = np.linalg.norm(tube.points[starts] - tube.points[stops], axis=1)
    assert got.min() >= 0.0
    assert got.max() <= 1.0
    assert (
        np.abs(got[starts] - got[stops]) <= lengths / (2.0 * smoothing * RADIUS) + auto_mix.SMALLEST
    ).all()
    assert np.ptp(got) > 0.02


def test_without_smoothing_each_vertex_has_its_own(tube):
    better = np.arange(len(tube.points)) % 2
    got = run(tube.points, tube.triangles, errors(10.0 * better, 10.0 * (1 - better)), 0.0)
    np.testing.assert_allclose(got, better, atol=0.02)


def test_where_both_are_alike_the_first_deforms():
    tube = Tube()
    far = tube.points[:, 2] > 3.0
    found = errors(1.0 * far, 0.1 * far, apart=far.astype(float))
    got = run(tube.points, tube.triangles, found, 0.3)
    assert (got[tube.points[:, 2] < 0.5] == 0.0).all()
    assert got[tube.points[:, 2] > 3.8].min() > 0.8


def test_a_mesh_split_at_every_face_has_the_shares_of_the_whole(tube, found):
    whole = run(tube.points, tube.triangles, found)
    corners = tube.triangles.ravel()
    split = VertexErrors(found.thickness[corners])
    split.errors, split.apart = found.errors[:, corners], found.apart[corners]
    got = run(tube.points[corners], np.arange(len(corners)).reshape(-1, 3), split)
    np.testing.assert_allclose(got, whole[corners], atol=1e-9)


def test_a_mesh_without_faces_or_with_flat_ones():
    points = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (5, 5, 5)], np.float32)
    found = errors([1.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.0, 0.0])
    no_faces = run(points, np.empty((0, 3), np.int32), found)
    np.testing.assert_allclose(no_faces, [1.0, 0.0, 1.0, 1.0], atol=0.02)
    flat = run(points, np.array([(0, 1, 2), (1, 1, 3)], np.int32), found)
    assert np.isfinite(flat).all()
    assert run(points[:0], np.empty((0, 3), np.int32), errors([], [])).shape == (0,)


def test_the_worst_frame_counts():
    """And a shape that is not finite is the worst of all."""
    tube = Tube(9, 8)
    edges = np.unique(np.sort(tube.quads[:, [[0, 1], [1, 2], [2, 3]]].reshape(-1, 2), axis=1), axis=0)
    surface = Surface(len(tube.points), tube.triangles, edges.astype(np.int32))
    gauge = Gauge(surface, Influences(*tube.mesh[1:]))
    axes = np.array([[(0, 0, 0), (0, 0, 2)], [(0, 0, 2), (0, 0, 4)]], float)
    gauge.set_frame(FrameOfRig(tube.points, axes, axes, np.array([np.eye(3)] * 2)))
    at_rest = gauge.measure(tube.points)
    np.testing.assert_allclose(at_rest.rest_distances, RADIUS)
    thin = tube.points * [0.5, 0.5, 1.0]
    broken = tube.points.copy()
    broken[3] = np.nan
    none = np.empty(0, np.int64)
    found = VertexErrors(at_rest.rest_distances)
    found.add((gauge.measure(thin), at_rest), (none, np.array([0])))
    once = found.errors.copy()
    # Half of the radius, three quarters of the volume of each limb, rings of half the length.
    expected = auto_mix.BULGE * 0.5**2 + auto_mix.VOLUME * 0.75**2 + auto_mix.STRETCH * 0.5**2
    np.testing.assert_allclose(once[0], expected, rtol=1e-6)
    np.testing.assert_allclose(found.apart, RADIUS / 2.0)
    crossed = np.isin(np.arange(len(tube.points)), tube.triangles[0])
    np.testing.assert_allclose(once[1], auto_mix.CROSSING * crossed, atol=1e-12)
    found.add((at_rest, at_rest), None)
    np.testing.assert_array_equal(found.errors, once)
    found.add((at_rest, gauge.measure(broken)), None)
    assert found.errors[1, 3] > 1e5
    assert np.isfinite(found.errors).all()
    assert np.isfinite(found.apart).all()
