# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.SkinnedNormals: the oracle is the derivative of the methods in float64."""

import numpy as np
import pytest
import rigs
import sinew

METHODS = [method.name for method in sinew.methods()]


def frames_of(rig, seed=3):
    """(normals, tangents perpendicular to them), float32 [vertices, 3]"""
    axes = np.random.default_rng(seed).normal(size=(len(rig.rest_points), 3, 3))
    q = np.linalg.qr(axes)[0]
    return q[..., 0].astype(np.float32), q[..., 1].astype(np.float32)


def jacobians(rig, method, step=1e-3):
    """float64 [vertices, 3, 3]: derivatives of the method's map of each vertex with fixed weights, by
    differences."""
    columns = []
    for axis in np.eye(3):
        ends = [
            rig.with_(rest_points=rig.rest_points.astype(np.float64) + sign * step * axis).reference(method)[
                0
            ]
            for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(columns, axis=-1)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def expected_of(rig, method, normals, tangents):
    """Also returns how well each is determined: 1 where the blend is a rotation, 0 where it flattens."""
    maps = jacobians(rig, method)
    values = np.linalg.svd(maps, compute_uv=False)
    inverse = np.linalg.inv(maps)
    side = np.sign(np.linalg.det(maps))[:, None]
    moved = side * np.einsum("vji,vj->vi", inverse, normals)
    return unit(moved), unit(np.einsum("vij,vj->vi", maps, tangents)), values[:, -1] / values[:, 0]


@pytest.mark.parametrize("is_scaled", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_agrees_with_the_differentiated_reference(method, is_scaled):
    rig = rigs.random_rig(5, vertices=80, most_influences=4, scaled=is_scaled)
    normals, tangents = frames_of(rig)
    skinned = sinew.SkinnedNormals(rig.binding(), normals, tangents, method=method)
    points, got_normals, got_tangents = skinned.deform(rig.transforms)
    np.testing.assert_array_equal(points, rig.deform(method))
    of_normals, of_tangents, determined = expected_of(rig, method, normals, tangents)
    clear = determined > 0.05
    assert clear.mean() > 0.8
    np.testing.assert_allclose(got_normals[clear], of_normals[clear], rtol=0, atol=1e-4)
    np.testing.assert_allclose(got_tangents[clear], of_tangents[clear], rtol=0, atol=1e-4)


def test_corners_have_the_normals_of_their_vertices():
    rig = rigs.random_rig(6)
    normals, tangents = frames_of(rig)
    vertices = np.random.default_rng(1).integers(0, len(normals), 900)
    binding = rig.binding()
    mix = ("dq", np.linspace(0, 1, len(normals)))
    each = sinew.SkinnedNormals(binding, normals, tangents, mix=mix).deform(rig.transforms)
    corners = sinew.SkinnedNormals(binding, normals[vertices], tangents[vertices], vertices, mix=mix)
    assert corners.frame_count == 900
    assert repr(corners) == "<sinew.SkinnedNormals: 900 of 200 vertices, method lbs>"
    got = corners.deform(rig.transforms)
    np.testing.assert_array_equal(got[0], sinew.Deformer(binding, "lbs", mix).deform(rig.transforms))
    np.testing.assert_array_equal(got[1], each[1][vertices])
    np.testing.assert_array_equal(got[2], each[2][vertices])
    # Also without the points, if these are known.
    out = np.empty_like(got[1])
    assert corners.deform_normals(rig.transforms, got[0], out=out) is out
    np.testing.assert_array_equal(out, got[1])


def test_in_the_space_of_the_bones():
    rig = rigs.random_rig(7, scaled=True)
    normals, _ = frames_of(rig)
    space = rigs.random_motion(np.random.default_rng(2))
    binding = rig.binding()
    skinned = sinew.SkinnedNormals(binding, normals, method="dq")
    points, got, tangents = skinned.deform(rig.transforms, bones_from_model=space)
    assert tangents is None
    np.testing.assert_array_equal(
        points, sinew.Deformer(binding, "dq").deform(rig.transforms, bones_from_model=space)
    )
    assert np.abs(got - normals).max() > 0.1
    # Bones that do not move do not change normals, in any space.
    still = np.broadcast_to(np.eye(4, dtype=np.float32), rig.transforms.shape)
    for method in METHODS:
        at_rest = sinew.SkinnedNormals(binding, normals, method=method).deform(still, bones_from_model=space)
        np.testing.assert_allclose(at_rest[1], normals, rtol=0, atol=2e-6)
