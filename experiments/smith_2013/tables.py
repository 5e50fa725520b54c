# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables 3.1 to 3.10: memory, operations, times, accuracy."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import sinew

from . import orders, printed
from .measure import OPERATIONS, Measurements, Timing
from .model import Fact, Row, Table
from .orders import RATIO_TOLERANCE

LAYOUTS = {"affine": sinew.affine, "quat_vec": sinew.quat_vec, "dual_quat": sinew.dual_quat}
# The report's matrices normalise the axis, as glm::rotate does; its quaternions are normalised themselves.
AS_REPORT = {"affine": "axis", "quat_vec": "quaternion", "dual_quat": "quaternion"}
# Coordinates reach 10.8, where float32 has steps of 1e-6: ten of them.
CHAIN_TOLERANCE = 1e-5
# The number of neighbouring angles that are tried, any of which can have given the printed numbers.
ANGLES = 2000
HOW_TO_MEASURE = (
    "Not measured: it takes programs that are built against GLM and Eigen, which ./dev report builds and "
    "passes on."
)


def tables(measurements: Measurements | None) -> tuple[Table, ...]:
    """Returns all ten tables; those that need `measurements` say so without them."""
    return (
        memory(),
        point_operations(measurements),
        chain_operations(measurements),
        chain_times(measurements),
        point_times(measurements),
        translation(),
        one_by_one(),
        combined(),
        interpolation_times(measurements),
        skinning_times(measurements),
    )


def error(got: object, expected: object) -> float:
    """Returns the largest difference of a component."""
    return float(np.abs(np.asarray(got, np.float64) - np.asarray(expected, np.float64)).max())


def memory() -> Table:
    # The fourth row of a matrix, always (0, 0, 0, 1), exists only in Python's arrays.
    sizes = {name: module.identity().size for name, module in LAYOUTS.items()}
    sizes["affine"] = sinew.affine.identity()[:3].size
    rows = [
        Row(
            printed.NAMES[name],
            (printed.MEMORY[name],),
            (size,),
            size == printed.MEMORY[name],
            more={"bytes in float32": 4 * size},
        )
        for name, size in sizes.items()
    ]
    return Table(
        "3.1",
        "Memory of the representations",
        ("numbers",),
        "The numbers must be equal.",
        0,
        tuple(rows),
        ("bytes in float32",),
    )


# --- Operations

_OPERATION_COLUMNS = ("adds", "multiplies", "total")
_OPERATION_NOTE = (
    "Counted by running Sinew's templates on a number that counts. As in the report, multiplying by a 0 or "
    "1 that the source writes and adding such a 0 are free. A doubling counts as an addition, x + x: so the "
    "report's numbers come out."
)


def _operations(counts: dict[str, int]) -> tuple[int, int, int]:
    """Counts as the report does. These operations have no divisions or roots, unlike those that are timed."""
    adds = counts["additions"] + counts["doublings"]
    return adds, counts["multiplications"], adds + counts["multiplications"]


def _operation_rows(
    counts: dict[str, dict[str, int]],
    wanted: dict[str, tuple[int, int, int]],
    names: dict[str, str],
    why: dict[str, str],
) -> tuple[Row, ...]:
    rows = []
    for key, name in names.items():
        ours, expected = _operations(counts[key]), wanted.get(key)
        agrees = None if expected is None else ours == expected
        rows.append(Row(name, expected, ours, agrees, why.get(key, "") if agrees is False else ""))
    return tuple(rows)


