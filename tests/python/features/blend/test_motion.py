# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects blended clips: compared with the library's blends, and with walks whose contacts are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sinew
import walks
from sinew import affine, dual_quat, quat_vec
from sinew_addon.base.errors import SinewError
from sinew_addon.features.blend.align import PHASES, align
from sinew_addon.features.blend.clip import Clip
from sinew_addon.features.blend.motion import IN_PLACE, KEYED, METHODS, TRAVEL, Settings, blend
from sinew_addon.features.blend.root import grounded, main_root
from sinew_addon.io.poses import Poses

UP = walks.UP
matrices = quat_vec.to_affine


def apart(a, b):
    """The largest difference of two arrays of rigid transforms, independent of the signs of quaternions."""
    return np.abs(matrices(a) - matrices(b)).max()


def plain(method, **more):
    """Every clip from its first frame, with its root like any bone: only what the formulas give."""
    return Settings(method=method, align=False, root_motion=KEYED, **more)


def pair(seed=1):
    rng = np.random.default_rng(seed)
    return walks.random_clip(rng, "a"), walks.random_clip(rng, "b")


# --- Properties of all blends


@pytest.mark.parametrize("root_motion", [TRAVEL, KEYED])
@pytest.mark.parametrize("method", METHODS)
def test_a_clip_of_weight_one_is_that_clip(method, root_motion):
    walk, run = walks.walk(), walks.walk("run", 30, 1.1, 0.2, start=0.3)
    for is_aligned in (True, False):
        settings = Settings(method=method, root_motion=root_motion, align=is_aligned)
        for number, clip in enumerate((walk, run)):
            made = blend([walk, run], np.eye(2)[number], settings).clip("one")
            assert made.length == clip.length
            assert apart(made.poses.rigid, clip.poses.rigid) < 1e-9
            assert np.abs(made.poses.scale - clip.poses.scale).max() < 1e-9


def test_signs_of_quaternions_and_the_sum_of_weights_do_not_matter():
    a, b = pair(3)
    flipped = a.poses.rigid.copy()
    flipped[::2, :, :4] *= -1.0
    for method in METHODS:
        one = blend([a, b], (1, 3), plain(method))
        other = blend([replace(a, poses=Poses(flipped, a.poses.scale)), b], (0.25, 0.75), plain(method))
        assert apart(one.poses.rigid, other.poses.rigid) < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_where_on_the_ground_clips_are_does_not_matter(method):
    """With root motion, clips may have other positions and directions: the blend starts where the
    heaviest clip starts."""
    walk, run = walks.walk(), walks.walk("run", 30, 1.1, 0.2)
    rigid = run.poses.rigid.copy()
    ground = quat_vec.from_screw_about(UP, np.array([3.0, 1.0, 0.0]), 1.2, 0.0)
    rest = run.rig.rest[0]
    there = quat_vec.compose(ground, quat_vec.compose(rest, rigid[:, 0]))
    rigid[:, 0] = quat_vec.compose(quat_vec.inverse(rest), there)
    elsewhere = replace(run, poses=Poses(rigid, run.poses.scale))
    settings = Settings(method=method)
    one = blend([walk, run], (0.6, 0.4), settings)
    other = blend([walk, elsewhere], (0.6, 0.4), settings)
    assert apart(one.poses.rigid, other.poses.rigid) < 1e-9


def test_linear_matrices_shrink_and_no_other_method_does():
    a, b = pair(11)
    left, right = matrices(a.poses.rigid), matrices(b.poses.rigid)
    wanted = np.linalg.det(0.5 * left[..., :3, :3] + 0.5 * right[..., :3, :3])
    for method in METHODS:
        made = blend([a, b], (1, 1), plain(method))
        scale = 0.5 * (a.poses.scale + b.poses.scale)
        if method == "matrix_linear":
            assert np.abs(made.volume - wanted).max() < 1e-12
            assert made.volume.min() < 0.8
            # What Blender receives of it: the lengths of the axes.
            axes = np.linalg.norm(0.5 * (left + right)[..., :3, :3], axis=-2)
            assert np.abs(made.poses.scale - scale * axes).max() < 1e-12
            volume, bone, frame = made.smallest()
            assert volume == made.volume.min() == made.volume[frame, a.rig.index(bone)]
        else:
            assert (made.volume == 1.0).all()
            assert np.abs(made.poses.scale - scale).max() < 1e-12
        assert np.abs(np.linalg.norm(made.poses.rigid[..., :4], axis=-1) - 1.0).max() < 1e-9


