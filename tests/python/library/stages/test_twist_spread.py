# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects Twist Spread: compared with its formula in float64, and its effect on a twisted tube."""

import itertools

import numpy as np
import pytest
import sinew
import twist_spread_reference
from reference import skin
from rigs import TOLERANCE, about, random_motion, random_rig, transform, translation
from tube import Tube

BLENDS = ("linear", "matrices", "rotations", "logarithms")
# How each method blends rotations.
BLEND_OF = {"lbs": "linear", "ddm": "matrices", "log": "logarithms", "dib": "logarithms"}
every_blend = pytest.mark.parametrize("blend", BLENDS)


def chain(rig, seed=1):
    """Every second bone shares a twist: its own, or that of the next. Arguments of sinew.TwistSpread."""
    rng, count = np.random.default_rng(seed), len(rig.transforms)
    bones = np.arange(0, count - 1, 2, dtype=np.int32)
    from_parent = bones % 4 == 0
    twists = np.column_stack(
        [bones, np.where(from_parent, bones + 1, bones), np.where(from_parent, bones, bones + 1), from_parent]
    )
    heads = rng.uniform(-1.0, 1.0, (len(bones), 3)).astype(np.float32)
    tails = heads + rng.uniform(-1.0, 1.0, heads.shape).astype(np.float32)
    return twists.astype(np.int32), heads, tails, rig.rest_bones


def true_channels(rig, twists, turns):
    """What channels tell of the tips, with so many more turns about Y."""
    channels = np.zeros((len(twists), 7), np.float32)
    for row, (_bone, base, tip, _from) in zip(channels, twists, strict=True):
        turned = twist_spread_reference.relative_rotation(
            *rig.transforms[[base, tip]].astype(np.float64), rig.rest_bones[tip].astype(np.float64)
        )
        axes = rig.rest_bones[tip, :3, :3].astype(np.float64)
        row[:4] = skin.quaternion(axes.T @ turned @ axes)
        row[4:] = 0.1, 2.0 * np.pi * turns, -0.2
    return channels


def posed(rig, blend):
    return rig.deform("lbs" if blend == "linear" else "dq")


@every_blend
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
@pytest.mark.parametrize("most", [2, 12])
@pytest.mark.parametrize("turns", [None, 0.7, -2.0])
def test_agrees_with_the_reference(blend, scaled, most, turns):
    second = BLENDS[(BLENDS.index(blend) + (2 if scaled else 3)) % len(BLENDS)]
    rig = random_rig(1, vertices=300, most_influences=most, scaled=scaled)
    twists, *ends = chain(rig)
    parents = np.arange(-1, len(rig.transforms) - 1, dtype=np.int32)
    rng = np.random.default_rng(2)
    values = {
        "amount": 0.9,
        "amounts": rng.uniform(0.5, 1.0, len(twists)).astype(np.float32),
        "curves": rng.uniform(-1.0, 1.0, len(twists)).astype(np.float32),
        "channels": None if turns is None else true_channels(rig, twists, turns),
        "blend": blend,
        "mix_blend": second,
    }
    mix = None if turns is None else rng.uniform(-0.5, 1.5, 300).astype(np.float32)
    mask = np.linspace(-0.5, 1.5, 300).astype(np.float32)
    points = posed(rig, blend)
    binding = sinew.Binding(*rig.mesh)
    spread = sinew.TwistSpread(binding, twists, *ends, parents=parents, weights=mask, mix=mix)
    got = spread.apply(points, rig.transforms, **values)
    expected, margins = twist_spread_reference.spread(
        points, *rig.mesh, twists, *ends, rig.transforms, parents=parents, mask=mask, mix=mix, **values
    )
    assert (np.abs(expected - points).max(axis=1) > 0.01).mean() > 0.2
    decided = margins > 0.01
    assert decided.mean() > 0.5
    np.testing.assert_allclose(got[decided], expected[decided], atol=30 * TOLERANCE)