def point_operations(measurements: Measurements | None) -> Table:
    title, tolerance = "Operations to move a point", "The numbers must be equal."
    if measurements is None:
        return Table("3.2", title, _OPERATION_COLUMNS, tolerance, 0, missing=HOW_TO_MEASURE)
    counts = measurements.counts["3.2"]
    products = _operations(counts["dual_quat_by_products"])
    names = {
        **printed.NAMES,
        "dual_quat_by_products": "The report's formula d p d* by our product",
        "matrix_4x4": "GLM's 4x4 matrix, fourth row and all",
    }
    why = {
        "dual_quat": "Ours rotates the point by two cross products and reads the translation from 2 dual "
        "real*. "
        f"The report's formula, two products of dual quaternions, takes {products[0]} and {products[1]} when "
        "every component is computed; how it comes to the printed numbers, it does not say."
    }
    return Table(
        "3.2",
        title,
        _OPERATION_COLUMNS,
        tolerance,
        0,
        _operation_rows(counts, printed.POINT_OPERATIONS, names, why),
        notes=(_OPERATION_NOTE,),
    )


def chain_operations(measurements: Measurements | None) -> Table:
    title, tolerance = "Operations to chain two transforms", "The numbers must be equal."
    if measurements is None:
        return Table("3.3", title, _OPERATION_COLUMNS, tolerance, 0, missing=HOW_TO_MEASURE)
    names = {**printed.NAMES, "matrix_4x4": "GLM's 4x4 matrix, fourth row and all"}
    adds, multiplies, total = printed.CHAIN_OPERATIONS["quat_vec"]
    why = {
        "quat_vec": f"Adds and multiplies are equal; the printed total of {total} is a slip: "
        f"{adds} + {multiplies} = {adds + multiplies}.",
        "dual_quat": "Three quaternion products have 48 multiplications and 36 additions: the printed "
        "columns are exchanged. Adding two of the products, in each component, makes 4 additions more.",
    }
    return Table(
        "3.3",
        title,
        _OPERATION_COLUMNS,
        tolerance,
        0,
        _operation_rows(measurements.counts["3.3"], printed.CHAIN_OPERATIONS, names, why),
        notes=(_OPERATION_NOTE,),
    )


# --- Times

_UNOPTIMISED = "ratio, not optimised"
# The table in which a candidate's operations are counted.
_COUNTED_IN = {"3.4": "3.3", "3.5": "3.2"}
_COUNTED = {
    "sinew_affine": "affine",
    "sinew_quat_vec": "quat_vec",
    "sinew_dual_quat": "dual_quat",
    "glm_4x4": "matrix_4x4",
    **{
        f"sinew_{name}": name
        for name in ("matrix_linear", "matrix_log", "qv_nlerp", "qv_slerp", "dlb", "sclerp")
    },
    **{f"sinew_{name}": name for name in ("lbs", "qv", "dq")},
}
_TIME_COLUMNS = ("printed s", "ns each", "spread ns", "fastest ns", "operations", _UNOPTIMISED)


