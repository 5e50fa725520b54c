# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the reader of .glb that verifies exports: all forms of accessors, interpolation, and which bones a
file can not store."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from rigs import about
from scipy.spatial.transform import Rotation, Slerp
from sinew_addon.features.gltf.export_check import damaged_bones, spread_frames
from sinew_addon.features.gltf.played import GltfFile, _matrix, _sampled


def glb(tmp_path, accessors, views, binary):
    header = json.dumps({"accessors": accessors, "bufferViews": views}).encode()
    header += b" " * (-len(header) % 4)
    path = tmp_path / "a.glb"
    chunks = struct.pack("<I4s", len(header), b"JSON") + header + struct.pack("<I4s", len(binary), b"BIN\0")
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks) + len(binary)) + chunks + binary)
    return GltfFile(path)


def test_interleaved_accessors(tmp_path):
    rows = np.arange(24, dtype="<f4").reshape(4, 6)
    accessors = [
        {"bufferView": 0, "byteOffset": at, "componentType": 5126, "type": "VEC3", "count": 4}
        for at in (0, 12)
    ]
    file = glb(tmp_path, accessors, [{"byteOffset": 0, "byteStride": 24}], rows.tobytes())
    assert np.array_equal(file.array(0), rows[:, :3])
    assert np.array_equal(file.array(1), rows[:, 3:])


def test_normalised_and_sparse_accessors(tmp_path):
    binary = bytes([0, 255, 51, 102]) + struct.pack("<2H", 1, 3) + np.array([7, 8], "<f4").tobytes()
    sparse = {
        "count": 2,
        "indices": {"bufferView": 0, "byteOffset": 4, "componentType": 5123},
        "values": {"bufferView": 0, "byteOffset": 8},
    }
    accessors = [
        {"bufferView": 0, "componentType": 5121, "normalized": True, "type": "VEC4", "count": 1},
        {"componentType": 5126, "type": "SCALAR", "count": 5, "sparse": sparse},
    ]
    file = glb(tmp_path, accessors, [{}], binary)
    assert np.allclose(file.array(0), [[0.0, 1.0, 0.2, 0.4]])
    assert file.array(1)[:, 0].tolist() == [0.0, 7.0, 0.0, 8.0, 0.0]


def test_rotations_are_interpolated_on_the_sphere():
    times = np.array([0.0, 0.5, 2.0])
    rotations = Rotation.random(3, random_state=2)
    values = rotations.as_quat()
    values[1] *= -1.0
    for time in (-1.0, 0.0, 0.1, 0.5, 1.3, 2.0, 3.0):
        found = _sampled(times, values, time, "LINEAR", is_rotation=True)
        expected = Slerp(times, rotations)(np.clip(time, 0.0, 2.0)).as_quat()
        assert np.isclose(abs(found @ expected), 1.0, atol=1e-12)
        matrix = _matrix({"rotation": found, "scale": (1.0, 2.0, 3.0), "translation": (4.0, 5.0, 6.0)})
        assert np.allclose(matrix[:3, :3], Rotation.from_quat(found).as_matrix() * (1.0, 2.0, 3.0))
        assert matrix[:3, 3].tolist() == [4.0, 5.0, 6.0]


@pytest.mark.parametrize(("time", "expected"), [(0.2, 1.0), (0.5, 3.0), (1.9, 3.0), (2.0, 4.0), (9.0, 4.0)])
def test_steps(time, expected):
    times, values = np.array([0.0, 0.5, 2.0]), np.array([[1.0], [3.0], [4.0]])
    assert _sampled(times, values, time, "STEP", is_rotation=False) == expected


def test_bones_that_a_file_can_not_store():
    """A chain: the second is sheared relative to the first, the third moves with it, the fourth is apart."""
    scale = np.diag([1.0, 2.0, 1.0, 1.0])
    turn = about((0.0, 0.0, 1.0), 40.0)
    poses = np.array([scale, turn, turn @ turn, scale])
    parents = np.array([-1, 0, 1, -1])
    assert damaged_bones(poses, parents, ".glb").tolist() == [0.0, np.inf, np.inf, 0.0]
    # All that it inherits is no shear.
    poses[1] = scale @ turn
    poses[2] = poses[1] @ turn
    assert not damaged_bones(poses, parents, ".glb").any()
    poses[3, :3, :3] = 1.1 * np.identity(3)
    assert damaged_bones(poses, parents, ".usdc").tolist() == [0.0, 0.0, 0.0, 0.01]
    poses[3, :3, :3] = about((0.0, 1.0, 0.0), 89.9)[:3, :3]
    assert damaged_bones(poses, parents, ".fbx").tolist() == [0.0, 0.0, 0.0, 0.01]


def test_frames_are_spread_evenly():
    assert spread_frames(1, 3, 25) == ([1.0, 2.0, 3.0], [1.5, 2.5])
    frames, between = spread_frames(0, 1000, 11)
    assert frames == [100.0 * number for number in range(11)]
    assert between == [frame + 0.5 for frame in frames[:-1]]
