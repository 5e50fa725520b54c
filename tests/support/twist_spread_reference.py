# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage twist_spread in float64 numpy, by its definition and matrices: the oracle for the library."""

import numpy as np
from reference import axes_keeping_y, is_rigid, methods, rotation_of_bone, skin

FADE_START, HALF, TURN = np.radians(150.0), np.pi, 2.0 * np.pi


def about(axis, angle):
    """Rodrigues' formula, 3x3."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def fade(x, start, end):
    t = np.clip((x - start) / (end - start), 0.0, 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)


def swing_and_twist(turned, axis):
    """The angle between `axis` and its image, and the angle about `axis` of what is left of the rotation
    `turned`, 3x3, without the shortest rotation that takes `axis` there."""
    image = turned @ axis
    normal = np.cross(axis, image)
    size = np.linalg.norm(normal)
    swing = np.arctan2(size, axis @ image)
    left = turned if size == 0.0 else about(normal / size, -swing) @ turned
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    moved = left @ across
    return swing, np.arctan2(np.cross(across, moved) @ axis, across @ moved)


def reading(turned, axis, expected):
    """The angle that is spread, the whole turns that it is beyond the shorter way, the share that fades
    leave, and the least distance in radians from where one of them jumps."""
    swing, shorter = swing_and_twist(turned, axis)
    around = np.round((expected - shorter) / TURN)
    angle = shorter + TURN * around
    apart = abs(angle - expected)
    share = fade(apart, FADE_START, HALF) * fade(swing, FADE_START, HALF)
    margin = min(HALF - swing, HALF - abs(shorter), HALF - apart)
    return share * np.clip(angle, -2.0 * TURN, 2.0 * TURN), around, share, margin


def expected_angle(channels, turned, axes, axis):
    told = np.asarray(channels[:4], np.float64)
    if not told.any():
        return 0.0
    told = axes @ methods.rotation_of(told) @ axes.T
    apart = 2.0 * np.arccos(min(1.0, abs(skin.quaternion(told) @ skin.quaternion(turned))))
    return fade(apart, np.radians(1.0), np.radians(5.0)) * (np.asarray(channels[4:], float) @ (axes.T @ axis))


def left_out(blend, around, below, part):
    if blend in ("linear", "matrices") or not 0.0 < below < 1.0 or not part > 0.5:
        return 0.0
    return around * (TURN * below if blend == "logarithms" else 4.0 * np.arctan2(below, 1.0 - below))


def are_below(tip, parents, count):
    found = np.zeros(count, bool)
    for bone in range(count):
        at = bone
        for _step in range(count):
            if at == tip or at < 0:
                break
            at = -1 if parents is None else parents[at]
        found[bone] = at == tip
    return found


def relative_rotation(base, tip, tip_rest):
    """The base's scale is taken off both. A base without width leaves its rotation alone."""
    if np.linalg.det(base[:3, :3]) == 0.0:
        base = rotation_of_bone(base, tip_rest)
    linear = np.linalg.inv(base[:3, :3]) @ tip[:3, :3]
    return rotation_of_bone(np.block([[linear, np.zeros((3, 1))], [0.0, 0.0, 0.0, 1.0]]), tip_rest)


def spread(  # noqa: PLR0913 - as the library's
    points,
    rest_points,
    offsets,
    bones,
    weights,
    twists,
    heads,
    tails,
    rest_bones,
    transforms,
    *,
    parents=None,
    amount=1.0,
    amounts=None,
    curves=None,
    channels=None,
    blend="linear",
    mix_blend="linear",
    mask=None,
    mix=None,
):
    """The twisted points, float64 [vertices, 3], and the least margin in radians of each vertex: how far it
    is from where a matrix decides between two readings. All arguments are in the space of the bones."""
    transforms, rest_bones = np.asarray(transforms, np.float64), np.asarray(rest_bones, np.float64)
    result, margins = np.asarray(points, np.float64).copy(), np.full(len(points), np.pi)
    for number in range(len(twists))[::-1]:
        bone, base, tip, from_parent = twists[number]
        origin = np.asarray(heads[number], np.float64)
        along = np.asarray(tails[number], np.float64) - origin
        axis = along if along.any() else rest_bones[bone, :3, 1]
        axis = axis / np.linalg.norm(axis)
        turned = relative_rotation(transforms[base], transforms[tip], rest_bones[tip])
        axes = rest_bones[tip, :3, :3]
        axes = axes if is_rigid(axes) else axes_keeping_y(axes)
        expected = 0.0 if channels is None else expected_angle(channels[number], turned, axes, axis)
        angle, around, part, margin = reading(turned, axis, expected)
        factor = amount * (1.0 if amounts is None else np.clip(amounts[number], 0.0, 1.0))
        curve = 0.0 if curves is None else np.clip(curves[number], -1.0, 1.0)
        motion = transforms[bone]
        linear, shift = motion[:3, :3], motion[:3, 3]
        beyond, posed_axis = are_below(tip, parents, len(rest_bones)), linear @ axis
        for vertex, x in enumerate(result.copy()):
            span = slice(offsets[vertex], offsets[vertex + 1])
            of, share = bones[span], np.asarray(weights[span], np.float64)
            if not share.sum() > 0.0:
                continue
            share = share / share.sum()
            weight, below = share[of == bone].sum(), share[beyond[of]].sum()
            if weight > 0.0 or 0.0 < below < 1.0:
                margins[vertex] = min(margins[vertex], margin)
            rest = np.asarray(rest_points[vertex], np.float64)
            squared = along @ along
            e = np.clip((rest - heads[number]) @ along / squared, 0.0, 1.0) if squared > 0.0 else 0.0
            e = e + curve * e * (1.0 - e)
            own = 1.0 if mask is None else np.clip(mask[vertex], 0.0, 1.0)
            theta = own * factor * angle * (e - 1.0 if from_parent else e)
            second = 0.0 if mix is None else np.clip(mix[vertex], 0.0, 1.0)
            twisted = linear @ (origin + about(axis, theta) @ (rest - origin)) + shift
            untwisted = linear @ rest + shift
            # The point is a mix of two methods' points, and so is what is added to it.
            for made_by, portion in ((blend, 1.0 - second), (mix_blend, second)):
                if made_by == "linear":
                    result[vertex] += portion * weight * (twisted - untwisted)
                    continue
                if not posed_axis.any():
                    continue
                side = np.copysign(1.0, np.linalg.det(linear)) if np.linalg.det(linear) else 1.0
                posed = side * posed_axis / np.linalg.norm(posed_axis)
                centre = linear @ origin + shift
                gap = left_out(made_by, around, below, own * factor * part)
                moved = centre + about(posed, weight * theta + gap) @ (x - centre)
                if not is_rigid(linear):
                    moved += weight * (twisted - centre - about(posed, theta) @ (untwisted - centre))
                result[vertex] += portion * (moved - x)
    return result, margins
