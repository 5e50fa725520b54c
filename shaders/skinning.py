# SPDX-License-Identifier: MIT
"""What the shaders compute, with numpy for all vertices at once. Joints and weights are [vertices, n], bones
those of bone_buffer()."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np


def rotated(quaternions, vectors):
    """Vectors [n, 3] by quaternions [n, 4], x, y, z, w."""
    axes, real = quaternions[:, :3], quaternions[:, 3:]
    return vectors + 2.0 * np.cross(axes, np.cross(axes, vectors) + real * vectors)


def by_bones(bones, points):
    """Points [n, 3] by the matrices of bones [n, 4, 4] of the bone buffer."""
    return np.einsum("nij,nj->ni", bones[:, :3, :3], points) + bones[:, :3, 3]


def skinned(method, points, centres, joints, weights, bones, keeps_signs=False):
    """As the shaders: points [vertices, 3] by lbs, dq or cor.

    bones        float [bones, 8, 4], of bone_buffer()
    keeps_signs  those of the hierarchy
    """
    weights = weights / weights.sum(axis=1, keepdims=True)
    slots = [(bones[joints[:, k]].astype(np.float64), weights[:, k, None]) for k in range(joints.shape[1])]
    linear = sum(weight * by_bones(bone, points) for bone, weight in slots)
    if method == "lbs":
        return linear
    real, dual = np.zeros((len(points), 4)), np.zeros((len(points), 4))
    for bone, weight in slots:
        q = bone[:, 3]
        is_away = (q * real).sum(axis=1, keepdims=True) < 0.0
        signed = np.where(is_away & (not keeps_signs), -weight, weight)
        t = by_bones(bone, points) - rotated(q, points)
        real += signed * q
        dual += (
            0.5
            * signed
            * np.column_stack([q[:, 3:] * t + np.cross(t, q[:, :3]), -(t * q[:, :3]).sum(axis=1)])
        )
    length = np.linalg.norm(real, axis=1, keepdims=True)
    real, dual = real / length, dual / length
    if method == "dq":
        translation = (
            real[:, 3:] * dual[:, :3] - dual[:, 3:] * real[:, :3] + np.cross(real[:, :3], dual[:, :3])
        )
        return rotated(real, points) + 2.0 * translation
    if method == "cor":
        arms = points - centres
        return (
            linear + rotated(real, arms) - sum(weight * rotated(bone[:, 3], arms) for bone, weight in slots)
        )
    raise SystemExit(f"{method}: these shaders have lbs, dq and cor alone")


def spun(axis, angles, vectors):
    """What rotations about an axis add to vectors [n, 3]."""
    across = np.cross(axis, vectors)
    return np.sin(angles) * across + (1.0 - np.cos(angles)) * np.cross(axis, across)


def twist_spread(blended, linear_share, amounts, rest, joints, weights, bones):
    """The stage: points [vertices, 3]; linear_share and amounts [vertices, 1]."""
    weights, points = weights / weights.sum(axis=1, keepdims=True), blended.copy()
    numbers = bones[:, 6, 2]
    # Those that other bones carry first.
    for bone in np.argsort(-numbers)[: np.count_nonzero(numbers)]:
        rows, (head, curve_of, twist) = (
            bones[bone, :3].astype(np.float64),
            bones[bone, 4:7].astype(np.float64),
        )
        matrix, head, along = rows[:, :3], head[:3], curve_of[:3]
        weight = (weights * (joints == bone)).sum(axis=1, keepdims=True)
        share = np.clip((rest - head) @ along / (along @ along), 0.0, 1.0)[:, None]
        share += curve_of[3] * share * (1.0 - share)
        angles = amounts * (twist[0] + share * (twist[1] - twist[0]))
        axis = matrix @ along
        length = np.linalg.norm(axis) * (-1.0 if np.linalg.det(matrix) < 0.0 else 1.0)
        axis = axis / length if length else axis
        own = spun(along / np.linalg.norm(along), angles, rest - head) @ matrix.T
        angle = weight * angles + left_out(bone, amounts, joints, weights, bones)
        by = spun(axis, angle, points - (matrix @ head + rows[:, 3]))
        by += weight * (own - spun(axis, angles, (rest - head) @ matrix.T))
        points += linear_share * weight * own + (1.0 - linear_share) * by * bool(length)
    return points


def left_out(bone, amounts, joints, weights, bones):
    """What a blend the shorter way leaves out where bones are whole turns farther apart. In Blender it is
    also added to vertices that have bones on either side, but not the twisted one."""
    _number, first, end, turns = bones[bone, 7]
    numbers = bones[joints, 7, 0]
    beyond = (weights * ((numbers >= first) & (numbers < end))).sum(axis=1, keepdims=True)
    is_between = (beyond > 0.0) & (beyond < 1.0 - 1e-9) & (amounts * bones[bone, 6, 3] > 0.5)
    is_between &= (weights * (joints == bone)).any(axis=1, keepdims=True)
    return np.where(is_between, 4.0 * turns * np.arctan2(beyond, 1.0 - beyond), 0.0)


def to_segments(heads, along, points):
    """From points [n, 3] to the nearest of segments."""
    squares = (along * along).sum(axis=1)
    shares = np.divide(((points - heads) * along).sum(axis=1), squares, where=squares > 0, out=0.0 * squares)
    return heads + shares.clip(0.0, 1.0)[:, None] * along - points


def bulge_limit(points, form, amounts, rest, joints, weights, bones):
    """The stage after that: amounts [vertices, 1], with the strength."""
    weights, has_several = weights / weights.sum(axis=1, keepdims=True), (weights > 0.0).sum(axis=1) > 1
    if form == "kim_han":
        weights = np.eye(weights.shape[1])[weights.argmax(axis=1)]
    to_bones, at_rest, stretch = np.zeros_like(points), 0.0, 0.0
    for k in range(joints.shape[1]):
        own, weight = bones[joints[:, k]].astype(np.float64), weights[:, k, None]
        head, along = own[:, 4, :3], own[:, 5, :3]
        posed = np.einsum("nij,nj->ni", own[:, :3, :3], along)
        to_bones += weight * to_segments(by_bones(own, head), posed, points)
        at_rest = at_rest + weight[:, 0] * np.linalg.norm(to_segments(head, along, rest), axis=1)
        stretch = stretch + weight[:, 0] * own[:, 4, 3]
    allowed, now = 1.000001 * at_rest * stretch, np.linalg.norm(to_bones, axis=1)
    is_far = (now > allowed) & has_several
    back = np.where(is_far, 1.0 - allowed / np.where(is_far, now, 1.0), 0.0)[:, None]
    return points + amounts * back * to_bones


@dataclass
class Skinning:
    """
    mix           the second method, or the first again
    by_hierarchy  the methods whose signs are from the hierarchy
    share         of the second method, [vertices]
    twist, bulge  of the stages, [vertices]
    form          of Limit Bulge
    """

    method: str
    mix: str
    by_hierarchy: Collection[str] = ()
    share: np.ndarray | float = 0.0
    twist: np.ndarray | float = 0.0
    bulge: np.ndarray | float = 0.0
    form: str = "continuous"


def deformed(by, points, centres, joints, weights, bones):
    """Points [vertices, 3] by a Skinning."""
    first, second = (
        skinned(each, points, centres, joints, weights, bones, each in by.by_hierarchy)
        for each in (by.method, by.mix)
    )
    share, twist, bulge = (
        np.zeros((len(points), 1)) + np.reshape(a, (-1, 1)) for a in (by.share, by.twist, by.bulge)
    )
    moved, of_rest = first + share * (second - first), (points, joints, weights, bones)
    linear_share = (by.method == "lbs") * (1.0 - share) + (by.mix == "lbs") * share
    moved = twist_spread(moved, linear_share, twist, *of_rest)
    return bulge_limit(moved, by.form, bulge, *of_rest)
