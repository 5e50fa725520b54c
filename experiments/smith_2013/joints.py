# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 3.3: an arm between two keys, interpolated relative to the parents and relative to the root."""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType

import numpy as np
import sinew
from sinew_addon.base.errors import SinewError
from sinew_addon.features.pages.plots import new_figure, to_svg

from .model import Fact, Figure, Picture
from .paths import in_layout, layout

# Two bones of length 1, each rotated by this angle about its head between the keys.
DEGREES = 75.0
# The report's linear methods, of Algorithm 2.
METHODS: tuple[sinew.interpolate.Method, ...] = ("matrix_linear", "qv_nlerp", "dlb")
TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
TITLE = "An arm of two bones between two keys, interpolated relative to its parents and relative to the root"


def keys(degrees: float) -> np.ndarray:
    """[2, 7]: each bone relative to its parent; the second begins where the first ends, at (1, 0, 0)."""
    rotation = sinew.quat_vec.from_axis_angle([0.0, 0.0, 1.0], np.radians(degrees))[:4]
    return np.array([[*rotation, 0, 0, 0], [*rotation, 1, 0, 0]])


def root_relative(module: ModuleType, parents: Iterable[int], relative: np.ndarray) -> np.ndarray:
    """[bones, ..]: each bone relative to the root, by algorithm 1.

    module    the transforms' layout
    parents   of each bone, which precedes it; -1 for none
    relative  [bones, ..] to its parent
    """
    result = relative.copy()
    for bone, parent in enumerate(parents):
        if parent >= 0:
            result[bone] = module.compose(result[parent], result[bone])
    return result


def arms(method: sinew.interpolate.Method, t: np.ndarray, from_root: bool) -> np.ndarray:
    """[t, 4, 3]: head and end of the first bone, then of the second."""
    module = layout(method)
    parents = [-1, 0]
    ends = [in_layout(module, keys(degrees)) for degrees in (0.0, DEGREES)]
    if from_root:
        # The result of algorithm 1, interpolated by algorithm 2: the wrong order.
        ends = [root_relative(module, parents, end) for end in ends]
    bones = sinew.interpolate.between(ends[0], ends[1], t[:, None], method).transforms
    if not from_root:
        bones = np.array([root_relative(module, parents, each) for each in bones])
    points = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    return module.transform_point(bones[:, :, None], points).reshape(-1, 4, 3)


def figure_3_3() -> Figure:
    t = np.linspace(0.0, 1.0, 101)
    gaps = {
        where: {
            method: float(np.linalg.norm(arm[:, 1] - arm[:, 2], axis=1).max())
            for method in METHODS
            for arm in (arms(method, t, from_root),)
        }
        for where, from_root in (("parent", False), ("root", True))
    }
    closed, torn = max(gaps["parent"].values()), gaps["root"]
    fact = Fact(
        "Interpolated relative to the root, bones rotate about another centre: that is not the correct "
        "interpolation.",
        f"Relative to the parents the two bones stay joined to {closed:.0e} of their length. Relative to the "
        "root they come apart by up to "
        + ", ".join(f"{gap:.2f} ({method})" for method, gap in torn.items())
        + ".",
        closed < 1e-12 and torn["qv_nlerp"] > 0.05 and torn["dlb"] > 0.05,
        {f"gap, {where}, {method}": gap for where, of in gaps.items() for method, gap in of.items()},
    )
    try:
        pictures = tuple(
            Picture(caption, _plot(from_root))
            for caption, from_root in (
                ("Relative to the parents, then combined: the elbow holds.", False),
                ("Combined, then interpolated relative to the root: the elbow opens.", True),
            )
        )
    except SinewError as error:
        return Figure("3.3", TITLE, (), (fact,), (), f"Not drawn: {error}.")
    return Figure("3.3", TITLE, pictures, (fact,))


# Lower lines are wider, so that coinciding arms are all visible.
_STYLES = (("#d8b365", 5.0), ("#01665e", 3.2), ("#c51b7d", 1.4))


def _plot(from_root: bool) -> str:
    with new_figure(f"3.3 {'root' if from_root else 'parent'}", (6.4, 4.4)) as figure:
        axes = figure.add_subplot()
        for method, (colour, width) in zip(METHODS, _STYLES, strict=True):
            style = {"color": colour, "linewidth": width, "markersize": width + 1.0}
            axes.plot([], [], "-o", label=method, **style)
            for arm in arms(method, np.array(TIMES), from_root):
                for bone in (arm[:2], arm[2:]):
                    axes.plot(bone[:, 0], bone[:, 1], "-o", **style)
        axes.set(xlabel="x", ylabel="y", aspect="equal", adjustable="datalim")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
        return to_svg(figure)
