# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects splines at their ends and cuts, and skeletons without bones.
exact_interpolation.py has the oracles."""

import numpy as np
import pytest
from motions import LAYOUT_OF, close, layout, matrix, rigid
from scipy.spatial.transform import RigidTransform, Rotation
from sinew.interpolate import METHODS, between
from sinew.spline import catmull_rom

TIMES = np.array([0.0, 1.0, 1.5, 4.0, 5.0])
AT = np.linspace(-0.5, 5.5, 61)
ALL = pytest.mark.parametrize("method", METHODS)


@ALL
def test_one_key_and_two(method):
    name = LAYOUT_OF[method]
    keys = layout(rigid(np.random.default_rng(4), 2), name)
    single = catmull_rom(keys[:1], TIMES[:1], AT, method)
    close(matrix(single.transforms, name), np.tile(matrix(keys[0], name), (len(AT), 1, 1)))
    # Between two keys the tangents have the direction of the straight line.
    t = np.array([0.25, 0.5, 0.75])
    double = catmull_rom(keys, TIMES[:2], t, method)
    straight = between(keys[0], keys[1], t, method)
    close(matrix(double.transforms, name), matrix(straight.transforms, name), 1e-12)


@pytest.mark.parametrize("method", ["qv_nlerp", "dlb"])
def test_signs_along_a_spline_go_from_key_to_key(method):
    """Keys that are two steps apart differ by more than 180 degrees. If signs followed the heaviest key, they
    would change in the middle of an interval."""
    name, steps = LAYOUT_OF[method], np.arange(5.0)
    turns = Rotation.from_rotvec(100.0 * steps[:, None] * np.ones(3) / np.sqrt(3), degrees=True)
    motions = RigidTransform.from_components(steps[:, None] * [1.0, 0, 0], turns)
    path = matrix(catmull_rom(layout(motions, name), TIMES, np.arange(0, 5, 0.001), method).transforms, name)
    assert np.abs(np.diff(path, axis=0)).max() < 0.05
    # As each step is equal, the middle of the middle one is known.
    middle = catmull_rom(layout(motions[:4], name), steps[:4], 1.5, method).transforms
    close(matrix(middle, name)[:3, :3], Rotation.from_rotvec(turns[1].as_rotvec() * 1.5).as_matrix())
