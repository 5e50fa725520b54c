# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the report's conclusions from its times with ours, using the best implementation of each
representation."""

from __future__ import annotations

from itertools import combinations, pairwise

from . import printed
from .measure import OPERATIONS, Measurements, Timing
from .model import Fact

# The implementations measured here, by representation. GLM's are first, which the report used.
CANDIDATES = {
    "affine": ("glm_4x4", "plain_4x4", "lanes_4x4", "lanes_3x4", "sinew_affine", "eigen_4x4", "eigen_3x4"),
    "quat_vec": ("glm_quat_vec", "sinew_quat_vec", "eigen_quat_vec"),
    "dual_quat": ("glm_dual_quat", "sinew_dual_quat"),
}
_OTHER_MATRICES = ("plain_4x4", "lanes_4x4", "lanes_3x4", "eigen_4x4", "eigen_3x4")
# By table: the times that the report prints, and the candidates of each row. For ScLERP, Kenwright's on GLM.
TIMED: dict[str, tuple[dict[str, float], dict[str, tuple[str, ...]]]] = {
    "3.4": (printed.CHAIN_SECONDS, CANDIDATES),
    "3.5": (printed.POINT_SECONDS, CANDIDATES),
    "3.9": (
        printed.INTERPOLATION_SECONDS,
        {
            "matrix_linear": ("glm_4x4", "sinew_matrix_linear", *_OTHER_MATRICES),
            "qv_nlerp": ("glm_quat_vec_nlerp", "sinew_qv_nlerp", "eigen_quat_vec_nlerp"),
            "qv_slerp": ("glm_quat_vec_slerp", "sinew_qv_slerp", "eigen_quat_vec_slerp"),
            "dlb": ("glm_dual_quat", "sinew_dlb"),
            "sclerp": ("glm_dual_quat_sclerp", "sinew_sclerp"),
        },
    ),
    "3.10": (
        printed.SKINNING_SECONDS,
        {
            "lbs": ("glm_4x4", "sinew_lbs", *_OTHER_MATRICES),
            "qv": ("glm_quat_vec", "sinew_qv", "eigen_quat_vec"),
            "dq": ("glm_dual_quat", "sinew_dq"),
        },
    ),
}
MAKERS = {
    "glm": "GLM",
    "plain": "plain loops",
    "lanes": "registers of four",
    "sinew": "Sinew",
    "eigen": "Eigen",
}
_ROWS = {
    "affine": "matrix",
    "quat_vec": "pair",
    "dual_quat": "dual quaternion",
    "matrix_linear": "linear matrices",
    "qv_nlerp": "nlerp",
    "qv_slerp": "slerp",
    "dlb": "DLB",
    "sclerp": "ScLERP",
    "lbs": "matrix",
    "qv": "pair",
    "dq": "dual quaternion",
}
# How far a printed ratio may differ from ours.
RATIO_TOLERANCE = 0.25


def nanoseconds(measurements: Measurements, table: str, name: str) -> float:
    """The time of one operation in a table's optimised loop."""
    return measurements.optimised[f"{table}/{name}"].median / OPERATIONS[table] * 1e9


def fastest(measurements: Measurements, table: str, row: str) -> str:
    """The name of the fastest implementation of a table's row."""
    return min(TIMED[table][1][row], key=lambda name: nanoseconds(measurements, table, name))


def best(measurements: Measurements, table: str, row: str) -> str:
    """The time of the fastest implementation of a table's row, its spread over the runs, and its name."""
    name = fastest(measurements, table, row)
    return _in_words(measurements.optimised[f"{table}/{name}"], table, name)


def ratio_of_best(measurements: Measurements, table: str, row: str, other: str) -> float:
    """The time of one row relative to another, each by its fastest implementation."""
    of_row, of_other = (
        nanoseconds(measurements, table, fastest(measurements, table, each)) for each in (row, other)
    )
    return of_row / of_other


def _in_words(timing: Timing, table: str, name: str) -> str:
    each = 1e9 / OPERATIONS[table]
    time, half = timing.median * each, timing.spread * each / 2
    digits = 1 if time >= 10 else 2
    return f"{time:.{digits}f} ± {half:.{digits}f} ns ({MAKERS[name.split('_')[0]]})"


def facts(measurements: Measurements, table: str) -> tuple[Fact, ...]:
    """Returns facts about the order of a table's rows: unoptimised as in the report, and optimised with the
    fastest of each; for Table 3.9 also about what section 3.5.3 says of ScLERP."""
    rows = TIMED[table][1]
    as_reported = {row: names[0] for row, names in rows.items()}
    fastest_of_each = {row: fastest(measurements, table, row) for row in rows}
    found = [
        _order(measurements.unoptimised, table, as_reported, "Without optimisation, as the report had them"),
        _order(measurements.optimised, table, fastest_of_each, "Optimised, by the fastest of each"),
    ]
    if table == "3.9":
        found += [
            _sclerp(measurements.unoptimised, as_reported, "Without optimisation, Kenwright's and GLM's"),
            _sclerp(measurements.optimised, fastest_of_each, "Optimised, by the fastest of each"),
        ]
    return tuple(found)


def _order(timings: dict[str, Timing], table: str, names: dict[str, str], how: str) -> Fact:
    seconds = TIMED[table][0]
    ours = {row: timings[f"{table}/{name}"] for row, name in names.items()}
    theirs = sorted(seconds, key=seconds.__getitem__)
    order = sorted(ours, key=lambda row: ours[row].median)
    pairs = list(combinations(theirs, 2))
    alike = sum(ours[a].median < ours[b].median for a, b in pairs)
    close = [
        f"{_ROWS[a]} and {_ROWS[b]}"
        for a, b in pairwise(order)
        if ours[b].median - ours[a].median < (ours[a].spread + ours[b].spread) / 2
    ]
    text = f"{how}: {', '.join(f'{_ROWS[row]} {_in_words(ours[row], table, names[row])}' for row in order)}. "
    text += f"Of {len(pairs)} pairs of rows {alike} are in the printed order."
    if close:
        text += f" Not told apart by the spread: {'; '.join(close)}."
    return Fact(
        f"From the fastest: {', '.join(_ROWS[row] for row in theirs)}.",
        text,
        order == theirs,
        {row: timing.median / OPERATIONS[table] * 1e9 for row, timing in ours.items()},
    )


def _sclerp(timings: dict[str, Timing], names: dict[str, str], how: str) -> Fact:
    seconds = printed.INTERPOLATION_SECONDS
    expected = seconds["sclerp"] / seconds["dlb"]
    ratio = timings[f"3.9/{names['sclerp']}"].median / timings[f"3.9/{names['dlb']}"].median
    return Fact(
        "ScLERP is almost twice as slow as DLB (section 3.5.3).",
        f"{how}: {ratio:.1f} times as long (printed {expected:.2f}).",
        abs(ratio / expected - 1) <= RATIO_TOLERANCE,
        {"ratio": ratio},
    )
