# SPDX-License-Identifier: GPL-3.0-or-later
"""Any arguments for everything that the library exports: a result, or one of four errors that names an argument.

What is accepted gives what plain contiguous arrays of the same numbers give. SINEW_FUZZ_SECONDS (default 60) is shared by
all cases; every tenth of an example runs in a child that a crash ends alone.
"""

import os
import time

import numpy as np
import pytest
import sinew
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

REFUSALS = (ValueError, TypeError, MemoryError, OverflowError)
SECONDS = float(os.environ.get("SINEW_FUZZ_SECONDS", "60"))


class Raises:
    """Says that it is an array, and then is none."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no array of mine")


class Lies:
    """An array of something else than it says."""

    __array_interface__ = {"shape": (2, 3), "typestr": "<f4", "version": 3, "data": None}

    def __len__(self):
        return 2**62

    def __index__(self):
        raise ZeroDivisionError("no index either")


GARBAGE = st.sampled_from(
    [
        None, "", "dq", "\ud800", b"dq", 3, -1, 2**31, 2**63, -(2**70), 10**400, 1.5, float("nan"), float("inf"),
        1j, True, [], [[]], (), {}, set(), object(), type, len, Raises(), Lies(), [1, "a"], [[1, 2], [3]],
        np.array(None), np.array("text"), np.array(["a", "b"]), np.array([b"a"]), np.array({}),
        np.zeros((2, 3), complex), np.zeros(3, "M8[s]"), np.zeros(2, [("a", "f4"), ("b", "i8")]),
        np.zeros((2, 2), object), np.longdouble(1), np.zeros((2, 3), np.longdouble),
        np.ma.masked_all((2, 3)), np.broadcast_to(np.float32(0), (2**50, 3)),
        np.broadcast_to(np.float64(0), (2**50, 4, 4)), np.broadcast_to(np.int32(0), (2**55,)),
        memoryview(b"abc"), bytearray(12), range(5), np.dtype("f4"), np.float32,
    ]
)  # fmt: skip

DTYPES = st.sampled_from(["f4", "f8", "f2", "i4", "i8", "u1", "u8", "?", ">f4", ">i4", ">f8"])
NUMBERS = st.sampled_from(
    [0, 0, 1, 1, 1, -1, 0.5, 2, 3, 7, 1e-30, 1e20, 3e38, 1e300, np.nan, np.inf, -np.inf, 2**31, 1e-45]
)
LAYOUTS = ["plain", "negative", "strided", "fortran", "read-only", "unaligned", "list", "sub"]


def laid_out(array, how):
    """The same numbers lying differently."""
    if how == "list":
        return array.tolist()
    if how == "fortran":
        return np.asfortranarray(array)
    if how == "sub":
        return array.view(np.recarray) if array.dtype.kind != "O" else array
    if how == "unaligned":
        memory = np.zeros(array.nbytes + 1, np.uint8)
        other = memory[1:].view(array.dtype).reshape(array.shape)
        other[...] = array
        return other
    step = {"negative": -1, "strided": 3}.get(how)
    if step and array.ndim:
        large = np.zeros([abs(step) * length for length in array.shape], array.dtype)
        other = large[tuple(slice(None, None, step) for _ in array.shape)]
        other[...] = array
        return other
    other = array.copy()
    other.setflags(write=how != "read-only")
    return other


@st.composite
def arrays(draw, shape, *, rigid=0.0):
    """(what is given, plain numbers or None): mostly of this shape, of unit numbers here and there of any."""
    shape = list(shape)
    if draw(st.integers(0, 5)) == 0:
        change = draw(st.integers(0, 3))
        if change == 0 and shape:
            shape.pop()
        elif change == 1:
            shape.append(draw(st.integers(0, 4)))
        elif shape:
            shape[draw(st.integers(0, len(shape) - 1))] = draw(st.integers(0, 9))
    dtype = np.dtype(draw(DTYPES))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    numbers = rng.uniform(-1, 1, shape)
    if shape and shape[-1] in (7, 8) and rigid:
        numbers[..., :4] /= np.linalg.norm(numbers[..., :4], axis=-1, keepdims=True)
    if dtype.kind in "iu?":
        numbers = np.abs(np.round(numbers * 3))
    if numbers.size and draw(st.integers(0, 3)) == 0:
        numbers.flat[draw(st.integers(0, numbers.size - 1))] = draw(NUMBERS)
    with np.errstate(all="ignore"):
        array = numbers.astype(dtype)
    return laid_out(array, draw(st.sampled_from(LAYOUTS))), array


@st.composite
def integers(draw, values):
    """(what is given, plain numbers): these, here and there another."""
    values = list(values)
    if values and draw(st.integers(0, 4)) == 0:
        wrong = st.sampled_from([-1, 0, 1, 5, 2**20 - 1, 2**20, 2**31 - 1, 2**31, 2**32, 2**62, -(2**31)])
        values[draw(st.integers(0, len(values) - 1))] = draw(wrong)
    if draw(st.integers(0, 9)) == 0:
        values = values[:-1]
    array = np.array(
        values, draw(st.sampled_from(["i8", ">i8", "u8"])) if min(values, default=0) >= 0 else "i8"
    )
    return laid_out(array, draw(st.sampled_from(LAYOUTS))), array


def or_garbage(strategy):
    return st.one_of(strategy, strategy, strategy, strategy, GARBAGE.map(lambda value: (value, None)))


LEAD = st.sampled_from([(), (1,), (2,), (3,), (0,), (2, 1), (1, 3)])
KINDS = {
    "affine": (4, 4), "rows": (3, 4), "quat_vec": (7,), "dual_quat": (8,),
    "axis": (3,), "matrix": (3, 3), "twist": (6,), "number": (),
}  # fmt: skip


def of(kind):
    if kind == "number":
        number = st.floats(-4, 4).map(lambda value: (value, value))
        return or_garbage(st.one_of(number, LEAD.flatmap(arrays)))
    return or_garbage(LEAD.flatmap(lambda lead: arrays((*lead, *KINDS[kind]), rigid=1.0)))


METHODS = st.one_of(
    st.sampled_from([method.name for method in sinew.methods()]),
    GARBAGE.filter(lambda v: not isinstance(v, float)),
)
WAYS = st.one_of(st.sampled_from(sinew.interpolate.METHODS), GARBAGE)


def names_of_arguments(function):
    """The arguments that a native function lists in its signature."""
    import re

    return set(re.findall(r"(\w+): ", function.__doc__.split("->")[0])) | {"state"}


def attempt(call, arguments, names):
    """The result, or None where it was refused as it ought to be."""
    try:
        return call(*arguments)
    except REFUSALS as error:
        if not isinstance(error, MemoryError):
            text = str(error)
            # Pybind's own sentence has the signature, with every name.
            assert any(name in text for name in names), (names, text)
            assert "\n" not in text or "incompatible" in text
        return None


def flat(result):
    if isinstance(result, tuple):
        return [part for item in result for part in flat(item)]
    return [np.asarray(result)]


def same(result, plain):
    for one, other in zip(flat(result), flat(plain), strict=True):
        np.testing.assert_array_equal(one, other)


def plain_of(values):
    """The same arguments as contiguous arrays, of float64 where the call's arrays are not all of less."""
    numbers = [array for _, array in values if isinstance(array, np.ndarray)]
    wide = any(a.dtype.itemsize > (4 if a.dtype.kind == "f" else 2) for a in numbers)
    dtype = np.float64 if wide else np.float32
    return [
        np.ascontiguousarray(array, dtype) if isinstance(array, np.ndarray) else given
        for given, array in values
    ]


