# SPDX-License-Identifier: GPL-3.0-or-later
"""Point caches of baked frames (MDD and PC2), and checks of the frames and the disk space of a bake."""

import os
import shutil
import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ...base.errors import SinewError, WrongUse
from ...base.output import remove, writing

# Bakes that a .blend plays; those of Blender's exporters, and all that other programs play.
BONES = "bones"
EXPORTS = {"alembic": ".abc", "usd": ".usdc"}
VAT = "vat"
FILES = {**EXPORTS, VAT: ".glb"}
KINDS = ("shape-keys", "mdd", "pc2", BONES, *FILES)


def mdd_header(frames: Sequence[float], vertices: int, rate: float) -> bytes:
    """Returns, big-endian: number of frames, number of points, and the time of each frame in seconds."""
    times = (np.asarray(frames, dtype=np.float64) / rate).astype(">f4")
    return struct.pack(">ii", len(frames), vertices) + times.tobytes()


def pc2_header(frames: Sequence[float], vertices: int, _rate: float) -> bytes:
    """Returns, little-endian: version 1, number of points, first frame, frames between samples, number of
    samples."""
    step = frames[1] - frames[0] if len(frames) > 1 else 1.0
    return struct.pack("<12siiffi", b"POINTCACHE2\0", 1, vertices, frames[0], step, len(frames))


# For each format, its header and the type of a coordinate.
FORMATS: dict[str, tuple[Callable[[Sequence[float], int, float], bytes], str]] = {
    "mdd": (mdd_header, ">f4"),
    "pc2": (pc2_header, "<f4"),
}


def played_elsewhere(kind: str, frames: Sequence[float]) -> str:
    """How a Mesh Cache modifier plays the file where Sinew did not add it: by default it takes no notice of
    times, start and rate, and has sample n at frame n."""
    if kind == "mdd":
        return "elsewhere, set Mesh Cache's Time Mode to Time, as it otherwise has sample n at frame n"
    if not is_even(frames):
        return (
            "elsewhere, key Mesh Cache's Evaluation Frame, as .pc2 has no frames that are unequally far apart"
        )
    step = frames[1] - frames[0] if len(frames) > 1 else 1.0
    scale = f" and Frame Scale to {1.0 / step:g}" if step != 1.0 else ""
    return (
        f"elsewhere, set Mesh Cache's Start Frame to {frames[0] / step:g}{scale}, as it otherwise has "
        "sample n at frame n"
    )


class PointCache:
    """A point cache that is written frame by frame to a temporary file; publish() renames it to `path`.

    frames  of the samples that will be written
    rate    frames per second
    """

    def __init__(self, path: Path, kind: str, frames: Sequence[float], vertices: int, rate: float) -> None:
        self.path = path
        header, self._coordinate = FORMATS[kind]
        self.unfinished = path.with_name(f".{path.name}.unfinished")
        remove(self.unfinished)
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.unfinished.open("wb")
            self._file.write(header(frames, vertices, rate))

    def write(self, points: np.ndarray) -> None:
        """Writes the next sample, [vertices, 3]."""
        with writing(self.path):
            self._file.write(points.astype(self._coordinate).tobytes())

    def close(self) -> None:
        """Closes the file after its last sample."""
        with writing(self.path):
            self._file.close()

    def discard(self) -> None:
        """Removes the temporary file, also where the disk is full."""
        # Closing flushes the buffer, which fails on a full disk; the file is removed anyway.
        with suppress(OSError):
            self._file.close()
        remove(self.unfinished)


def publish(unfinished: Path, path: Path) -> None:
    with writing(path):
        os.replace(unfinished, path)


def check_space(folder: Path, needed: int) -> None:
    """Raises SinewError where `folder`, which need not exist yet, has fewer than `needed` bytes free."""
    existing = next(parent for parent in (folder.resolve(), *folder.resolve().parents) if parent.exists())
    free = shutil.disk_usage(existing).free
    if free < needed:
        raise SinewError(
            f"{folder}: the bake takes {_megabytes(needed)} and {_megabytes(free)} are free; bake fewer "
            "frames, or to another disk"
        )


def check_frames(kind: str, frames: Sequence[float]) -> None:
    """Raises WrongUse where an export of this kind is not possible for the frames, which are ascending."""
    is_whole = all(float(frame).is_integer() for frame in frames)
    if not (is_whole and is_even(frames, 1)):
        raise WrongUse(f"{kind}: Blender exports every frame of a range; give frames such as 1-48")
    if kind == "usd" and frames[0] < 0:
        raise WrongUse(f"{kind}: Blender exports no frames before 0; give others, or bake to alembic")


def is_whole(path: Path, kind: str) -> bool:
    """Whether an exported file is complete. Blender's USD exporter reports no error on a full disk (4.5)."""
    with path.open("rb") as file:
        start = file.read(24)
        size = file.seek(0, os.SEEK_END)
        if len(start) < 24:
            return False
        if kind == "alembic":
            # Ogawa sets the sixth byte when the file is closed.
            return start[:6] == b"Ogawa\xff"
        if kind == "gltf":
            return start[:4] == b"glTF" and struct.unpack("<I", start[8:12])[0] == size
        # A USD crate's header gives the offset of its table of contents, which ends the file: a count, then
        # 32 bytes each.
        (contents,) = struct.unpack("<q", start[16:])
        if start[:8] != b"PXR-USDC" or not 24 <= contents <= size - 8:
            return False
        file.seek(contents)
        (count,) = struct.unpack("<Q", file.read(8))
        return contents + 8 + 32 * count <= size


def is_even(frames: Sequence[float], step: float | None = None) -> bool:
    """Whether the frames are equally far apart, by `step` where it is given."""
    gaps = np.diff(frames)
    return len(gaps) == 0 or bool(np.all(gaps == (gaps[0] if step is None else step)))


def ramps(frames: Sequence[float]) -> list[tuple[list[float], list[float]]]:
    """Returns, for each frame, times and values of the keys of its shape: 1 at that frame, 0 at its
    neighbours. With linear interpolation between the keys, two neighbours are mixed at a time and all values
    sum to 1."""
    result = []
    for number in range(len(frames)):
        neighbours = range(max(number - 1, 0), min(number + 2, len(frames)))
        result.append(([frames[i] for i in neighbours], [float(i == number) for i in neighbours]))
    return result


def _megabytes(count: int) -> str:
    return f"{count / 1e6:,.1f} MB"
