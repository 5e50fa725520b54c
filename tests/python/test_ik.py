# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.ik: compared with scipy's least squares, the law of cosines, and plain matrices for the
poses."""

import numpy as np
import pytest
import sinew
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from sinew import ik

CHAINS = 120


def rest_of(lengths):
    """Bones along y, each at the end of the one before, [bones, 7]."""
    rest = np.zeros((len(lengths), 7))
    rest[:, 0] = 1.0
    rest[1:, 5] = lengths[:-1]
    return rest


def turned_by(quaternions):
    """A Rotation of scipy."""
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1))


def poses_of(rest, turns):
    """The oracle for poses, with matrices: rotation and head of each bone of a chain whose rest has no
    rotations. turns: a Rotation of scipy"""
    rotation, head, poses = np.eye(3), np.zeros(3), []
    for own, turn in zip(rest, turns.as_matrix(), strict=True):
        head = head + rotation @ own[4:]
        rotation = rotation @ turn
        poses.append((rotation, head))
    return poses


def tip_of(rest, turns, length):
    rotation, head = poses_of(rest, turns)[-1]
    return head + rotation @ (0.0, length, 0.0)


def quaternions_of(vectors):
    return np.roll(Rotation.from_rotvec(vectors).as_quat(), 1, axis=-1)


def chain(parents, **limits):
    return ik.Solver(parents, [ik.Effector(len(parents) - 1)], **limits)


def line_of(count):
    return np.arange(count) - 1


def test_two_bones_by_the_law_of_cosines():
    rng = np.random.default_rng(1)
    solver = chain(line_of(2))
    for _ in range(100):
        a, b = rng.uniform(0.5, 1.5, 2)
        distance = rng.uniform(abs(a - b) + 0.05, a + b - 0.05)
        goal = rng.normal(size=3)
        goal *= distance / np.linalg.norm(goal)
        rest, start = rest_of([a, b]), quaternions_of(rng.uniform(-0.5, 0.5, (2, 3)))
        found = solver.solve(rest, [[0, b, 0]], [[1, 0, 0, 0, *goal]], rotations=start)
        assert found.is_reached
        at_root = (a * a + distance * distance - b * b) / (2 * a * distance)
        at_knee = (a * a + b * b - distance * distance) / (2 * a * b)
        poses = poses_of(rest, turned_by(found.rotations))
        first, second = poses[0][0][:, 1], poses[1][0][:, 1]
        assert first @ goal / distance == pytest.approx(at_root, abs=1e-4)
        assert -first @ second == pytest.approx(at_knee, abs=1e-4)


def test_chains_without_limits_reach_where_scipy_does():
    rng = np.random.default_rng(2)
    for _ in range(CHAINS // 2):
        count = int(rng.integers(2, 9))
        lengths = rng.uniform(0.5, 1.5, count)
        rest, total = rest_of(lengths), lengths.sum()
        goal = rng.normal(size=3)
        goal *= rng.uniform(0.0, 1.4) * total / np.linalg.norm(goal)
        start = rng.uniform(-0.4, 0.4, (count, 3))

        def error(vectors, rest=rest, length=lengths[-1], goal=goal):
            return tip_of(rest, Rotation.from_rotvec(vectors.reshape(-1, 3)), length) - goal

        theirs = np.linalg.norm(least_squares(error, start.ravel(), xtol=1e-12, ftol=1e-12).fun)
        solver = chain(line_of(count))
        found = solver.solve(
            rest,
            [[0, lengths[-1], 0]],
            [[1, 0, 0, 0, *goal]],
            rotations=quaternions_of(start),
        )
        distance = np.linalg.norm(tip_of(rest, turned_by(found.rotations), lengths[-1]) - goal)
        assert distance == pytest.approx(found.distance, abs=1e-9 * total)
        # Folded to the end of its reach, a chain is at a minimum of the fourth order.
        assert distance <= theirs + 1.1e-6 * total


def turned_by_angles(angles):
    """The inverse of swing_twist_angles(), by scipy, with the swing from its quaternion."""
    x, z = np.sin(angles[:, 0] / 2), np.sin(angles[:, 2] / 2)
    w = np.sqrt(np.maximum(1 - x * x - z * z, 0.0))
    swing = Rotation.from_quat(np.column_stack([x, np.zeros_like(x), z, w]))
    return swing * Rotation.from_rotvec(angles * (0.0, 1.0, 0.0))


def test_angles_of_swing_and_twist():
    rng = np.random.default_rng(3)
    angles = rng.uniform(-1.2, 1.2, (100, 3))
    quaternions = np.roll(turned_by_angles(angles).as_quat(), 1, axis=-1)
    for multiple in (1, -3):
        np.testing.assert_allclose(ik.swing_twist_angles(multiple * quaternions), angles, atol=1e-12)


def test_chains_with_limits_come_as_near_as_scipy():
    """Both start from the same pose within the same bounds. A local minimum is no fault, but there must
    not be more."""
    rng = np.random.default_rng(4)
    nearer, as_near, farther = 0, 0, 0
    for _ in range(CHAINS):
        count = int(rng.integers(2, 6))
        lengths = rng.uniform(0.5, 1.5, count)
        rest, total = rest_of(lengths), lengths.sum()
        # x is free within its limits and z locked, or the other way round: scipy's bounds can not be an
        # ellipse.
        locked = np.zeros((count, 3), bool)
        locked[np.arange(count), np.where(rng.random(count) < 0.5, 0, 2)] = True
        limits = np.stack([-rng.uniform(0.2, 2.5, (count, 3)), rng.uniform(0.2, 2.5, (count, 3))], axis=-1)
        free = ~locked
        inside = rng.uniform(0.05, 0.95, (count, 3))
        posed = np.where(free, limits[..., 0] + inside * (limits[..., 1] - limits[..., 0]), 0.0)
        goal = tip_of(rest, turned_by_angles(posed), lengths[-1])
        start = np.where(free, 0.1 * limits[..., 1], 0.0)
        begun = turned_by_angles(start)

        def error(values, rest=rest, length=lengths[-1], goal=goal, free=free):
            angles = np.zeros(free.shape)
            angles[free] = values
            return tip_of(rest, turned_by_angles(angles), length) - goal

        bounds = (limits[..., 0][free], limits[..., 1][free])
        theirs = np.linalg.norm(least_squares(error, start[free], bounds=bounds, xtol=1e-12).fun)
        solver = chain(line_of(count), locked=locked, limits=limits)
        found = solver.solve(
            rest, [[0, lengths[-1], 0]], [[1, 0, 0, 0, *goal]], rotations=np.roll(begun.as_quat(), 1, axis=-1)
        )
        angles = ik.swing_twist_angles(found.rotations)
        assert (np.abs(angles[locked]) < 1e-7).all()
        assert (angles >= limits[..., 0] - 1e-7)[free].all()
        assert (angles <= limits[..., 1] + 1e-7)[free].all()
        ours = np.linalg.norm(tip_of(rest, turned_by(found.rotations), lengths[-1]) - goal)
        nearer += ours < theirs - 1e-4 * total
        farther += ours > theirs + 1e-4 * total
        as_near += abs(ours - theirs) <= 1e-4 * total
    assert as_near >= 0.9 * CHAINS
    assert farther <= 0.04 * CHAINS, (nearer, as_near, farther)


def test_wanted_rotations_against_scipy():
    rng = np.random.default_rng(5)
    for _ in range(40):
        count = int(rng.integers(3, 7))
        lengths = rng.uniform(0.5, 1.5, count)
        rest, total = rest_of(lengths), lengths.sum()
        # Half of the goals are unreachable: the sum of squares must be minimal.
        goal = rng.normal(size=3) * 0.5 * total
        wanted = Rotation.random(random_state=rng)
        start = rng.uniform(-0.4, 0.4, (count, 3))

        def error(vectors, rest=rest, length=lengths[-1], goal=goal, wanted=wanted, total=total):
            rotation, head = poses_of(rest, Rotation.from_rotvec(vectors.reshape(-1, 3)))[-1]
            tip = head + rotation @ (0.0, length, 0.0)
            turn = (wanted * Rotation.from_matrix(rotation).inv()).as_rotvec()
            return np.concatenate([(goal - tip) / total, 0.3 * turn])

        theirs = least_squares(error, start.ravel(), xtol=1e-12, ftol=1e-12).cost
        solver = ik.Solver(line_of(count), [ik.Effector(count - 1, 1.0, 0.3)])
        found = solver.solve(
            rest,
            [[0, lengths[-1], 0]],
            [[*np.roll(wanted.as_quat(), 1), *goal]],
            rotations=quaternions_of(start),
            iterations=500,
        )
        vectors = Rotation.from_quat(np.roll(found.rotations, -1, axis=-1)).as_rotvec()
        ours = 0.5 * (error(vectors.ravel()) ** 2).sum()
        assert ours <= theirs + 1e-6


def test_layouts_and_frames_broadcast():
    rng = np.random.default_rng(6)
    solver = chain(line_of(3))
    rest, tips = rest_of([1, 1, 1]), [[0, 1, 0]]
    goals = np.zeros((5, 1, 7))
    goals[..., 0], goals[..., 4:] = 1.0, rng.uniform(-1.2, 1.2, (5, 1, 3))
    root = sinew.quat_vec.normalized(rng.normal(size=7))
    start = quaternions_of(rng.uniform(-0.4, 0.4, (3, 3)))
    together = solver.solve(rest, tips, goals, rotations=start, root=root)
    assert together.rotations.shape == (5, 3, 4)
    assert together.iterations.shape == (5,)
    assert together.iterations.dtype == np.int32
    for frame in range(5):
        for layout in (sinew.quat_vec.to_dual_quat, sinew.quat_vec.to_affine):
            one = solver.solve(layout(rest), tips, layout(goals[frame]), rotations=start, root=layout(root))
            np.testing.assert_allclose(one.rotations, together.rotations[frame], atol=1e-9)
    assert isinstance(one.is_reached, bool | np.bool_)
    assert one.rotations.dtype == np.float64
    float32 = solver.solve(rest.astype(np.float32), tips, goals.astype(np.float32), rotations=start)
    assert float32.rotations.dtype == np.float64