# --- Timing


def test_a_blend_of_periods_20_and_30_has_period_25_and_keeps_the_contacts():
    """Whatever frames the clips start at, the left foot of the blend is on the ground when it is in both
    clips."""
    walk = walks.walk(period=20, start=0.1)
    run = walks.walk("run", 30, 1.1, 0.2, start=0.65)
    made = blend([walk, run], (0.5, 0.5))
    assert made.is_cyclic
    clip = made.clip("blend")
    assert clip.length == 25.0
    # For the reference, which is the first clip: it starts at phase 0.1, and its left foot lifts at 0.6.
    phases = 0.1 + np.arange(26) / 25.0
    sides = [walks.foot(phases + ahead, 1.0, 0.1)[1] == 0.0 for ahead in (0.0, 0.5)]
    feet = [clip.rig.index(name) for name in ("foot.L", "foot.R")]
    heights = clip.rig.points(clip.rig.to_armature(clip.poses.rigid))[:, feet, 0, 2]
    for height, on_ground in zip(heights.T, sides, strict=True):
        sure = on_ground & np.roll(on_ground, 1) & np.roll(on_ground, -1)
        assert height[sure].max() < walks.ANKLE + 0.012
        lifted = height > walks.ANKLE + 0.05
        assert lifted.any()
        assert not (lifted & on_ground).any()
    # It is closed except for its travel.
    assert apart(clip.poses.rigid[0, 1:], clip.poses.rigid[-1, 1:]) < 1e-9


def test_without_alignment_feet_meet_the_ground_at_other_times_and_slide():
    walk = walks.walk(period=20)
    run = walks.walk("run", 30, 1.1, 0.2, start=0.65)
    slides = {}
    for is_aligned in (True, False):
        made = blend([walk, run], (0.5, 0.5), Settings(align=is_aligned)).clip("blend")
        slides[is_aligned] = walks.mean_sliding(made)
    own = max(map(walks.mean_sliding, (walk, run)))
    assert slides[True] < 1.5 * own
    assert slides[False] > 2.0 * slides[True]


@pytest.mark.parametrize("offset", [0.0, 0.05, 0.31, 0.5, 0.77])
def test_the_offset_of_a_cycle_is_found(offset):
    reference, late = (grounded(walks.walk(start=start), 0, UP).clip for start in (0.0, offset))
    warp = align(reference, late, np.ones(8, dtype=bool))
    # Where the reference has phase 0, the other clip has -offset, which equals 1 - offset.
    off = np.mod(warp.own - np.arange(PHASES + 1) / PHASES + offset + 0.5, 1.0) - 0.5
    assert np.abs(off).max() < 1.0 / PHASES
    assert warp.own[-1] - warp.own[0] == pytest.approx(1.0)
    assert -0.5 <= warp.own[0] <= 0.5


def test_another_pace_within_the_cycle_is_found():
    even = np.linspace(0.0, 1.0, 41)
    bent = even + 0.06 * np.sin(2 * np.pi * even)
    reference = grounded(walks.walk(period=40), 0, UP).clip
    other = grounded(walks.walk("bent", 40, phases=bent), 0, UP).clip
    warp = align(reference, other, np.ones(8, dtype=bool))
    # The other clip is at `bent` when this one is at `even`, so it is the inverse.
    phases = np.arange(PHASES + 1) / PHASES
    wanted = np.interp(phases, bent, even)
    assert np.abs(warp.own - wanted).max() < 1.2 / PHASES
    assert (np.diff(warp.own) > 0.0).all()