@every_blend
def test_rest_poses_stay_and_rigid_motions_commute(blend):
    rig = random_rig(9)
    twists, *ends = chain(rig)
    spread = sinew.TwistSpread(sinew.Binding(*rig.mesh), twists, *ends)
    identity = np.tile(np.eye(4, dtype=np.float32), (len(rig.transforms), 1, 1))
    np.testing.assert_array_equal(spread.apply(rig.rest_points, identity, blend=blend), rig.rest_points)
    motion = random_motion(np.random.default_rng(10))
    moved = transform(motion, rig.rest_points).astype(np.float32)
    alike = np.tile(motion.astype(np.float32), (len(rig.transforms), 1, 1))
    np.testing.assert_allclose(spread.apply(moved, alike, blend=blend), moved, atol=TOLERANCE)
    points = posed(rig, blend)
    first = spread.apply(points, rig.transforms, blend=blend)
    second = spread.apply(
        transform(motion, points.astype(np.float64)).astype(np.float32),
        (motion @ rig.transforms).astype(np.float32),
        blend=blend,
    )
    np.testing.assert_allclose(second, transform(motion, first), atol=50 * TOLERANCE)


@every_blend
def test_degenerate_bones_are_finite(blend):
    rig = random_rig(14, vertices=50)
    twists, heads, _tails, rest_bones = chain(rig)
    motions = rig.transforms.copy()
    motions[::2, :3, :3] = 0.0
    spread = sinew.TwistSpread(sinew.Binding(*rig.mesh), twists, heads, heads, rest_bones)
    assert np.isfinite(spread.apply(rig.rest_points, motions, blend=blend)).all()


# --- A tube of radius 0.5 and length 4, twisted in its middle. Its bones point along z.

REST_BONES = np.array([[[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, z], [0, 0, 0, 1]] for z in (0, 2)], np.float32)
JOINT = translation([0.0, 0.0, 2.0])


def wrist(over=1.0, from_parent=False, mix=None):
    """The tube, whose weights change over this length, and the stage."""
    made = Tube(over=over)
    bone = int(from_parent)
    spread = sinew.TwistSpread(
        sinew.Binding(*made.mesh),
        [[bone, 0, 1, bone]],
        [[0, 0, 2 * bone]],
        [[0, 0, 2 * bone + 2]],
        REST_BONES,
        parents=[-1, 0],
        mix=mix,
    )
    return made, spread


def hand(degrees, swing=0.0):
    """Poses: the second bone twisted by `degrees`, then bent by `swing`."""
    bent = JOINT @ about([1, 0, 0], swing) @ about([0, 0, 1], degrees) @ np.linalg.inv(JOINT)
    return np.array([np.eye(4), bent], np.float32)


def told(degrees, swing=0.0):
    """Its channels, as Euler angles."""
    turned = about([1, 0, 0], swing) @ about([0, 1, 0], degrees)
    angles = np.radians([swing, degrees, 0.0])
    return np.float32([[*skin.quaternion(turned[:3, :3]), *angles]])


def poser(made, spread, method):
    """Takes degrees of twist, whether channels tell them, and degrees of swing; returns points."""
    deformer = sinew.Deformer(*made.mesh, method, vertex_data=made.vertex_data(method))
    blend = BLEND_OF.get(method, "rotations")

    def points(degrees, known=True, swing=0.0):
        pose, channels = hand(degrees, swing), told(degrees, swing) if known else None
        return spread.apply(deformer.deform(pose), pose, blend=blend, channels=channels).astype(np.float64)

    return points


def numbers(made, points):
    edges = np.concatenate([made.triangles[:, [k, (k + 1) % 3]] for k in range(3)]).T
    posed, rest = (np.linalg.norm(p[edges[0]] - p[edges[1]], axis=1) for p in (points, made.points))
    volume = made.volume(points) / made.volume(made.points)
    return volume, np.hypot(*points[:, :2].T).min() / 0.5, (posed / rest).max()


@pytest.mark.parametrize("blends", list(itertools.product(BLENDS, repeat=2)), ids="-".join)
def test_a_mix_has_the_share_of_what_each_blend_gives(blends):
    made, alone = wrist()
    mix = np.linspace(-0.5, 1.5, len(made.points)).astype(np.float32)
    share = np.clip(mix, 0.0, 1.0)[:, None]
    pose, channels = hand(300.0), told(300.0)
    points = sinew.Deformer(*made.mesh, "dq").deform(pose)
    first, second = (alone.apply(points, pose, blend=blend, channels=channels) for blend in blends)
    assert blends[0] == blends[1] or np.abs(second - first).max() > 0.05
    _made, mixed = wrist(mix=mix)
    got = mixed.apply(points, pose, blend=blends[0], mix_blend=blends[1], channels=channels)
    np.testing.assert_allclose(got, first + share * (second - first), atol=2 * TOLERANCE)


