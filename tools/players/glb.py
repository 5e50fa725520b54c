# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a .glb into its header and accessors, changes them, and writes it again."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
NUMBERS = {np.dtype(kind): number for number, kind in KINDS.items()}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
NAMES = {width: name for name, width in WIDTHS.items()}


class Glb:
    """A file of one buffer; its accessors have no sparse values."""

    def __init__(self, path: Path | None = None) -> None:
        self.header: dict = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self.binary = b""
        if path is not None:
            data = path.read_bytes()
            (length,) = struct.unpack_from("<I", data, 12)
            self.header, self.binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(self, number: int) -> np.ndarray:
        """The values of an accessor, [count, width]."""
        accessor = self.header["accessors"][number]
        view = self.header["bufferViews"][accessor["bufferView"]]
        kind, width = np.dtype(KINDS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        own = kind.itemsize * width
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(self.binary, "u1", offset=start),
            (accessor["count"], own),
            (view.get("byteStride", own), 1),
        )
        return np.ascontiguousarray(rows).view(kind).reshape(-1, width)

    def add(self, values: np.ndarray, **others: object) -> int:
        """Adds an accessor; each value begins at a multiple of four bytes. values: [count, width]"""
        own = values.dtype.itemsize * values.shape[1]
        row = -(-own // 4) * 4
        padded = np.zeros((len(values), row), "u1")
        padded[:, :own] = np.ascontiguousarray(values).view("u1").reshape(len(values), own)
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": padded.nbytes}
        view |= {"byteStride": row} if row != own else {}
        self.binary += padded.tobytes()
        self.header["bufferViews"].append(view)
        about = {"bufferView": len(self.header["bufferViews"]) - 1, "count": len(values)}
        about |= {"componentType": NUMBERS[values.dtype], "type": NAMES[values.shape[1]]}
        self.header["accessors"].append({**about, **others})
        return len(self.header["accessors"]) - 1

    def write(self, path: Path) -> None:
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        self.header["buffers"] = [{"byteLength": len(binary)}]
        text = json.dumps(self.header).encode()
        text += b" " * (-len(text) % 4)
        first = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(binary), len(text), b"JSON")
        path.write_bytes(first + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def write_still(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """A mesh without a skin. points: [n, 3], Z up"""
    made = Glb()
    x, y, z = points.T
    upright = np.column_stack([x, z, -y]).astype("<f4")
    about = {"min": upright.min(axis=0).tolist(), "max": upright.max(axis=0).tolist()}
    attributes = {"POSITION": made.add(upright, **about)}
    indices = made.add(triangles.reshape(-1, 1).astype("<u4"))
    made.header |= {
        "meshes": [{"primitives": [{"attributes": attributes, "indices": indices}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    made.write(path)
