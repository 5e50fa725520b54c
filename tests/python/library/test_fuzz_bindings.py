# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects everything that the library exports from arbitrary arguments: the outcome is a result, or an error
that names an argument.

Accepted arguments must give the same result as plain contiguous arrays of the same numbers, on one thread.
SINEW_FUZZ_EXAMPLES is the number for all calls together: 6000 by default, 24000 in ./dev test --all.
"""

import os

import numpy as np
import pytest
import sinew
from calls import CALLS, FACES, MORE, SKIN

REFUSALS = (ValueError, TypeError, MemoryError, OverflowError)
EXAMPLES = int(os.environ.get("SINEW_FUZZ_EXAMPLES", "24000" if "SINEW_TEST_ALL" in os.environ else "6000"))


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


GARBAGE = [
    None, "", "dq", "\ud800", b"dq", 3, -1, 2**31, 2**63, -(2**70), 10**400, 1.5, np.nan, np.inf,
    1j, True, [], [[]], (), {}, set(), object(), type, len, Raises(), Lies(), [1, "a"], [[1, 2], [3]],
    np.array(None), np.array("text"), np.array(["a", "b"]), np.array([b"a"]), np.array({}),
    np.zeros((2, 3), complex), np.zeros(3, "M8[s]"), np.zeros(2, [("a", "f4"), ("b", "i8")]),
    np.zeros((2, 2), object), np.longdouble(1), np.zeros((2, 3), np.longdouble),
    np.ma.masked_all((2, 3)), np.broadcast_to(np.float32(0), (2**50, 3)),
    np.broadcast_to(np.float64(0), (2**50, 4, 4)), np.broadcast_to(np.int32(0), (2**55,)),
    memoryview(b"abc"), bytearray(12), range(5), np.dtype("f4"), np.float32,
]  # fmt: skip
DTYPES = ["f4", "f8", "f2", "i4", "i8", "u1", "u8", "?", ">f4", ">i4", ">f8"]
NUMBERS = [0, 1, -1, 0.5, 2, 3, 7, 1e-30, 1e20, 3e38, 1e300, np.nan, np.inf, -np.inf, 2**31, 1e-45]
INTEGERS = [-1, 0, 1, 5, 2**20 - 1, 2**20, 2**31 - 1, 2**31, 2**32, 2**62, -(2**31)]
LEADS = [(), (1,), (2,), (3,), (0,), (2, 1), (1, 3)]


class Arraylike:
    """Like tensors of other libraries."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array if dtype is None else self.array.astype(dtype)


def strided(array):
    """Every axis reversed, and every third element of a larger array."""
    large = np.zeros([3 * length for length in array.shape], array.dtype)
    other = large[(..., *(slice(None, None, -3) for _ in array.shape))]
    other[...] = array
    return other


def unaligned(array):
    memory = np.zeros(array.nbytes + 1, np.uint8)
    other = memory[1:].view(array.dtype).reshape(array.shape)
    other[...] = array
    return other


def read_only(array):
    array = array.copy()
    array.setflags(write=False)
    return array


# The same numbers in another form.
FORMS = {
    "plain": np.copy,
    "list": np.ndarray.tolist,
    "tuple": lambda a: tuple(a.tolist()) if a.ndim else a,
    "wide": lambda a: a.astype(np.float64 if a.dtype.kind == "f" else np.int64),
    "swapped bytes": lambda a: a.astype(a.dtype.newbyteorder()),
    "strided": strided,
    "fortran": np.asfortranarray,
    "read-only": read_only,
    "unaligned": unaligned,
    "with __array__": Arraylike,
    "memoryview": lambda a: memoryview(a) if a.dtype.isnative else a,
    "subclass": lambda a: a.view(np.recarray),
    "masked without masks": np.ma.asarray,
    "three rows": lambda a: a[..., :3, :] if a.shape[-2:] == (4, 4) else a,
}


def led(rng, array):
    """Repeated, with leading axes."""
    return np.broadcast_to(array, (*LEADS[rng.integers(len(LEADS))], *array.shape)).copy()


def spoilt(rng, array):
    """With another shape, type or number."""
    how = rng.integers(6)
    if how == 0 and array.ndim:
        return array[..., 0] if array.shape[-1] else array.reshape((*array.shape[:-1], 0, 1))
    if how == 1:
        return np.repeat(array[..., None], rng.integers(4), axis=-1)
    if how == 2:
        return led(rng, array)
    if how == 3 and array.ndim and array.size:
        return array.take(range(rng.integers(10)), axis=rng.integers(array.ndim), mode="wrap")
    if how == 4 and array.size:
        wrong = rng.choice(INTEGERS if array.dtype.kind == "i" else NUMBERS)
        array = array.astype(np.int64 if array.dtype.kind == "i" else array.dtype)
        array.flat[rng.integers(array.size)] = wrong
        return array
    return array.astype(rng.choice(DTYPES))


def as_array(value):
    """The array that a good argument is, or None."""
    array = np.asarray(value) if isinstance(value, list | np.ndarray) else np.array(None)
    return array if array.dtype.kind in "if" else None


def drawn(rng, name):
    """Arguments of a call that it accepts, of another size where it has a mesh."""
    needed, more = CALLS[name][1], MORE.get(name, {})
    good = dict(needed)
    if needed.keys() >= SKIN.keys():
        good |= skin(rng)
    if "." in name:
        # Of transforms, one or many.
        good = {each: value if as_array(value) is None else led(rng, value) for each, value in good.items()}
    if needed.keys() >= FACES.keys() and rng.integers(2):
        return good | sheet(rng, good)
    return good | {each: value for each, value in more.items() if rng.integers(2)}


