# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 3.4 and 3.5: the path of a point between two transforms under every interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
import sinew
from sinew_addon.base.errors import SinewError
from sinew_addon.features.pages.plots import new_figure, to_svg

from . import printed
from .model import Fact, Figure, Picture

# The report's three first.
METHODS: tuple[sinew.interpolate.Method, ...] = (
    "matrix_linear",
    "qv_nlerp",
    "qv_slerp",
    "dlb",
    "sclerp",
    "matrix_polar",
    "matrix_log",
    "dib",
)
ORIGIN, CORNER = np.zeros(3), np.ones(3)
STEPS = 400


@dataclass(frozen=True)
class Path:
    """One method's path from the first end to the second.

    moved    [steps + 1, 3], positions of the point
    other    [steps + 1, 3], positions of the other of the two points
    rotated  [steps + 1], degrees from the first end; NaN where the transform is not rigid
    """

    moved: np.ndarray
    other: np.ndarray
    rotated: np.ndarray


def layout(method: str) -> ModuleType:
    if method.startswith("matrix"):
        return sinew.affine
    return sinew.quat_vec if method.startswith("qv") else sinew.dual_quat


def ends() -> np.ndarray:
    """Returns the two transforms as quaternion-vector pairs, [2, 7], with unit axes."""
    pairs = []
    for angle, axis, shift in printed.ENDS:
        one = sinew.quat_vec.from_axis_angle(np.array(axis, float), np.radians(angle))
        pairs.append([*one[:4], *shift])
    return np.array(pairs)


def in_layout(module: ModuleType, pairs: np.ndarray) -> np.ndarray:
    if module is sinew.quat_vec:
        return pairs
    return sinew.quat_vec.to_affine(pairs) if module is sinew.affine else sinew.quat_vec.to_dual_quat(pairs)


def paths(point: np.ndarray, steps: int = STEPS) -> dict[str, Path]:
    """Returns paths by method, for `point` [3]; `other` is the path of the other end of (0, 0, 0) to (1, 1,
    1)."""
    t = np.linspace(0.0, 1.0, steps + 1)
    other = CORNER if not point.any() else ORIGIN
    result: dict[str, Path] = {}
    for method in METHODS:
        module = layout(method)
        a, b = in_layout(module, ends())
        between = sinew.interpolate.between(a, b, t, method).transforms
        if method == "matrix_linear":
            rotated = np.full(len(t), np.nan)
        else:
            rotated = np.degrees(module.rigid_distance(a, between).angle)
        result[method] = Path(
            module.transform_point(between, point), module.transform_point(between, other), rotated
        )
    return result


def figure_3_4() -> Figure:
    all_paths = paths(ORIGIN)
    facts = (_bends(all_paths), _paces(all_paths))
    notes = (_spline_note(),)
    title = "The origin under interpolated transforms, seen along z"
    try:
        rotated = {method: path.rotated for method, path in all_paths.items()}
        pictures = (
            Picture(_PATH_CAPTION, _plot_paths(all_paths, "3.4")),
            Picture(
                "How far each has rotated from the first transform; linear matrices do not only rotate.",
                _plot_over_t(rotated, "degrees rotated", "3.4"),
            ),
        )
    except SinewError as error:
        return Figure("3.4", title, (), facts, notes, f"Not drawn: {error}.")
    return Figure("3.4", title, pictures, facts, notes)


def figure_3_5() -> Figure:
    all_paths = paths(CORNER)
    facts = (_shrinking(all_paths),)
    title = "The point (1, 1, 1) under interpolated transforms, seen along z"
    try:
        pictures = (
            Picture(_PATH_CAPTION, _plot_paths(all_paths, "3.5")),
            Picture(
                "How far the point is from where the origin goes, against sqrt(3), which it is at first.",
                _plot_over_t(_lengths(all_paths), "length kept", "3.5"),
            ),
        )
    except SinewError as error:
        return Figure("3.5", title, (), facts, (), f"Not drawn: {error}.")
    return Figure("3.5", title, pictures, facts)


_PATH_CAPTION = "x and y of the point. Dots: t = 0, 0.1, ... 1."


def _lengths(all_paths: dict[str, Path]) -> dict[str, np.ndarray]:
    """[steps + 1] by method: the distance of the two points, divided by sqrt(3), its value under a rigid
    transform."""
    return {
        method: np.linalg.norm(path.moved - path.other, axis=1) / np.sqrt(3.0)
        for method, path in all_paths.items()
    }


def bends(all_paths: dict[str, Path]) -> dict[str, float]:
    """Returns, by method, how far the path deviates from the straight line between its ends."""
    result = {}
    for method, path in all_paths.items():
        along = path.moved[-1] - path.moved[0]
        along = along / np.linalg.norm(along)
        offset = path.moved - path.moved[0]
        away = np.linalg.norm(offset - np.outer(offset @ along, along), axis=1)
        result[method] = float(away.max())
    return result


