# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's conclusions and future work, answered from the numbers of this page."""

from __future__ import annotations

import numpy as np
import sinew

from . import paths, printed, tables
from .measure import OPERATIONS, Measurements
from .model import Answer, Fact, Figure

# What counts as no dearer: within what one machine's neighbours change in a measurement.
CLOSE = 1.25
# Times as dear that a method of skinning may be for its shape to be worth it.
WORTH = 3.0


def answers(measurements: Measurements | None, figures: tuple[Figure, ...]) -> tuple[Answer, ...]:
    """One for each question. What is not measured in this installation is said to be so."""
    return (
        _matrices(measurements),
        _worth(measurements, figures),
        _accuracy(),
        _slower_methods(measurements),
        _chains(),
        Answer(
            "Future work: inverse kinematics, blending of motions, rigid bodies",
            "This page has no experiments on them.",
        ),
    )


def _nanoseconds(measurements: Measurements, table: str, name: str) -> float:
    """One operation in a table's optimised loop."""
    return measurements.optimised[f"{table}/{name}"].median / OPERATIONS[table] * 1e9


def _matrices(measurements: Measurements | None) -> Answer:
    question = (
        "The times of matrices were likely wrong: better implementations should be looked into (chapters 4 "
        "and 5)"
    )
    if measurements is None:
        return Answer(question, "Not measured in this installation; see Table 3.4.")
    orders, shares = [], []
    for table, seconds in (("3.4", printed.CHAIN_SECONDS), ("3.10", printed.SKINNING_SECONDS)):
        theirs = list(seconds.values())
        ours = [
            measurements.unoptimised[f"{table}/glm_{name}"].median
            for name in ("4x4", "quat_vec", "dual_quat")
        ]
        orders.append(np.array_equal(np.argsort(ours), np.argsort(theirs)))
        shares.append(f"{ours[2] / ours[0]:.2f} (printed {theirs[2] / theirs[0]:.2f})")
    tasks = {
        "moving a point": ("3.5", ("sinew_affine", "sinew_quat_vec", "sinew_dual_quat")),
        "interpolating": ("3.9", ("sinew_matrix_linear", "sinew_qv_nlerp", "sinew_dlb")),
        "blending three and moving a point": ("3.10", ("sinew_lbs", "sinew_qv", "sinew_dq")),
        "combining two": ("3.4", ("sinew_affine", "sinew_quat_vec", "sinew_dual_quat")),
    }
    parts = []
    for task, (table, names) in tasks.items():
        times = [_nanoseconds(measurements, table, name) for name in names]
        parts.append(f"{task} {times[0]:.1f}, {times[1]:.1f} and {times[2]:.1f}")
    return Answer(
        question,
        f"Built without optimisation, GLM gives {'' if all(orders) else 'not quite '}the printed order: its "
        f"dual quaternions take {shares[0]} of the time of its 4x4 matrices to combine and {shares[1]} to "
        "blend and move a point. Optimised, in nanoseconds with Sinew's 3x4 matrix, pair and dual "
        f"quaternion: {'; '.join(parts)}.",
    )


def _fact(figures: tuple[Figure, ...], number: str, key: str) -> float | None:
    for figure in figures:
        if figure.number == number:
            for fact in figure.facts:
                if key in fact.values:
                    return fact.values[key]
    return None


def _worth(measurements: Measurements | None, figures: tuple[Figure, ...]) -> Answer:
    question = (
        "Dual quaternions are a natural fit for skeletal animation (chapter 5). Are they worth it over "
        "pairs and matrices, when matrices are implemented well?"
    )
    sentences = []
    if measurements is None:
        sentences.append("What they cost is not measured in this installation; see Table 3.10.")
    else:
        kernels = {name: _nanoseconds(measurements, "3.10", f"kernel_{name}") for name in ("lbs", "qv", "dq")}
        over_matrix, over_pair = kernels["dq"] / kernels["lbs"], kernels["dq"] / kernels["qv"]
        one_vertex, point, chain = (
            _nanoseconds(measurements, table, name) / _nanoseconds(measurements, table, matrix)
            for table, name, matrix in (
                ("3.10", "sinew_dq", "sinew_lbs"),
                ("3.5", "sinew_dual_quat", "sinew_affine"),
                ("3.4", "sinew_dual_quat", "sinew_affine"),
            )
        )
        sentences.append(
            f"For skinning {'yes' if over_matrix <= WORTH else 'at a price'}: in Sinew's kernels a vertex of "
            f"three bones takes {kernels['dq']:.1f} ns, {over_matrix:.1f} times as long as with matrices and "
            f"{over_pair:.1f} times as long as with pairs: for 100,000 vertices {kernels['dq'] * 0.1:.2f} ms "
            f"a frame. One vertex after the other, as the papers write it, it is {one_vertex:.1f} times as "
            "long as with matrices."
        )
        sentences.append(
            f"Moving points by one transform takes {point:.1f} times as long as with a 3x4 matrix, combining "
            f"transforms {chain:.2f} times as long, in 8 numbers instead of 12. Where points are only moved, "
            + ("it is as good as a matrix." if point <= CLOSE else "a matrix is better.")
        )
    thin = _fact(figures, "3.11", "radius, lbs")
    drift = _fact(figures, "3.10", "drift, in widths")
    kept = _fact(figures, "3.11", "radius, dq")
    if thin is None or drift is None or kept is None:
        sentences.append("What it looks like is not drawn in this installation; see Figures 3.10 and 3.11.")
    else:
        sentences.append(
            f"What it buys: a joint twisted by 170 degrees keeps {kept:.0%} of its radius, {thin:.0%} with "
            f"matrices; and pairs, which keep it too, move a bent joint by {drift:.1f} widths of the limb, "
            "as they rotate about the origin."
        )
    apart = _fact(figures, "3.7", "apart")
    if apart is not None and apart < 1e-5:
        sentences.append(
            "In a hierarchy whose joints only rotate, pairs interpolate as dual quaternions do: they "
            "are enough."
        )
    return Answer(question, " ".join(sentences))


