# SPDX-License-Identifier: GPL-3.0-or-later
"""Skeletons: transforms relative to the root, interpolation and splines of whole hierarchies."""

import numpy as np
import pytest
import sinew
from motions import layout, rigid
from rigs import random_motion

PARENTS = np.int32([-1, 0, 1, 1, 0, -1, 5])


def random_bones(seed=0):
    rng = np.random.default_rng(seed)
    return np.array([random_motion(rng) for _ in PARENTS], np.float32)


def by_hand(bones):
    a = bones.astype(np.float64)
    return np.array(
        [a[0], a[0] @ a[1], a[0] @ a[1] @ a[2], a[0] @ a[1] @ a[3], a[0] @ a[4], a[5], a[5] @ a[6]]
    )


def test_root_relative_is_the_product_along_the_chain():
    bones = random_bones()
    result = sinew.Skeleton(PARENTS).root_relative(bones)
    assert result.dtype == np.float32
    np.testing.assert_allclose(result, by_hand(bones), atol=2e-6)


def test_root_relative_keeps_scale_and_shear():
    bones = random_bones(1)
    bones[:, :3, :3] *= np.float32([0.5, 2.0, -1.5])
    np.testing.assert_allclose(sinew.Skeleton(PARENTS).root_relative(bones), by_hand(bones), atol=2e-5)


def test_root_relative_leaves_its_input():
    bones = random_bones(2)
    before = bones.copy()
    sinew.Skeleton(PARENTS).root_relative(bones)
    np.testing.assert_array_equal(bones, before)


def test_root_relative_takes_three_rows_and_other_layouts():
    bones = random_bones(3)
    skeleton = sinew.Skeleton(PARENTS)
    expected = skeleton.root_relative(bones)
    np.testing.assert_array_equal(skeleton.root_relative(bones[:, :3]), expected)
    np.testing.assert_array_equal(skeleton.root_relative(np.asfortranarray(bones)), expected)
    np.testing.assert_array_equal(expected[:, 3], np.tile([0, 0, 0, 1], (len(PARENTS), 1)))


def test_long_chain_equals_repeated_product():
    parents = np.arange(-1, 99, dtype=np.int32)
    step = random_motion(np.random.default_rng(4))
    result = sinew.Skeleton(parents).root_relative(np.tile(step.astype(np.float32), (100, 1, 1)))
    np.testing.assert_allclose(result[-1], np.linalg.matrix_power(step, 100), atol=1e-3)


def test_empty_skeleton_works():
    skeleton = sinew.Skeleton(np.empty(0, np.int32))
    assert skeleton.bone_count == 0
    assert skeleton.root_relative(np.empty((0, 4, 4), np.float32)).shape == (0, 4, 4)


def test_bone_count():
    assert sinew.Skeleton(PARENTS).bone_count == 7
    assert sinew.Skeleton(PARENTS[::2][:1]).bone_count == 1


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


@pytest.mark.parametrize("name", ["affine", "quat_vec", "dual_quat"])
def test_root_and_branches(name):
    rng = np.random.default_rng(9)
    parents = [-1, 0, 1, 0, 3, 3, -1, 6]
    skeleton = sinew.Skeleton(parents)
    bones, root = layout(rigid(rng, 8), name), layout(rigid(rng), name)
    module = getattr(sinew, name)
    plain, placed = skeleton.root_relative(bones), skeleton.root_relative(bones, root)
    np.testing.assert_allclose(placed, module.compose(root, plain), atol=1e-13)
    for changed in range(8):
        other = bones.copy()
        other[changed] = layout(rigid(rng), name)
        want = skeleton.root_relative(other, root)
        np.testing.assert_array_equal(skeleton.update_branch(placed, other, changed, root), want)
    # Other bones are not changed, whether right or wrong.
    wrong = np.repeat(root[None], 8, axis=0)
    result = skeleton.update_branch(wrong, bones, 3, root)
    np.testing.assert_array_equal(result[[0, 1, 2, 6, 7]], wrong[[0, 1, 2, 6, 7]])
    assert (result[[3, 4, 5]] != wrong[[3, 4, 5]]).any(axis=tuple(range(1, result.ndim))).all()


@pytest.mark.parametrize("bone", [-1, 8, 1.5, None, "0"])
def test_branches_of_no_bone_are_refused(bone):
    skeleton = sinew.Skeleton([-1] * 8)
    bones = np.tile(np.eye(4), (8, 1, 1))
    with pytest.raises(ValueError, match="bone: expected the index of one of 8 bones"):
        skeleton.update_branch(bones, bones, bone)