def _time_table(
    number: str,
    title: str,
    measurements: Measurements | None,
    names: dict[str, str],
    seconds: dict[str, float],
    glm: dict[str, str],
    notes: tuple[str, ...] = (),
) -> Table:
    """Returns a table of ratios to the first of `names`, plain 4x4 matrices.

    names    of candidates, for people
    seconds  printed, by candidate; the first is that of the report's matrices
    glm      the candidates as in the report, by those that `seconds` names
    """
    tolerance = (
        "Ratios to the report's matrices, 4x4 with all sixteen numbers; one agrees within "
        f"{RATIO_TOLERANCE:.0%} of the printed one. Without optimisation the ratios are to GLM's 4x4. The "
        "spread is the range of the middle half of the runs."
    )
    if measurements is None:
        return Table(number, title, ("ratio",), tolerance, 2, missing=HOW_TO_MEASURE)
    each = OPERATIONS[number]
    counts = measurements.counts[_COUNTED_IN.get(number, number)]

    def times(key: str, of: dict[str, Timing]) -> Timing:
        return of[f"{number}/{key}"]

    base_key = next(iter(names))
    base = times(base_key, measurements.optimised)
    glm_base = times("glm_4x4", measurements.unoptimised)
    rows = []
    for key, name in names.items():
        ours = times(key, measurements.optimised)
        slow = measurements.unoptimised.get(f"{number}/{key}")
        ratio = ours.median / base.median
        expected = seconds[key] / seconds[base_key] if key in seconds else None
        agrees, why = None, ""
        if expected is not None and key != base_key:
            agrees = abs(ratio / expected - 1) <= RATIO_TOLERANCE
            if not agrees:
                like = times(glm[key], measurements.unoptimised)
                why = (
                    f"Optimisation makes plain matrices {_times(number, base_key, measurements)} times as "
                    f"fast and these {_times(number, key, measurements)} times. Without it, and in GLM where "
                    f"GLM has it, the ratio is {like.median / glm_base.median:.2f}."
                )
        more: dict[str, float | str] = {
            "printed s": seconds.get(key, ""),
            "ns each": ours.median / each * 1e9,
            "spread ns": ours.spread / each * 1e9,
            "fastest ns": ours.fastest / each * 1e9,
            "operations": counts[_COUNTED[key]]["total"] if _COUNTED.get(key) in counts else "",
            _UNOPTIMISED: "" if slow is None else slow.median / glm_base.median,
        }
        rows.append(Row(name, None if expected is None else (expected,), (ratio,), agrees, why, more))
    printed_each = seconds[base_key] / each * 1e9
    glm_each = glm_base.median / each * 1e9
    plain_each = base.median / each * 1e9
    first = (
        f"The report's matrices take {printed_each:,.0f} ns each. Here GLM's take {glm_each:,.0f} ns without "
        f"optimisation, and plain loops {plain_each:.1f} ns with it: the printed times look like those of a "
        "build for debugging."
    )
    facts = orders.facts(measurements, number)
    return Table(number, title, ("ratio",), tolerance, 2, tuple(rows), _TIME_COLUMNS, facts, (first, *notes))


def _times(number: str, key: str, measurements: Measurements) -> str:
    """Returns the factor by which optimisation makes it faster."""
    name = f"{number}/{key}"
    return f"{measurements.unoptimised[name].median / measurements.optimised[name].median:.0f}"


_OURS_AND_OTHERS = {
    "plain_4x4": "Matrices 4x4, plain loops",
    "lanes_4x4": "Matrices 4x4, registers of four",
    "lanes_3x4": "Matrices 3x4, registers of four",
    "sinew_affine": "Matrices 3x4, Sinew",
    "sinew_quat_vec": "Quaternion-vector, Sinew",
    "sinew_dual_quat": "Dual quaternions, Sinew",
    "glm_4x4": "Matrices 4x4, GLM",
    "glm_quat_vec": "Quaternion-vector, GLM",
    "glm_dual_quat": "Dual quaternions, GLM",
    "eigen_4x4": "Matrices 4x4, Eigen",
    "eigen_3x4": "Matrices 3x4, Eigen",
    "eigen_quat_vec": "Quaternion-vector, Eigen",
}
_GLM = {"sinew_quat_vec": "glm_quat_vec", "sinew_dual_quat": "glm_dual_quat"}


def _seconds(of: dict[str, float]) -> dict[str, float]:
    keys = {"affine": "plain_4x4", "quat_vec": "sinew_quat_vec", "dual_quat": "sinew_dual_quat"}
    return {keys[name]: value for name, value in of.items()}


def chain_times(measurements: Measurements | None) -> Table:
    return _time_table(
        "3.4",
        "Time to combine six transforms, 100,000 times",
        measurements,
        _OURS_AND_OTHERS,
        _seconds(printed.CHAIN_SECONDS),
        _GLM,
    )


def point_times(measurements: Measurements | None) -> Table:
    return _time_table(
        "3.5",
        "Time to move a point, 1,000,000 times",
        measurements,
        _OURS_AND_OTHERS,
        _seconds(printed.POINT_SECONDS),
        _GLM,
    )