def test_clips_that_are_no_cycles_are_aligned_from_end_to_end():
    even = np.linspace(0.0, 1.0, 41)
    half = walks.walk("half", 40, phases=0.45 * even)
    late = walks.walk("late", 40, phases=0.45 * even**1.4)
    reference, other = (grounded(clip, 0, UP, False).clip for clip in (half, late))
    warp = align(reference, other, np.ones(8, dtype=bool))
    assert np.abs(warp.own[[0, -1]] - (0.0, 1.0)).max() < 1e-12
    inside = slice(4, -4)
    phases = np.arange(PHASES + 1) / PHASES
    assert np.abs(warp.own - phases ** (1 / 1.4))[inside].max() < 2.0 / PHASES
    assert not blend([half, late], (1, 1)).is_cyclic


def test_clips_that_do_not_move_and_single_poses_blend():
    walk = walks.walk()
    pose = Clip("pose", walk.rig, Poses(walk.poses.rigid[:1], walk.poses.scale[:1]), 0.0)
    still = replace(walk, poses=Poses(np.repeat(pose.poses.rigid, 21, 0), walk.poses.scale), name="still")
    assert blend([pose, pose], (1, 1)).poses.rigid.shape == (1, 8, 7)
    for other in (pose, still):
        made = blend([walk, other], (0.5, 0.5))
        assert len(made.poses.rigid) == 21
        wanted = sinew.interpolate.blend(
            np.stack([quat_vec.to_dual_quat(walk.poses.rigid[:, 1:]),
                      quat_vec.to_dual_quat(np.repeat(pose.poses.rigid[:, 1:], 21, 0))], axis=2),
            np.full((21, 7, 2), 0.5), "dlb")  # fmt: skip
        assert np.abs(dual_quat.to_affine(wanted.transforms) - matrices(made.poses.rigid[:, 1:])).max() < 1e-9


def test_weights_change_over_the_blend():
    """A transition from a walk to a run starts as the one and ends as the other, with their speeds."""
    walk, run = walks.walk(), walks.walk("run", 30, 1.1, 0.2, start=0.3)
    made = blend([walk, run], ((1, 0), (0, 1)), Settings(cycles=3))
    timing = made.timing
    assert np.array_equal(timing.weights[0], (1.0, 0.0))
    assert np.array_equal(timing.weights[-1], (0.0, 1.0))
    assert (np.diff(timing.weights[:, 1]) > 0.0).all()
    assert (np.diff(timing.times, axis=0) > 0.0).all()
    assert len(timing.times) - 1 == pytest.approx(75.0, abs=1.0)
    assert apart(made.poses.rigid[0], walk.poses.rigid[0]) < 1e-9
    last = grounded(run, 0, UP).clip.at(timing.times[-1:, 1]).rigid
    assert apart(made.poses.rigid[-1:, 1:], last[:, 1:]) < 1e-9
    # Where a clip is alone, one frame of the blend is one frame of the clip.
    assert timing.times[1, 0] - timing.times[0, 0] == pytest.approx(1.0, abs=0.03)
    assert timing.times[-1, 1] - timing.times[-2, 1] == pytest.approx(1.0, abs=0.03)
    assert not made.is_cyclic


def test_between_samples_and_beyond_the_ends():
    clip = pair(2)[0]
    middle = clip.at(np.array([3.5])).rigid[0]
    wanted = sinew.interpolate.between(*clip.poses.rigid[3:5], 0.5, "qv_slerp").transforms
    assert apart(middle, wanted) < 1e-12
    assert apart(clip.at(np.array([-2.0, 99.0])).rigid, clip.poses.rigid[[0, -1]]) == 0.0
    cycle = grounded(walks.walk(), 0, UP).clip
    assert apart(cycle.at(np.array([20.0, 47.0, -3.0])).rigid, cycle.poses.rigid[[20, 7, 17]]) < 1e-12


# --- Root motion


