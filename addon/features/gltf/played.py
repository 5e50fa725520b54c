# SPDX-License-Identifier: GPL-3.0-or-later
"""A skinned mesh as an engine plays it from a file, and a reader of .glb files, without Blender.

They read what exporters write, and skin as the formats say, linearly.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sinew

from ...base.errors import SinewError
from ...skinning.influences import Influences

# Blender's axes from those of glTF; and from those of VRM 0, where characters look the other way.
Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
Z_UP_OF_VRM_0 = Z_UP @ np.diag([-1.0, 1.0, -1.0, 1.0])
_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True)
class Played:
    """
    rest     float64 [vertices, 3]
    targets  float64 [targets, vertices, 3], offsets of its shapes
    joints   names
    slots, weights  int and float64 [vertices, n], joints and weights of sum 1; 0 for unused ones
    motions  for a frame float64 [joints, 4, 4], from the space of `rest` to the world, Z up, in metres
    shapes   for a frame float64 [targets], how much of each
    normals  float64 [vertices, 3] at rest; None where the reader leaves them out
    is_animated  whether an animation of the file moves the joints
    up           float64 [4, 4], of glTF: Blender's axes from those of the file
    binds        float64 [joints, 4, 4], of glTF: the joints at rest, in the world
    shape_names  of glTF: of its shapes
    """

    name: str
    rest: np.ndarray
    targets: np.ndarray
    joints: tuple[str, ...]
    slots: np.ndarray
    weights: np.ndarray
    motions: Callable[[float], np.ndarray]
    shapes: Callable[[float], np.ndarray]
    normals: np.ndarray | None = None
    is_animated: bool = True
    up: np.ndarray = field(default_factory=lambda: np.identity(4))
    binds: np.ndarray | None = None
    shape_names: tuple[str, ...] = ()

    def rest_at(self, frame: float) -> np.ndarray:
        """float64 [vertices, 3], with its shapes."""
        return self.rest + np.tensordot(self.shapes(frame), self.targets, axes=1)


def blended(slots: np.ndarray, weights: np.ndarray, motions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """float64 [vertices, 3]: linear blend skinning.

    slots, weights  [vertices, n], of `motions` [joints, 4, 4]
    """
    result = np.zeros(points.shape)
    for slot, weight in zip(slots.T, weights.T, strict=True):
        own = motions[slot]
        moved = np.einsum("vij,vj->vi", own[:, :3, :3], points) + own[:, :3, 3]
        result += weight[:, None] * moved
    return result


def padded(influences: Influences, otherwise: int) -> tuple[np.ndarray, np.ndarray]:
    """Slots and weights of sum 1, as of Played. Vertices without influences are moved by `otherwise`."""
    slots, weights = influences.padded()
    slots[influences.counts == 0, 0], weights[influences.counts == 0, 0] = otherwise, 1.0
    return np.maximum(slots, 0), weights / weights.sum(axis=1, keepdims=True)


def of_sum_one(weights: np.ndarray) -> np.ndarray:
    sums = weights.sum(axis=1, keepdims=True)
    return np.divide(weights, sums, out=np.zeros_like(weights), where=sums > 0.0)


# --- glTF


class GltfFile:
    """The header of a .glb, and its accessors."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        (length,) = struct.unpack("<I", data[12:16])
        self.header: dict[str, Any] = json.loads(data[20 : 20 + length])
        self._binary = data[28 + length :]

    def array(self, number: int) -> np.ndarray:
        """[count, width]; normalised integers as float64."""
        accessor = self.header["accessors"][number]
        kind, width = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        if "bufferView" in accessor:
            values = self._read(accessor["bufferView"], accessor, kind, width, accessor["count"])
        else:
            values = np.zeros((accessor["count"], width), kind)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            at, new = sparse["indices"], sparse["values"]
            own = np.dtype(_COMPONENTS[at["componentType"]])
            rows = self._read(at["bufferView"], at, own, 1, sparse["count"])[:, 0]
            values = values.copy()
            values[rows] = self._read(new["bufferView"], new, kind, width, sparse["count"])
        if accessor.get("normalized"):
            values = np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def _read(self, number: int, at: dict[str, Any], kind: np.dtype, width: int, count: int) -> np.ndarray:
        view = self.header["bufferViews"][number]
        start = view.get("byteOffset", 0) + at.get("byteOffset", 0)
        row = kind.itemsize * width
        step = view.get("byteStride", row)
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(self._binary, "u1", step * (count - 1) + row if count else 0, start),
            (count, row),
            (step, 1),
        )
        return np.ascontiguousarray(rows).view(kind).reshape(count, width)


def _matrix(node: dict[str, Any]) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    matrix = np.identity(4)
    matrix[:3, :3] = sinew.quat.to_rotation_matrix((w, x, y, z))
    matrix[:3, :3] *= np.asarray(node.get("scale", (1.0, 1.0, 1.0)))
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _sampled(times: np.ndarray, values: np.ndarray, time: float, kind: str, is_rotation: bool) -> np.ndarray:
    """The value of a sampler; spherical for rotations. values: [times, width]"""
    last = int(np.clip(np.searchsorted(times, time, side="right"), 1, max(len(times) - 1, 1)))
    first, last = (last - 1, last) if len(times) > 1 else (0, 0)
    span = times[last] - times[first]
    share = float(np.clip((time - times[first]) / span, 0.0, 1.0)) if span > 0.0 else 0.0
    if kind == "STEP":
        share = float(share >= 1.0)
    a, b = values[first].astype(np.float64), values[last].astype(np.float64)
    if not is_rotation:
        return a + share * (b - a)
    # Each number is computed alike, so w may be the last.
    return sinew.quat.normalized(sinew.quat.slerp(a, b, share))


