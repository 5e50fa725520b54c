# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects Limit Bulge: compared with its formula in float64, and its effect on a bent tube."""

import bulge_limit_reference
import numpy as np
import pytest
import sinew
from rigs import TOLERANCE, random_motion, random_rig, transform
from tube import Tube, bulge

FORMS = ("continuous", "kim_han")
every_form = pytest.mark.parametrize("form", FORMS)


def bones_of(rig, seed=1):
    """Heads and tails of the rig's size; the last bone is a point."""
    rng = np.random.default_rng(seed)
    heads = rng.uniform(-1.0, 1.0, (len(rig.transforms), 3)).astype(np.float32)
    tails = heads + rng.uniform(-0.5, 0.5, heads.shape).astype(np.float32)
    tails[-1] = heads[-1]
    return heads, tails


@every_form
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
@pytest.mark.parametrize("most", [2, 12])
def test_agrees_with_the_reference(form, scaled, most):
    rig = random_rig(1, vertices=400, most_influences=most, scaled=scaled)
    heads, tails = bones_of(rig)
    points = rig.deform("dq") * np.float32(1.3)
    mask = np.linspace(-0.5, 1.5, len(points)).astype(np.float32)
    limit = sinew.BulgeLimit(sinew.Binding(*rig.mesh), heads, tails, weights=mask)
    got = limit.apply(points, rig.transforms, form=form, strength=0.8)
    expected = bulge_limit_reference.limit(points, *rig.mesh, heads, tails, rig.transforms, 0.8, form, mask)
    assert (np.abs(expected - points).max(axis=1) > 0.01).mean() > 0.1
    np.testing.assert_allclose(got, expected, atol=10 * TOLERANCE)


@every_form
def test_rest_poses_and_rigid_motions_change_nothing(form):
    rig = random_rig(5)
    limit = sinew.BulgeLimit(sinew.Binding(*rig.mesh), *bones_of(rig))
    identity = np.tile(np.eye(4, dtype=np.float32), (len(rig.transforms), 1, 1))
    np.testing.assert_array_equal(limit.apply(rig.rest_points, identity, form=form), rig.rest_points)
    motion = random_motion(np.random.default_rng(6)).astype(np.float32)
    moved = transform(motion, rig.rest_points).astype(np.float32)
    alike = np.tile(motion, (len(rig.transforms), 1, 1))
    np.testing.assert_allclose(limit.apply(moved, alike, form=form), moved, atol=TOLERANCE)


@every_form
def test_vertices_of_one_bone_and_scaled_bones_keep_their_place(form):
    single = random_rig(7, most_influences=1, scaled=True)
    limit = sinew.BulgeLimit(sinew.Binding(*single.mesh), *bones_of(single))
    points = single.deform("lbs")
    np.testing.assert_array_equal(limit.apply(points, single.transforms, form=form), points)
    # All bones have the same scale, with which the limit grows.
    rig = random_rig(8)
    larger = np.tile(np.diag([2.0, 2.0, 2.0, 1.0]).astype(np.float32), (len(rig.transforms), 1, 1))
    points = 2.0 * rig.rest_points
    limit = sinew.BulgeLimit(sinew.Binding(*rig.mesh), *bones_of(rig))
    np.testing.assert_allclose(limit.apply(points, larger, form=form), points, atol=TOLERANCE)


@every_form
def test_degenerate_bones_and_points_are_finite(form):
    rig = random_rig(13, vertices=50)
    heads, tails = bones_of(rig)
    motions = rig.transforms.copy()
    motions[::2, :3, :3] = 0.0
    limit = sinew.BulgeLimit(sinew.Binding(*rig.mesh), heads, heads)
    assert np.isfinite(limit.apply(rig.rest_points, motions, form=form)).all()
    assert np.isfinite(limit.apply(np.tile(heads[:1], (50, 1)), motions, form=form)).all()
    assert np.isfinite(
        sinew.BulgeLimit(sinew.Binding(*rig.mesh), heads, tails).apply(rig.rest_points, motions)
    ).all()


# --- A tube that bends by 90 degrees, of radius 0.5 and length 4

SEGMENTS = np.float32([[0, 0, 0], [0, 0, 2]]), np.float32([[0, 0, 2], [0, 0, 4]])


def elbow(offset):
    """The tube, its deformed points and its bones. The middle of the weights' ramp is `offset` away from
    where the bones meet."""
    made = Tube(middle=2.0 + offset)
    return made, *made.deformed("dq", (1, 0, 0), 90)


def tear(made, before, after):
    """The largest factor by which the stage lengthens an edge."""
    edges = np.concatenate([made.quads[:, [0, 1]], made.quads[:, [1, 2]], made.quads[:, [2, 3]]]).T
    moved = after.astype(np.float64) - before
    lengths = np.linalg.norm(made.points[edges[0]] - made.points[edges[1]], axis=1)
    return (np.linalg.norm(moved[edges[0]] - moved[edges[1]], axis=1) / lengths).max()


def test_an_elbow_with_misaligned_weights_keeps_its_thickness_and_its_surface():
    made, points, bones = elbow(0.25)
    assert bulge(points, bones) > 1.2
    limit = sinew.BulgeLimit(sinew.Binding(*made.mesh), *SEGMENTS)
    continuous = limit.apply(points, bones)
    assert bulge(continuous, bones) <= 1.08
    assert tear(made, points, continuous) <= 0.5
    # Kim and Han's form tears where the heaviest bone changes.
    hard = limit.apply(points, bones, form="kim_han")
    assert bulge(hard, bones) <= 1.12
    assert tear(made, points, hard) > 1.5


def test_an_elbow_with_good_weights_keeps_its_thickness():
    made, points, bones = elbow(0.0)
    limit = sinew.BulgeLimit(sinew.Binding(*made.mesh), *SEGMENTS)
    assert bulge(points, bones) > 1.08
    assert bulge(limit.apply(points, bones), bones) <= 1.02
    assert bulge(limit.apply(points, bones, form="kim_han"), bones) <= 1.001