def interpolation_times(measurements: Measurements | None) -> Table:
    keys = {"matrix_linear": "plain_4x4"}
    return _time_table(
        "3.9",
        "Time to interpolate between two transforms, 1,000,000 times",
        measurements,
        {
            "plain_4x4": "Matrices 4x4 linear, plain loops",
            "lanes_4x4": "Matrices 4x4 linear, registers of four",
            "lanes_3x4": "Matrices 3x4 linear, registers of four",
            "sinew_matrix_linear": "Matrices 3x4 linear, Sinew",
            "sinew_matrix_polar": "Matrices 3x4 polar, Sinew",
            "sinew_matrix_log": "Matrices 3x4 logarithm, Sinew",
            "sinew_qv_nlerp": "Quaternion-vector nlerp, Sinew",
            "sinew_qv_slerp": "Quaternion-vector slerp, Sinew",
            "sinew_dlb": "Dual quaternions DLB, Sinew",
            "sinew_sclerp": "Dual quaternions ScLERP, Sinew",
            "glm_4x4": "Matrices 4x4 linear, GLM",
            "glm_quat_vec_nlerp": "Quaternion-vector nlerp, GLM",
            "glm_quat_vec_slerp": "Quaternion-vector slerp, GLM",
            "glm_dual_quat": "Dual quaternions DLB, GLM",
            "glm_dual_quat_sclerp": "Dual quaternions ScLERP, Kenwright's on GLM",
            "eigen_4x4": "Matrices 4x4 linear, Eigen",
            "eigen_3x4": "Matrices 3x4 linear, Eigen",
            "eigen_quat_vec_nlerp": "Quaternion-vector nlerp, Eigen",
            "eigen_quat_vec_slerp": "Quaternion-vector slerp, Eigen",
        },
        {keys.get(name, f"sinew_{name}"): value for name, value in printed.INTERPOLATION_SECONDS.items()},
        {
            "sinew_qv_nlerp": "glm_quat_vec_nlerp",
            "sinew_qv_slerp": "glm_quat_vec_slerp",
            "sinew_dlb": "glm_dual_quat",
            "sinew_sclerp": "glm_dual_quat_sclerp",
        },
        (
            "Sinew's functions check more than the others: they also say whether the result is defined. "
            "Kenwright's ScLERP, which the report took, divides by the sine of half the angle: between equal "
            "rotations it is NaN.",
        ),
    )


def skinning_times(measurements: Measurements | None) -> Table:
    keys = {"lbs": "plain_4x4"}
    return _time_table(
        "3.10",
        "Time to blend three transforms and move a point, 1,000,000 times",
        measurements,
        {
            "plain_4x4": "Matrix linear blending 4x4, plain loops",
            "lanes_4x4": "Matrix linear blending 4x4, registers of four",
            "lanes_3x4": "Matrix linear blending 3x4, registers of four",
            "sinew_lbs": "Matrix linear blending 3x4, Sinew",
            "sinew_qv": "Direct quaternion blending, Sinew",
            "sinew_dq": "Dual quaternion linear blending, Sinew",
            "kernel_lbs": "Matrix linear blending, Sinew's kernel",
            "kernel_qv": "Direct quaternion blending, Sinew's kernel",
            "kernel_dq": "Dual quaternion linear blending, Sinew's kernel",
            "kernel_log": "Log-matrix blending, Sinew's kernel",
            "kernel_sbs": "Spherical blend skinning, Sinew's kernel",
            "glm_4x4": "Matrix linear blending 4x4, GLM",
            "glm_quat_vec": "Direct quaternion blending, GLM",
            "glm_dual_quat": "Dual quaternion linear blending, GLM",
            "eigen_4x4": "Matrix linear blending 4x4, Eigen",
            "eigen_3x4": "Matrix linear blending 3x4, Eigen",
            "eigen_quat_vec": "Direct quaternion blending, Eigen",
        },
        {keys.get(name, f"sinew_{name}"): value for name, value in printed.SKINNING_SECONDS.items()},
        {"sinew_qv": "glm_quat_vec", "sinew_dq": "glm_dual_quat"},
        (
            "The report does not say how often; a million times is taken, as in Table 3.5. Sinew without a "
            "kernel is the one vertex of native/sinew/methods, written like the paper; a kernel does "
            "meshes of 10,000 vertices, a hundred times, on one thread.",
        ),
    )


