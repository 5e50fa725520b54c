# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects errors: each names the argument, what was expected and what was given, and changes nothing.
test_fuzz_bindings.py tries any arguments; here each check has a row."""

import re
from pathlib import Path

import numpy as np
import pytest
import sinew
from calls import BINDING, CALLS, ENDS, FACES, HALF, KEYS, MORE, POINTS, SHEET, bones
from sinew import interpolate

NAN, INF = np.float32("nan"), np.float32("inf")
MOMENTS = [0, 0, 1, *[0] * 9]


def spoilt(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize("name", CALLS)
def test_what_the_rows_spoil_is_accepted(name):
    call, good = CALLS[name]
    call(**good)
    call(**good | MORE.get(name, {}))


F32_POINTS, OFFSETS = "float32 [n, 3]", "int32 [vertices + 1]"
BONES, WEIGHTS = "int32 [influences]", "float32 [influences]"
AFFINES = "float32 [n, 4, 4] or [n, 3, 4]"
FINITE_WEIGHTS = "finite values, 0 or more"
METHOD = "one of " + ", ".join(method.name for method in sinew.methods())
MIX, MIX_WEIGHTS = "None or (method, weights)", "weights float32 [vertices]"
OUT = "writable C-contiguous float32 [2, 3]"
INVERSES = "float64 [2, 4, 4], one for each of bone_transforms"
AFFINE = "float32 [4, 4] or [3, 4]"
THREADS = "None or an integer, 0 or more"
LAYOUTS = "float32 or float64 [bones, 4, 4], [bones, 3, 4], [bones, 7] or [bones, 8]"
INVERTIBLE = "an invertible transform"
FINITE = "finite values"
PARAMETERS = "names of parameters of methods, METHOD.PARAMETER"
SLERP = "of sdef.interpolation one of nlerp, slerp"
INTS = f"list of {np.dtype(int)}"
READ_ONLY = np.zeros((2, 3), np.float32)
READ_ONLY.setflags(write=False)
UNALIGNED = np.frombuffer(bytearray(25), np.float32, 6, 1).reshape(2, 3)

SKINS = [
    ("rest_points", POINTS.astype(np.complex64), F32_POINTS, "complex64 [2, 3]"),
    ("rest_points", np.full((2, 3), 1e300), "numbers that float32 holds", "1e+300"),
    ("rest_points", np.ma.masked_all((2, 3)), "an array without masked values", "one with them"),
    ("rest_points", np.zeros((2, 4), np.float32), F32_POINTS, "float32 [2, 4]"),
    ("rest_points", np.zeros(6, np.float32), F32_POINTS, "float32 [6]"),
    ("rest_points", [[0, 0], [1, 1]], F32_POINTS, f"{INTS} [2, 2]"),
    ("rest_points", [[0, 0, 0], [1, 1]], F32_POINTS, "list"),
    ("rest_points", np.zeros((2, 3), object), F32_POINTS, "object [2, 3]"),
    ("rest_points", None, F32_POINTS, "NoneType"),
    # Repeated without memory of their own: refused before memory is allocated.
    ("rest_points", np.broadcast_to(POINTS[:1], (2**58, 3)), f"{F32_POINTS}, at most 2147483647", None),
    ("rest_points", spoilt(POINTS, (1, 2), NAN), FINITE, "NaN or infinity at vertex 1"),
    ("rest_points", spoilt(POINTS, (0, 0), -INF), FINITE, "NaN or infinity at vertex 0"),
    ("influence_offsets", np.float32([0, 1, 3]), OFFSETS, "float32 [3]"),
    ("influence_offsets", np.broadcast_to(1, (2**31 + 1,)), f"{OFFSETS}, at most 2147483648", None),
    ("influence_offsets", np.int32([[0, 1, 3]]), OFFSETS, "int32 [1, 3]"),
    ("influence_offsets", np.int64([0, 1, 2**31]), "numbers that int32 holds", "2147483648"),
    ("influence_offsets", np.int32([0, 3]), "3 values (vertices + 1)", "2"),
    ("influence_offsets", np.int32([]), "3 values (vertices + 1)", "0"),
    ("influence_offsets", np.int32([-1, 1, 3]), "0 at the start", "-1"),
    ("influence_offsets", np.int32([0, 4, 3]), "values that never fall", "3 after 4 at vertex 1"),
    ("influence_offsets", np.int32([0, -1, 3]), "values that never fall", "-1 after 0 at vertex 0"),
    ("influence_offsets", np.int32([0, 1, 2]), "3 at the end (the number of influences)", "2"),
    ("influence_offsets", np.int32([0, 1, 4]), "3 at the end (the number of influences)", "4"),
    ("influence_bones", np.int64([0, 0, -(2**31) - 1]), "numbers that int32 holds", "-2147483649"),
    ("influence_bones", np.uint64([0, 0, 2**64 - 1]), "numbers that int32 holds", "18446744073709551615"),
    ("influence_bones", np.int32([[0, 0, 1]]), BONES, "int32 [1, 3]"),
    ("influence_bones", [0, 0, 2**70], BONES, "list"),
    ("influence_bones", np.broadcast_to(1, (2**31,)), f"{BONES}, at most 2147483647", None),
    ("influence_bones", [0, 0, 1 << 20], "indices of bones below 1048576", "1048576 at influence 2"),
    ("influence_bones", np.int32([0, -1, 1]), "indices of bones, 0 or more", "-1 at influence 1"),
    ("influence_weights", np.float32([[1, 0.5, 0.5]]), WEIGHTS, "float32 [1, 3]"),
    ("influence_weights", np.broadcast_to(0.5, (2**40,)), f"{WEIGHTS}, at most 2147483647", None),
    ("influence_weights", {1, 0.5}, WEIGHTS, "set"),
    ("influence_weights", np.float32([1, 1]), "one for each of the 3 influence_bones", "2"),
    ("influence_weights", np.float32([1, -0.5, 1]), FINITE_WEIGHTS, "-0.500000 at influence 1"),
    ("influence_weights", np.float32([1, 1, INF]), FINITE_WEIGHTS, "inf at influence 2"),
    ("rest_bones", bones()[0], AFFINES, "float32 [4, 4]"),
    ("rest_bones", bones()[:, :2], AFFINES, "float32 [2, 2, 4]"),
    ("rest_bones", spoilt(bones(), (1, 0, 3), NAN), FINITE, "NaN or infinity at index 1"),
    ("rest_bones", bones(1), "at least 2 bones", "1"),
]
# Windows and Apple's processors have it as wide as float64, which is taken.
if np.dtype(np.longdouble).itemsize > 8:
    SKINS += [("rest_points", POINTS.astype(np.longdouble), F32_POINTS, f"{np.dtype(np.longdouble)} [2, 3]")]

ROWS = [
    *(("Binding", *row) for row in SKINS),
    *(("Deformer", *row) for row in SKINS[::6]),
    ("Deformer", "method", "DQ", METHOD, "'DQ'"),
    ("Deformer", "method", "", METHOD, "''"),
    ("mix", "mix", "dq", MIX, "str"),
    ("mix", "mix", ("dq", HALF, HALF), MIX, "a tuple of 3"),
    ("mix", "mix", ["dq"], MIX, "a list of 1"),
    ("mix", "mix", ("DQ", HALF), METHOD, "'DQ'"),
    ("mix", "mix", ("dq", HALF.astype(complex)), MIX_WEIGHTS, "complex128 [2]"),
    ("mix", "mix", ("dq", HALF[:1]), "a weight for each of the 2 vertices", "1"),
    ("mix", "mix", ("dq", np.float32([0, NAN])), "weights from 0 to 1", "NaN at vertex 1"),
    ("set_rest_points", "rest_points", np.zeros((3, 3), np.float32), "2 points", "3"),
    ("set_rest_points", "rest_points", np.broadcast_to(POINTS[:1], (2**31, 3)), None, None),
    ("set_rest_points", "rest_points", np.zeros((2, 2), np.float32), F32_POINTS, "float32 [2, 2]"),
    ("set_rest_points", "rest_points", [[0, 0, 0], [0, INF, 0]], FINITE, "NaN or infinity at vertex 1"),
    ("deform", "bone_transforms", bones(1), "at least 2 bones", "1"),
    ("deform", "bone_transforms", bones().reshape(2, 16), AFFINES, "float32 [2, 16]"),
    ("deform", "bone_transforms", bones().tolist()[0], AFFINES, "list of float64 [4, 4]"),
    ("deform", "bone_transforms", None, AFFINES, "NoneType"),
    ("deform", "bone_transforms", spoilt(bones(), (1, 2, 3), NAN), FINITE, "NaN or infinity at index 1"),
    ("deform", "out", np.zeros((3, 3), np.float32), OUT, "float32 [3, 3]"),
    ("deform", "out", np.zeros((2, 3), np.float64), OUT, "float64 [2, 3]"),
    ("deform", "out", np.zeros((2, 3), np.float32, order="F"), OUT, "one that is not C-contiguous"),
    ("deform", "out", np.zeros((4, 3), np.float32)[::2], OUT, "one that is not C-contiguous"),
    ("deform", "out", UNALIGNED, OUT, "one that is not aligned"),
    ("deform", "out", READ_ONLY, OUT, "a read-only array"),
    ("deform", "out", [[0, 0, 0], [0, 0, 0]], OUT, f"{INTS} [2, 3]"),
    ("deform", "bones_from_model", np.eye(3, dtype=np.float32), AFFINE, "float32 [3, 3]"),
    ("deform", "bones_from_model", spoilt(bones()[0], (2, 3), NAN), FINITE, "NaN or infinity"),
    ("deform", "bones_from_model", spoilt(bones()[0], (1, 1), 0), INVERTIBLE, "one of determinant 0"),
    ("deform", "rest_inverses", bones(3).astype(np.float64), INVERSES, "float64 [3, 4, 4]"),
    ("deform", "rest_inverses", np.zeros((2, 4, 3)), INVERSES, "float64 [2, 4, 3]"),
    ("deform", "parameters", ["slerp"], "None or a dict of values by names such as METHOD.PARAMETER", "list"),
    ("deform", "parameters", {"sdef": "slerp"}, PARAMETERS, "'sdef'"),
    ("deform", "parameters", {"dq.interpolation": "slerp"}, PARAMETERS, "'dq.interpolation'"),
    ("deform", "parameters", {"sdef.interpolation": "dlb"}, SLERP, "'dlb'"),
    ("deform", "parameters", {"sdef.interpolation": 1}, SLERP, "1"),
    ("BulgeLimit", "tails", np.zeros((3, 3)), "float32 [2, 3], one for each of heads", "float64 [3, 3]"),
    ("BulgeLimit", "heads as segments", ENDS[0] * np.nan, FINITE, "NaN or infinity at bone 0"),
    ("BulgeLimit", "weights", np.zeros(7), "None or float32 [2], at most 2", "float64 [7]"),
    ("BulgeLimit", "weights", np.full(2, np.nan), "weights from 0 to 1", "NaN at vertex 0"),
    ("BulgeLimit", "bones_from_model", np.zeros((4, 4)), INVERTIBLE, "one of determinant 0"),
    ("limit", "strength", 1.5, "of bulge_limit.strength a finite number from 0 to 1", "1.5"),
    ("limit", "strength", "much", "of bulge_limit.strength a finite number from 0 to 1", "'much'"),
    ("limit", "form", "hard", "of bulge_limit.form one of continuous, kim_han", "'hard'"),
    ("TwistSpread", "twists", np.zeros((1, 3), int), "int32 [twists, 4]", f"{np.dtype(int)} [1, 3]"),
    ("TwistSpread", "twists", [[0, 0, 2, 0]] * 2, "bones from 0 to 2 - 1", "2 at twist 0"),
    ("TwistSpread", "twists", [[0, 0, 1, 0]] * 2, "each bone at most once", "bone 0 at twist 1 again"),
    ("TwistSpread", "tails as twists", ENDS[1] * np.nan, "finite ends", "NaN or infinity at twist 0"),
    ("TwistSpread", "heads", np.zeros((3, 3)), "float32 [2, 3]", "float64 [3, 3]"),
    ("TwistSpread", "rest_bones", np.zeros((2, 4, 4)), "a Y axis of each twisted bone", ""),
    ("TwistSpread", "rest_bones", bones(1), "at least 2 bones", "1"),
    ("TwistSpread", "parents", [2, 2], "-1, or bones below 2", "2 at bone 0"),
    ("TwistSpread", "parents", [0], "None or int32 [2]", f"{INTS} [1]"),
    ("TwistSpread", "weights", np.full(2, np.nan), "weights from 0 to 1", "NaN at vertex 0"),
    ("TwistSpread", "mix", np.zeros(7), "None or float32 [2], at most 2", "float64 [7]"),
    ("TwistSpread", "bones_from_model", np.zeros((4, 4)), INVERTIBLE, "one of determinant 0"),
    ("spread", "amount", 1.5, "of twist_spread.amount a finite number from 0 to 1", "1.5"),
    ("spread", "amounts", [1.0], "None or float32 [2]", "list of float64 [1]"),
    ("spread", "curves", [[1.0]], "None or float32 [2]", "list of float64 [1, 1]"),
    ("spread", "channels", np.zeros((2, 4)), "None or float32 [2, 7]", "float64 [2, 4]"),
    ("spread", "channels", np.full((2, 7), np.nan), FINITE, "NaN or infinity at index 0"),
    ("spread", "blend", "dq", "one of linear, matrices, rotations, logarithms", "'dq'"),
    ("DeltaMush", "face_offsets", [0, 3], "to rise from 0 to the 6 corner_vertices", ""),
    ("DeltaMush", "corner_vertices", [0, 1, 2, 0, 2, 4], "vertices from 0 to 3", "4 at index 5"),
    ("DeltaMush", "edges", FACES["edges"][1:], "every edge of each face", "none from vertex 0 to 1"),
    ("DeltaMush", "edges", [0, 1], "int32 [edges, 2]", f"{INTS} [2]"),
    ("bind", "iterations", -1, "an integer from 0 to 1000", "-1"),
    ("bind", "iterations", 10**30, "an integer from 0 to 1000", "one far beyond"),
    ("bind", "iterations", 2.0, "an integer from 0 to 1000", "float"),
    ("bind", "radius", float("nan"), "0 or more", "nan"),
    ("bind", "factor", "x", "a number", "str"),
    ("bind", "factor", 1.1, "a number from 0 to 1", "1.100000"),
    ("bind", "smooth_type", "other", "one of simple, length_weighted", "'other'"),
    ("bind", "pin_boundary", 2, "True or False", "int"),
    ("bind", "weights", [1.0], "a weight for each of the 4 vertices", "1"),
    ("mush", "points", SHEET[:-1], "float32 [4, 3]", "float32 [3, 3]"),
    ("mush", "out", np.zeros((4, 3)), "writable C-contiguous float32 [4, 3]", "float64 [4, 3]"),
    ("Normals", "vertex_count", -1, "an integer from 0 to 536870911", "-1"),
    ("Normals", "vertex_count", 1.5, "an integer from 0 to 536870911", "float"),
    ("Normals", "sharp_edges", [True], "none, or one for each of the 5 edges", "1"),
    ("Normals", "sharp_faces", "x", "None or bool [faces]", "str"),
    ("compute", "domain", "edge", "one of vertex, corner, face", "'edge'"),
    ("compute", "out", np.zeros((4, 3)), "writable C-contiguous float32 [4, 3]", "float64 [4, 3]"),
    ("SkinnedNormals", "normals", POINTS[:-1], "one for each of the 2 vertices", "1"),
    ("SkinnedNormals", "normals", POINTS * NAN, FINITE, "NaN or infinity at index 0"),
    ("SkinnedNormals", "tangents", SHEET, "none, or one for each of the 2 normals", "4"),
    ("SkinnedNormals", "vertices", [1], "none, or one for each of the 2 normals", "1"),
    ("SkinnedNormals", "vertices", [2, 0], "vertices below 2", "2 at index 0"),
    ("SkinnedNormals", "method", "slerp", METHOD, "'slerp'"),
    ("deform_normals", "bone_transforms", bones(1), "at least 2 bones", "1"),
    ("deform_normals", "points", POINTS[:-1], "float32 [2, 3]", "float32 [1, 3]"),
    ("centres", "triangles", [0, 1, 2], "int32 [triangles, 3]", f"{INTS} [3]"),
    ("centres", "triangles", np.zeros((2, 3)), "int32 [triangles, 3]", "float64 [2, 3]"),
    ("centres", "triangles", [[0, 1, 2]], "numbers of vertices, below 2", "2 at triangle 0"),
    ("vertex data", "vertex_data", [1], "None or a dict of arrays by names of methods", f"{INTS} [1]"),
    ("vertex data", "vertex_data", {"dq": POINTS[:, :0]}, "that of methods that need it", "that of dq"),
    ("vertex data", "vertex_data", {"cor": POINTS[:, :2]}, "of cor float32 [vertices, 3]", "float32 [2, 2]"),
    ("vertex data", "vertex_data", {"cor": POINTS[:1]}, "6 numbers of cor", "3"),
    ("vertex data", "vertex_data", {"cor": POINTS * NAN}, FINITE, "NaN or infinity of cor at vertex 0"),
    ("deform", "parents", np.int32([-1, 2, 0]), "-1 or the index of an earlier bone", "2 for bone 1"),
    ("deform", "parents", np.int32([-1, -2]), "-1 or the index of an earlier bone", "-2 for bone 1"),
    ("deform", "parents", np.float32([-1]), "int32 [bones]", "float32 [1]"),
    ("deform", "parents", [-1, None], "int32 [bones]", "list"),
    ("catmull_rom", "keys", KEYS[:0], "one axis of keys, at least one", "float64 [0, 8]"),
    ("catmull_rom", "times", np.arange(3.0), "float64 [5], one for each key", "float64 [3]"),
    ("catmull_rom", "times", -np.arange(5.0), "times that do not decrease", "a smaller one at index 1"),
    ("catmull_rom", "at", np.nan, FINITE, "NaN or infinity at index 0"),
    ("catmull_rom", "method", "cubic", "one of " + ", ".join(interpolate.METHODS), "'cubic'"),
    ("catmull_rom_vector", "keys", KEYS[:, :5], LAYOUTS.replace("bones", "keys"), "float64 [5, 5]"),
    ("between", "b", KEYS[:3], "leading axes that broadcast with [5]", "[3]"),
    ("between", "b", 1j * KEYS, "float32 or float64 [.., 8]", "complex128 [5, 8]"),
    ("between", "t", "x", "a number or float64 [..]", "str"),
    ("between", "t", np.complex64(1j), "a number or float64 [..]", "complex64"),
    ("blend", "weights", np.ones(3), "float64 [.., 5], one for each transform", "float64 [3]"),
    ("blend", "transforms", KEYS[:0], "at least one transform", "none"),
    ("blend", "signs", "shortest", "one of heaviest, running_sum, as_given", "'shortest'"),
    ("dual_quat.inverse", "a", [*KEYS.tolist(), [1]], "float32 or float64 [.., 8]", "list"),
    ("dual_quat.inverse", "a", KEYS.astype("M8[s]"), "float32 or float64 [.., 8]", "datetime64[s] [5, 8]"),
    ("affine.inverse", "a", np.zeros((4, 4)), INVERTIBLE, "one of determinant 0"),
    ("dual.divide", "b", [0, 1], None, None),
    ("dual.sqrt", "a", [0, 1], None, None),
    ("dual.log", "a", [-1, 1], None, None),
]
if "ddm" in {method.name for method in sinew.methods()}:
    ROWS += [("moments", "radius", radius, "a number of 0 or more", "") for radius in (-1.0, np.nan, np.inf)]
    ROWS += [
        ("vertex data", "vertex_data", {"ddm": np.float32(rows)}, wanted, got)
        for rows, wanted, got in (
            (np.zeros((2, 3)), "of ddm float32 [rows, 12]", "float32 [2, 3]"),
            ([spoilt(np.float32(MOMENTS), 5, INF)], "finite values in column 5 of ddm", "inf in row 0"),
            ([[2, *MOMENTS[1:]]], "numbers of vertices in column 0 of ddm", "2.000000 in row 0"),
            ([[0, 0.5, *MOMENTS[2:]]], "numbers of bones in column 1 of ddm", "0.500000 in row 0"),
            ([[0, 0, -0.5, *MOMENTS[3:]]], "weights of 0 and more in column 2 of ddm", "-0.500000 in row 0"),
            ([MOMENTS] * 2, "rows of ddm in ascending order of vertices and bones", "another order in row 1"),
        )
    ]


# Every call that takes `threads`.
THREADED = (
    *("deform", "limit", "spread", "mush", "compute", "deform_skinned", "deform_normals"),
    *("centres", "moments", "crossing_triangles"),
)


@pytest.mark.parametrize("name", THREADED)
def test_threads_mean_the_same_everywhere(name):
    call, good = CALLS[name]
    expected = call(**good)
    for threads in (None, 0, 1, np.int64(4), np.uint8(2), True, 10**30):
        np.testing.assert_array_equal(call(**good, threads=threads), expected)
    for wrong, got in (
        *((-3, "-3"), (-(10**30), "a negative one"), (np.int8(-1), "-1"), (1.5, "float")),
        *((np.float32(2), "float32"), ("2", "str"), ([1], f"list of {np.array([1]).dtype} [1]")),
    ):
        with pytest.raises(ValueError, match=f"^threads: expected {THREADS}, got {re.escape(got)}$"):
            call(**good, threads=wrong)


def test_each_call_with_threads_is_among_these():
    stub = Path(__file__).parents[3] / "native" / "python" / "sinew" / "_native" / "__init__.pyi"
    assert stub.read_text(encoding="utf-8").count("threads: typing.SupportsIndex") == len(THREADED)


@pytest.mark.parametrize(("name", "argument", "value", "wanted", "got"), ROWS)
def test_an_error_says_what_is_wrong(name, argument, value, wanted, got):
    """None stands for any text. Several arguments become one: "heads as segments"."""
    call, good = CALLS[name]
    given_as, _, named = argument.partition(" as ")
    start = f"{named or given_as}: expected "
    with pytest.raises(ValueError, match=f"^{start}") as caught:
        call(**good | {given_as: value})
    said, _, given = str(caught.value).removeprefix(start).partition(", got ")
    assert said == wanted or not wanted
    assert given == got or not got


def test_what_names_no_array_is_a_type_error():
    for call in (sinew.Deformer, lambda: sinew.Deformer(BINDING, 3)):
        with pytest.raises(TypeError):
            call()
    with pytest.raises(TypeError, match="mix"):
        sinew.Deformer(BINDING, "lbs", mix=(3, HALF))


def test_a_refused_call_leaves_out_alone():
    out = np.full((2, 3), 7.0, np.float32)
    for spoilt_call in ({"bone_transforms": bones(1)}, {"bone_transforms": bones(), "threads": -1}):
        with pytest.raises(ValueError, match="expected"):
            sinew.Deformer(BINDING).deform(**spoilt_call, out=out)
    assert (out == 7.0).all()
