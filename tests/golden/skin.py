# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Armature modifier in numpy, run on this folder's cases; says how far it is from Blender."""

import json
from pathlib import Path

import numpy as np


def moved_by(m, points):
    return points @ m[:3, :3].T + m[:3, 3]


def axes(m):  # of unit length and square to each other, keeping Y
    y = m[:3, 1] / np.linalg.norm(m[:3, 1])
    x = m[:3, 0] - y * (m[:3, 0] @ y)
    x /= np.linalg.norm(x)
    return np.column_stack([x, y, np.cross(x, y)])


def quaternion(r):  # (w, x, y, z) of a rotation, w >= 0
    k = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    a = np.block([[np.trace(r), k], [k[:, None], r + r.T - np.trace(r) * np.eye(3)]])
    q = np.linalg.eigh(a)[1][:, -1]
    return -q if q[0] < 0 else q


def multiply(p, q):
    (a, *u), (b, *v) = p, q
    return np.array([a * b - np.dot(u, v), *(a * np.array(v) + b * np.array(u) + np.cross(u, v))])


def joints(case, bone, point):  # of a bendy bone: the two next to the point, with their shares
    n = int(case["segments"][bone])
    if n == 1:
        return [(bone, 1.0)]
    along = moved_by(np.linalg.inv(case["rest"][bone]), point)[1] / case["lengths"][bone]
    position = np.clip(along, 0, 1) * n
    k = min(int(position), n - 1)
    first = int(case["first_joint"][bone]) + k
    return [(first, 1 - (position - k)), (first + 1, position - k)]


def skin(case, preserve_volume):
    case = {k: v.astype(np.float64) if v.dtype.kind == "f" else v for k, v in case.items()}
    motion = case["posed"] @ np.linalg.inv(case["rest"])
    rotation = np.array([axes(p) @ axes(r).T for p, r in zip(case["posed"], case["rest"], strict=True)])
    quaternions, result = np.array([quaternion(r) for r in rotation]), case["points"].copy()
    for v, x in enumerate(moved_by(case["armature_from_mesh"], case["points"])):
        total, real, dual, translation = 0.0, np.zeros(4), np.zeros(4), np.zeros(3)
        for i in range(case["offsets"][v], case["offsets"][v + 1]):
            for b, share in joints(case, case["bones"][i], x):
                w, q, y = share * case["weights"][i], quaternions[b], moved_by(motion[b], x)
                s = -w if q @ real < 0 else w  # against the running sum, in stored order
                total, translation, real = total + w, translation + w * (y - x), real + s * q
                dual = dual + s / 2 * multiply([0.0, *(y - rotation[b] @ x)], q)
        if total > 1e-4:
            point, conjugate = x + translation / total, real * [1, -1, -1, -1]
            if preserve_volume:
                point = multiply(multiply(real, [0.0, *x]) + 2 * dual, conjugate)[1:] / (real @ real)
            result[v] = moved_by(np.linalg.inv(case["armature_from_mesh"]), point)
    return result


if __name__ == "__main__":
    for path in sorted(Path(__file__).parent.glob("*.npz")):
        case, about = dict(np.load(path)), json.loads(path.with_suffix(".json").read_text())
        linear = np.abs(skin(case, False) - case["linear"]).max()
        volume = np.abs(skin(case, True) - case["preserve_volume"]).max()
        print(f"{path.stem}: {about['about']}: linear {linear:.1e}, Preserve Volume {volume:.1e}")
