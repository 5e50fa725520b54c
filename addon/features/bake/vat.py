# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex animation textures: the positions and normals of a mesh's vertices in each frame as pictures, for
the shaders of engines. docs/bake.md has the layout."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import SinewError
from ...base.options import option
from .baked_files import is_even

# By engine: its axes in those of Blender, and its units in one of Blender's.
AXES: dict[str, tuple[np.ndarray, float]] = {
    "unreal": (np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]]), 100.0),
    "unity": (np.array([[-1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]), 1.0),
    "gltf": (np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]), 1.0),
}
# What texels are.
EXR, EXR_HALF, PNG = "exr", "exr-half", "png"
# What engines and graphics cards take.
MOST_COLUMNS, MOST_ROWS = 4096, 16384
_OF_16_BITS = 65535


@dataclass(frozen=True)
class VatOptions:
    axes: str = option(
        "unreal",
        "Engine",
        "Whose axes and units the textures have",
        choices=(
            ("unreal", "Unreal", "Z up, Y to the other side, centimetres"),
            ("unity", "Unity", "Y up, X to the other side, metres"),
            ("gltf", "Godot, three.js", "Y up, metres, as glTF has them"),
        ),
    )
    texels: str = option(
        EXR,
        "Texels",
        "How exact they are",
        choices=(
            (EXR, "EXR, Float", "32 bits: exact"),
            (EXR_HALF, "EXR, Half", "16 bits of floating point: half the size, to a part in 2,000"),
            (PNG, "PNG, 16 Bits", "Whole numbers between the bounds: to a part in 130,000 of these"),
        ),
    )


DEFAULT_VAT = VatOptions()


@dataclass(frozen=True)
class Layout:
    """Where a vertex is: those of a frame fill `rows` rows of `width` texels; frames follow each other
    downwards."""

    vertices: int
    frames: int
    width: int
    rows: int

    @classmethod
    def of(cls, vertices: int, frames: int) -> Layout:
        """Raises SinewError where the textures would be too high."""
        rows = -(-vertices // MOST_COLUMNS) or 1
        if rows * frames > MOST_ROWS:
            raise SinewError(
                f"{vertices:,} vertices and {frames:,} frames make textures of {rows * frames:,} rows, and "
                f"{MOST_ROWS:,} are the most; bake fewer frames, or every second one"
            )
        return cls(vertices, frames, -(-vertices // rows) or 1, rows)

    @property
    def height(self) -> int:
        return self.rows * self.frames

    def texture(self, samples: np.ndarray) -> np.ndarray:
        """float32 [height, width, 3] of samples [frames, vertices, 3]; 0 where there is no vertex."""
        texels = np.zeros((self.frames, self.rows * self.width, 3), dtype=np.float32)
        texels[:, : self.vertices] = samples
        return texels.reshape(self.height, self.width, 3)

    def places(self) -> np.ndarray:
        """float64 [vertices, 2]: the middle of each vertex's texel in the first frame, from the left and from
        the top, as shares of the texture."""
        vertex = np.arange(self.vertices)
        return np.stack(
            [(vertex % self.width + 0.5) / self.width, (vertex // self.width + 0.5) / self.height], axis=1
        )


def in_axes(vectors: np.ndarray, axes: str) -> np.ndarray:
    """Vectors [..., 3] of Blender's in the axes of an engine."""
    return np.einsum("ij,...j->...i", AXES[axes][0], vectors)


def encoded(texture: np.ndarray, texels: str) -> tuple[bytes, dict[str, list[float]]]:
    """Returns the file of float32 [height, width, 3], and what gives its values back: those of its texels
    times `scale`, plus `bias`, for each axis."""
    if texels != PNG:
        return exr(texture, np.float16 if texels == EXR_HALF else np.float32), {
            "scale": [1.0] * 3,
            "bias": [0.0] * 3,
        }
    low, high = texture.min(axis=(0, 1)).astype(float), texture.max(axis=(0, 1)).astype(float)
    scale = np.where(high > low, high - low, 1.0)
    whole = np.round((texture - low) / scale * _OF_16_BITS).astype(np.uint16)
    return png(whole), {"scale": scale.tolist(), "bias": low.tolist()}


def exr(texture: np.ndarray, kind: type) -> bytes:
    """An OpenEXR file of [height, width, 3], not compressed.

    kind  numpy's float16 or float32
    """
    height, width = texture.shape[:2]
    of_kind, box = 1 if kind is np.float16 else 2, struct.pack("<4i", 0, 0, width - 1, height - 1)
    # Alphabetical, as the format wants them.
    channels = b"".join(struct.pack("<2siiii", name, of_kind, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    header = b"".join(
        name + b"\0" + type_name + b"\0" + struct.pack("<i", len(value)) + value
        for name, type_name, value in (
            (b"channels", b"chlist", channels),
            (b"compression", b"compression", b"\0"),
            (b"dataWindow", b"box2i", box),
            (b"displayWindow", b"box2i", box),
            (b"lineOrder", b"lineOrder", b"\0"),
            (b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
            (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0.0, 0.0)),
            (b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
        )
    )
    start = struct.pack("<ii", 20000630, 2) + header + b"\0"
    size = 3 * width * np.dtype(kind).itemsize
    lines = np.empty(height, dtype=[("y", "<i4"), ("size", "<i4"), ("data", np.void, size)])
    lines["y"], lines["size"] = np.arange(height), size
    planes = texture[:, :, ::-1].swapaxes(1, 2).astype(np.dtype(kind).newbyteorder("<"))
    lines["data"] = np.ascontiguousarray(planes).reshape(height, -1).view(np.dtype((np.void, size)))[:, 0]
    first = len(start) + 8 * height
    offsets = first + lines.dtype.itemsize * np.arange(height, dtype=np.int64)
    return start + offsets.astype("<u8").tobytes() + lines.tobytes()


def png(texture: np.ndarray) -> bytes:
    """A PNG file of uint16 [height, width, 3]."""
    height, width = texture.shape[:2]
    rows = texture.astype(">u2").reshape(height, -1).view(np.uint8)
    # Each row begins with its filter: none.
    data = zlib.compress(np.pad(rows, ((0, 0), (1, 0))).tobytes(), 9)
    header = struct.pack(">2I5B", width, height, 16, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(value)) + name + value + struct.pack(">I", zlib.crc32(name + value))
        for name, value in chunks
    )


def description(
    layout: Layout, options: VatOptions, frames: Sequence[float], rate: float, positions: np.ndarray
) -> dict[str, Any]:
    """What the file beside the textures says of both.

    rate       of the scene, frames a second
    positions  [frames, vertices, 3], in the engine's axes and units
    """
    step = frames[1] - frames[0] if len(frames) > 1 and is_even(frames) else 1
    return {
        "axes": options.axes,
        "units": AXES[options.axes][1],
        "vertices": layout.vertices,
        "frames": list(frames),
        "rate": rate / step,
        "width": layout.width,
        "height": layout.height,
        "rows": layout.rows,
        "low": positions.min(axis=(0, 1)).tolist(),
        "high": positions.max(axis=(0, 1)).tolist(),
    }
