# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures precomputations for a plate of 316 x 316 vertices with bones all over it:
python bench/precompute.py [--name NAME] [--threads 2]

Wall-clock and processor seconds, minimum of the runs. Processor times are those of all threads; other
programs hardly increase them.
"""

from __future__ import annotations

import time

import common
import numpy as np
import sinew

SIDE, SIZE = 316, 2.0
# The number of bones along each side, and the radius for ddm.
CASES = [(3, 0.2), (10, 0.05), (10, 0.2), (10, 0.5), (20, 0.02)]


def plate() -> tuple[np.ndarray, np.ndarray]:
    """Rest points and triangles of a plate that is not quite flat."""
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(*2 * [np.linspace(-SIZE / 2, SIZE / 2, SIDE)], indexing="ij")
    z = 0.05 * np.sin(2.5 * x) + 0.0005 * rng.normal(size=x.shape)
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    a, b, c, d = first, first + SIDE, first + SIDE + 1, first + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32), triangles.astype(np.int32)


def influences(points: np.ndarray, along: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets, bones and weights: the four nearest of along x along bones, weighted by a Gaussian."""
    apart = SIZE / along
    middles = -SIZE / 2 + apart * (np.arange(along) + 0.5)
    squared = (points[:, :1] - middles)[:, :, None] ** 2 + (points[:, 1:2] - middles)[:, None] ** 2
    squared = squared.reshape(len(points), -1)
    bones = np.argpartition(squared, 3, axis=1)[:, :4]
    weights = np.exp(-np.take_along_axis(squared, bones, axis=1) / apart**2)
    weights /= weights.sum(axis=1, keepdims=True)
    offsets = np.arange(0, 4 * len(points) + 1, 4)
    return offsets.astype(np.int32), bones.ravel().astype(np.int32), weights.ravel().astype(np.float32)


def main() -> None:
    parser = common.options(__doc__, "")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    facts = common.begin("precomputations", threads=arguments.threads)
    points, triangles = plate()
    seconds = {}
    for along, radius in CASES:
        mesh = points, *influences(points, along), triangles
        makers = {"cor": lambda mesh=mesh: sinew.centres_of_rotation(*mesh, threads=arguments.threads)}
        makers["ddm"] = lambda mesh=mesh, radius=radius: sinew.direct_delta_mush(
            *mesh, radius, threads=arguments.threads
        )
        for method, make in makers.items():
            case = f"{method}, {along * along} bones" + (f", radius {radius}" if method == "ddm" else "")
            if case in seconds:
                continue
            times = []
            for _run in range(arguments.runs):
                started = time.perf_counter(), time.process_time()
                kept = make().result()
                times.append((time.perf_counter() - started[0], time.process_time() - started[1]))
            clock, processor = (min(column) for column in zip(*times, strict=True))
            seconds[case] = {"clock": clock, "processor": processor, "rows": len(kept)}
            print(f"{case:28}{clock:8.2f}{processor:8.2f}{len(kept):>12,} rows", flush=True)
    if arguments.name:
        common.write(arguments.name, machine=facts, vertices=len(points), seconds=seconds)


if __name__ == "__main__":
    main()
