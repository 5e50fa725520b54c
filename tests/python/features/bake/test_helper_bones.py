# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects helper bones: properties of the solution, and motions that were made by known helper bones."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from rigs import about
from sinew_addon.base import steps as core_steps
from sinew_addon.features.bake import helper_bones, simplex
from sinew_addon.features.bake.helper_bones import HelperOptions, Motion, Report, Wanted
from sinew_addon.skinning.influences import Influences
from tube import Tube

TUBE = Tube(29, 12)
INFLUENCES = Influences(*TUBE.mesh[1:])
POSES = [((1, 0, 0), angle) for angle in range(0, 131, 13)]
POSES += [((0, 0, 1), angle) for angle in range(17, 171, 17)]
SEGMENTS = np.array([[[0, 0, 0], [0, 0, 2]], [[0, 0, 2], [0, 0, 4]]], dtype=np.float64)
# Relative to the limb.
DIAMETER = 1.0


def solved(motion, wanted):
    return result_of(helper_bones.solve(motion, wanted))


def result_of(steps):
    """What a generator of shares that are done returns."""
    shares = []
    result = core_steps.result_of(steps, shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return result


def motion_by(method):
    shapes = [TUBE.deformed(method, *pose) for pose in POSES]
    return Motion(
        TUBE.points.astype(np.float32)[None],
        np.array([points for points, _bones in shapes], dtype=np.float32),
        np.array([bones[:, :3] for _points, bones in shapes]),
        INFLUENCES,
        SEGMENTS,
    )


def played(motion, solution):
    """float64 [frames, vertices, 3]: linear blend skinning, independent of the solver's code."""
    motions = np.concatenate([motion.bones, solution.motions], axis=1)
    rest = np.broadcast_to(motion.rest, motion.targets.shape).astype(np.float64)
    points = np.zeros(motion.targets.shape)
    for bones, weights in zip(solution.bones.T, solution.weights.T, strict=True):
        own = motions[:, bones]
        moved = np.einsum("fvij,fvj->fvi", own[..., :3], rest) + own[..., 3]
        points += np.where(bones >= 0, weights, 0.0)[None, :, None] * moved
    return points


def errors_of(points, targets):
    distances = np.linalg.norm(points - targets, axis=2)
    return np.sqrt(np.square(distances).mean()), distances.max()


@pytest.mark.parametrize("method", ["dq", "cor"])
def test_two_helper_bones_a_joint_play_the_method(method):
    motion = motion_by(method)
    solution = solved(motion, Wanted(2))
    rms, worst = errors_of(played(motion, solution), motion.targets)
    assert np.allclose((solution.after.rms, solution.after.worst), (rms, worst), rtol=1e-3)
    assert rms <= 0.008 * DIAMETER
    assert worst <= 0.1 * DIAMETER
    assert rms <= 0.16 * solution.before.rms


def test_the_error_never_grows_with_more_helper_bones():
    motion = motion_by("dq")
    errors = [solved(motion, Wanted(count)) for count in range(5)]
    lbs = np.array([TUBE.deformed("lbs", *pose)[0] for pose in POSES])
    assert np.allclose(
        (errors[0].before.rms, errors[0].before.worst), errors_of(lbs, motion.targets), rtol=1e-4
    )
    rms = [errors[0].before.rms, *(solution.after.rms for solution in errors)]
    assert rms == sorted(rms, reverse=True)


def test_no_more_helper_bones_than_the_error_needs():
    motion = motion_by("dq")
    few = solved(motion, HelperOptions(20, error=0.5).of(motion))
    assert few.after.rms <= 0.005 * motion.diagonal
    assert 0 < len(few.parents) < 6
    assert HelperOptions().of(motion).helpers == 2


@pytest.mark.parametrize("most", [1, 2, 4])
def test_weights_are_few_and_sum_to_one(most):
    solution = solved(motion_by("dq"), Wanted(3, influences=most))
    assert solution.weights.shape == (len(TUBE.points), most)
    assert (solution.weights >= 0.0).all()
    assert np.allclose(solution.weights.sum(axis=1), 1.0)
    assert ((solution.bones >= 0) == (solution.weights > 0.0)).all()
    assert set(solution.parents) <= {0, 1}
    # Rest is not changed: helper bones only rotate and move.
    linear = solution.motions[..., :3]
    assert np.allclose(linear @ linear.swapaxes(-1, -2), np.identity(3), atol=1e-9)


@pytest.mark.parametrize("moving", [False, True])
def test_motions_of_known_helper_bones_are_found(moving):
    """Two bones that scale, and a third that the rig does not have; the rest points move or stay."""
    rng = np.random.default_rng(3)
    frames, count = 12, len(TUBE.points)
    motions = np.zeros((frames, 3, 3, 4))
    for frame in range(frames):
        for bone in range(3):
            size = 1.0 + 0.05 * frame
            turned = about(rng.normal(size=3), 70.0 * rng.random())[:3, :3]
            motions[frame, bone] = np.column_stack([size * turned, rng.normal(size=3)])
    known = np.clip(np.abs(TUBE.points[:, 2:] - [[0.5, 3.5, 2.0]]), 0.0, 1.2)
    known = (1.2 - known) / (1.2 - known).sum(axis=1, keepdims=True)
    rest = np.repeat(TUBE.points[None], frames if moving else 1, axis=0)
    if moving:
        rest[:, :, 0] *= np.linspace(1.0, 1.5, frames)[:, None]
    rest = np.broadcast_to(rest, (frames, count, 3))
    moved = np.einsum("fbij,fvj->fbvi", motions[..., :3], rest) + motions[:, :, None, :, 3]
    targets = np.einsum("vb,fbvi->fvi", known, moved)
    motion = Motion(
        rest[: frames if moving else 1].astype(np.float32),
        targets.astype(np.float32),
        motions[:, :2],
        INFLUENCES,
        SEGMENTS,
    )
    solution = solved(motion, Wanted(1))
    assert solution.before.rms > 0.3
    assert solution.after.rms <= 0.02 * solution.before.rms
    assert np.allclose(solution.motions[:, 0], motions[:, 2], atol=0.25)


def test_a_vertex_without_weights_and_a_mesh_without_vertices():
    motion = motion_by("dq")
    influences = motion.influences
    offsets = influences.offsets.copy()
    lost = influences.counts[0]
    offsets[1:] -= lost
    bare = Influences(offsets, influences.bones[lost:], influences.weights[lost:])
    solution = solved(Motion(motion.rest, motion.targets, motion.bones, bare, SEGMENTS), Wanted(1))
    assert (solution.bones[0] == -1).all()
    assert (solution.weights[0] == 0.0).all()
    # It stays at rest, even where a stage after the method moves it; that is an error, too.
    distances = np.linalg.norm(motion.targets[:, 0].astype(np.float64) - motion.rest[0, 0], axis=1)
    assert np.isclose(solution.errors[0], np.sqrt(np.square(distances).mean()), atol=1e-6)
    targets = motion.targets.copy()
    targets[3, 0] += 7.0
    bare_motion = Motion(motion.rest, targets, motion.bones, bare, SEGMENTS)
    moved = solved(bare_motion, Wanted(1))
    found = errors_of(played(bare_motion, moved) + (moved.bones[:, :1] < 0) * motion.rest, targets)
    assert np.allclose((moved.after.rms, moved.after.worst), found, rtol=1e-3)
    assert moved.after.worst > 12.0
    none = Influences(np.zeros(1, np.int32), np.empty(0, np.int32), np.empty(0, np.float32))
    empty = Motion(motion.rest[:, :0], motion.targets[:, :0], motion.bones, none, SEGMENTS)
    solution = solved(empty, Wanted(3))
    assert len(solution.parents) == 0
    assert Report.of("Rig", solution, 1.0, empty.diagonal).sentences("m")


def best_of_all_subsets(gram, allowed, most):
    """The smallest w G w over all sets of at most `most` candidates."""
    best = np.inf
    for count in range(1, most + 1):
        for chosen in itertools.combinations(np.flatnonzero(allowed), count):
            direction = np.linalg.solve(gram[np.ix_(chosen, chosen)], np.ones(count))
            weights = direction / direction.sum()
            if (weights >= 0.0).all():
                best = min(best, weights @ gram[np.ix_(chosen, chosen)] @ weights)
    return best


def test_sparse_weights_against_all_subsets():
    rng = np.random.default_rng(5)
    rows, candidates = 60, 6
    errors = rng.normal(size=(rows, candidates, 8)) + rng.normal(size=(rows, 1, 8))
    grams = errors @ errors.transpose(0, 2, 1)
    allowed = rng.random((rows, candidates)) < 0.8
    allowed[:, 0] = True
    for most, slack in ((candidates, 1e-6), (3, 0.2)):
        weights = simplex.sparse_weights(grams, allowed, most)
        assert (weights[~allowed] == 0.0).all()
        assert ((weights > 0.0).sum(axis=1) <= most).all()
        found = simplex.objective(grams, weights)
        best = np.array([best_of_all_subsets(g, a, most) for g, a in zip(grams, allowed, strict=True)])
        # With a limit the search does not try all sets.
        assert (found <= best * (1.0 + slack)).mean() > 0.95
        assert (found >= best * (1.0 - 1e-6)).all()