# --- Accuracy


def pair(
    angle: float, axis: tuple[float, ...], shift: tuple[float, ...], dtype: type, normalise: str
) -> np.ndarray:
    """Returns a quaternion-vector pair [7], normalised as `normalise` says: "axis" or "quaternion".

    angle  degrees
    axis   as printed: rounded, and so not of unit length
    """
    half, direction = np.radians(angle) / 2, np.array(axis, np.float64)
    if normalise == "axis":
        direction /= np.linalg.norm(direction)
    quaternion = np.array([np.cos(half), *(np.sin(half) * direction)])
    quaternion /= np.linalg.norm(quaternion)
    return np.array([*quaternion, *shift], dtype)


def chain(name: str, dtype: type, normalise: str) -> np.ndarray:
    """Returns transforms A to D of Table 3.7 in the representation `name`."""
    pairs = np.array([pair(*row, dtype, normalise) for row in printed.CHAIN.values()])
    return pairs if name == "quat_vec" else getattr(sinew.quat_vec, f"to_{name}")(pairs)


def moved_one_by_one(name: str, dtype: type, normalise: str) -> np.ndarray:
    """[4, 3]: the point (0, 0, 0) after each transform, one after the other."""
    point: np.ndarray = np.zeros(3, dtype)
    points: list[np.ndarray] = []
    for transform in chain(name, dtype, normalise):
        point = LAYOUTS[name].transform_point(transform, point)
        points.append(point)
    return np.array(points)


def moved_combined(name: str, dtype: type, normalise: str) -> np.ndarray:
    """[3]: the same with one transform, D C B A."""
    module = LAYOUTS[name]
    a, b, c, d = chain(name, dtype, normalise)
    product = module.compose(d, module.compose(c, module.compose(b, a)))
    return module.transform_point(product, np.zeros(3, dtype))


def moved_by_one(name: str, dtype: type) -> np.ndarray:
    """[3]: the point (0, 0, 0) after the transform of Table 3.6."""
    motion = pair(*printed.TRANSLATION, dtype, AS_REPORT[name])
    transform = motion if name == "quat_vec" else getattr(sinew.quat_vec, f"to_{name}")(motion)
    return LAYOUTS[name].transform_point(transform, np.zeros(3, dtype))


def _vector(numbers: np.ndarray) -> tuple[float, ...]:
    return tuple(float(number) for number in numbers)


def _text(numbers: np.ndarray) -> str:
    return ", ".join(f"{number:.7f}" for number in numbers)


def translation_errors(name: str) -> np.ndarray:
    """[ANGLES]: the error of the translation of Table 3.6 in float32, over the half angles next to 40
    degrees.

    A dual quaternion is normalised, as a chain of them is; its translation is read from 2 dual real*.
    """
    angle, axis, shift = printed.TRANSLATION
    steps = np.arange(ANGLES) - ANGLES // 2
    halves = (np.float32(np.radians(angle / 2)).view(np.int32) + steps).astype(np.int32).view(np.float32)
    direction = (np.array(axis) / np.linalg.norm(axis)).astype(np.float32)
    quaternions = np.column_stack([np.cos(halves), np.sin(halves)[:, None] * direction])
    pairs = np.column_stack([quaternions, np.tile(np.array(shift, np.float32), (ANGLES, 1))])
    transforms = pairs if name == "quat_vec" else getattr(sinew.quat_vec, f"to_{name}")(pairs)
    if name == "dual_quat":
        transforms = sinew.dual_quat.normalized(transforms)
    moved = LAYOUTS[name].transform_point(transforms, np.zeros(3, np.float32))
    return np.abs(moved.astype(np.float64) - shift).max(axis=1)


