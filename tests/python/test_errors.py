# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects errors: each names the argument, what was expected and what was given."""

import numpy as np
import pytest
import sinew

NAN, INF = np.float32("nan"), np.float32("inf")


def good():
    """Valid arguments, two vertices on two bones, of which each case below spoils one."""
    return {
        "rest_points": np.float32([[0, 0, 0], [1, 1, 1]]),
        "influence_offsets": np.int32([0, 1, 3]),
        "influence_bones": np.int32([0, 0, 1]),
        "influence_weights": np.float32([1, 0.5, 0.5]),
        "method": "dq",
        "rest_bones": np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)),
    }


def bones(count=2):
    return np.tile(np.eye(4, dtype=np.float32), (count, 1, 1))


def spoilt(array, index, value):
    array = array.copy()
    array[index] = value
    return array


def refusal(call, *args, **kwargs):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - callers compare the whole message
        call(*args, **kwargs)
    return str(caught.value)


def test_what_the_cases_spoil_is_accepted():
    sinew.Deformer(**good()).deform(bones())


POINTS, OFFSETS = "float32 [n, 3]", "int32 [vertices + 1]"
BONES, WEIGHTS = "int32 [influences]", "float32 [influences]"
AFFINES = "float32 [n, 4, 4] or [n, 3, 4]"
FINITE_WEIGHTS = "finite values, 0 or more"
METHOD = "one of " + ", ".join(method.name for method in sinew.methods())

CONSTRUCTOR = [
    ("rest_points", good()["rest_points"].astype(np.complex64), POINTS, "complex64 [2, 3]"),
    # Windows and Apple's processors have it as wide as float64, which is taken.
    *(
        [
            (
                "rest_points",
                good()["rest_points"].astype(np.longdouble),
                POINTS,
                f"{np.dtype(np.longdouble)} [2, 3]",
            )
        ]
        if np.dtype(np.longdouble).itemsize > 8
        else []
    ),
    ("rest_points", np.full((2, 3), 1e300), "numbers that float32 holds", "1e+300"),
    ("rest_points", np.ma.masked_all((2, 3)), "an array without masked values", "one with them"),
    ("rest_points", np.zeros((2, 4), np.float32), POINTS, "float32 [2, 4]"),
    ("rest_points", np.zeros(6, np.float32), POINTS, "float32 [6]"),
    ("rest_points", np.zeros((1, 2, 3), np.float32), POINTS, "float32 [1, 2, 3]"),
    ("rest_points", [[0, 0], [1, 1]], "float32 [n, 3]", f"list of {np.dtype(int)} [2, 2]"),
    ("rest_points", [[0, 0, 0], [1, 1]], POINTS, "list"),
    ("rest_points", [["a", "b", "c"]], POINTS, "list"),
    ("rest_points", np.zeros((2, 3), object), POINTS, "object [2, 3]"),
    ("rest_points", None, POINTS, "NoneType"),
    (
        "rest_points",
        spoilt(good()["rest_points"], (1, 2), NAN),
        "finite values",
        "NaN or infinity at vertex 1",
    ),
    (
        "rest_points",
        spoilt(good()["rest_points"], (0, 0), -INF),
        "finite values",
        "NaN or infinity at vertex 0",
    ),
    ("influence_offsets", np.float32([0, 1, 3]), OFFSETS, "float32 [3]"),
    ("influence_offsets", np.int32([[0, 1, 3]]), OFFSETS, "int32 [1, 3]"),
    ("influence_offsets", [0, 1.0, 3], OFFSETS, "float64 [3]"),
    ("influence_offsets", np.int64([0, 1, 2**31]), "numbers that int32 holds", "2147483648"),
    ("influence_offsets", np.int32([0, 3]), "3 values (vertices + 1)", "2"),
    ("influence_offsets", np.int32([]), "3 values (vertices + 1)", "0"),
    ("influence_offsets", np.int32([1, 1, 3]), "0 at the start", "1"),
    ("influence_offsets", np.int32([-1, 1, 3]), "0 at the start", "-1"),
    ("influence_offsets", np.int32([0, 4, 3]), "values that never fall", "3 after 4 at vertex 1"),
    ("influence_offsets", np.int32([0, -1, 3]), "values that never fall", "-1 after 0 at vertex 0"),
    ("influence_offsets", np.int32([0, 1, 2]), "3 at the end (the number of influences)", "2"),
    ("influence_offsets", np.int32([0, 1, 4]), "3 at the end (the number of influences)", "4"),
    ("influence_bones", np.int64([0, 0, -(2**31) - 1]), "numbers that int32 holds", "-2147483649"),
    ("influence_bones", np.uint64([0, 0, 2**64 - 1]), "numbers that int32 holds", "18446744073709551615"),
    ("influence_bones", np.int32([[0, 0, 1]]), BONES, "int32 [1, 3]"),
    ("influence_bones", [0, 0, 2**70], BONES, "list"),
    ("influence_bones", np.int32([0, -1, 1]), "indices of bones, 0 or more", "-1 at influence 1"),
    ("influence_weights", np.float32([[1, 0.5, 0.5]]), WEIGHTS, "float32 [1, 3]"),
    ("influence_weights", {1, 0.5}, WEIGHTS, "set"),
    ("influence_weights", np.float32([1, 1]), "one for each of the 3 influence_bones", "2"),
    ("influence_weights", np.float32([1, -0.5, 1]), FINITE_WEIGHTS, "-0.500000 at influence 1"),
    ("influence_weights", np.float32([NAN, 1, 1]), FINITE_WEIGHTS, "nan at influence 0"),
    ("influence_weights", np.float32([1, 1, INF]), FINITE_WEIGHTS, "inf at influence 2"),
    ("method", "DQ", METHOD, "'DQ'"),
    ("method", "", METHOD, "''"),
    ("rest_bones", bones()[0], AFFINES, "float32 [4, 4]"),
    ("rest_bones", bones()[:, :, :3], AFFINES, "float32 [2, 4, 3]"),
    ("rest_bones", bones()[:, :2], AFFINES, "float32 [2, 2, 4]"),
    ("rest_bones", spoilt(bones(), (1, 0, 3), NAN), "finite values", "NaN or infinity at index 1"),
    ("rest_bones", bones(1), "at least 2 bones", "1"),
]