@pytest.mark.parametrize("method", METHODS)
def test_two_straight_walks_move_at_the_blended_speed(method):
    """For equal periods the mean of the speeds; for others the mean stride in the mean period."""
    for period, share in ((20, 0.25), (30, 0.25), (30, 0.6)):
        slow, fast = walks.walk(stride=0.6), walks.walk("fast", period, 1.1, start=0.2)
        made = blend([slow, fast], (1 - share, share), Settings(method=method, cycles=2))
        place = made.clip("x").rig.to_armature(made.poses.rigid)[:, 0, 4:]
        stride = (1 - share) * 0.6 + share * 1.1
        frames = len(place) - 1
        assert frames == round(2 * ((1 - share) * 20 + share * period))
        assert np.abs(place[-1] - place[0] - (0.0, -2 * stride, 0.0)).max() < 1e-9
        if period == 20:
            speed = np.diff(place[:, 1])
            assert speed.mean() == pytest.approx(-((1 - share) * 0.6 + share * 1.1) / 20)
        assert np.abs(place[:, 0]).max() < 1e-9


@pytest.mark.parametrize("method", ["dlb", "sclerp", "qv_slerp", "matrix_polar"])
def test_turns_add_up_to_the_blended_turn(method):
    left, right = walks.walk(turn=0.9), walks.walk("right", turn=-0.3)
    made = blend([left, right], (0.5, 0.5), Settings(method=method, cycles=4))
    root = made.rig.to_armature(made.poses.rigid)[:, 0]
    whole = quat_vec.to_screw(quat_vec.compose(root[-1], quat_vec.inverse(root[0])))
    # A regular walk on a circle: its rotation is the mean, and it continues on the circle about the vertical.
    assert whole.angle * np.sign(whole.axis @ UP) == pytest.approx(-4 * 0.3, abs=2e-3)
    assert np.abs(root[:, 6] - root[0, 6]).max() < 1e-9
    same = blend([left, left], (0.5, 0.5), Settings(method=method, cycles=2))
    whole = quat_vec.compose(same.poses.rigid[20, 0], quat_vec.inverse(same.poses.rigid[0, 0]))
    assert apart(quat_vec.compose(whole, same.poses.rigid[20, 0]), same.poses.rigid[40, 0]) < 1e-9


def test_in_place_keeps_the_pose_and_goes_nowhere():
    walk, run = walks.walk(), walks.walk("run", 30, 1.1, 0.2)
    moving = blend([walk, run], (0.5, 0.5), Settings(cycles=2))
    still = blend([walk, run], (0.5, 0.5), Settings(cycles=2, root_motion=IN_PLACE))
    assert apart(moving.poses.rigid[:, 1:], still.poses.rigid[:, 1:]) < 1e-12
    place = still.rig.to_armature(still.poses.rigid)[:, 0, 4:]
    assert np.abs(place - place[0]).max() < 1e-9
    assert moving.rig.to_armature(moving.poses.rigid)[-1, 0, 5] == pytest.approx(-1.9)
    # As keyed they are not cyclic, so each is blended once from end to end.
    keyed = blend([walk, run], (0.5, 0.5), Settings(root_motion=KEYED))
    assert not keyed.is_cyclic
    assert keyed.root is None


def test_the_root_is_the_uppermost_bone_that_moves():
    walk = walks.walk()
    assert main_root(walk.rig, [walk]) == 0
    rigid = walk.poses.rigid.copy()
    rigid[:, 0] = quat_vec.identity()
    assert walk.rig.names[main_root(walk.rig, [replace(walk, poses=Poses(rigid, walk.poses.scale))])] in (
        "thigh.L",
        "thigh.R",
    )
    # A bone above the root that does not move does not carry it.
    rig = walk.rig
    names, parents = (
        ("master", *rig.names),
        np.concatenate([[-1], np.where(rig.parents < 0, 0, rig.parents + 1)]),
    )
    under = replace(
        rig,
        names=names,
        parents=parents,
        rest=np.vstack([quat_vec.identity(), rig.rest]),
        lengths=np.concatenate([[1.0], rig.lengths]),
    )
    still = np.broadcast_to(quat_vec.identity(), (21, 1, 7))
    poses = Poses(np.concatenate([still, walk.poses.rigid], axis=1), np.ones((21, 9, 3)))
    clip = Clip("walk", under, poses, 20.0)
    assert names[main_root(under, [clip])] == "hips"
    made = blend([clip, clip], (1, 1), Settings(cycles=2))
    assert made.root == "hips"
    assert len(made.poses.rigid) == 41
    assert under.to_armature(made.poses.rigid)[-1, 1, 5] == pytest.approx(-1.6)