def translation() -> Table:
    rows = []
    for name, expected in printed.TRANSLATED.items():
        errors = translation_errors(name)
        # The printed digits end at 1e-8.
        theirs = error(expected, printed.TRANSLATION[2])
        agrees = errors.min() - 1e-8 <= theirs <= errors.max() + 1e-8
        rows.append(
            Row(
                printed.NAMES[name],
                expected,
                _vector(moved_by_one(name, np.float32)),
                bool(agrees),
                "" if agrees else f"Printed is {theirs:.1e} off, which is no rounding.",
                {
                    "printed, off (1, 0, 0.5)": theirs,
                    "ours, least": float(errors.min()),
                    "most": float(errors.max()),
                    "as far off or farther, %": float(100 * (errors >= theirs - 1e-8).mean()),
                    "in float64": error(moved_by_one(name, np.float64), printed.TRANSLATION[2]),
                },
            )
        )
    return Table(
        "3.6",
        "The translation of one transform: (0, 0, 0) rotated about (0, 1, 1) by 80 degrees and moved by (1, "
        "0, 0.5)",
        ("x", "y", "z"),
        f"It agrees where it is as far off (1, 0, 0.5) as float32 is for some of the {ANGLES:,} angles "
        "nearest to 80 degrees: the last digit of the angle, which is not printed, decides the last digits "
        "of the point.",
        8,
        tuple(rows),
        ("printed, off (1, 0, 0.5)", "ours, least", "most", "as far off or farther, %", "in float64"),
        (),
        ("The dual quaternion's error is the rounding of 2 dual real*, in the last digit of float32.",),
    )


_SHORT_NAMES = {"affine": "matrices", "quat_vec": "pair", "dual_quat": "dual quaternions"}
_CHAIN_COLUMNS = (
    "difference",
    "in float32",
    "float32, difference",
    "with unit axes",
    "difference from unit axes",
)


def _chain_row(
    label: str, name: str, expected: tuple[float, ...], built: dict[tuple[str, type], np.ndarray]
) -> Row:
    """built: [3] by what was normalised and element type."""
    ours = built[AS_REPORT[name], np.float64]
    unit, single = built["axis", np.float64], built[AS_REPORT[name], np.float32]
    difference = error(ours, expected)
    agrees = difference <= CHAIN_TOLERANCE
    return Row(
        label,
        expected,
        _vector(ours),
        agrees,
        "" if agrees else f"It is {difference:.1e} off.",
        {
            "difference": difference,
            "in float32": _text(single),
            "float32, difference": error(single, expected),
            "with unit axes": _text(unit),
            "difference from unit axes": error(unit, expected),
        },
    )


def _built(compute: Callable[[str, type, str], np.ndarray], name: str) -> dict[tuple[str, type], np.ndarray]:
    return {
        (normalise, dtype): compute(name, dtype, normalise)
        for normalise in ("axis", "quaternion")
        for dtype in (np.float32, np.float64)
    }


_CHAIN_TOLERANCE_TEXT = (
    f"A component agrees within {CHAIN_TOLERANCE:.0e}, ten steps of float32 at 10.8; ours is float64, built "
    "as the report's representation builds it. The report computed in float32, which stands beside it: its "
    "last digits are those of the order of its sums."
)


def chain_spreads() -> dict[str, float]:
    """The largest differences between the columns of Table 3.7, as printed and as computed here.

    as_report    ours, each built as in the report
    unit_axes    ours in float64, all with unit axes; unit_axes_float32 likewise
    quaternions  ours in float64, all with normalised quaternions
    axis_error   the largest difference of a printed axis's length from 1
    """

    def spread(columns: dict[str, np.ndarray]) -> float:
        values = list(columns.values())
        return max(error(a, b) for a in values for b in values)

    def ours(dtype: type, normalise: str) -> dict[str, np.ndarray]:
        return {name: moved_one_by_one(name, dtype, normalise) for name in LAYOUTS}

    return {
        "printed": spread({name: np.array(points) for name, points in printed.ONE_BY_ONE.items()}),
        "as_report": spread({n: moved_one_by_one(n, np.float64, AS_REPORT[n]) for n in LAYOUTS}),
        "unit_axes": spread(ours(np.float64, "axis")),
        "unit_axes_float32": spread(ours(np.float32, "axis")),
        "quaternions": spread(ours(np.float64, "quaternion")),
        "axis_error": max(abs(float(np.linalg.norm(axis)) - 1) for _, axis, _ in printed.CHAIN.values()),
    }