@pytest.mark.parametrize(("argument", "value", "wanted", "got"), CONSTRUCTOR)
def test_constructor_refuses(argument, value, wanted, got):
    message = refusal(sinew.Deformer, **{**good(), argument: value})
    assert message == f"{argument}: expected {wanted}, got {got}"


def binding():
    return sinew.Binding(**{name: value for name, value in good().items() if name != "method"})


@pytest.mark.parametrize(("argument", "value", "wanted", "got"), [c for c in CONSTRUCTOR if c[0] != "method"])
def test_binding_refuses(argument, value, wanted, got):
    arguments = {**good(), argument: value}
    del arguments["method"]
    assert refusal(sinew.Binding, **arguments) == f"{argument}: expected {wanted}, got {got}"


HALF = np.float32([0.5, 0.5])
MIX, MIX_WEIGHTS = "None or (method, weights)", "weights float32 [vertices]"


@pytest.mark.parametrize(
    ("mix", "wanted", "got"),
    [
        ("dq", MIX, "str"),
        (("dq",), MIX, "a tuple of 1"),
        (("dq", HALF, HALF), MIX, "a tuple of 3"),
        (("DQ", HALF), METHOD, "'DQ'"),
        (["dq"], MIX, "a list of 1"),
        (("dq", "half"), MIX_WEIGHTS, "str"),
        (("dq", HALF.astype(complex)), MIX_WEIGHTS, "complex128 [2]"),
        (("dq", HALF[None]), MIX_WEIGHTS, "float32 [1, 2]"),
        (("dq", HALF[:1]), "a weight for each of the 2 vertices", "1"),
        (("dq", np.float32([0, NAN])), "weights from 0 to 1", "NaN at vertex 1"),
    ],
)
def test_mix_refuses(mix, wanted, got):
    assert refusal(sinew.Deformer, binding(), "lbs", mix=mix) == f"mix: expected {wanted}, got {got}"


def test_deformers_of_nothing_are_refused():
    with pytest.raises(TypeError):
        sinew.Deformer()
    with pytest.raises(TypeError, match="mix"):
        sinew.Deformer(binding(), "lbs", mix=(3, HALF))


def test_method_that_is_no_text_is_a_type_error():
    with pytest.raises(TypeError, match="method"):
        sinew.Deformer(**{**good(), "method": 3})