FUNCTIONS = {}
for of_module in ("affine", "quat_vec", "dual_quat"):
    native = getattr(sinew._native, of_module)
    for name in (name for name in dir(native) if not name.startswith("_")):
        FUNCTIONS[of_module, name] = getattr(native, name)
ARGUMENT_KINDS = {
    "axis": "axis", "moment": "axis", "point": "axis", "points": "axis", "vectors": "axis", "normals": "axis",
    "translation": "axis", "angle": "number", "exponent": "number", "rotation": "matrix", "twist": "twist",
    "posed_from_rest": "affine", "rest_bone": "affine",
}  # fmt: skip


@st.composite
def transform_calls(draw):
    module, name = draw(st.sampled_from(sorted(FUNCTIONS)))
    function = FUNCTIONS[module, name]
    listed = function.__doc__.split(")")[0].split("(")[1].split(", ")
    arguments = []
    for argument in (text.split(":")[0] for text in listed):
        kind = ARGUMENT_KINDS.get(argument, module)
        if argument == "translation" and "screw" in name:
            kind = "number"
        if kind == "affine":
            kind = draw(st.sampled_from(["affine", "rows"]))
        arguments.append(draw(of(kind)))
    return function, arguments


@st.composite
def blend_calls(draw):
    module, names = draw(
        st.sampled_from(
            [
                (sinew._native.interpolate.between, "transform transform number"),
                (sinew._native.interpolate.blend, "many weights"),
                (sinew._native.spline.catmull_rom, "keys times number"),
                (sinew._native.spline.catmull_rom_vector, "keys times number"),
            ]
        )
    )
    layout = draw(st.sampled_from(["affine", "rows", "quat_vec", "dual_quat"]))
    count = draw(st.integers(0, 5))
    kinds = {
        "transform": of(layout),
        "number": of("number"),
        "many": or_garbage(arrays((count, *KINDS[layout]), rigid=1.0)),
        "keys": or_garbage(arrays((count, *KINDS[layout]), rigid=1.0)),
        "weights": or_garbage(arrays((count,))),
        "times": or_garbage(integers(range(count))),
    }
    arguments = [draw(kinds[name]) for name in names.split()]
    if module is not sinew._native.spline.catmull_rom_vector:
        method = draw(WAYS)
        arguments.append((method, None))
    return module, arguments