class _GltfScene:
    """Nodes and animations of a file. `played`: names of the animations that play; the first of all where the
    file has none of these."""

    def __init__(self, file: GltfFile, played: Collection[str], rate: float) -> None:
        self.file, self._rate = file, rate
        self.nodes: list[dict[str, Any]] = file.header.get("nodes", [])
        self._parents = {c: n for n, node in enumerate(self.nodes) for c in node.get("children", ())}
        animations = file.header.get("animations", [])
        chosen = [each for each in animations if each.get("name") in played] or animations[:1]
        # Each channel: node, property, times, values, interpolation.
        self._channels: list[tuple[int, str, np.ndarray, np.ndarray, str]] = []
        for animation in chosen:
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                times = file.array(sampler["input"])[:, 0].astype(np.float64)
                values = file.array(sampler["output"])
                kind = sampler.get("interpolation", "LINEAR")
                if kind == "CUBICSPLINE":
                    raise SinewError(
                        "an animation has cubic splines, which exporters of Blender do not write"
                    )
                target = channel["target"]
                self._channels.append(
                    (target["node"], target["path"], times, values.reshape(len(times), -1), kind)
                )
        self._last: tuple[float, list[dict[str, Any]]] | None = None

    def at(self, frame: float) -> list[dict[str, Any]]:
        """The nodes, posed."""
        if self._last is None or self._last[0] != frame:
            posed = [dict(node) for node in self.nodes]
            for node, path, times, values, kind in self._channels:
                posed[node][path] = _sampled(times, values, frame / self._rate, kind, path == "rotation")
            self._last = frame, posed
        return self._last[1]

    def moves(self, nodes: Sequence[int]) -> bool:
        """Whether an animation moves one of the nodes, or one above."""
        moved = {node for node, path, *_sampler in self._channels if path != "weights"}
        while nodes and moved.isdisjoint(nodes):
            nodes = [self._parents[node] for node in nodes if node in self._parents]
        return bool(nodes)

    def world(self, frame: float, joints: Sequence[int]) -> np.ndarray:
        """float64 [joints, 4, 4]"""
        posed, found = self.at(frame), {}

        def of(number: int) -> np.ndarray:
            if number not in found:
                own = _matrix(posed[number])
                found[number] = of(self._parents[number]) @ own if number in self._parents else own
            return found[number]

        return np.array([of(joint) for joint in joints])


def read_gltf(path: Path, played: Collection[str], rate: float) -> list[Played]:
    """The skinned meshes of a .glb. `rate`: frames per second."""
    file = GltfFile(path)
    scene = _GltfScene(file, played, rate)
    return [
        _gltf_mesh(scene, number, node)
        for number, node in enumerate(scene.nodes)
        if "skin" in node and "mesh" in node
    ]


def _gltf_mesh(scene: _GltfScene, number: int, node: dict[str, Any]) -> Played:
    file = scene.file
    mesh, skin = file.header["meshes"][node["mesh"]], file.header["skins"][node["skin"]]
    joints = skin["joints"]
    inverses = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2).astype(np.float64)
    parts = [primitive["attributes"] for primitive in mesh["primitives"]]
    up = Z_UP_OF_VRM_0 if "VRM" in file.header.get("extensions", {}) else Z_UP

    def stacked(name: str) -> np.ndarray:
        sets = max(sum(key.startswith(f"{name}_") for key in part) for part in parts)
        rows = []
        for part in parts:
            found = [file.array(part[f"{name}_{k}"]) for k in range(sets) if f"{name}_{k}" in part]
            found += [np.zeros_like(found[0])] * (sets - len(found))
            rows.append(np.hstack(found))
        return np.vstack(rows)

    count = len(mesh["primitives"][0].get("targets", ()))
    targets = [
        np.vstack([file.array(p["targets"][k]["POSITION"]) for p in mesh["primitives"]]) for k in range(count)
    ]
    rest = np.vstack([file.array(part["POSITION"]) for part in parts]).astype(np.float64)
    plain = np.asarray(node.get("weights", mesh.get("weights", np.zeros(count))), dtype=np.float64)
    return Played(
        node.get("name", ""),
        rest,
        np.array(targets, dtype=np.float64).reshape(count, len(rest), 3),
        tuple(scene.nodes[joint].get("name", "") for joint in joints),
        stacked("JOINTS").astype(np.int64),
        of_sum_one(stacked("WEIGHTS").astype(np.float64)),
        lambda frame: up @ scene.world(frame, joints) @ inverses,
        lambda frame: np.asarray(scene.at(frame)[number].get("weights", plain), dtype=np.float64),
        np.vstack([file.array(part["NORMAL"]) for part in parts]).astype(np.float64)
        if all("NORMAL" in part for part in parts)
        else None,
        scene.moves(joints),
        up,
        up @ np.linalg.pinv(inverses),
        tuple({**mesh["primitives"][0], **mesh}.get("extras", {}).get("targetNames", ())),
    )
