# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses between keyed poses: `sinew.interpolate` and `sinew.spline` for bones that also have a scale.

Each bone is interpolated relative to its parent: interpolated relative to the root, bones would separate from
their parents' tails (Smith 2013, figure 3.3). The method gives the rigid part; the scale is the mean of the
keyed scales, with the same weights.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import sinew
from sinew import affine, interpolate, quat_vec, spline

from ...base.options import option
from ...io.poses import Poses

# Between two keys, or on a spline through four.
STRAIGHT, SPLINE = "straight", "spline"

# The range of progress() beyond its keys. Easing of type Elastic overshoots by a fixed amount, however close
# the keys: without a limit, keys that differ by a rounding error would overshoot without bound.
PROGRESS_RANGE = (-10.0, 11.0)


class Method(NamedTuple):
    """A way of interpolating, named as in sinew.interpolate.METHODS."""

    name: str
    label: str
    description: str
    number: int


# In the order of menus, the recommended method first. The numbers are stored in files.
METHODS = {
    method.name: method
    for method in (
        Method(
            "qv_slerp",
            "Straight rotation, even pace (recommended)",
            "The shortest rotation at an even pace, rigid; location goes straight. QV with slerp",
            5,
        ),
        Method(
            "qv_nlerp",
            "Straight rotation, smooth on splines",
            "The shortest rotation at a slightly uneven pace, rigid; location goes straight. QV with nlerp",
            4,
        ),
        Method(
            "sclerp",
            "Screw, even pace",
            "The screw from key to key: a bone that rotates and moves swings along an arc. ScLERP of dual "
            "quaternions",
            7,
        ),
        Method(
            "dlb",
            "Nearly a screw, smooth on splines",
            "Dual quaternions blended linearly, at a slightly uneven pace. DLB",
            6,
        ),
        Method(
            "dib",
            "Screw, smooth on splines",
            "The screw between two keys; on a spline, all keys blended iteratively. DIB of dual quaternions",
            8,
        ),
        Method(
            "matrix_polar",
            "Straight matrix, made rigid",
            "Matrices component by component, brought back to the nearest rotation. Polar decomposition",
            2,
        ),
        Method(
            "matrix_log",
            "Log-matrix, rigid",
            "Logarithms of matrices: dependent on the rest pose. Log-matrix blending",
            3,
        ),
        Method(
            "matrix_linear",
            "Straight matrix, not rigid",
            "Matrices component by component: bones grow thin between keys rotated far from each other",
            1,
        ),
    )
}


# Warnings for bones whose in-betweens the method does not define uniquely.
TOO_FAR = {
    STRAIGHT: "rotates by 180 degrees or more from key to key, and takes the shorter way: key in between",
    SPLINE: "rotates too far for this spline, and may jump: key in between, or choose one that is smooth on "
    "splines",
}


@dataclass(frozen=True)
class InbetweenOptions:
    """step: from one baked key to the next"""

    method: interpolate.Method = option(
        "qv_slerp",
        "Method",
        "How the bones move between the keyed poses of the action",
        choices=[(m.name, m.label, m.description, m.number) for m in METHODS.values()],
    )
    path: str = option(
        STRAIGHT,
        "Path",
        "Which keyed poses shape the way from one to the next",
        choices=(
            (STRAIGHT, "Key to Key", "The two neighbours, at the pace of the keys' own interpolation"),
            (SPLINE, "Spline", "Catmull-Rom through four keyed poses: smooth at keys, at the spline's pace"),
        ),
    )
    step: int = option(1, "Step", "Frames from one baked key to the next", least=1, soft_most=12)


class Inbetweens(NamedTuple):
    """The poses, and whether the method defines each one; sinew.interpolate documents the undefined
    results."""

    poses: Poses
    is_defined: np.ndarray


def straight(a: Poses, b: Poses, progress: np.ndarray, method: interpolate.Method) -> Inbetweens:
    """Each bone between `a` and `b`, [bones], at `progress` [bones]: 0 is a, 1 is b."""
    between = interpolate.between(
        in_layout_of(method, a.rigid), in_layout_of(method, b.rigid), progress, method
    )
    return inbetweens(between, a.scale + progress[:, None] * (b.scale - a.scale), method)


def on_spline(keys: Poses, times: np.ndarray, at: float, method: interpolate.Method) -> Inbetweens:
    """Each bone on the Catmull-Rom spline through its keys, blend form.

    keys   [4, bones]: two before `at` and two after; at an end of the keys one of them twice
    times  [4]
    """
    layout = np.ascontiguousarray(np.swapaxes(in_layout_of(method, keys.rigid), 0, 1))
    values = [spline.catmull_rom(bone, times, at, method) for bone in layout]
    blended = interpolate.Blended(
        np.array([value.transforms for value in values]), np.array([value.is_defined for value in values])
    )
    # The translation of a blended pair is the mean of the keys' translations, so the scales are passed as
    # translations.
    translations = np.zeros_like(keys.rigid) + quat_vec.identity()
    translations[..., 4:] = keys.scale
    scale = [
        spline.catmull_rom(np.ascontiguousarray(bone), times, at, "qv_nlerp").transforms[4:]
        for bone in np.swapaxes(translations, 0, 1)
    ]
    return inbetweens(blended, np.array(scale).reshape(-1, 3), method)


def progress(now: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """[bones]: how far each bone is from `a` to `b` at `now`, 0 to 1; overshooting is limited to
    PROGRESS_RANGE.

    now, a, b  [bones, channels], values of Blender's curves at this time and at the keys; channels without
               keys are equal

    It is the mean over the channels, each weighted with its change, so that a bone keeps the easing of its
    keys. 0 where a and b are equal.
    """
    change = b - a
    total = np.abs(change).sum(axis=1)
    covered = (np.sign(change) * (now - a)).sum(axis=1)
    # Smaller changes are rounding errors of equal keys in float32.
    moves = total > 1e-6
    return np.clip(np.divide(covered, total, out=np.zeros_like(total), where=moves), *PROGRESS_RANGE)


def in_layout_of(method: str, rigid: np.ndarray) -> np.ndarray:
    """Converts rigid transforms to the layout that a method of sinew.interpolate takes."""
    if method.startswith("matrix_"):
        return quat_vec.to_affine(rigid)
    return rigid if method.startswith("qv_") else quat_vec.to_dual_quat(rigid)


def rigid_of(method: str, transforms: np.ndarray) -> np.ndarray:
    """The inverse of in_layout_of(); for a matrix that is not rigid, the nearest rotation."""
    if method == "matrix_linear":
        transforms = affine.normalized(transforms)
    if method.startswith("matrix_"):
        return affine.to_quat_vec(transforms)
    return transforms if method.startswith("qv_") else sinew.dual_quat.to_quat_vec(transforms)


def inbetweens(blended: interpolate.Blended, scale: np.ndarray, method: str) -> Inbetweens:
    """The poses of blended transforms. Of a matrix that is not rigid, a bone can take the lengths of its axes
    as scale, and no shear."""
    transforms = blended.transforms
    if method == "matrix_linear":
        scale = scale * np.linalg.norm(transforms[..., :3, :3], axis=-2)
    return Inbetweens(Poses(rigid_of(method, transforms), scale), np.asarray(blended.is_defined))