def test_a_root_that_tilts_on_a_turned_armature_travels_on_its_own_ground():
    """Up may be any direction in armature space, as in files with Y up; a tilt is not part of the travel."""
    walk = walks.walk(sway=0.0)
    x = quat_vec.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)
    rig = replace(walk.rig, rest=walk.rig.rest.copy())
    rig.rest[0] = quat_vec.compose(x, rig.rest[0])
    up = quat_vec.transform_vector(x, UP)
    rigid = walk.poses.rigid.copy()
    tilt = 0.3 * np.sin(2 * np.pi * np.arange(21) / 20)
    rigid[:, 0] = quat_vec.compose(rigid[:, 0], quat_vec.from_axis_angle([1.0, 0.0, 0.0], tilt))
    clip = Clip("walk", rig, Poses(rigid, walk.poses.scale), 20.0)
    made = blend([clip, clip], (1, 2), Settings(cycles=3), up=up)
    assert made.is_cyclic
    assert len(made.poses.rigid) == 61
    assert apart(made.poses.rigid[:21], rigid) < 1e-9
    place = rig.to_armature(made.poses.rigid)[:, 0, 4:]
    assert np.abs(place[-1] - place[0] - quat_vec.transform_vector(x, [0.0, -2.4, 0.0])).max() < 1e-9


# --- Errors


@pytest.mark.parametrize(
    ("weights", "settings", "sentence"),
    [
        ((1,), {}, "expected one for each of 2 clips, got 1"),
        (((1, 0), (1,)), {}, "expected one for each of 2 clips, got 1"),
        ((0, 0), {}, "not all of them 0"),
        ((1, -1), {}, "0 or more"),
        ((1, float("nan")), {}, "0 or more"),
        ((1, 1), {"method": "slerp"}, "method: expected one of dlb"),
        ((1, 1), {"root_motion": "yes"}, "root motion: expected one of travel"),
        ((1, 1), {"cycles": 0}, "cycles: expected 1 or more"),
        ((1, 1), {"cycles": 10_000}, "choose fewer cycles"),
        ((1, 1), {"root": "tail"}, "There is no bone 'tail'"),
    ],
)
def test_errors_are_one_sentence(weights, settings, sentence):
    with pytest.raises(SinewError, match=sentence):
        blend([walks.walk(), walks.walk("other")], weights, Settings(**settings))


def test_clips_of_other_armatures_are_refused():
    walk = walks.walk()
    other = replace(walk, rig=replace(walk.rig, names=("pelvis", *walk.rig.names[1:])), name="other")
    with pytest.raises(SinewError, match="other and walk move other bones"):
        blend([walk, other], (1, 1))
    with pytest.raises(SinewError, match="choose two actions"):
        blend([], ())


def test_many_frames_at_once_are_frame_by_frame():
    a, b = pair(21)
    c = walks.random_clip(np.random.default_rng(22), "c")
    weights = np.array([0.2, 0.5, 0.3])
    for method in METHODS:
        made = matrices(blend([a, b, c], weights, plain(method)).poses.rigid)
        layout = {"m": quat_vec.to_affine, "q": np.asarray}.get(method[0], quat_vec.to_dual_quat)
        for frame, bone in ((0, 1), (7, 3), (12, 6)):
            three = np.stack([clip.poses.rigid[frame, bone] for clip in (a, b, c)])
            one = sinew.interpolate.blend(layout(three), weights, method).transforms
            if method.startswith("matrix"):
                one = affine.normalized(one)
            elif method.startswith("qv"):
                one = quat_vec.to_affine(one)
            else:
                one = dual_quat.to_affine(one)
            assert np.abs(one[:3] - made[frame, bone, :3]).max() < 1e-9