def _bends(all_paths: dict[str, Path]) -> Fact:
    values = bends(all_paths)
    straight = max(values[method] for method in ("matrix_linear", "matrix_polar", "qv_nlerp", "qv_slerp"))
    curved = min(values[method] for method in ("dlb", "sclerp"))
    return Fact(
        "Dual quaternions do not just rotate about the origin, but choose an ideal centre.",
        "So their paths of the origin are curved. Matrices (linear and polar) and pairs leave the straight "
        f"line by at most {straight:.0e}, dual quaternions by {curved:.2f}, logarithms of matrices by "
        f"{values['matrix_log']:.2f}.",
        straight < 1e-9 < 1e-2 < curved,
        values,
    )


def _paces(all_paths: dict[str, Path]) -> Fact:
    dlb, sclerp = all_paths["dlb"], all_paths["sclerp"]
    angle = float(np.abs(dlb.rotated - sclerp.rotated).max())
    distance = float(np.linalg.norm(dlb.moved - sclerp.moved, axis=1).max())
    a, b = in_layout(sinew.dual_quat, ends())
    t = np.linspace(0.1, 0.9, 9)
    one, other = (
        sinew.dual_quat.to_screw(
            sinew.dual_quat.compose(
                sinew.dual_quat.inverse(a), sinew.interpolate.between(a, b, t, method).transforms
            )
        )
        for method in ("dlb", "sclerp")
    )
    apart = float(max(np.abs(one.axis - other.axis).max(), np.abs(one.moment - other.moment).max()))
    return Fact(
        "DLB uses the same screw axis as ScLERP, but interpolates differently.",
        f"The axes are the same to {apart:.0e}. Rotation and translation along it are not: at the same t "
        f"the two are up to {angle:.1f} degrees and {distance:.2f} apart.",
        apart < 1e-9 and angle > 1.0,
        {"axis": apart, "degrees": angle, "distance": distance},
    )


def _shrinking(all_paths: dict[str, Path]) -> Fact:
    values = {method: float(lengths.min()) for method, lengths in _lengths(all_paths).items()}
    rigid = min(value for method, value in values.items() if method != "matrix_linear")
    return Fact(
        "Interpolating matrices has undesirable effects.",
        f"Linear matrices shrink the distance of (0, 0, 0) and (1, 1, 1) to {values['matrix_linear']:.1%} of "
        f"what it is; every other method keeps {rigid:.1%}.",
        values["matrix_linear"] < 0.99 and rigid > 1 - 1e-9,
        values,
    )


def _spline_note() -> str:
    """Two keys make no curve: returns what Sinew's splines give for these ends."""
    t = np.linspace(0.0, 1.0, 41)
    keys = sinew.quat_vec.to_dual_quat(ends())
    spline = sinew.spline.catmull_rom(keys, np.array([0.0, 1.0]), t, "dlb").transforms
    straight = sinew.interpolate.between(keys[0], keys[1], t, "dlb").transforms
    distance = sinew.dual_quat.rigid_distance(spline, straight)
    return (
        "dib, the blend of many, is sclerp between two. A Catmull-Rom spline through these two keys alone "
        "is the method that it blends with (dlb: within "
        f"{max(distance.translation.max(), distance.angle.max()):.0e})."
    )


# --- Plots

# Colour, width and dashes. Lower lines are wider, so that coinciding paths are all visible.
_STYLES = {
    "matrix_linear": ("#d8b365", 8.0, "-"),
    "matrix_polar": ("#8c510a", 5.5, "-"),
    "dlb": ("#f4a6c0", 4.5, "-"),
    "sclerp": ("#c51b7d", 3.4, "-"),
    "qv_nlerp": ("#80cdc1", 2.6, "-"),
    "matrix_log": ("#7f7f7f", 1.8, "--"),
    "dib": ("#000000", 1.4, ":"),
    "qv_slerp": ("#01665e", 1.2, "-"),
}


def _plot_paths(all_paths: dict[str, Path], name: str) -> str:
    with new_figure(f"{name} path", (6.4, 4.4)) as figure:
        axes = figure.add_subplot()
        for order, (method, (colour, width, dash)) in enumerate(_STYLES.items()):
            x, y = all_paths[method].moved[:, 0], all_paths[method].moved[:, 1]
            axes.plot(
                x, y, dash, color=colour, linewidth=width, label=method, zorder=order, solid_capstyle="butt"
            )
            tenths = slice(None, None, (len(x) - 1) // 10)
            axes.plot(
                x[tenths], y[tenths], "o", color="white", markeredgecolor=colour, markersize=4, zorder=20
            )
        axes.set(xlabel="x", ylabel="y", aspect="equal", adjustable="datalim")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
        return to_svg(figure)


def _plot_over_t(values: dict[str, np.ndarray], label: str, name: str) -> str:
    """values: [steps + 1] by method; methods with NaN are left out."""
    with new_figure(f"{name} t", (6.4, 4.4)) as figure:
        axes = figure.add_subplot()
        for order, (method, (colour, width, dash)) in enumerate(_STYLES.items()):
            if np.isnan(values[method]).any():
                continue
            t = np.linspace(0.0, 1.0, len(values[method]))
            axes.plot(t, values[method], dash, color=colour, linewidth=width, label=method, zorder=order)
        axes.set(xlabel="t", ylabel=label, xlim=(0, 1))
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
        return to_svg(figure)