def run(function, arguments):
    names = names_of_arguments(function)
    result = attempt(function, [given for given, _ in arguments], names)
    if result is not None and all(isinstance(plain, np.ndarray) for _, plain in arguments):
        same(result, function(*plain_of(arguments)))


class Clock:
    """Examples end when a part of SECONDS has passed: what comes after does nothing."""

    def __init__(self, part):
        self.end = None
        self.seconds = part * SECONDS

    def is_over(self):
        if self.end is None:
            self.end = time.monotonic() + self.seconds
        return time.monotonic() > self.end


MANY = settings(
    max_examples=100_000 if SECONDS > 60 else 4000,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
TRANSFORMS, BLENDS, SKELETONS, MESHES = (Clock(part) for part in (0.25, 0.2, 0.15, 0.4))


@MANY
@given(transform_calls())
def test_transforms(call):
    if not TRANSFORMS.is_over():
        run(*call)


@MANY
@given(blend_calls())
def test_blends_and_splines(call):
    if not BLENDS.is_over():
        run(*call)


@MANY
@given(st.data())
def test_skeletons(data):
    if SKELETONS.is_over():
        return
    count = data.draw(st.integers(0, 4))
    parents = data.draw(or_garbage(integers(range(-1, count - 1))))
    skeleton = attempt(sinew.Skeleton, [parents[0]], {"parents"})
    if skeleton is None:
        return
    bones = skeleton.bone_count
    layout = KINDS[data.draw(st.sampled_from(["affine", "rows", "quat_vec", "dual_quat"]))]
    keys = data.draw(st.integers(0, 3))
    of_bones, of_keys = (bones, *layout), (keys, bones, *layout)
    number, method = of("number"), WAYS.map(lambda name: (name, None))
    call, strategies = data.draw(
        st.sampled_from(
            [
                (skeleton.root_relative, [or_garbage(arrays(of_bones, rigid=1.0))]),
                (skeleton.interpolate, [or_garbage(arrays(of_bones, rigid=1.0))] * 2 + [number, method]),
                (
                    skeleton.spline,
                    [
                        or_garbage(arrays(of_keys, rigid=1.0)),
                        or_garbage(integers(range(keys))),
                        number,
                        method,
                    ],
                ),
                (
                    skeleton.spline_vector,
                    [or_garbage(arrays(of_keys, rigid=1.0)), or_garbage(integers(range(keys))), number],
                ),
            ]
        )
    )
    run(call, [data.draw(strategy) for strategy in strategies])


MESH = ("rest_points", "influence_offsets", "influence_bones", "influence_weights", "rest_bones")


def plain_mesh(values):
    types = (np.float32, np.int32, np.int32, np.float32, np.float32)
    return [
        given if array is None else np.ascontiguousarray(array, dtype)
        for (given, array), dtype in zip(values, types, strict=True)
    ]


@MANY
@given(st.data())
def test_meshes(data):
    if MESHES.is_over():
        return
    vertices = data.draw(st.sampled_from([0, 1, 2, 5, 20]))
    each = data.draw(st.integers(0, 4))
    bones = data.draw(st.integers(1, 4))
    influences = vertices * each
    mesh = [
        data.draw(or_garbage(arrays((vertices, 3)))),
        data.draw(or_garbage(integers(range(0, influences + 1, each) if each else [0] * (vertices + 1)))),
        data.draw(or_garbage(integers([i % bones for i in range(influences)]))),
        data.draw(or_garbage(arrays((influences,)).map(positive))),
        data.draw(st.one_of(st.just((None, None)), or_garbage(arrays((bones, 4, 4))))),
    ]
    binding = attempt(sinew.Binding, [given for given, _ in mesh], MESH)
    method, other = data.draw(METHODS), data.draw(METHODS)
    mix = data.draw(
        st.one_of(st.none(), or_garbage(arrays((vertices,))).map(lambda shares: (other, shares[0])), GARBAGE)
    )
    if binding is None:
        return
    repr(binding)
    deformer = attempt(sinew.Deformer, [binding, method, mix], {"method", "mix", "binding"})
    if deformer is None:
        return
    repr(deformer)
    points = data.draw(or_garbage(arrays((vertices, 3))))
    attempt(deformer.set_rest_points, [points[0]], {"rest_points"})
    pose = data.draw(or_garbage(arrays((binding.bone_count, 4, 4))))
    out = data.draw(st.one_of(st.none(), GARBAGE, st.just(np.zeros((vertices, 3), np.float32))))
    threads = data.draw(st.one_of(st.none(), st.integers(0, 70), GARBAGE))
    space = data.draw(st.one_of(st.just((None, None)), or_garbage(arrays((4, 4)))))
    inverses = data.draw(st.one_of(st.just((None, None)), or_garbage(arrays((binding.bone_count, 4, 4)))))
    names = {"bone_transforms", "out", "threads", "bones_from_model", "rest_inverses"}
    result = attempt(deformer.deform, [pose[0], out, threads, space[0], inverses[0]], names)
    if result is None:
        return
    assert result.shape == (binding.vertex_count, 3)
    plain = sinew.Deformer(sinew.Binding(*plain_mesh(mesh)), method, mix)
    attempt(plain.set_rest_points, [points[0]], {"rest_points"})
    types = (np.float32, np.float32, np.float64)
    pose, space, inverses = (
        given if array is None else np.ascontiguousarray(array, dtype)
        for (given, array), dtype in zip((pose, space, inverses), types, strict=True)
    )
    same(result, plain.deform(pose, None, 1, space, inverses))


def positive(pair):
    given, array = pair
    if isinstance(given, np.ndarray):
        return np.abs(given), np.abs(array)
    return np.abs(array).tolist(), np.abs(array)


def test_functions_without_arguments():
    for function in (sinew.methods, sinew.stages, sinew.keep_thread_state):
        function()
        with pytest.raises(TypeError, match=function.__name__):
            function(1)