def _accuracy() -> Answer:
    exact = {name: tables.moved_one_by_one(name, np.float64, "axis")[-1] for name in tables.LAYOUTS}
    single = {
        name: tables.error(tables.moved_one_by_one(name, np.float32, "axis")[-1], exact[name])
        for name in exact
    }
    names = {"affine": "matrices", "quat_vec": "pairs", "dual_quat": "dual quaternions"}
    errors = ", ".join(f"{value:.0e} with {names[name]}" for name, value in single.items())
    spreads = tables.chain_spreads()
    return Answer(
        "Pairs have more accurate results than dual quaternions (chapter 4)",
        f"By the last digit of float32. The differences in Table 3.7, {spreads['printed']:.0e}, come from "
        "axes that were rounded for print and normalised in two ways. Built alike, float32 is off float64 "
        f"at the end of the chain by {errors}, where coordinates reach {exact['affine'].max():.0f}.",
    )


def _slower_methods(measurements: Measurements | None) -> Answer:
    question = "Future work: results for log-matrix and spherical blend skinning"
    names = [method.name for method in sinew.methods()]
    bends = paths.bends(paths.paths(paths.ORIGIN))
    sentences = []
    if measurements is not None:
        log, linear, dlb = (
            _nanoseconds(measurements, "3.9", f"sinew_{name}")
            for name in ("matrix_log", "matrix_linear", "dlb")
        )
        sentences.append(
            f"Interpolating by logarithms of matrices takes {log:.0f} ns, {log / linear:.0f} times as long "
            f"as linear matrices and {log / dlb:.0f} times as long as DLB."
        )
    sentences.append(
        "It is rigid, but no shortest path: in Figure 3.4 the origin leaves the straight way by "
        f"{bends['matrix_log']:.1f}, with dual quaternions by {bends['sclerp']:.1f}."
    )
    sentences.append(
        "Spherical blend skinning is among Sinew's methods, and not measured here."
        if "sbs" in names
        else f"Spherical blend skinning is not among Sinew's methods ({', '.join(names)})."
    )
    return Answer(question, " ".join(sentences))


def dlb_bound() -> Fact:
    """The largest differences of DLB and ScLERP between the identity and a screw of up to 180 degrees."""
    t = np.linspace(0.0, 1.0, 201)
    axis, point = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    degrees, share = 0.0, 0.0
    for angle in np.radians(np.linspace(1.0, 179.9, 180)):
        screw = sinew.dual_quat.from_screw_about(axis, point, angle, 1.0)
        one, other = (
            sinew.dual_quat.to_screw(
                sinew.interpolate.between(sinew.dual_quat.identity(), screw, t, method).transforms
            )
            for method in ("dlb", "sclerp")
        )
        degrees = max(degrees, float(np.degrees(np.abs(one.angle - other.angle)).max()))
        share = max(share, float(np.abs(one.translation - other.translation).max()))
    bound, part = printed.DLB_BOUND
    return Fact(
        f"ScLERP and DLB differ by at most {bound} degrees and {part:.0%} of the translation.",
        f"Over screws of up to 180 degrees, by up to {degrees:.2f} degrees and {share:.1%}.",
        degrees <= bound + 0.01 and share <= part + 0.005,
        {"degrees": degrees, "share of translation": share},
    )


def chain_drift(links: int = 6, degrees: float = 90.0) -> float:
    """How far apart DLB and ScLERP have the tip of a chain, each joint rotated by `degrees` between two keys,
    at most, as a part of its length."""
    link = np.array([1.0, 0.0, 0.0])
    axis = np.array([0.0, 1.0, 0.0])
    step = sinew.dual_quat.from_translation(link)
    start, end = (
        sinew.dual_quat.compose(step, sinew.dual_quat.from_axis_angle(axis, np.radians(sign * degrees / 2)))
        for sign in (-1, 1)
    )
    skeleton = sinew.Skeleton(np.arange(-1, links - 1, dtype=np.int32))
    first, second = np.tile(start, (links, 1)), np.tile(end, (links, 1))
    worst = 0.0
    for t in np.linspace(0.0, 1.0, 101):
        tips = []
        for method in ("dlb", "sclerp"):
            relative, _is_defined = skeleton.interpolate(first, second, float(t), method)
            tips.append(sinew.dual_quat.transform_point(skeleton.root_relative(relative)[-1], link))
        worst = max(worst, float(np.linalg.norm(tips[0] - tips[1])))
    return worst / (links + 1)


def _chains() -> Answer:
    bound = dlb_bound()
    short, long = chain_drift(6), chain_drift(24)
    return Answer(
        f"In long chains the error of DLB against ScLERP may add up (chapter 4). {bound.says[:-1]} (section "
        "3.5.2)",
        f"{bound.ours} Where each joint rotates by 90 degrees between two keys, the tip of a chain of 6 "
        f"links is up to {short:.1%} of its length off, of 24 links {long:.1%}: "
        + ("it does add up." if long > 1.5 * short else "it does not add up."),
    )