# Volume, least radius and longest edge, each 1 at rest; computed independently of this code, in numpy.
TABLE = {
    ("lbs", 1.0, 90): (0.999, 0.997, 1.19),
    ("lbs", 1.0, 170): (0.997, 0.991, 1.36),
    ("lbs", 1.0, 180): (0.997, 0.990, 1.38),
    ("lbs", 0.5, 170): (0.998, 0.998, 1.37),
    ("lbs", 0.5, 180): (0.998, 0.997, 1.39),
    ("dq", 1.0, 90): (0.999, 1.0, 1.18),
    ("dq", 1.0, 170): (0.998, 1.0, 1.39),
    ("dq", 1.0, 180): (0.998, 1.0, 1.46),
    ("dq", 0.5, 170): (0.998, 1.0, 1.71),
    ("dq", 0.5, 180): (0.998, 1.0, 1.90),
}


@pytest.mark.parametrize("case", TABLE)
def test_a_twisted_wrist_has_the_numbers_of_the_table(case):
    method, over, degrees = case
    made, spread = wrist(over)
    found = numbers(made, poser(made, spread, method)(degrees))
    assert (np.abs(np.array(found) - TABLE[case]) < (0.001, 0.001, 0.006)).all()
    # From the parent, it is the mirror image of the same.
    made, spread = wrist(over, from_parent=True)
    other = numbers(made, poser(made, spread, method)(degrees))
    np.testing.assert_allclose(other, found, atol=0.001)


def speeds(shapes):
    """The largest of all vertices from each shape to the next, where one degree moves the surface by 1."""
    moves = [np.linalg.norm(b - a, axis=1).max() for a, b in itertools.pairwise(shapes)]
    return np.array(moves) / (0.5 * np.radians(1.0))


@pytest.mark.parametrize("method", ["lbs", "dq", "cor", "log"])
@pytest.mark.parametrize("known", [True, False], ids=["channels", "matrices"])
@pytest.mark.parametrize("swing", [0.0, 60.0])
def test_no_vertex_jumps_from_minus_400_to_400_degrees(method, known, swing):
    made, spread = wrist()
    steps = np.arange(-400.0, 401.0)
    points = poser(made, spread, method)
    found = speeds([points(at, known, swing) for at in steps])
    if method == "lbs" or (known and swing == 0.0):
        assert found.max() < (1.2 if known else 7.0)
        return
    # Of a bone that is bent as well, and where only matrices tell it, such methods jump at 180 degrees.
    deformer = sinew.Deformer(*made.mesh, method, vertex_data=made.vertex_data(method))
    own = speeds([deformer.deform(hand(at, swing)).astype(np.float64) for at in steps])
    assert own.max() > 50.0
    assert (found - own).max() < 8.0
    assert found[np.abs(np.abs(steps[:-1] + 0.5) - 180.0) > 1.0].max() < 8.0


def test_near_180_degrees_of_swing_it_fades():
    made, spread = wrist()
    bends = np.arange(0.0, 361.0)
    points = [spread.apply(made.points.astype(np.float32), hand(60.0, swing)) for swing in bends]
    assert speeds(points).max() < 6.0
    for swing, left in ((120.0, 60.0), (150.0, 60.0), (165.0, 30.0), (179.9, 0.0)):
        assert np.degrees(spread.angles(hand(60.0, swing))[0]) == pytest.approx(left, abs=0.01)


def test_channels_tell_turns_up_to_two():
    _made, spread = wrist()
    for degrees in (-700, -400, -200, -90, 90, 200, 400, 540, 700, 900):
        found = np.degrees(spread.angles(hand(degrees), told(degrees)))[0]
        assert found == pytest.approx(np.clip(degrees, -720, 720), abs=1e-3)
        # Something else rotated it as well.
        other = np.degrees(spread.angles(hand(degrees + 40.0), told(degrees)))[0]
        assert abs(other) <= 150.0