@pytest.mark.parametrize(
    ("value", "wanted", "got"),
    [
        (np.zeros((3, 3), np.float32), "2 points", "3"),
        (np.zeros((2, 2), np.float32), POINTS, "float32 [2, 2]"),
        ([[0, 0, 0], [1, 1]], POINTS, "list"),
        (np.float32([[0, 0, 0], [0, INF, 0]]), "finite values", "NaN or infinity at vertex 1"),
    ],
)
def test_set_rest_points_refuses_and_keeps_the_old(value, wanted, got):
    deformer = sinew.Deformer(**good())
    assert refusal(deformer.set_rest_points, value) == f"rest_points: expected {wanted}, got {got}"
    np.testing.assert_array_equal(deformer.deform(bones()), good()["rest_points"])


def read_only():
    array = np.zeros((2, 3), np.float32)
    array.setflags(write=False)
    return array


OUT = "writable C-contiguous float32 [2, 3]"
INVERSES = "float64 [2, 4, 4], one for each of bone_transforms"
AFFINE = "float32 [4, 4] or [3, 4]"
THREADS = "None or an integer, 0 or more"

DEFORM = [
    ("bone_transforms", bones(1), "at least 2 bones", "1"),
    ("bone_transforms", bones(0), "at least 2 bones", "0"),
    ("bone_transforms", bones()[0], AFFINES, "float32 [4, 4]"),
    ("bone_transforms", bones().reshape(2, 16), AFFINES, "float32 [2, 16]"),
    ("bone_transforms", bones().reshape(2, 2, 8), AFFINES, "float32 [2, 2, 8]"),
    ("bone_transforms", bones().tolist()[0], AFFINES, "list of float64 [4, 4]"),
    ("bone_transforms", None, AFFINES, "NoneType"),
    ("bone_transforms", spoilt(bones(), (1, 2, 3), NAN), "finite values", "NaN or infinity at index 1"),
    ("bone_transforms", spoilt(bones(), (0, 0, 0), INF), "finite values", "NaN or infinity at index 0"),
    ("out", np.zeros((3, 3), np.float32), OUT, "float32 [3, 3]"),
    ("out", np.zeros((2, 4), np.float32), OUT, "float32 [2, 4]"),
    ("out", np.zeros(6, np.float32), OUT, "float32 [6]"),
    ("out", np.zeros((2, 3), np.float64), OUT, "float64 [2, 3]"),
    ("out", np.zeros((2, 3), np.float32, order="F"), OUT, "one that is not C-contiguous"),
    ("out", np.zeros((4, 3), np.float32)[::2], OUT, "one that is not C-contiguous"),
    ("out", read_only(), OUT, "a read-only array"),
    ("out", [[0, 0, 0], [0, 0, 0]], OUT, f"list of {np.dtype(int)} [2, 3]"),
    ("threads", -3, THREADS, "-3"),
    ("threads", -(10**30), THREADS, "a negative one"),
    ("threads", np.int64(-1), THREADS, "-1"),
    ("threads", np.float32(2), THREADS, "float32"),
    ("threads", 2.0, THREADS, "float"),
    ("threads", "2", THREADS, "str"),
    ("bones_from_model", np.eye(3, dtype=np.float32), AFFINE, "float32 [3, 3]"),
    ("bones_from_model", bones(), AFFINE, "float32 [2, 4, 4]"),
    ("bones_from_model", bones()[0].tolist()[:2], AFFINE, "list of float64 [2, 4]"),
    ("bones_from_model", spoilt(bones()[0], (2, 3), NAN), "finite values", "NaN or infinity"),
    ("rest_inverses", bones(3).astype(np.float64), INVERSES, "float64 [3, 4, 4]"),
    ("rest_inverses", np.eye(4), INVERSES, "float64 [4, 4]"),
    ("rest_inverses", np.zeros((2, 4, 3)), INVERSES, "float64 [2, 4, 3]"),
    ("bones_from_model", np.zeros((4, 4), np.float32), "an invertible transform", "one of determinant 0"),
    ("bones_from_model", spoilt(bones()[0], (1, 1), 0), "an invertible transform", "one of determinant 0"),
]


@pytest.mark.parametrize(("argument", "value", "wanted", "got"), DEFORM)
def test_deform_refuses(argument, value, wanted, got):
    deformer = sinew.Deformer(**good())
    message = refusal(deformer.deform, **{"bone_transforms": bones(), argument: value})
    assert message == f"{argument}: expected {wanted}, got {got}"


def test_a_refused_call_leaves_out_alone():
    out = np.full((2, 3), 7.0, np.float32)
    refusal(sinew.Deformer(**good()).deform, bones(1), out=out)
    refusal(sinew.Deformer(**good()).deform, bones(), out=out, threads=-1)
    assert (out == 7.0).all()
