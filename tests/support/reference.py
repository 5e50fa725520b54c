# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in float64 numpy, one vertex at a time: the oracle of the library. The formulas are those of the
golden set, with bones as Blender reads them, for any rig and parameters, and with margins: how far a vertex
is from where rounding decides, 1 where that is nowhere near. Quaternions are (w, x, y, z)."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "golden"))
import methods
import skin
import stages  # noqa: F401 - for the references of stages


def nearest_rotation(matrix):
    """The proper rotation nearest to the 3x3 `matrix` (polar decomposition)."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def is_rigid(linear):
    return bool(np.allclose(linear.T @ linear, np.eye(3), rtol=0, atol=1e-5) and np.linalg.det(linear) > 0)


def rotation_of_bone(posed_from_rest, rest_bone):
    """The rotation of a bone's motion, 3x3: of a scaled bone, that of its posed axes made orthonormal and
    right-handed, with Y kept and X as near as possible. Rest axes that are not quite orthonormal, as some of
    Blender's, leave it to the reader which rotation that is: Blender's reading counts."""
    if is_rigid(posed_from_rest[:3, :3]):
        return nearest_rotation(posed_from_rest[:3, :3])
    axes = axes_keeping_y(posed_from_rest[:3, :3] @ rest_bone[:3, :3])
    return methods.rotation_of(quaternion_by_blender(axes @ np.linalg.inv(rest_bone[:3, :3])))


def axes_keeping_y(axes):
    """Orthonormal axes for a posed bone's, 3x3, with Blender's choice of a second axis under shear."""
    x, y, z = axes[:, 0], axes[:, 1] / np.linalg.norm(axes[:, 1]), axes[:, 2]
    if y @ x < 1.0:
        x = x - y * (y @ x)
    elif x @ z < 1.0:
        x = np.cross(y, z)
    else:
        x = np.cross(y, y[[1, 2, 0]])
    x /= np.linalg.norm(x)
    return np.column_stack([x, y, np.cross(x, y)])


def quaternion_by_blender(matrix):
    """The unit quaternion that Blender's mat3_normalized_to_quat_fast() reads from a 3x3 matrix whose columns
    it has made of unit length: one component by the diagonal, the others divided by it."""
    m = matrix / np.linalg.norm(matrix, axis=0)
    # 4 w (x, y, z), and off its diagonal 4 (x, y, z)^T (x, y, z).
    by_w = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    by_each = m + m.T
    first = None
    if m[2, 2] < 0.0:
        first = 0 if m[0, 0] > m[1, 1] else 1
    elif m[0, 0] < -m[1, 1]:
        first = 2
    if first is None:
        multiple = np.array([1.0 + np.trace(m), *by_w])
    else:
        by_each[first, first] = 1.0 + 2.0 * m[first, first] - np.trace(m)
        multiple = np.array([by_w[first], *by_each[first]])
    return multiple / np.linalg.norm(multiple)


def pose_of(transforms, rest_bones):
    """As skin.bones(), with rotations as Blender reads them."""
    rotations = np.array([rotation_of_bone(m, b) for m, b in zip(transforms, rest_bones, strict=True)])
    heads = rest_bones[:, :3, 3]
    posed_heads = np.einsum("bij,bj->bi", transforms[:, :3, :3], heads) + transforms[:, :3, 3]
    return SimpleNamespace(
        motion=transforms,
        rotation=rotations,
        quaternion=np.array([skin.quaternion(r) for r in rotations]),
        translation=posed_heads - np.einsum("bij,bj->bi", rotations, heads),
        head=heads,
    )


def along_chain(pose, parents, turns=None):
    """Quaternions [bones, 4] with the signs that continue the parents', and how far each, and those before
    it, are from a tie. A bone that mirrors has the sign of its parent's.

    turns  [bones, 4] or fewer, as sinew.Deformer.deform takes them: within 5 degrees of a bone their signs
           count
    """
    quaternions, margins = [], []
    told = np.zeros((len(pose.motion), 4))
    if turns is not None:
        told[: len(turns)] = turns
    for matrix, parent, turn in zip(pose.motion[:, :3, :3], parents, told, strict=True):
        at_root = np.array([1.0, 0, 0, 0]), 1.0
        before, margin = at_root if parent < 0 else (quaternions[parent], margins[parent])
        q = before
        if np.linalg.det(matrix) >= 0.0:
            lengths = np.linalg.norm(matrix, axis=0)
            q = quaternion_by_blender(matrix / np.where(lengths > 0.0, lengths, 1.0))
        along = q @ before
        if turn.any():
            by_turn = q @ methods.multiply(before, turn) / np.linalg.norm(turn)
            if abs(by_turn) > np.cos(np.radians(2.5)):
                along = by_turn
            margin = min(margin, 1e3 * abs(abs(by_turn) - np.cos(np.radians(2.5))))
        quaternions.append(-q if along < 0.0 else q)
        margins.append(min(margin, abs(along)))
    along = (pose.quaternion * quaternions).sum(axis=1)
    return np.where(along < 0.0, -1.0, 1.0)[:, None] * pose.quaternion, np.minimum(margins, np.abs(along))


def margin_of_signs(of, w, pose, signs):
    """Of quaternions: how far the closest sign is from a tie; where signs are kept, also the sum's length."""
    signed = methods.signed(of, w, pose, signs)
    if signs == "hierarchy":
        return min(pose.of_chain[of].min(), np.linalg.norm(w @ signed))
    totals = np.cumsum(w[:, None] * signed, axis=0)[:-1]
    along = np.einsum("ki,ki->k", signed[1:], totals) / np.linalg.norm(totals, axis=1)
    return np.abs(along).min(initial=1.0)


