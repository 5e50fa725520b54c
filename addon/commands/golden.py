# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares pictures with golden ones: how much they differ, and a picture of where."""

import json
from dataclasses import asdict, dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Self

import numpy as np

from ..base.errors import SinewError
from ..features.measure.heat_scale import viridis
from ..features.pages.views import View

SETTINGS = "render.json"
# A pixel differs visibly when a channel differs by more than this share of its range. Along the edges of one
# mesh, pictures of Blender 4.2 and 5.2 differ by up to 0.19.
VISIBLE = 0.2


@dataclass(frozen=True)
class RenderSettings:
    """How a folder of pictures was made; stored with them, so that they can be made again in the same way.

    engine  "workbench" or "cycles"; with own_look the file's own
    size    pixels of the longer side
    views   one for each frame; none with own_look
    set     parameters as NAME=VALUE
    """

    file: str
    method: str
    frames: list[float]
    engine: str
    size: int
    own_look: bool
    meshes: list[str]
    views: list[View]
    set: list[str] = field(default_factory=list)

    def to_json(self) -> str:
        return json.dumps(asdict(self), indent=1, default=lambda array: array.tolist())

    def _check_types(self) -> None:
        """Raises TypeError or ValueError for values that to_json() does not write."""
        kinds = {"file": str, "method": str, "engine": str, "size": int, "own_look": bool}
        if not all(isinstance(getattr(self, name), kind) for name, kind in kinds.items()):
            raise TypeError
        if not self.frames or not all(
            type(frame) in (int, float) and abs(frame) < 1e9 for frame in self.frames
        ):
            raise TypeError
        if not self.own_look and len(self.views) != len(self.frames):
            raise ValueError
        if not isinstance(self.set, list) or not all(isinstance(text, str) for text in self.set):
            raise TypeError

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Raises SinewError where `folder` was not written by `sinew render`."""
        path = folder / SETTINGS
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            views = [
                View(np.array(v.pop("direction")), np.array(v.pop("target")), **v)
                for v in values.pop("views")
            ]
            settings = cls(views=views, **values)
            settings._check_types()
            return settings
        except OSError as error:
            raise SinewError(
                f"{path}: can not be read: {error.strerror}; make golden pictures with `sinew render … --out "
                f"{folder}` first"
            ) from None
        except (ValueError, TypeError, KeyError, AttributeError):
            raise SinewError(f"{path}: is not what `sinew render` writes; make the pictures again") from None


def picture_name(frame: float) -> str:
    """Returns a name such as 0001.png or 0006.50.png: different for each frame, and sorted by frame."""
    whole = int(np.floor(frame))
    # Two decimals, more only where needed.
    exact = f"{Decimal(repr(float(frame))) - whole:f}"[2:]
    decimals = f".{exact.ljust(2, '0')}" if frame != whole else ""
    return f"{whole:04d}{decimals}.png"


def difference(picture: np.ndarray, golden: np.ndarray) -> np.ndarray:
    """float [height, width]: the largest difference of a channel, 0..1, between pictures [height, width, 4]
    in 0..1 with straight alpha."""
    return np.abs(_over_black(picture) - _over_black(golden)).max(axis=2)


def differing_share(differences: np.ndarray) -> float:
    """The share of pixels that differ visibly."""
    return float(np.mean(differences > VISIBLE))


def difference_picture(differences: np.ndarray, golden: np.ndarray) -> np.ndarray:
    """float [height, width, 4]: differing pixels in colour, towards yellow, over the golden picture in
    grey."""
    grey = 0.15 + 0.25 * _over_black(golden)[:, :, :3].mean(axis=2)
    result = np.ones((*differences.shape, 4))
    result[:, :, :3] = grey[:, :, None]
    seen = differences > VISIBLE
    result[seen, :3] = viridis(0.4 + 0.6 * differences[seen])
    return result


def _over_black(picture: np.ndarray) -> np.ndarray:
    result = picture.astype(np.float64)
    result[:, :, :3] *= result[:, :, 3:]
    return result
