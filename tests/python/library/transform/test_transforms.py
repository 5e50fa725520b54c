# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects transforms of any size and of none, exponentials of any angle, degenerate scales, and what is
refused as no rigid motion. exact_transforms.py has the oracles."""

import numpy as np
import pytest
import sinew
from motions import close, layout, rigid
from scipy.spatial.transform import Rotation
from sinew import quat

EPSILON = {np.float32: 1e-6, np.float64: 1e-14}


@pytest.mark.parametrize("size", [1e-300, 1e-30, 1.0, 1e20, 1e200])
def test_lengths_of_any_size(size):
    q = Rotation.random(rng=np.random.default_rng(2)).as_quat(scalar_first=True)
    pair, pose = np.append(q, [1, 2, 3]), sinew.quat_vec.to_dual_quat(np.append(q, [1, 2, 3]))
    types = [np.float64] + [np.float32] * (1e-35 < size < 1e35)
    for dtype in types:
        scaled, small = (size * q).astype(dtype), EPSILON[dtype]
        close(quat.normalized(scaled), q, small)
        np.testing.assert_allclose(quat.norm(scaled), size, rtol=small)
        close(sinew.quat_vec.normalized(np.append(scaled, [1, 2, 3]).astype(dtype)), pair, small)
        close(sinew.dual_quat.normalized((size * pose).astype(dtype)), pose, 4 * small)
        np.testing.assert_allclose(sinew.dual_quat.norm((size * pose).astype(dtype))[0], size, rtol=small)
    assert (quat.normalized(np.zeros(4)) == [1, 0, 0, 0]).all()


@pytest.mark.parametrize(("dtype", "angle"), [(np.float32, 1e15), (np.float64, 1e150)])
def test_exponentials_of_any_angle_are_finite(dtype, angle):
    twist = np.array([0, angle, 0, 1, 2, 3], dtype)
    for module in (sinew.affine, sinew.quat_vec, sinew.dual_quat):
        assert np.isfinite(module.from_twist(twist)).all()
    # Equal along the axis, and nearly equal across it.
    close(sinew.quat_vec.from_twist(twist)[4:], [0, 2, 0], 1e-6)
    # The formula for large angles continues where the other one ends.
    below, above = (sinew.quat_vec.from_twist([0, a, 0, 1, 2, 3.0]) for a in (1e4, np.nextafter(1e4, 2e4)))
    close(below, above, 1e-11)


def test_matrices_that_are_not_rigid_are_refused():
    mirror = np.diag([-1.0, 1, 1, 1])
    shear = np.eye(4)
    shear[0, 1] = 0.1
    for a in (mirror, shear, 2 * np.eye(4)):
        for name in ("to_quat_vec", "to_dual_quat", "to_screw", "to_twist"):
            with pytest.raises(ValueError, match=r"^a: expected rigid"):
                getattr(sinew.affine, name)(a)
        with pytest.raises(ValueError, match=r"^b: expected rigid"):
            sinew.affine.rigid_distance(np.eye(4), a)
        for module in (sinew.quat, sinew.quat_vec, sinew.dual_quat):
            with pytest.raises(ValueError, match=r"^rotation: expected rigid"):
                module.from_rotation_matrix(a[:3, :3])
    # Rounding by float32 and by some products is accepted.
    turned = sinew.affine.from_axis_angle([1, 2, 3], 1.0).astype(np.float32)
    turned[0] *= np.float32(1.0002)
    sinew.affine.to_quat_vec(turned)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_has_no_length_is_the_identity(dtype):
    for module in (sinew.affine, sinew.quat_vec, sinew.dual_quat):
        still = module.from_screw(np.zeros(3, dtype), np.array([1, 2, 3], dtype), dtype(1), dtype(2))
        np.testing.assert_array_equal(still, module.identity(dtype))
        np.testing.assert_array_equal(module.normalized(0 * still), still)
    assert not sinew.dual_quat.norm(np.array([0, 0, 0, 0, 1, 2, 3, 4], dtype)).any()
    screw = sinew.dual_quat.to_screw(sinew.dual_quat.identity(dtype))
    np.testing.assert_array_equal(screw.axis, [0, 0, 1])
    assert (screw.angle, screw.translation, screw.pitch) == (0, 0, 0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_translations_come_back_to_the_bit(dtype):
    far = np.array([0.1, -2e6, 3e-6], dtype)
    for module in (sinew.affine, sinew.dual_quat):
        np.testing.assert_array_equal(module.to_quat_vec(module.from_translation(far))[4:], far)


# --- Scale and rotation of a bone's motion, by Blender's rules

TILTED = layout(rigid(np.random.default_rng(8)), "affine")
MOTION = layout(rigid(np.random.default_rng(9)), "affine")


def scaling(*factors):
    return np.diag([*factors, 1.0])


def linear(*columns):
    result = np.eye(4)
    result[:3, :3] = np.column_stack(columns)
    return result


def along(bone, scale):
    """The motion of a bone that is scaled along its own axes."""
    return bone @ scale @ np.linalg.inv(bone)


def good_split(motion, bone):
    split = sinew.affine.split_scale(motion, bone)
    assert np.isfinite(split.rigid).all()
    assert np.isfinite(split.scale).all()
    rotation = split.rigid[:3, :3]
    close(rotation.T @ rotation, np.eye(3), 1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    close(split.rigid @ split.scale, motion, 1e-12)
    return split


SHEAR = linear([1.0, 0.4, -0.2], [0, 1, 0], [0, 0, 1])
SCALES = {
    "uniform": scaling(2, 2, 2),
    "tiny": scaling(1e-4, 1e-4, 1e-4),
    "mirror x": scaling(-1, 1, 1),
    "mirror y": scaling(1, -1, 1),
    "mirror all": scaling(-2, -1, -3),
    "180 degrees by signs": scaling(-1, 1, -1),
    "sheared": SHEAR,
    "mirrored shear": SHEAR @ scaling(1, 1, -2),
    # Both other axes lean towards Y and are long: Blender's rule then uses only Y.
    "leaning": linear([5, 4, 4], [1, 1, 1], [5, 5, 6]),
    "x leaning on y": linear([1, 4, 0], [0, 1, 0], [0, 0, 1]),
    "x and z leaning on y": linear([1, 4, 0], [0, 1, 0], [0, 4, 1]),
    "a line": np.outer([0.3, -0.5, 0.8, 0], [0.9, -0.4, 0.2, 0]) + scaling(0, 0, 0),
    "a plane": linear([1, 0, 0], [0, 1, 0], [0.3, 0.6, 0]),
}


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
@pytest.mark.parametrize("bone", [np.eye(4), TILTED], ids=["unturned", "tilted"])
def test_parts_of_a_motion_multiply_to_the_whole(bone, scale):
    for motion in (np.eye(4), MOTION):
        split = good_split(motion @ along(bone, scale), bone)
        # The direction of Y is kept.
        posed = (motion @ bone @ scale)[:3, 1]
        close((split.rigid @ bone)[:3, 1], posed / np.linalg.norm(posed), 1e-12)


def test_scale_along_the_axes_is_found_again_and_rigid_motions_keep_their_bits():
    scale = along(TILTED, scaling(0.5, 3.0, 0.8))
    split = sinew.affine.split_scale(MOTION @ scale, TILTED)
    assert split.has_scale
    close(split.rigid, MOTION, 1e-14)
    close(split.scale, scale, 1e-14)
    split = sinew.affine.split_scale(MOTION, TILTED)
    np.testing.assert_array_equal(split.rigid, MOTION)
    np.testing.assert_array_equal(split.scale, np.eye(4))
    for stretch, has_scale in ((1.001, True), (1.000001, False)):
        assert sinew.affine.split_scale(along(TILTED, scaling(stretch, 1, 1)), TILTED).has_scale == has_scale


# For bones along the model's axes, one wrong choice of a perpendicular axis is parallel to Y.
@pytest.mark.parametrize("axis", [(0, 0, 0), (90, 0, 0), (0, 0, -90), (40, 50, 60)])
@pytest.mark.parametrize("zeros", range(1, 8))
def test_axes_without_length_give_a_rotation(axis, zeros):
    bone = np.eye(4)
    bone[:3, :3] = Rotation.from_euler("xyz", axis, degrees=True).as_matrix()
    scale = scaling(*(0.0 if zeros >> k & 1 else 1.5 for k in range(3)))
    good_split(MOTION @ along(bone, scale), bone)
    split = good_split(along(bone, scale), bone)
    if zeros == 7:
        close((split.rigid @ bone)[:3, :3], np.eye(3), 1e-14)
    for size in (1e-30, 1e-12, 1e-4, 1e4, -1.0):
        small = scaling(*(size if zeros >> k & 1 else 1.0 for k in range(3))).astype(np.float32)
        found = sinew.affine.split_scale(along(bone, small).astype(np.float32), bone.astype(np.float32))
        assert np.isfinite([found.rigid, found.scale]).all()
