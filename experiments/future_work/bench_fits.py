# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares rigid fits with scipy and with solving in two steps: times, errors for noisy data, fits.svg."""

from __future__ import annotations

from pathlib import Path

import common
import matplotlib
import numpy as np
import sinew
from scipy.spatial.transform import RigidTransform, Rotation

from future_work import fit

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
SIZES = (10, 100, 1_000, 10_000)
SETS = 2_000
NOISES = (0.001, 0.003, 0.01, 0.03, 0.1)
OUTLIERS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.45)


def motions(rng: np.random.Generator, count: int, extent: float = 2.0) -> RigidTransform:
    return RigidTransform.from_components(
        rng.uniform(-extent, extent, (count, 3)), Rotation.random(count, rng=rng)
    )


def dual(transform: RigidTransform) -> np.ndarray:
    return transform.as_dual_quat(scalar_first=True)


# --- Times


def scipy_fit(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Includes the middles, which align_vectors() leaves to its caller."""
    middles = source.mean(axis=0), target.mean(axis=0)
    rotation = Rotation.align_vectors(target - middles[1], source - middles[0])[0]
    return np.append(rotation.as_quat(), middles[1] - rotation.apply(middles[0]))


def times(seconds: float) -> dict:
    """{"points/solver": spread() of seconds per fit}, and the same for SETS sets of 10 points in one
    call."""
    rng = np.random.default_rng(0)
    found = {}
    for size in SIZES:
        motion = motions(rng, 1)[0]
        source = rng.normal(size=(size, 3))
        target = motion.apply(source) + 0.01 * rng.normal(size=source.shape)
        candidates = {
            f"{size}/sinew": lambda a=source, b=target: fit.rigid(a, b),
            f"{size}/scipy": lambda a=source, b=target: scipy_fit(a, b),
        }
        found |= common.alternate(candidates, seconds)
    source = rng.normal(size=(SETS, 10, 3))
    target = source[:, :, [1, 2, 0]] + 0.01 * rng.normal(size=source.shape)
    candidates = {
        "sets/sinew": lambda: fit.rigid(source, target),
        "sets/scipy": lambda: [scipy_fit(a, b) for a, b in zip(source, target, strict=True)],
    }
    for name, spread in common.alternate(candidates, max(seconds, 1.0)).items():
        found[name] = spread | {"least": spread["least"] / SETS, "median": spread["median"] / SETS}
    return found


# --- Hand-eye: with dual quaternions, or with matrices


def two_steps(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """[4, 4]: the rotation between the axes, then the translation by least squares (Park, Martin 1994)."""
    x = np.eye(4)
    axes = [Rotation.from_matrix(each[:, :3, :3]).as_rotvec() for each in (a, b)]
    x[:3, :3] = Rotation.align_vectors(axes[0], axes[1])[0].as_matrix()
    rows = np.vstack([each[:3, :3] - np.eye(3) for each in a])
    wanted = np.concatenate([x[:3, :3] @ q[:3, 3] - p[:3, 3] for p, q in zip(a, b, strict=True)])
    x[:3, 3] = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    return x


def hand_eye(trials: int) -> dict:
    """{noise: {solver: [median angle, median distance]}} of the errors for eight motions."""
    rng = np.random.default_rng(1)
    found = {}
    for noise in NOISES:
        off: dict[str, list] = {"dual quaternions": [], "two steps": []}
        for _ in range(trials):
            x = motions(rng, 1)[0]
            # Below 180 degrees, where noise would decide the sign of a logarithm.
            hand = RigidTransform.from_exp_coords(
                np.hstack([rng.uniform(-1.5, 1.5, (8, 3)), rng.uniform(-2, 2, (8, 3))])
            )
            eye = RigidTransform.concatenate([x.inv() * each * x for each in hand])
            eye = eye * RigidTransform.from_exp_coords(noise * rng.normal(size=(8, 6)))
            a, b = hand.as_matrix(), eye.as_matrix()
            for name, got in (
                ("dual quaternions", fit.hand_eye(a, b).transforms),
                ("two steps", two_steps(a, b)),
            ):
                off[name].append(sinew.affine.rigid_distance(got, x.as_matrix()))
        found[noise] = {name: np.median(of, axis=0).tolist() for name, of in off.items()}
    return found


# --- Averages with outliers


def outliers(trials: int) -> dict:
    """{share: {kind: [median angle, median distance]}} from the middle of 100 poses, with a spread of
    0.02."""
    rng = np.random.default_rng(2)
    found = {}
    for share in OUTLIERS:
        wrong = round(100 * share)
        off: dict[str, list] = {"mean": [], "robust": []}
        for _ in range(trials):
            middle = motions(rng, 1)[0]
            right = RigidTransform.from_exp_coords(0.02 * rng.normal(size=(100 - wrong, 6)))
            poses = dual(RigidTransform.concatenate([middle * each for each in right]))
            if wrong:
                poses = np.vstack([poses, dual(motions(rng, wrong))])
            for name, is_robust in (("mean", False), ("robust", True)):
                got = fit.average(poses, robust=is_robust).transforms
                off[name].append(sinew.dual_quat.rigid_distance(got, dual(middle)))
        found[share] = {name: np.median(of, axis=0).tolist() for name, of in off.items()}
    return found


# --- Output


def draw(spreads: dict, eyes: dict, averages: dict) -> None:
    figure, (first, second, third) = plt.subplots(1, 3, figsize=(12.6, 3.6), layout="constrained")
    styles = (("#4477aa", "o"), ("#ccbb44", "s"))
    for (colour, marker), name in zip(styles, ("sinew", "scipy"), strict=True):
        values = [spreads[f"{size}/{name}"]["least"] * 1e6 for size in SIZES]
        first.loglog(SIZES, values, color=colour, marker=marker, label=name)
    first.set(xlabel="points", ylabel="microseconds a fit", title="The time of one fit")
    for (colour, marker), name in zip(styles, ("dual quaternions", "two steps"), strict=True):
        values = [eyes[noise][name][1] for noise in NOISES]
        second.loglog(NOISES, values, color=colour, marker=marker, label=name)
    second.set(
        xlabel="noise of a motion", ylabel="median distance from the truth", title="Hand-eye of 8 motions"
    )
    for (colour, marker), name in zip(styles, ("mean", "robust"), strict=True):
        values = [averages[share][name][1] for share in OUTLIERS]
        third.semilogy([100 * share for share in OUTLIERS], values, color=colour, marker=marker, label=name)
    third.set(xlabel="outliers, %", ylabel="median distance from the truth", title="The average of 100 poses")
    for axes in (first, second, third):
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(HERE / "fits.svg", metadata={"Date": None})


def main() -> None:
    arguments = common.options(__doc__, "fits", "fewer trials, shorter runs, no picture").parse_args()
    plt.rcParams["svg.hashsalt"] = "sinew"
    trials, seconds = (20, 0.05) if arguments.quick else (400, 0.5)
    facts = common.begin("rigid fits", scipy=common.version_of("scipy"), numpy=np.__version__)
    spreads, eyes, averages = times(seconds), hand_eye(trials), outliers(trials)
    print("Microseconds a fit, the least of many runs")
    for name, spread in spreads.items():
        ratio = spread["least"] / spreads[f"{name.split('/')[0]}/sinew"]["least"]
        print(f"{name:18}{spread['least'] * 1e6:12.2f}{ratio:8.1f} x")
    for title, table in (("Hand-eye by noise", eyes), ("Averages by share of outliers", averages)):
        print(f"\n{title}: median angle (radians) and distance from the truth")
        for key, row in table.items():
            print(f"{key:8}", *(f"  {name}: {of[0]:.2e} {of[1]:.2e}" for name, of in row.items()))
    common.write(arguments.name, machine=facts, seconds=spreads, hand_eye=eyes, averages=averages)
    if not arguments.quick:
        draw(spreads, eyes, averages)


if __name__ == "__main__":
    main()
