# SPDX-License-Identifier: GPL-3.0-or-later
"""What the programs have in common that play a file by one player each.

python PLAYER.py FILE OUT.npz --times 0,0.4 --clip 0 [--still A.glb B.glb]

OUT.npz has `version` and one of these: `rest` and `points`; `outlines`, and those of meshes that stand
still, `still`; `said`, a sentence, where the player shows no skin; `missing`, what this machine lacks.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
# The camera of outlines, in glTF's axes: its place, what it looks at, its angle from top to bottom.
EYE, TARGET, DEGREES, PIXELS = (0.0, 3.0, 24.0), (0.0, 3.0, 0.0), 30.0, 1024


class MissingError(Exception):
    """Of what this machine lacks."""


class NoSkinError(Exception):
    """Of a player that shows no skin, and what it does instead."""


@dataclass
class Task:
    """
    times  in seconds
    clip   the number of the file's clip that is to be played
    still  files of meshes that stand still
    """

    path: Path
    times: list[float]
    clip: int
    still: list[str]


def z_up(points: object) -> np.ndarray:
    """float64 [..., 3], from glTF's axes."""
    x, y, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
    return np.stack([x, -z, y], axis=-1)


def outline(picture: np.ndarray) -> np.ndarray:
    """bool [height, width]: what is not as in the first pixel. picture: [height, width, channels]"""
    return np.abs(picture.astype(int) - picture[0, 0].astype(int)).max(axis=2) > 2


def blended(
    points: np.ndarray, slots: np.ndarray, weights: np.ndarray, motions: Sequence[np.ndarray]
) -> np.ndarray:
    """float64 [vertices, 3]: linear blending of motions [bones, 4, 4], for what reads bones and weights and
    leaves the skin to others."""
    matrices = np.einsum("vk,vkij->vij", weights, np.asarray(motions)[slots])
    return np.einsum("vij,vj->vi", matrices[:, :3, :3], points) + matrices[:, :3, 3]


def main(version: str, play: Callable[[Task], dict]) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument("out")
    parser.add_argument("--times", required=True)
    parser.add_argument("--clip", type=int, default=0)
    parser.add_argument("--still", nargs="*", default=[])
    given = parser.parse_args()
    task = Task(given.file.resolve(), [*map(float, given.times.split(","))], given.clip, given.still)
    try:
        found = play(task)
    except NoSkinError as error:
        found = {"said": str(error)}
    except MissingError as error:
        found = {"missing": str(error)}
    np.savez(given.out, version=version, **found)