# Rotations of a set that differ by less along a direction leave its centre free there.
SAME_ROTATION = 1e-3


def margin_of_centre(of, pose):
    """Of sbs: how far the singular values of all pairs' equations are from where one is left out."""
    first, second = np.triu_indices(len(of), 1)
    equations = (pose.rotation[of[first]] - pose.rotation[of[second]]).reshape(-1, 3)
    sizes = np.linalg.svd(equations)[1]
    return np.abs(sizes / (SAME_ROTATION * len(of)) - 1.0).min(initial=1.0)


# Of singular values over the largest: nearer to a tie, the polar factor depends on rounding.
LEAST_SINGULAR = 0.05


def margin_of_neighbourhood(kept, pose, variant):
    rows, c, *_images, correlation = methods.neighbourhood(kept, pose)
    if variant != "0" or not methods.has_extent(kept):
        return margin_of_signs(rows, c, pose, "blender")
    sizes = np.linalg.svd(correlation)[1]
    smallest = sizes[1] + np.sign(np.linalg.det(correlation)) * sizes[2]
    return 1.0 if smallest > LEAST_SINGULAR * sizes[0] else 0.0


def by_iteration(x, of, w, pose, signs):
    """As deformed(), of dib: the ties are at 180 degrees from the result, at 360 where signs are kept, and
    where the iteration is slow."""
    found = list(methods.corrections(x, of, w, pose, signs))
    q, t, _left = found[-1]
    farthest = max(np.linalg.norm(left, axis=1).max() for *_motion, left in found)
    margin = (2.0 if signs == "hierarchy" else 1.0) * np.pi - farthest if len(found) < 60 else 0.0
    return methods.rotation_of(q) @ x + t, margin


def deformed(method, x, of, w, pose, kept, **parameters):
    """The point, and its margin."""
    signs = parameters.get("signs", "blender")
    if method == "dib":
        point, margin = by_iteration(x, of, w, pose, signs)
        return point, min(margin, margin_of_signs(of, w, pose, signs))
    point = getattr(methods, method)(x, of, w, pose, kept, **parameters)
    if method == "lbs" or (method == "sdef" and (len(of) != 2 or not kept[1])):
        return point, 1.0
    if method == "log":
        return point, np.abs(pose.quaternion[of, 0]).min()
    if method == "ddm":
        return point, margin_of_neighbourhood(kept, pose, parameters["variant"])
    margin = margin_of_signs(of, w, pose, signs)
    return point, min(margin, margin_of_centre(of, pose)) if method == "sbs" else margin


# Methods that keep something of each vertex, and values of parameters that have no default in the golden set.
KEEPING = {"cor", "sdef", "ddm"}
DEFAULTS = {"sdef": {"interpolation": "nlerp"}, "ddm": {"variant": "0", "radius": None}}


def kept_of(method, data, vertex):
    """What a method keeps of a vertex; None: it is blended linearly."""
    if data is None:
        return None
    if method == "ddm":
        rows = data[slice(*np.searchsorted(data[:, 0], (vertex, vertex + 1)))]
        return [skin.moments(row, np.eye(4)) for row in rows] or None
    return (data[vertex, :9].reshape(3, 3), data[vertex, 9]) if method == "sdef" else data[vertex]


def deform(
    method,
    rest_points,
    offsets,
    bones,
    weights,
    transforms,
    rest_bones=None,
    vertex_data=None,
    parameters=None,
):
    """Deformed points float64 [vertices, 3], and [vertices] how far each is from a tie of signs.

    vertex_data  as sinew.Binding takes it
    parameters   as sinew.Deformer.deform takes them; with them METHOD.parents and METHOD.turns, its arguments

    A vertex without influences, or with all weights zero, stays.
    """
    transforms = np.asarray(transforms, np.float64)
    if rest_bones is None:
        rest_bones = np.tile(np.eye(4), (len(transforms), 1, 1))
    rest_bones = np.asarray(rest_bones, np.float64)
    prefix = f"{method}."
    given = {name[len(prefix) :]: v for name, v in (parameters or {}).items() if name.startswith(prefix)}
    values = DEFAULTS.get(method, {}) | given
    values.pop("weld", None)
    parents, turns = values.pop("parents", np.full(len(transforms), -1)), values.pop("turns", None)
    pose = pose_of(transforms, rest_bones)
    if values.get("signs") == "hierarchy":
        pose.along_chain, pose.of_chain = along_chain(pose, parents, turns)
    data = (vertex_data or {}).get(method)
    data = None if data is None else np.asarray(data, np.float64)
    points = np.asarray(rest_points, np.float64).copy()
    margins = np.ones(len(points))
    for vertex in range(len(points)):
        span = slice(offsets[vertex], offsets[vertex + 1])
        share = np.asarray(weights[span], np.float64)
        if share.sum() > 0.0:
            of, w = bones[span][share > 0.0], share[share > 0.0] / share.sum()
            kept = kept_of(method, data, vertex)
            own, more = ("lbs", {}) if kept is None and method in KEEPING else (method, values)
            points[vertex], margins[vertex] = deformed(own, points[vertex], of, w, pose, kept, **more)
    return points, margins