def one_by_one() -> Table:
    built = {name: _built(moved_one_by_one, name) for name in LAYOUTS}
    rows = []
    for step, letter in enumerate(printed.CHAIN):
        for name in LAYOUTS:
            here = {key: points[step] for key, points in built[name].items()}
            label = f"{letter}, {_SHORT_NAMES[name]}"
            rows.append(_chain_row(label, name, printed.ONE_BY_ONE[name][step], here))
    s = chain_spreads()
    notes = (
        f"Why the printed columns differ by up to {s['printed']:.1e}: the printed axes are rounded, and up "
        f"to {s['axis_error']:.1e} off unit length. The report's matrices normalise the axis, its "
        "quaternions the whole quaternion, which is another rotation. Built so in float64, ours differ by "
        f"{s['as_report']:.1e} too.",
        "The other reading, all three with unit axes (or all with normalised quaternions): they agree to "
        f"{s['unit_axes']:.0e} (or {s['quaternions']:.0e}) in float64 and to {s['unit_axes_float32']:.0e} in "
        "float32. What is left is rounding.",
    )
    return Table(
        "3.7",
        "A point through a chain of transforms, one after the other",
        ("x", "y", "z"),
        _CHAIN_TOLERANCE_TEXT,
        7,
        tuple(rows),
        _CHAIN_COLUMNS,
        _divergence(),
        notes,
    )


def _divergence() -> tuple[Fact, ...]:
    """Returns what section 3.4.3 says about the chain, by the printed digits and by ours in float32 with unit
    axes."""

    def apart(columns: dict[str, np.ndarray]) -> list[float]:
        return [error(a, b) for a, b in zip(columns["affine"], columns["dual_quat"], strict=True)]

    steps = apart({name: np.array(points) for name, points in printed.ONE_BY_ONE.items()})
    ours = apart({name: moved_one_by_one(name, np.float32, "axis") for name in LAYOUTS})
    grows = all(a < b for a, b in pairwise(ours))
    return (
        Fact(
            "Matrices and dual quaternions diverge by 1e-5, more with each transformation (section 3.4.3).",
            f"After A to D the printed ones are {', '.join(f'{step:.0e}' for step in steps)} apart, ours in "
            f"float32, all of one axis, {', '.join(f'{step:.0e}' for step in ours)}.",
            max(ours) > CHAIN_TOLERANCE / 2 and grows,
            {letter: step for letter, step in zip(printed.CHAIN, ours, strict=True)},
        ),
    )


def combined() -> Table:
    rows, ours, theirs = [], {}, {}
    for name, expected in printed.COMBINED.items():
        built = _built(moved_combined, name)
        rows.append(_chain_row(_SHORT_NAMES[name], name, expected, built))
        key = AS_REPORT[name], np.float32
        ours[name] = error(built[key], moved_one_by_one(name, np.float32, key[0])[-1])
        theirs[name] = error(expected, printed.ONE_BY_ONE[name][-1])
    listed = "; ".join(
        f"{printed.NAMES[name].lower()} {ours[name]:.1e} (printed {theirs[name]:.1e})" for name in ours
    )
    most = 1e-7 * max(1.0, *printed.COMBINED["affine"])
    fact = Fact(
        "Combined or one by one differs by 1e-7, least with matrices (section 3.4.3).",
        f"In float32 of a coordinate of 10.8: {listed}. That would be {most:.1e} as a part of it.",
        max(ours.values()) <= most and min(ours, key=ours.__getitem__) == "affine",
        ours,
    )
    return Table(
        "3.8",
        "The same chain combined into one transform",
        ("x", "y", "z"),
        _CHAIN_TOLERANCE_TEXT,
        7,
        tuple(rows),
        _CHAIN_COLUMNS,
        (fact,),
    )
