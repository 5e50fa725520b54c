# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects that numbers do not change the type of arrays, and that pickles give the same bits."""

import copy
import pickle

import numpy as np
import pytest
import sinew
from rigs import LINEAR, random_rig
from test_deformer import every_method

RIG = random_rig(70, vertices=60, scaled=True)


def test_numbers_change_no_type():
    axis = np.float32([0, 0, 1])
    for angle in (1, 0.5, np.float64(0.5), np.int64(1), True):
        assert sinew.affine.from_axis_angle(axis, angle).dtype == np.float32
        assert sinew.affine.from_axis_angle(axis.tolist(), angle).dtype == np.float64
    assert sinew.affine.from_axis_angle(axis, np.array(0.5)).dtype == np.float64
    assert sinew.affine.from_axis_angle(axis, [0.5, 1]).shape == (2, 4, 4)


# --- Pickles


def again(value):
    return pickle.loads(pickle.dumps(value))


@every_method
def test_pickles_give_the_same_bits(method):
    # Large and small sets, vertices without influences, weights of 0, and weights of any sum.
    rig = random_rig(71, vertices=500, most_influences=4, scaled=True)
    weights = rig.weights * np.float32(3.7)
    weights[::7] = 0
    bones = rig.bones % 3
    whole = {"cor": rig.vertex_data["cor"], "sdef": rig.vertex_data["sdef"]}
    for mesh in ((*rig.mesh[:2], bones, weights), (*rig.mesh[:3], weights)):
        for rest_bones, data in ((None, LINEAR), (rig.rest_bones, LINEAR | whole)):
            binding = sinew.Binding(*mesh, rest_bones, data)
            deformer = sinew.Deformer(binding, method)
            expected = deformer.deform(rig.transforms)
            for other in (again(deformer), copy.copy(deformer), sinew.Deformer(again(binding), method)):
                np.testing.assert_array_equal(other.deform(rig.transforms), expected)
                assert repr(other) == repr(deformer)
                assert other.bone_count == deformer.bone_count


def test_pickles_keep_the_rest_points_of_now_and_the_mix():
    binding = sinew.Binding(*RIG.mesh)
    shares = np.linspace(-0.5, 1.5, 60, dtype=np.float32)
    deformer = sinew.Deformer(binding, "lbs", mix=("log", shares))
    deformer.set_rest_points(RIG.rest_points + np.float32(1))
    other = again(deformer)
    assert other.mixed_method == "log"
    np.testing.assert_array_equal(other.deform(RIG.transforms), deformer.deform(RIG.transforms))
    np.testing.assert_array_equal(
        sinew.Deformer(again(binding)).deform(RIG.transforms), sinew.Deformer(binding).deform(RIG.transforms)
    )


def test_pickles_keep_bones_that_are_named_without_weight():
    binding = sinew.Binding([[0, 0, 0], [1, 0, 0]], [0, 2, 2], [0, 9], [1, 0])
    other = again(binding)
    assert (
        (other.bone_count, other.influence_count) == (binding.bone_count, binding.influence_count) == (10, 1)
    )
    nothing = again(sinew.Binding(np.zeros((0, 3)), [0], [], []))
    assert (nothing.vertex_count, nothing.bone_count) == (0, 0)


@pytest.mark.parametrize(
    ("of", "state", "message"),
    [
        (sinew.Binding, None, "state: expected a tuple of 6, as pickling makes it, got NoneType"),
        (sinew.Binding, (1, 2), "state: expected a tuple of 6, as pickling makes it, got a tuple of 2"),
        (sinew.Binding, (None,) * 6, r"rest_points: expected float32 \[n, 3\], got NoneType"),
        (
            sinew.Binding,
            ([[0, 0, 0]], [0, 1], [0], [2.0], None, None),
            "influence_weights: expected normalised ones",
        ),
        (sinew.Deformer, ((), "lbs", None), "state: expected a tuple of 6"),
        (sinew.Deformer, (([[0, 0, 0]], [0, 0], [], [], None, None), "l", None), "method: expected one of"),
    ],
)
def test_states_of_other_things_are_refused(of, state, message):
    with pytest.raises(ValueError, match=message):
        of.__new__(of).__setstate__(state)
