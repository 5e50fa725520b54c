# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects spherical deform: compared with its formula in float64, and parameters of methods, since it has
one."""

import numpy as np
import pytest
import sinew
from rigs import NO_TIE, TOLERANCE, random_rig

SLERP = {"sdef.interpolation": "slerp"}


def pairs(seed, **options):
    """Most vertices have two bones."""
    rig = random_rig(seed, vertices=600, bones=6, most_influences=3, **options)
    assert (np.diff(rig.offsets) == 2).sum() > 150
    return rig


@pytest.mark.parametrize("interpolation", ["nlerp", "slerp"])
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
def test_each_interpolation_agrees_with_its_formula(interpolation, scaled):
    rig = pairs(1, scaled=scaled)
    parameters = {"sdef.interpolation": interpolation}
    points = rig.deform("sdef", parameters=parameters)
    expected, margins = rig.reference("sdef", parameters)
    sure = margins > NO_TIE
    assert sure.mean() > 0.95
    assert np.linalg.norm(points - expected, axis=1)[sure].max() < 4 * TOLERANCE


def test_nlerp_is_the_default_and_slerp_another_shape():
    rig = pairs(2)
    nlerp = rig.deform("sdef")
    np.testing.assert_array_equal(rig.deform("sdef", parameters={}), nlerp)
    np.testing.assert_array_equal(rig.deform("sdef", parameters={"sdef.interpolation": "nlerp"}), nlerp)
    assert np.abs(rig.deform("sdef", parameters=SLERP) - nlerp).max() > 0.01


def test_the_mixed_method_has_its_parameters_and_other_methods_none():
    rig = pairs(4)
    slerp = rig.deform("sdef", parameters=SLERP)
    mixed = sinew.Deformer(rig.binding(), "dq", mix=("sdef", np.ones(len(rig.rest_points))))
    np.testing.assert_array_equal(mixed.deform(rig.transforms, parameters=SLERP), slerp)
    assert np.abs(mixed.deform(rig.transforms) - slerp).max() > 0.01
    np.testing.assert_array_equal(rig.deform("dq", parameters=SLERP), rig.deform("dq"))


@pytest.mark.parametrize("parameters", [{}, SLERP], ids=["nlerp", "slerp"])
def test_half_turns_and_opposite_quaternions_are_finite_and_near(parameters):
    rig = pairs(7)
    motions = np.tile(np.eye(4, dtype=np.float32), (6, 1, 1))
    motions[1] = np.diag([1, -1, -1, 1])
    motions[2] = np.diag([-1, -1, 1, 1])
    motions[3, :3, :3] = rig.transforms[3, :3, :3]
    motions[4, :3, :3] = rig.transforms[3, :3, :3] @ motions[1, :3, :3]
    points = rig.with_(transforms=motions).deform("sdef", parameters=parameters)
    assert np.isfinite(points).all()
    # Rotations about points in the cube of size 2, which itself rotates about its middle.
    assert np.linalg.norm(points, axis=1).max() < 4 * np.sqrt(3)
