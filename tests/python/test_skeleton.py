# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects layouts of skeletons and empty ones. exact_interpolation.py has the oracles."""

import numpy as np
import sinew
from rigs import random_motion

PARENTS = np.int32([-1, 0, 1, 1, 0, -1, 5])


def random_bones(seed=0):
    rng = np.random.default_rng(seed)
    return np.array([random_motion(rng) for _ in PARENTS], np.float32)


def test_root_relative_takes_three_rows_and_other_layouts():
    bones = random_bones(3)
    skeleton = sinew.Skeleton(PARENTS)
    expected = skeleton.root_relative(bones)
    np.testing.assert_array_equal(skeleton.root_relative(bones[:, :3]), expected)
    np.testing.assert_array_equal(skeleton.root_relative(np.asfortranarray(bones)), expected)
    np.testing.assert_array_equal(expected[:, 3], np.tile([0, 0, 0, 1], (len(PARENTS), 1)))


def test_empty_skeleton_works():
    skeleton = sinew.Skeleton(np.empty(0, np.int32))
    assert skeleton.bone_count == 0
    assert skeleton.root_relative(np.empty((0, 4, 4), np.float32)).shape == (0, 4, 4)