def skin(rng):
    vertices, each = rng.choice([0, 1, 2, 5, 20]), rng.integers(5)
    weights = rng.uniform(0, 1, vertices * each).astype(np.float32)
    offsets, bones = each * np.arange(vertices + 1), np.arange(vertices * each) % 2
    points = rng.uniform(-1, 1, (vertices, 3)).astype(np.float32)
    return dict(zip(SKIN, (points, offsets, bones, weights), strict=True))


def sheet(rng, good):
    """Without faces, or one of five corners."""
    vertices, *faces = [(0, [0], [], []), (2, [0], [], [[0, 1]]), PENTAGON][rng.integers(3)]
    more = dict(zip(FACES, (np.array(each, int) for each in faces), strict=True))
    more["edges"] = more["edges"].reshape(-1, 2)
    if "vertex_count" in good:
        return more | {"vertex_count": min(vertices, 4)}
    return more | {"rest_points": rng.uniform(-1, 1, (vertices, 3))}


PENTAGON = 5, [0, 5], [0, 1, 2, 3, 4], [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0], [0, 2]]


def flat(result):
    """The arrays of a result; of an object what its pickle has."""
    if isinstance(result, (tuple, list)):
        return [part for item in result for part in flat(item)]
    if isinstance(result, dict):
        return flat([*result.items()])
    if type(result).__module__.startswith("sinew"):
        assert repr(result)
        return flat(result.__getstate__()) if hasattr(result, "__setstate__") else []
    return [np.asarray(result)]


def assert_same(result, plain):
    for one, other in zip(flat(result), flat(plain), strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype


def attempt(name, given):
    """The result, or None if it was refused correctly."""
    call, needed = CALLS[name]
    try:
        result = call(**given)
    except REFUSALS as error:
        if not isinstance(error, MemoryError):
            text = str(error)
            assert any(each in text for each in (*needed, *MORE.get(name, {}), *OTHERS)), text
            assert "\n" not in text or "incompatible" in text
        return None
    return True if result is None else result


# What errors name beside arguments of the call: of several together, and of what a call also makes.
OTHERS = "segments", "weights", "method", "self"


def form_of(rng, name, array):
    if name == "out":
        return array.copy()
    if array.dtype.kind == "f" and array.dtype.isnative:
        array = array.astype(rng.choice([array.dtype, np.float32]))
    return FORMS[rng.choice([*FORMS])](array)


def plain_of(good, given):
    """The same as contiguous arrays, without `out`; and their type: float64 if not all of the call's arrays
    are smaller."""
    plain = {name: value for name, value in given.items() if name != "out"}
    could_be = [name for name in plain if as_array(good[name]) is not None or isinstance(good[name], float)]
    # Plain numbers do not count.
    arrays = {name: np.asarray(plain[name]) for name in could_be}
    arrays = {name: a for name, a in arrays.items() if a.ndim or isinstance(plain[name], np.ndarray)}
    arrays = {name: array for name, array in arrays.items() if array.dtype.kind in "iufb"}
    wide = any(a.dtype.itemsize > (4 if a.dtype.kind == "f" else 2) for a in arrays.values())
    kind = np.float64 if wide else np.float32
    for name, array in arrays.items():
        # One that is larger has no memory of its own.
        if array.size < 2**20:
            if array.shape[-2:] == (3, 4) and np.shape(good[name])[-2:] == (4, 4):
                array = np.insert(array, 3, [0, 0, 0, 1], axis=-2)
            is_integer = array.dtype.kind in "iub" and np.asarray(good[name]).dtype.kind == "i"
            plain[name] = np.array(array, np.int64 if is_integer else kind, order="C")
    return plain, kind


def check(name, seed):
    rng = np.random.default_rng([seed, *name.encode()])
    good = drawn(rng, name)
    # None or one may be anything, so that errors do not hide each other.
    chosen = rng.choice([None, *good])
    given = {}
    for each, value in good.items():
        array = as_array(value)
        with np.errstate(all="ignore"):
            if each == chosen and (array is None or rng.integers(3) == 0):
                given[each] = GARBAGE[rng.integers(len(GARBAGE))]
            elif array is None:
                given[each] = value
            else:
                given[each] = form_of(rng, each, spoilt(rng, array) if each == chosen else array)
    result = attempt(name, given)
    if result is not None:
        plain, kind = plain_of(good, given)
        # Transforms have the type that numpy gives all arrays together, but float16.
        assert "." not in name or flat(result)[0].dtype == kind
        if "threads" in MORE.get(name, {}):
            plain["threads"] = 1
        assert_same(result, CALLS[name][0](**plain))


@pytest.mark.parametrize("name", CALLS)
def test_any_arguments_give_a_result_or_an_error_that_names_one(name):
    for seed in range(max(10, EXAMPLES // len(CALLS))):
        try:
            check(name, seed)
        except Exception as error:
            error.add_note(f"check({name!r}, {seed})")
            raise


def test_functions_without_arguments():
    for function in (sinew.methods, sinew.stages, sinew.keep_thread_state, sinew.thread_id):
        function()
        with pytest.raises(TypeError, match=function.__name__):
            function(1)
