# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.DeltaMush: compared with float64 numpy."""

import numpy as np
import sinew


def mesh_of(seed, size=12):
    """(rest points, faces as lists of vertices, edges): triangles, quads, a hexagon, a hole, loose edges."""
    rng = np.random.default_rng(seed)
    x, y = np.mgrid[:size, :size]
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3) / size
    points = points + rng.normal(0, 0.01, points.shape)
    quads = [
        [v, v + size, v + size + 1, v + 1] for v in range(size * (size - 1)) if v % size < size - 1 and v % 17
    ]
    faces = []
    for number, (a, b, c, d) in enumerate(quads):
        faces += [[a, b, c], [a, c, d]] if number % 3 == 0 else [[a, b, c, d]]
    # A face with three edges, one of which already has two faces, and a hexagon with edges of its own.
    faces += [[30, 31, size * size], list(range(3 * size, 3 * size + 6))]
    points = np.concatenate([points, points[30:34] + rng.normal(0, 0.05, (4, 3))])
    edges = {frozenset((face[i - 1], face[i])) for face in faces for i in range(len(face))}
    edges |= {frozenset((5, size * size + 1)), frozenset((size * size + 1, size * size + 2))}
    return points.astype(np.float32), faces, np.array(sorted(map(sorted, edges)), np.int32)


def arrays_of(mesh):
    points, faces, edges = mesh
    offsets = np.cumsum([0, *map(len, faces)]).astype(np.int32)
    return points, offsets, np.concatenate(faces).astype(np.int32), edges


def bent(points, seed=5):
    rng = np.random.default_rng(seed)
    x, y, z = points.T
    return np.stack([x, np.cos(2 * y) + z, np.sin(2 * y) + 0.3 * x], axis=-1).astype(np.float32) + rng.normal(
        0, 0.005, points.shape
    ).astype(np.float32)


def test_binding_again_equals_a_new_one():
    mesh = mesh_of(3)
    points = bent(mesh[0])
    mush = sinew.DeltaMush(*arrays_of(mesh), iterations=9, weights=np.full(148, 0.5))
    rest = 2 * mesh[0]
    for settings in ({}, {"radius": 0.2}, {"smooth_type": "length_weighted", "factor": 0.3}):
        mush.bind(rest, **settings)
        made = sinew.DeltaMush(rest, *arrays_of(mesh)[1:], **settings)
        np.testing.assert_array_equal(mush.apply(points), made.apply(points))
        assert mush.iterations == made.iterations
    assert repr(mush) == f"<sinew.DeltaMush: 148 vertices, {mush.iterations} iterations>"
