# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's conclusions and future work, answered from the numbers of this page."""

from __future__ import annotations

import numpy as np
import sinew

from . import orders, paths, printed, studies, tables
from .measure import Measurements
from .model import Answer, Fact, Figure

# Times count as equal within this factor, which other load on a machine can cause.
CLOSE = 1.25
# A method of skinning is worth its better shape up to this factor in time.
WORTH = 3.0


def answers(measurements: Measurements | None, figures: tuple[Figure, ...]) -> tuple[Answer, ...]:
    """Returns an answer to each question. Answers say what is not measured."""
    return (
        _matrices(measurements),
        _worth(measurements, figures),
        _accuracy(),
        _slower_methods(measurements, figures),
        _chains(),
        _coordinate_changes(),
        Answer(
            "Future work: inverse kinematics, blending of motions (chapter 4), rigid bodies (chapter 5)",
            "This page has no experiments on them; future_work/ has fits and inverse kinematics.",
        ),
    )


_TASKS = {
    "3.4": "combining two",
    "3.5": "moving a point",
    "3.10": "blending three and moving a point",
}


def _in_words(numbers: list[str]) -> str:
    return ", ".join(numbers) if numbers else "none"


def _matrices(measurements: Measurements | None) -> Answer:
    question = (
        "The times of matrices were likely wrong: better implementations should be looked into (chapters 4 "
        "and 5)"
    )
    if measurements is None:
        return Answer(question, "Not measured; see Table 3.4.")
    held = {table: orders.facts(measurements, table)[:2] for table in orders.TIMED}
    as_reported, fastest = ([table for table, of in held.items() if of[i].agrees] for i in range(2))
    parts = [
        f"{task} {', '.join(orders.best(measurements, table, row) for row in orders.TIMED[table][0])}"
        for table, task in _TASKS.items()
    ]
    slower = orders.ratio_of_best(measurements, "3.9", "sclerp", "dlb")
    seconds = printed.INTERPOLATION_SECONDS
    return Answer(
        question,
        "Built without optimisation, GLM's times (of ScLERP Kenwright's) come in the printed order in "
        f"these of Tables 3.4, 3.5, 3.9 and 3.10: {_in_words(as_reported)}. Optimised, by the fastest "
        f"implementation of each: {_in_words(fastest)}. Those take, for matrix, pair and dual quaternion "
        f"(± half the range of the middle half of the runs): {'; '.join(parts)}. ScLERP takes {slower:.1f} "
        f"times as long as DLB (printed {seconds['sclerp'] / seconds['dlb']:.1f}).",
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
        sentences.append("What they cost is not measured; see Table 3.10.")
    else:
        kernels = {
            name: orders.nanoseconds(measurements, "3.10", f"kernel_{name}") for name in ("lbs", "qv", "dq")
        }
        over_matrix, over_pair = kernels["dq"] / kernels["lbs"], kernels["dq"] / kernels["qv"]
        one_vertex, point, chain = (
            orders.ratio_of_best(measurements, table, row, matrix)
            for table, row, matrix in (
                ("3.10", "dq", "lbs"),
                ("3.5", "dual_quat", "affine"),
                ("3.4", "dual_quat", "affine"),
            )
        )
        sentences.append(
            f"For skinning {'yes' if over_matrix <= WORTH else 'at a price'}: in Sinew's kernels a vertex of "
            f"three bones takes {kernels['dq']:.1f} ns, {over_matrix:.1f} times as long as with matrices and "
            f"{over_pair:.1f} times as long as with pairs: for 100,000 vertices {kernels['dq'] * 0.1:.2f} ms "
            "a frame. One vertex after the other, as the papers write it, the fastest takes "
            f"{one_vertex:.1f} times as long as the fastest with matrices."
        )
        sentences.append(
            f"Moving points by one transform takes {point:.1f} times as long as with the fastest matrix, "
            f"combining transforms {chain:.2f} times as long, in 8 numbers instead of 12. Where points are "
            "only moved, " + ("it is as good as a matrix." if point <= CLOSE else "a matrix is better.")
        )
    thin = _fact(figures, "3.11", "radius, lbs")
    drift = _fact(figures, "3.10", "drift, in widths")
    kept = _fact(figures, "3.11", "radius, dq")
    if thin is None or drift is None or kept is None:
        sentences.append("What it looks like is not drawn; see Figures 3.10 and 3.11.")
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


def _coordinate_changes() -> Answer:
    fits = studies.fits()
    found = ", ".join(f"{_NAMES[name]} {spread.rms:.3f}" for name, spread in fits.items())
    apart = max(spread.rms for spread in fits.values()) - min(spread.rms for spread in fits.values())
    return Answer(
        "Future work: rigid coordinate changes, how those are solved, and how useful the representations are "
        "in calculations of this kind (chapter 4)",
        f"Fitted to {studies.CHAINS:,} random sets of 12 points in float32, which go where a rotation takes "
        "them but for a hundredth of their size, the rotations found are off by these degrees (root mean "
        f"square), solved with {found}. These differ by {apart:.0e} degrees: "
        + (
            "the representation does not matter to the result."
            if apart < 1e-3
            else "the representation matters to the result."
        ),
    )


_NAMES = {"affine": "matrices", "quat_vec": "pairs", "dual_quat": "dual quaternions"}


def _accuracy() -> Answer:
    of_lengths = {length: studies.accuracy(length) for length in studies.LENGTHS}
    found = "; ".join(
        f"{length} links "
        + ", ".join(f"{spread.rms:.1e} ({spread.low:.0e} to {spread.high:.0e})" for spread in of.values())
        for length, of in of_lengths.items()
    )
    first, last = of_lengths[studies.LENGTHS[0]], of_lengths[studies.LENGTHS[-1]]
    orders = [
        ", ".join(_NAMES[name] for _rms, name in sorted((spread.rms, name) for name, spread in of.items()))
        for of in (first, last)
    ]
    spreads = tables.chain_spreads()
    return Answer(
        "Pairs have more accurate results than dual quaternions (chapter 4)",
        f"The differences in Table 3.7, {spreads['printed']:.0e}, come from axes that were rounded for print "
        f"and normalised in two ways. Over {studies.CHAINS:,} random chains in float32, none normalised on "
        "the way, the end is off float64 by these parts of the chain's length (root mean square, and what 5 "
        f"and 95 of 100 are below), with {', '.join(_NAMES.values())}: {found}. From the most accurate: at "
        f"{studies.LENGTHS[0]} links {orders[0]}; at {studies.LENGTHS[-1]} {orders[1]}.",
    )


def _slower_methods(measurements: Measurements | None, figures: tuple[Figure, ...]) -> Answer:
    question = "Future work: results for log-matrix and spherical blend skinning"
    bends = paths.bends(paths.paths(paths.ORIGIN))
    sentences = []
    if measurements is not None:
        log, linear, dlb = (
            orders.nanoseconds(measurements, "3.9", f"sinew_{name}")
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
    if measurements is not None:
        times = [
            orders.nanoseconds(measurements, "3.10", f"kernel_{name}") for name in ("lbs", "log", "sbs", "dq")
        ]
        sentences.append(
            "In Sinew's kernels a vertex of three bones takes {:.1f} ns by linear matrices, {:.1f} by "
            "logarithms, {:.1f} by spherical blending and {:.1f} by dual quaternions.".format(*times)
        )
    log_keeps, sbs_keeps, dq_keeps = (
        _fact(figures, "3.11", f"radius, {name}") for name in ("log", "sbs", "dq")
    )
    if log_keeps is not None and sbs_keeps is not None and dq_keeps is not None:
        sentences.append(
            f"A joint that is twisted by 170 degrees keeps {log_keeps:.0%} of its radius by logarithms, "
            f"{sbs_keeps:.0%} by spherical blending and {dq_keeps:.0%} by dual quaternions."
        )
    return Answer(question, " ".join(sentences))


def dlb_bound() -> Fact:
    """Returns the largest differences of DLB and ScLERP between the identity and a screw of up to 180
    degrees."""
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


def _chains() -> Answer:
    bound = dlb_bound()
    drifts = {length: studies.drift(length) for length in studies.LENGTHS}
    found = "; ".join(
        f"{length} links {spread.rms:.2%} ({spread.low:.2%} to {spread.high:.2%})"
        for length, spread in drifts.items()
    )
    grows = drifts[studies.LENGTHS[-1]].rms / drifts[studies.LENGTHS[0]].rms
    return Answer(
        f"In long chains the error of DLB against ScLERP may add up (chapter 4). {bound.says[:-1]} (section "
        "3.5.2)",
        f"{bound.ours} Over {studies.CHAINS:,} random chains whose joints rotate by up to 90 degrees between "
        f"two keys, the tips are apart by these parts of the length (root mean square, and what 5 and 95 of "
        f"100 are below): {found}. "
        + (
            f"It does add up: {grows:.1f} times from {studies.LENGTHS[0]} to {studies.LENGTHS[-1]} links."
            if grows > 1.5
            else "It does not add up."
        ),
    )
