# SPDX-License-Identifier: GPL-3.0-or-later
"""A bent joint in a few numbers, and which of several shapes of it are best at each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .metrics import Measured

# Magnitudes that differ by less than this part of the best, or by less in all, are equally good.
SAME_PART, SAME = 0.05, 0.005


class Figures(NamedTuple):
    """Of what is bent of some limbs, as shares; infinite for a shape that is not finite.

    stretch  of edges, RMS
    volume   that its limbs gain; below zero what they lose
    bulge    outwards, in girths
    folds    of the area, against a neighbour
    """

    stretch: float
    volume: float
    bulge: float
    folds: float

    @classmethod
    def of(cls, measured: Measured, limbs: np.ndarray) -> Figures:
        """limbs: bool [bones]"""
        pose = measured.pose
        bent = np.where(limbs, pose.bent_areas, 0.0)
        of_all = float(bent.sum())
        if not np.isfinite(measured.shape.points).all():
            return cls(*(float("inf"),) * 4)
        if of_all <= 0.0:
            return cls(0.0, 0.0, 0.0, 0.0)
        values = measured.by_limb()
        means = {name: float(np.nansum(each * bent)) / of_all for name, each in values.items()}
        squares = float(np.nansum(values["stretch"] ** 2 * bent)) / of_all
        bones = np.unique(pose.skin.limb_of_triangles)
        taken = bent[bones[bones >= 0]] > 0.0
        shape, before = measured.shape, pose.rest_limbs[taken]
        after = pose.skin.limbs.volumes(shape.points, shape.normals)[taken]
        whole = float(np.abs(before).sum())
        girth = float(measured.rest_distances[pose.is_bent].mean()) if pose.is_bent.any() else 0.0
        return cls(
            squares**0.5,
            float((after - before).sum()) / whole if whole > 0.0 else 0.0,
            means["bulge"] / girth if girth > 0.0 else 0.0,
            means["folded"],
        )


def best(figures: Sequence[Figures]) -> list[set[str]]:
    """Returns the names of the figures at which each is best; none where all are equally good."""
    found: list[set[str]] = [set() for _each in figures]
    for name in Figures._fields:
        sizes = [abs(getattr(each, name)) for each in figures]
        least = min(sizes)
        most = least + max(SAME, SAME_PART * least)
        chosen = [number for number, size in enumerate(sizes) if size <= most]
        if len(chosen) < len(sizes):
            for number in chosen:
                found[number].add(name)
    return found
