# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the arguments of skeletons. exact_interpolation.py has the oracles."""

import numpy as np
import pytest
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


@pytest.mark.parametrize(
    ("parents", "message"),
    [
        (np.int32([0]), "parents: expected -1 or the index of an earlier bone, got 0 for bone 0"),
        (np.int32([-1, 2, 0]), "parents: expected -1 or the index of an earlier bone, got 2 for bone 1"),
        (np.int32([-1, -2]), "parents: expected -1 or the index of an earlier bone, got -2 for bone 1"),
        (np.float32([-1]), "parents: expected int32 [bones], got float32 [1]"),
        (np.int32([[-1]]), "parents: expected int32 [bones], got int32 [1, 1]"),
        ([-1, None], "parents: expected int32 [bones], got list"),
        (None, "parents: expected int32 [bones], got NoneType"),
    ],
)
def test_parents_are_checked(parents, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared below
        sinew.Skeleton(parents)
    assert str(caught.value) == message


LAYOUTS = "float32 or float64 [bones, 4, 4], [bones, 3, 4], [bones, 7] or [bones, 8]"


def with_nan():
    bones = random_bones()
    bones[2, 1, 3] = np.nan
    return bones


@pytest.mark.parametrize(
    ("transforms", "message"),
    [
        (random_bones()[:6], "transforms: expected 7 bones, got 6"),
        (random_bones().astype(complex), f"transforms: expected {LAYOUTS}, got complex128 [7, 4, 4]"),
        (random_bones()[0], "transforms: expected one axis of bones, got float32 [4, 4]"),
        (random_bones()[:, :, :3], f"transforms: expected {LAYOUTS}, got float32 [7, 4, 3]"),
        (
            random_bones()[:, :2],
            "transforms: expected float32 [.., 4, 4] or [.., 3, 4], got float32 [7, 2, 4]",
        ),
        ([*random_bones().tolist(), [1]], f"transforms: expected {LAYOUTS}, got list"),
        (with_nan(), "transforms: expected finite values, got NaN or infinity at index 2"),
    ],
)
def test_transforms_are_checked(transforms, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared below
        sinew.Skeleton(PARENTS).root_relative(transforms)
    assert str(caught.value) == message


@pytest.mark.parametrize("bone", [-1, 8, 1.5, None, "0"])
def test_branches_of_no_bone_are_refused(bone):
    skeleton = sinew.Skeleton([-1] * 8)
    bones = np.tile(np.eye(4), (8, 1, 1))
    with pytest.raises(ValueError, match="bone: expected the index of one of 8 bones"):
        skeleton.update_branch(bones, bones, bone)
