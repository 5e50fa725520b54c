# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects inverse kinematics: compared with scipy's least squares, the law of cosines, and plain matrices
for the poses; and what holds of every solution: limits, trees, poles, degenerate chains, invariance."""

import numpy as np
import pytest
from future_work import ik
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from sinew import quat_vec

CHAINS = 120


def rest_of(lengths):
    """Bones along y, each at the end of the one before, [bones, 7]."""
    rest = np.zeros((len(lengths), 7))
    rest[:, 0] = 1.0
    rest[1:, 5] = lengths[:-1]
    return rest


def turned_by(quaternions):
    """A Rotation of scipy."""
    return Rotation.from_quat(quaternions, scalar_first=True)


def poses_of(rest, turns, parents=None):
    """The oracle for poses: matrices [bones, 4, 4].

    turns    a Rotation of scipy, with that of the rest
    parents  where it is no chain
    """
    poses = np.tile(np.eye(4), (len(rest), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = turns.as_matrix(), rest[:, 4:]
    for bone, parent in enumerate(line_of(len(rest)) if parents is None else parents):
        if parent >= 0:
            poses[bone] = poses[parent] @ poses[bone]
    return poses


def tips_of(rest, turns, lengths, parents=None):
    """The ends of the bones, [bones, 3]"""
    poses = poses_of(rest, turns, parents)
    return poses[:, :3, 3] + np.asarray(lengths)[:, None] * poses[:, :3, 1]


def quaternions_of(vectors):
    return Rotation.from_rotvec(vectors).as_quat(scalar_first=True)


def at(positions, rotation=(1.0, 0.0, 0.0, 0.0)):
    """Goals [.., 1, 7]"""
    rotations = np.broadcast_to(rotation, (*np.shape(positions)[:-1], 4))
    return np.concatenate([rotations, positions], axis=-1)[..., None, :]


def line_of(count):
    """The parents of a chain."""
    return np.arange(count) - 1


def chain(count, **limits):
    return ik.Solver(line_of(count), [ik.Effector(count - 1)], **limits)


def solved(solver, lengths, goals, **given):
    """The solution for a chain of bones of these lengths, and the position of its end."""
    rest = rest_of(lengths)
    found = solver.solve(rest, [[0, lengths[-1], 0]], goals, **given)
    return found, tips_of(rest, turned_by(found.rotations), lengths)[-1]


def test_two_bones_by_the_law_of_cosines():
    rng = np.random.default_rng(1)
    solver = chain(2)
    for _ in range(100):
        a, b = rng.uniform(0.5, 1.5, 2)
        distance = rng.uniform(abs(a - b) + 0.05, a + b - 0.05)
        goal = rng.normal(size=3)
        goal *= distance / np.linalg.norm(goal)
        rest, start = rest_of([a, b]), quaternions_of(rng.uniform(-0.5, 0.5, (2, 3)))
        found = solver.solve(rest, [[0, b, 0]], at(goal), rotations=start)
        assert found.is_reached
        at_root = (a * a + distance * distance - b * b) / (2 * a * distance)
        at_knee = (a * a + b * b - distance * distance) / (2 * a * b)
        first, second = poses_of(rest, turned_by(found.rotations))[:, :3, 1]
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

        def error(vectors, rest=rest, lengths=lengths, goal=goal):
            return tips_of(rest, Rotation.from_rotvec(vectors.reshape(-1, 3)), lengths)[-1] - goal

        theirs = np.linalg.norm(least_squares(error, start.ravel(), xtol=1e-12, ftol=1e-12).fun)
        found, tip = solved(chain(count), lengths, at(goal), rotations=quaternions_of(start))
        distance = np.linalg.norm(tip - goal)
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
    quaternions = turned_by_angles(angles).as_quat(scalar_first=True)
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
        goal = tips_of(rest, turned_by_angles(posed), lengths)[-1]
        start = np.where(free, 0.1 * limits[..., 1], 0.0)
        begun = turned_by_angles(start)

        def error(values, rest=rest, lengths=lengths, goal=goal, free=free):
            angles = np.zeros(free.shape)
            angles[free] = values
            return tips_of(rest, turned_by_angles(angles), lengths)[-1] - goal

        bounds = (limits[..., 0][free], limits[..., 1][free])
        theirs = np.linalg.norm(least_squares(error, start[free], bounds=bounds, xtol=1e-12).fun)
        solver = chain(count, locked=locked, limits=limits)
        found, tip = solved(solver, lengths, at(goal), rotations=begun.as_quat(scalar_first=True))
        angles = ik.swing_twist_angles(found.rotations)
        assert (np.abs(angles[locked]) < 1e-7).all()
        assert (angles >= limits[..., 0] - 1e-7)[free].all()
        assert (angles <= limits[..., 1] + 1e-7)[free].all()
        ours = np.linalg.norm(tip - goal)
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
            pose = poses_of(rest, Rotation.from_rotvec(vectors.reshape(-1, 3)))[-1]
            tip = pose[:3, 3] + length * pose[:3, 1]
            turn = (wanted * Rotation.from_matrix(pose[:3, :3]).inv()).as_rotvec()
            return np.concatenate([(goal - tip) / total, 0.3 * turn])

        theirs = least_squares(error, start.ravel(), xtol=1e-12, ftol=1e-12).cost
        solver = ik.Solver(line_of(count), [ik.Effector(count - 1, 1.0, 0.3)])
        goals, given = at(goal, wanted.as_quat(scalar_first=True)), quaternions_of(start)
        found, _tip = solved(solver, lengths, goals, rotations=given, iterations=500)
        vectors = turned_by(found.rotations).as_rotvec()
        ours = 0.5 * (error(vectors.ravel()) ** 2).sum()
        assert ours <= theirs + 1e-6


def test_layouts_and_frames_broadcast():
    rng = np.random.default_rng(6)
    solver = chain(3)
    rest, tips = rest_of([1, 1, 1]), [[0, 1, 0]]
    goals = at(rng.uniform(-1.2, 1.2, (5, 3)))
    root = quat_vec.normalized(rng.normal(size=7))
    start = quaternions_of(rng.uniform(-0.4, 0.4, (3, 3)))
    together = solver.solve(rest, tips, goals, rotations=start, root=root)
    assert together.rotations.shape == (5, 3, 4)
    assert together.iterations.shape == (5,)
    assert together.iterations.dtype == np.int32
    for frame in range(5):
        for layout in (quat_vec.to_dual_quat, quat_vec.to_affine):
            one = solver.solve(layout(rest), tips, layout(goals[frame]), rotations=start, root=layout(root))
            np.testing.assert_allclose(one.rotations, together.rotations[frame], atol=1e-9)
    assert isinstance(one.is_reached, bool | np.bool_)
    assert one.rotations.dtype == np.float64
    float32 = solver.solve(rest.astype(np.float32), tips, goals.astype(np.float32), rotations=start)
    assert float32.rotations.dtype == np.float64


# --- What holds of every solution


def beyond(locked, limits, quaternions):
    """By how many radians rotations exceed the limits of their bones, at most. x and z that are both limited
    are bounded by the ellipse through the four limits, whose semi-axes are sines of half angles."""
    angles = ik.swing_twist_angles(quaternions)
    low, high = (np.where(locked, 0.0, limits[..., side]) for side in (0, 1))
    worst = np.maximum(low - angles, angles - high).max()
    x_and_z, ends = angles[:, ::2], np.where(angles < 0.0, low, high)[:, ::2]
    both = np.isfinite(ends).all(axis=1) & ~locked[:, ::2].any(axis=1)
    radius = np.linalg.norm(np.sin(0.5 * x_and_z[both]) / np.sin(0.5 * ends[both]), axis=1)
    outside = (1.0 - 1.0 / np.maximum(radius, 1.0)) * np.linalg.norm(x_and_z[both], axis=1)
    return max(worst, outside.max(initial=0.0))


def random_limits(rng, count):
    """Of each bone one of several kinds: none, hinges, elbows, swings without twist, boxes and ellipses."""
    kind = rng.uniform(size=(count, 3))
    locked = kind < 0.3
    locked[locked[:, 0] & locked[:, 2], 0] = False
    ends = rng.uniform(0.1, 2.5, (count, 3, 2)) * (-1.0, 1.0)
    return locked, np.where(kind[..., None] > 0.6, ends, (-np.inf, np.inf))


def test_limits_are_never_violated_and_nearly_always_what_is_reachable_is_reached():
    rng, reached = np.random.default_rng(5), 0
    for _ in range(400):
        lengths = rng.uniform(0.5, 1.5, rng.integers(2, 11))
        count = len(lengths)
        locked, limits = random_limits(rng, count)
        solver = chain(count, locked=locked, limits=limits)
        # A solve without a step limits its start.
        start = quaternions_of(rng.uniform(-1.5, 1.5, (count, 3)))
        posed, goal = solved(solver, lengths, at([0, 0, 0]), rotations=start, iterations=0)
        start = quaternions_of(rng.uniform(-0.3, 0.3, (count, 3)))
        found, _tip = solved(solver, lengths, at(goal), rotations=start, iterations=200)
        for each in (posed, found):
            assert beyond(locked, limits, each.rotations) < 1e-7
        reached += found.is_reached
    assert reached >= 390


def test_trees_reach_two_goals():
    """A trunk of two bones, and two branches of three bones each."""
    rng, parents = np.random.default_rng(7), [-1, 0, 1, 2, 3, 1, 5, 6]
    lengths = np.array([1, 1, 0.5, 1, 1, 0.5, 1, 1])
    rest = np.zeros((8, 7))
    rest[1:, 5] = lengths[parents[1:]]
    rest[:, :4] = quaternions_of([[0, 0, np.radians({2: 60, 5: -60}.get(bone, 0))] for bone in range(8)])
    solver, at_rest = ik.Solver(parents, [ik.Effector(4), ik.Effector(7)]), turned_by(rest[:, :4])
    for _ in range(100):
        posed = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (8, 3)))
        goals = tips_of(rest, at_rest * posed, lengths, parents)[[4, 7]]
        start = quaternions_of(rng.uniform(-0.3, 0.3, (8, 3)))
        found = solver.solve(rest, [[0, 1, 0]] * 2, at(goals)[:, 0], rotations=start, iterations=5000)
        tips = tips_of(rest, at_rest * turned_by(found.rotations), lengths, parents)
        np.testing.assert_allclose(tips[[4, 7]], goals, rtol=0, atol=4.5e-6)


def test_poles_choose_the_plane_and_the_side_of_the_bend():
    rng = np.random.default_rng(8)
    for _ in range(200):
        lengths = rng.uniform(0.5, 1.5, rng.integers(2, 11))
        count, rest = len(lengths), rest_of(lengths)
        towards, pole = (v / np.linalg.norm(v) for v in rng.uniform(-1, 1, (2, 3)))
        solver = ik.Solver(line_of(count), [ik.Effector(count - 1, has_pole=True, pole_angle=0.5 * np.pi)])
        # Bent about x, so that its plane contains z, the axis that the pole angle refers to.
        found = solver.solve(
            rest,
            [[0, lengths[-1], 0]],
            at(rng.uniform(0.5, 0.9) * lengths.sum() * towards),
            poles=[3.0 * pole],
            rotations=quaternions_of([[0.15, 0, 0]] * count),
            iterations=5000,
        )
        assert found.is_reached
        up = pole - (pole @ towards) * towards
        tips = tips_of(rest, turned_by(found.rotations), lengths)
        np.testing.assert_allclose(tips @ np.cross(towards, up) / np.linalg.norm(up), 0.0, atol=1e-9)
        # The chain is bent away from the direction of its bones' z axes.
        assert tips[0] @ up < 0.0


@pytest.mark.parametrize("goal", [0.3, 1.0, 2.0, -0.5, -2.0])
def test_a_straight_chain_bends_to_a_goal_on_its_line(goal):
    knee = np.full((3, 3, 2), (-np.inf, np.inf))
    # Bends only to one side.
    knee[1:, 0] = 0.0, 2.6
    locked = np.zeros((3, 3), bool)
    locked[1:, 1:] = True
    for solver in (chain(3), chain(3, locked=locked, limits=knee)):
        found, tip = solved(solver, [1, 1, 1], at([0, goal, 0]), iterations=5000)
        assert np.linalg.norm(tip - (0, goal, 0)) < 3e-6
    assert beyond(locked, knee, found.rotations) < 1e-7


@pytest.mark.parametrize("lengths", [(0, 0, 0), (1, 0, 1), (0, 1, 0), (3, 1, 0.5), (1, 1, 1)])
@pytest.mark.parametrize("goal", [(0, 0, 0), (0, 0.4, 0), (1, 1, 0), (1e9, 0, 0)])
def test_degenerate_chains_come_as_near_as_they_can(lengths, goal):
    solver, total = ik.Solver(line_of(3), [ik.Effector(2, has_pole=True)]), sum(lengths)
    found, _tip = solved(solver, lengths, at(goal), poles=[[0, 5, 0]], iterations=2000)
    np.testing.assert_allclose(np.linalg.norm(found.rotations, axis=1), 1.0, atol=1e-9)
    apart = np.linalg.norm(goal)
    least = max(apart - total, 2.0 * max(lengths) - total - apart, 0.0)
    assert found.distance <= least * (1 + 1e-9) + 1e-4 * total


def test_a_rigid_motion_of_everything_changes_nothing():
    rng, rest = np.random.default_rng(9), rest_of([1, 1.2, 0.8, 0.6])
    for number in range(100):
        motion = quat_vec.normalized(rng.normal(size=7))
        goal, pole = (
            at(rng.uniform(-1.5, 1.5, 3), Rotation.random(rng=rng).as_quat()),
            rng.uniform(-4, 4, (1, 3)),
        )
        solver = ik.Solver(line_of(4), [ik.Effector(3, 1.0, number % 2 * 0.5, has_pole=number % 3 == 0)])
        given = {"rotations": quaternions_of(rng.uniform(-0.4, 0.4, (4, 3))), "iterations": 30}
        poles = [pole, quat_vec.transform_point(motion, pole)] if number % 3 == 0 else [None, None]
        here = solver.solve(rest, [[0, 0.6, 0]], goal, poles=poles[0], **given)
        moved = quat_vec.compose(motion, goal)
        there = solver.solve(rest, [[0, 0.6, 0]], moved, poles=poles[1], root=motion, **given)
        between = turned_by(here.rotations).inv() * turned_by(there.rotations)
        assert between.magnitude().max() < 1e-5


def test_signs_of_quaternions_do_not_matter_and_the_same_gives_the_same_bits():
    rng, rest = np.random.default_rng(10), rest_of([1, 1.2, 0.8])
    for number in range(100):
        locked, limits = random_limits(rng, 3) if number % 2 else (None, None)
        solver = ik.Solver(line_of(3), [ik.Effector(2, 1.0, 0.5)], locked=locked, limits=limits)
        start = quaternions_of(rng.uniform(-1.5, 1.5, (3, 3)))
        goal = at(rng.uniform(-1.5, 1.5, 3), Rotation.random(rng=rng).as_quat())
        once, same, again = (
            solver.solve(rest, [[0, 0.8, 0]], goal * signs, rotations=sign * start).rotations
            for sign, signs in ((1, 1), (1, 1), (-1, [-1] * 4 + [1] * 3))
        )
        np.testing.assert_array_equal(once, same)
        np.testing.assert_allclose(again, once, rtol=0, atol=1e-9)
        assert (once[:, 0] >= 0.0).all()


def test_stiff_bones_rotate_less():
    turns = []
    for stiffness in (0.0, 0.9):
        start = quaternions_of([[0.2, 0, 0]] * 3)
        solver = chain(3, stiffness=[[stiffness] * 3, [0] * 3, [0] * 3])
        found, _tip = solved(solver, [1, 1, 1], at([0.5, 2, 1]), rotations=start, iterations=5000)
        assert found.is_reached
        turns.append((turned_by(start[0]).inv() * turned_by(found.rotations[0])).magnitude())
    assert turns[1] < 0.7 * turns[0]
