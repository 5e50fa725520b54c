# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects everything that the library exports from arbitrary arguments: the outcome is a result, or an error
that names an argument.

Accepted arguments must give the same result as plain contiguous arrays of the same numbers, on one thread.
SINEW_FUZZ_EXAMPLES is the number for all cases together: 2000 by default, 8000 in ./dev test --all.
"""

import itertools
import os
import re

import numpy as np
import pytest
import sinew
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rigs import LINEAR

REFUSALS = (ValueError, TypeError, MemoryError, OverflowError)
EXAMPLES = int(os.environ.get("SINEW_FUZZ_EXAMPLES", "8000" if "SINEW_TEST_ALL" in os.environ else "2000"))


class Raises:
    """Claims to be an array, but is none."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no array of mine")


class Lies:
    """Claims to be an array of another type."""

    __array_interface__ = {"shape": (2, 3), "typestr": "<f4", "version": 3, "data": None}

    def __len__(self):
        return 2**62

    def __index__(self):
        raise ZeroDivisionError("no index either")


GARBAGE = st.sampled_from(
    [
        None, "", "dq", "\ud800", b"dq", 3, -1, 2**31, 2**63, -(2**70), 10**400, 1.5, np.nan, np.inf,
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
    [0, 1, -1, 0.5, 2, 3, 7, 1e-30, 1e20, 3e38, 1e300, np.nan, np.inf, -np.inf, 2**31, 1e-45]
)
LAYOUTS = ["plain", "negative", "strided", "fortran", "read-only", "unaligned", "list", "sub"]


def laid_out(array, how):
    """The same numbers in another memory layout."""
    if how == "list":
        return array.tolist()
    if how == "fortran":
        return np.array(array, order="F")
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
def arrays(draw, shape, wild=True):
    """(the argument, plain numbers): of this shape and with moderate numbers; if wild, sometimes others."""
    shape = list(shape)
    if wild and draw(st.booleans()):
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
    if shape and shape[-1] in (7, 8):
        numbers[..., :4] /= np.linalg.norm(numbers[..., :4], axis=-1, keepdims=True)
    if dtype.kind in "iu?":
        numbers = np.abs(np.round(numbers * 3))
    if wild and numbers.size and draw(st.booleans()):
        numbers.flat[draw(st.integers(0, numbers.size - 1))] = draw(NUMBERS)
    with np.errstate(all="ignore"):
        array = numbers.astype(dtype)
    given = laid_out(array, draw(st.sampled_from(LAYOUTS)))
    # A list has only the type that numpy gives it; without axes it is a number, which has none.
    if isinstance(given, list):
        return given, np.asarray(given)
    return given, array if isinstance(given, np.ndarray) else given


@st.composite
def integers(draw, values, wild=True):
    """(the argument, plain numbers): these, sometimes replaced."""
    values = list(values)
    if wild and values and draw(st.booleans()):
        wrong = st.sampled_from([-1, 0, 1, 5, 2**20 - 1, 2**20, 2**31 - 1, 2**31, 2**32, 2**62, -(2**31)])
        values[draw(st.integers(0, len(values) - 1))] = draw(wrong)
    if wild and draw(st.integers(0, 3)) == 0:
        values = values[:-1]
    array = np.array(
        values, draw(st.sampled_from(["i8", ">i8", "u8"])) if min(values, default=0) >= 0 else "i8"
    )
    given = laid_out(array, draw(st.sampled_from(LAYOUTS)))
    return given, np.asarray(given) if isinstance(given, list) else array


def or_garbage(strategy, wild=True):
    return st.one_of(strategy, GARBAGE.map(lambda value: (value, None))) if wild else strategy


LEAD = st.sampled_from([(), (1,), (2,), (3,), (0,), (2, 1), (1, 3)])
KINDS = {
    "affine": (4, 4), "rows": (3, 4), "quat_vec": (7,), "dual_quat": (8,),
    "axis": (3,), "matrix": (3, 3), "twist": (6,), "number": (),
}  # fmt: skip


def of(kind, wild):
    if kind == "number":
        number = st.floats(-4, 4).map(lambda value: (value, value))
        return or_garbage(st.one_of(number, LEAD.flatmap(lambda lead: arrays(lead, wild))), wild)
    return or_garbage(LEAD.flatmap(lambda lead: arrays((*lead, *KINDS[kind]), wild)), wild)


def wild_one(draw, count):
    """Whether each of these arguments may be anything: none or one of them, so that errors do not hide
    each other."""
    chosen = draw(st.integers(-1, count - 1))
    return [index == chosen for index in range(count)]


def names(known, wild):
    return st.one_of(known, GARBAGE) if wild else known


METHODS = st.sampled_from([method.name for method in sinew.methods()])
WAYS = st.sampled_from(sinew.interpolate.METHODS)


def names_of_arguments(function):
    """The arguments that a native function or class lists in its signature."""
    text = (function.__init__ if isinstance(function, type) else function).__doc__
    signatures = re.findall(r"^(?:\d+\. )?\w+\((.*)\) ->", text, re.MULTILINE)
    return set(re.findall(r"(\w+): ", "".join(signatures))) | {"state"}


def attempt(function, given, named=None, known=()):
    """The result, or None if it was refused correctly. given, named: arguments by position and by name;
    known: what an error may name besides the function's own."""
    try:
        result = function(*given, **(named or {}))
    except REFUSALS as error:
        if not isinstance(error, MemoryError):
            text = str(error)
            # Pybind's own message contains the signature, with every name.
            assert any(name in text for name in {*known, *names_of_arguments(function)}), text
            assert "\n" not in text or "incompatible" in text
        return None
    return True if result is None else result


def made(kind, given, named=None, known=()):
    """The object, or None if it was refused correctly."""
    thing = attempt(kind, given, named, known)
    if thing is not None:
        repr(thing)
    return thing


def flat(result):
    if isinstance(result, tuple):
        return [part for item in result for part in flat(item)]
    return [np.asarray(result)]


def same(result, plain):
    for one, other in zip(flat(result), flat(plain), strict=True):
        np.testing.assert_array_equal(one, other)


def plain_of(values):
    """The same arguments as contiguous arrays; float64 if not all of the call's arrays are smaller."""
    numbers = [array for _, array in values if isinstance(array, np.ndarray)]
    wide = any(a.dtype.itemsize > (4 if a.dtype.kind == "f" else 2) for a in numbers)
    dtype = np.float64 if wide else np.float32
    return [
        np.array(array, dtype, order="C") if isinstance(array, np.ndarray) else given
        for given, array in values
    ]


FUNCTIONS = {}
for of_module in ("affine", "quat_vec", "dual_quat"):
    for of_name, function in vars(getattr(sinew, of_module)).items():
        if not of_name.startswith("_") and of_name != "identity":
            FUNCTIONS[of_module, of_name] = function
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
    wild = wild_one(draw, len(listed))
    for index, argument in enumerate(text.split(":")[0] for text in listed):
        kind = ARGUMENT_KINDS.get(argument, module)
        if argument == "translation" and "screw" in name:
            kind = "number"
        if kind == "affine":
            kind = draw(st.sampled_from(["affine", "rows"]))
        arguments.append(draw(of(kind, wild[index])))
    return function, arguments


def blended(draw, calls, one, keys):
    """One of the calls, (function, kinds of arguments), and arguments for it.

    one, keys  the shapes of one transform and of several, without the layout's own
    """
    way = draw(WAYS)
    layout = {"m": draw(st.sampled_from(["affine", "rows"])), "q": "quat_vec"}.get(way[0], "dual_quat")
    function, of_arguments = draw(st.sampled_from(calls))
    wild = wild_one(draw, 4)
    kinds = {
        "transform": lambda wild: of(layout, wild),
        "one": lambda wild: or_garbage(arrays((*one, *KINDS[layout]), wild), wild),
        "number": lambda wild: of("number", wild),
        "many": lambda wild: or_garbage(arrays((*keys, *KINDS[layout]), wild), wild),
        "weights": lambda wild: or_garbage(arrays(keys[:1], wild), wild),
        "times": lambda wild: or_garbage(integers(range(keys[0]), wild), wild),
        "way": lambda wild: names(st.just(way), wild).map(lambda name: (name, None)),
    }
    return function, [draw(kinds[kind](wild[i])) for i, kind in enumerate(of_arguments.split())]


BLENDS = [
    (sinew.interpolate.between, "transform transform number way"),
    (sinew.interpolate.blend, "many weights way"),
    (sinew.spline.catmull_rom, "many times number way"),
    (sinew.spline.catmull_rom_vector, "many times number"),
]


class Draw:
    """Draws arguments of calls. Of some `count` none or one may be anything, so that errors do not hide each
    other."""

    def __init__(self, draw, count):
        self.draw = draw
        self._chosen = draw(st.integers(-1, count - 1))
        self._drawn = itertools.count()

    def _is_wild(self):
        return next(self._drawn) == self._chosen

    def _pair(self, make, is_optional):
        wild = self._is_wild()
        strategy = or_garbage(make(wild), wild)
        return self.draw(st.one_of(st.just((None, None)), strategy) if is_optional else strategy)

    def array(self, *shape, optional=False):
        return self._pair(lambda wild: arrays(shape, wild), optional)

    def integers(self, values, optional=False):
        return self._pair(lambda wild: integers(values, wild), optional)

    def one(self, known):
        """One of the known values, without plain numbers."""
        return self.draw(names(known, self._is_wild()))

    def threads(self):
        return self.one(st.one_of(st.none(), st.integers(0, 70)))

    def out(self, count):
        return self.one(st.sampled_from([None, np.zeros((count, 3), np.float32)]))

    def skin(self, vertices, each, bones):
        """Rest points and influences."""
        count = vertices * each
        return [
            self.array(vertices, 3),
            self.integers([each * vertex for vertex in range(vertices + 1)]),
            self.integers([i % bones for i in range(count)]),
            self._pair(lambda wild: arrays((count,), wild).map(positive), False),
        ]

    def faces(self, vertices):
        """Of one of SHEETS: rest points, the faces' offsets and corners, and edges."""
        offsets, corners, ends = SHEETS[vertices]
        edges = self.one(st.just(np.array(ends, np.int32).reshape(-1, 2)))
        return [self.array(vertices, 3)[0], self.integers(offsets)[0], self.integers(corners)[0], edges]


TRANSFORMS = st.sampled_from(["affine", "rows", "quat_vec", "dual_quat"])


@st.composite
def fit_calls(draw):
    count, layout = draw(st.integers(0, 5)), draw(TRANSFORMS)
    d = Draw(draw, 8)
    weights = d.array(count, optional=True)
    if draw(st.booleans()):
        directions = [(None, None)] * 3
        if draw(st.booleans()):
            directions = [d.array(count, 3), d.array(count, 3), (None, None)]
        keywords = ("source_directions", "target_directions", "direction_weights")
        return sinew.fit.rigid, [d.array(count, 3), d.array(count, 3), weights, *directions], *keywords
    poses = d.array(count, *KINDS[layout])
    if draw(st.booleans()):
        return sinew.fit.hand_eye, [poses, d.array(count, *KINDS[layout]), weights]
    return sinew.fit.average, [poses, weights, (draw(st.booleans()), None)], "robust"


@st.composite
def ik_calls(draw):
    count, shape = draw(st.integers(1, 3)), KINDS[draw(TRANSFORMS)]
    d = Draw(draw, 6)
    effector = sinew.ik.Effector(count - 1, 1.0, 0.5, has_pole=True, pole_angle=0.2)
    solver = sinew.ik.Solver(np.arange(-1, count - 1, dtype=np.int32), [effector])
    method = d.one(st.sampled_from(sinew.ik.METHODS)), None
    given = [
        d.array(count, *shape),
        d.array(1, 3),
        d.array(1, *shape),
        d.array(1, 3),
        d.array(count, 4),
        method,
    ]
    return solver.solve, [*given, (5, None)], "rotations", "method", "iterations"


def run(function, arguments, *keywords):
    """The last arguments have these keywords."""
    given, plain = [given for given, _ in arguments], plain_of(arguments)
    count = len(given) - len(keywords)
    result = attempt(function, given[:count], dict(zip(keywords, given[count:], strict=True)))
    if result is not None:
        same(result, function(*plain[:count], **dict(zip(keywords, plain[count:], strict=True))))


def same_on_one_thread(thing, method, given, shape, **named):
    """Calls a method that takes the arguments `out` and `threads`."""
    call = getattr(thing, method)
    result = attempt(call, given, named)
    if result is not None:
        assert result.shape == shape
        same(result, call(*given, **(named | {"out": None, "threads": 1})))
    return result


def many(part):
    """Settings for this case's share of the examples."""
    return settings(
        max_examples=max(10, int(EXAMPLES * part)),
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


@many(0.25)
@given(transform_calls())
def test_transforms(call):
    run(*call)


@many(0.2)
@given(st.data())
def test_blends_and_splines(data):
    run(*blended(data.draw, BLENDS, (), (data.draw(st.integers(1, 5)),)))


@many(0.05)
@given(fit_calls())
def test_fits(call):
    run(*call)


@many(0.05)
@given(ik_calls())
def test_inverse_kinematics(call):
    run(*call)


@many(0.05)
@given(st.data())
def test_solvers_of_inverse_kinematics(data):
    count, d = data.draw(st.integers(1, 3)), Draw(data.draw, 10)
    fields = [d.one(st.just(count - 1)), *(d.one(st.floats(-1, 4)) for _ in range(2))]
    fields += [d.one(st.booleans()), d.one(st.floats(-4, 4))]
    effectors = d.one(st.just([sinew.ik.Effector(*fields)]))
    shapes = {"locked": (3,), "limits": (3, 2), "stiffness": (3,)}
    named = {name: d.array(count, *shape, optional=True)[0] for name, shape in shapes.items()}
    given_data = [d.integers(range(-1, count - 1))[0], effectors]
    attempt(sinew.ik.Solver, given_data, named, ("weights", "pole_angle"))


@many(0.15)
@given(st.data())
def test_skeletons(data):
    count = data.draw(st.integers(0, 4))
    parents = or_garbage(integers(range(-1, count - 1)), data.draw(st.booleans()))
    skeleton = attempt(sinew.Skeleton, [data.draw(parents)[0]])
    if skeleton is None:
        skeleton = sinew.Skeleton(np.arange(-1, count - 1, dtype=np.int32))
    one, keys = (skeleton.bone_count,), data.draw(st.integers(1, 3))
    calls = [
        (skeleton.root_relative, "one"),
        (skeleton.interpolate, "one one number way"),
        (skeleton.spline, "many times number way"),
        (skeleton.spline_vector, "many times number"),
    ]
    run(*blended(data.draw, calls, one, (keys, *one)))


def plain_mesh(values):
    types = (np.float32, np.int32, np.int32, np.float32, np.float32)
    return [
        given if array is None else np.array(array, dtype, order="C")
        for (given, array), dtype in zip(values, types, strict=True)
    ]


@many(0.4)
@given(st.data())
def test_meshes(data):
    vertices = data.draw(st.sampled_from([0, 1, 2, 5, 20]))
    each, bones = data.draw(st.integers(0, 4)), data.draw(st.integers(1, 4))
    d = Draw(data.draw, 18)
    mesh = [*d.skin(vertices, each, bones), d.array(bones, 4, 4, optional=True)]
    binding = made(sinew.Binding, [*(given for given, _ in mesh), LINEAR])
    if binding is None:
        return
    method, other = d.one(METHODS), d.one(METHODS)
    mix = d.one(st.sampled_from([None, (other, d.array(vertices)[0])]))
    deformer = made(sinew.Deformer, [binding, method, mix])
    if deformer is None:
        return
    points = d.array(vertices, 3)
    moved = attempt(deformer.set_rest_points, [points[0]])
    pose, out, threads = d.array(binding.bone_count, 4, 4), d.out(vertices), d.threads()
    space = d.array(4, 4, optional=True)
    inverses = d.array(binding.bone_count, 4, 4, optional=True)
    key = st.sampled_from(["sdef.interpolation", "sdef", "", "dq.interpolation", b"sdef", 3, None, (1,)])
    value = d.one(st.just("slerp"))
    of_chain = {f"{name}.signs": "hierarchy" for name in ("dq", "cor", "sbs", "dib")}
    chosen = [None, {}, of_chain, {"sdef.interpolation": value}, {data.draw(key): value}]
    parameters = d.one(st.sampled_from(chosen))
    count = binding.bone_count
    parents = d.one(st.sampled_from([None, [*range(-1, count - 1)], [-1], [0] * count]))
    turns = d.array(count, 4, optional=True)
    options = [parameters, parents, turns[0]]
    result = attempt(deformer.deform, [pose[0], out, threads, space[0], inverses[0], *options])
    if result is None:
        return
    assert result.shape == (binding.vertex_count, 3)
    plain = sinew.Deformer(sinew.Binding(*plain_mesh(mesh), LINEAR), method, mix)
    if moved:
        plain.set_rest_points(np.array(points[1], np.float32, order="C"))
    types = (np.float32, np.float32, np.float64, np.float32)
    pose, space, inverses, turns = (
        given if array is None else np.array(array, dtype, order="C")
        for (given, array), dtype in zip((pose, space, inverses, turns), types, strict=True)
    )
    same(result, plain.deform(pose, None, 1, space, inverses, parameters, parents, turns))


SHEETS = {
    0: ([0], [], []),
    2: ([0], [], [0, 1]),
    4: ([0, 3, 6], [0, 1, 2, 0, 2, 3], [0, 1, 1, 2, 2, 0, 2, 3, 3, 0]),
    5: ([0, 5], [0, 1, 2, 3, 4], [0, 1, 1, 2, 2, 3, 3, 4, 4, 0, 0, 2]),
}


@many(0.2)
@given(st.data())
def test_delta_mush(data):
    vertices = data.draw(st.sampled_from(sorted(SHEETS)))
    d = Draw(data.draw, 15)
    settings = {
        "iterations": d.one(st.integers(0, 30)),
        "radius": d.one(st.floats(0, 2)),
        "factor": d.one(st.floats(0, 1)),
        "smooth_type": d.one(st.sampled_from(["simple", "length_weighted"])),
        "pin_boundary": d.one(st.booleans()),
        "weights": d.array(vertices, optional=True)[0],
    }
    mush = made(sinew.DeltaMush, d.faces(vertices), settings)
    if mush is not None:
        attempt(mush.bind, [d.array(vertices, 3)[0]], settings)
        how = {"scale": d.one(st.floats(-2, 2)), "out": d.out(vertices), "threads": d.threads()}
        same_on_one_thread(mush, "apply", [d.array(vertices, 3)[0]], (mush.vertex_count, 3), **how)


@many(0.2)
@given(st.data())
def test_normals(data):
    vertices = data.draw(st.sampled_from(sorted(SHEETS)))
    d = Draw(data.draw, 12)
    _points, offsets, corners, edges = d.faces(vertices)
    plain_offsets, plain_corners, ends = SHEETS[vertices]
    custom = np.array([(3 * i - 7, 900 * i) for i in range(len(plain_corners))], np.int16).reshape(-1, 2)
    sharp = {
        "sharp_edges": d.integers([i % 2 for i in range(len(ends) // 2)], optional=True)[0],
        "sharp_faces": d.integers([i % 2 for i in range(len(plain_offsets) - 1)], optional=True)[0],
        "custom_normals": d.one(st.sampled_from([None, custom])),
    }
    normals = made(sinew.Normals, [d.one(st.just(vertices)), offsets, corners, edges], sharp)
    if normals is None:
        return
    domain = d.one(st.sampled_from([None, "vertex", "corner", "face"]))
    given_data, how = [d.array(vertices, 3)[0], domain], {"out": d.out(vertices), "threads": d.threads()}
    count = getattr(normals, f"{domain}_count", getattr(normals, f"{normals.domain}_count"))
    result = same_on_one_thread(normals, "compute", given_data, (count, 3), **how)
    assert result is None or np.isfinite(result).all()


@many(0.2)
@given(st.data())
def test_skinned_normals(data):
    vertices, bones = data.draw(st.sampled_from([0, 1, 5, 20])), data.draw(st.integers(1, 4))
    d = Draw(data.draw, 13)
    mesh = np.zeros((vertices, 3)), range(vertices + 1), np.arange(vertices) % bones, np.ones(vertices)
    binding = sinew.Binding(*mesh, vertex_data=LINEAR)
    frames = data.draw(st.sampled_from([vertices, 3 * vertices]))
    of_frames = None if frames == vertices else [i % vertices for i in range(frames)]
    given_data = [binding, d.array(frames, 3)[0], d.array(frames, 3, optional=True)[0]]
    skinned = made(
        sinew.SkinnedNormals, [*given_data, d.one(st.just(of_frames)), d.one(METHODS), d.one(st.none())]
    )
    if skinned is None:
        return
    pose, options = d.array(bones, 4, 4)[0], [d.threads(), *(d.one(st.none()) for _ in range(5))]
    result = attempt(skinned.deform, [pose, *options])
    if result is not None:
        assert (result[0].shape, result[1].shape) == ((vertices, 3), (skinned.frame_count, 3))
    alone = attempt(skinned.deform_normals, [pose, d.array(vertices, 3)[0], None, *options])
    assert alone is None or alone.shape == (skinned.frame_count, 3)


def stage(d, kind, skin, given_data, named):
    """One that takes a Binding, with other rest points, or None if it was refused correctly."""
    binding = made(sinew.Binding, [given for given, _ in skin])
    if binding is None:
        return None
    thing = made(kind, [binding, *given_data], named, ("segments",))
    if thing is not None:
        attempt(thing.set_rest_points, [d.array(thing.vertex_count, 3)[0]])
    return thing


def apply_stage(d, thing, named):
    count = thing.vertex_count
    given_data = [d.array(count, 3)[0], d.array(thing.bone_count, 4, 4)[0]]
    same_on_one_thread(thing, "apply", given_data, (count, 3), out=d.out(count), **named)


@many(0.1)
@given(st.data())
def test_twist_spreads(data):
    vertices, bones = data.draw(st.sampled_from([0, 1, 2, 20])), data.draw(st.integers(1, 4))
    d = Draw(data.draw, 14)
    count = data.draw(st.integers(0, bones))
    twists = np.column_stack([np.arange(count), *([np.arange(count) % bones] * 2), np.arange(count) % 2])
    skin = d.skin(vertices, data.draw(st.integers(0, 4)), bones)
    given_data = [twists, d.array(count, 3)[0], d.array(count, 3)[0], d.array(bones, 4, 4)[0]]
    more = {
        "bones_from_model": d.array(4, 4, optional=True)[0],
        "weights": d.array(vertices, optional=True)[0],
        "mix": d.array(vertices, optional=True)[0],
    }
    spread = stage(d, sinew.TwistSpread, skin, given_data, more)
    if spread is None:
        return
    how = {
        "amount": d.one(st.floats(0, 1)),
        "amounts": d.array(count, optional=True)[0],
        "curves": d.array(count, optional=True)[0],
        "channels": d.array(count, 7, optional=True)[0],
        "blend": d.one(st.sampled_from(["linear", "matrices", "rotations", "logarithms"])),
    }
    attempt(spread.angles, [d.array(spread.bone_count, 4, 4)[0], how["channels"]])
    apply_stage(d, spread, how)


@many(0.1)
@given(st.data())
def test_bulge_limits(data):
    vertices, bones = data.draw(st.sampled_from([0, 1, 2, 20])), data.draw(st.integers(1, 4))
    d = Draw(data.draw, 14)
    skin = d.skin(vertices, data.draw(st.integers(0, 4)), bones)
    more = {
        "bones_from_model": d.array(4, 4, optional=True)[0],
        "weights": d.array(vertices, optional=True)[0],
    }
    limit = stage(d, sinew.BulgeLimit, skin, [d.array(bones, 3)[0], d.array(bones, 3)[0]], more)
    if limit is not None:
        form = d.one(st.sampled_from(["continuous", "kim_han"]))
        apply_stage(d, limit, {"strength": d.one(st.floats(0, 1)), "form": form})


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
