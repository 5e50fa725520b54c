# SPDX-License-Identifier: GPL-3.0-or-later
"""The skinning of this folder's cases in numpy, float64, one vertex at a time, as README.md says it; run, it
says how far it is from what the files hold. methods.py has the methods, stages.py what may follow them."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

FORMAT = 2


def read(path):
    """The arrays of a case, floats as float64, and what its JSON says."""
    about = json.loads(path.with_suffix(".json").read_text())
    if about["format"] != FORMAT:
        sys.exit(f"{path}: format {about['format']}, this reader knows {FORMAT}")
    arrays = dict(np.load(path.with_suffix(".npz")))
    return {k: v.astype(np.float64) if v.dtype.kind == "f" else v for k, v in arrays.items()}, about


def moved_by(m, points):
    return points @ m[:3, :3].T + m[:3, 3]


def axes(m):  # of unit length and perpendicular to each other, keeping Y
    y = m[:3, 1] / np.linalg.norm(m[:3, 1])
    x = m[:3, 0] - y * (m[:3, 0] @ y)
    x /= np.linalg.norm(x)
    return np.column_stack([x, y, np.cross(x, y)])


def quaternion(r):  # (w, x, y, z) of a rotation, w >= 0
    k = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    a = np.block([[np.trace(r), k], [k[:, None], r + r.T - np.trace(r) * np.eye(3)]])
    q = np.linalg.eigh(a)[1][:, -1]
    return -q if q[0] < 0 else q


def bones(case):
    """Of every bone, then of every joint of bendy bones: its motion, the rotation in it (3x3 and quaternion),
    the translation that goes with the rotation where the bone is not scaled, and its head at rest."""
    rest, posed = case["rest"], case["posed"]
    motion = posed @ np.linalg.inv(rest)
    rotation = np.array([axes(p) @ axes(r).T for p, r in zip(posed, rest, strict=True)])
    head = rest[:, :3, 3]
    translation = posed[:, :3, 3] - np.einsum("bij,bj->bi", rotation, head)
    quaternions = np.array([quaternion(r) for r in rotation])
    return SimpleNamespace(
        motion=motion,
        rotation=rotation,
        quaternion=quaternions,
        along_chain=along_chain(quaternions, case["parents"], np.linalg.det(motion[:, :3, :3]) < 0),
        translation=translation,
        head=head,
    )


def along_chain(quaternions, parents, mirrors):  # with the signs that continue the parents'
    result, nearby = [], []
    for q, parent, is_mirrored in zip(quaternions, parents, mirrors, strict=True):
        before = np.array([1.0, 0, 0, 0]) if parent < 0 else nearby[parent]
        result.append(-q if q @ before < 0 else q)
        nearby.append(before if is_mirrored else result[-1])
    return np.array(result)


def joints(case, bone, point):  # of a bendy bone: the two next to the point, with their shares
    n = int(case["segments"][bone])
    if n == 1:
        return [(bone, 1.0)]
    along = moved_by(np.linalg.inv(case["rest"][bone]), point)[1] / case["lengths"][bone]
    position = np.clip(along, 0, 1) * n
    k = min(int(position), n - 1)
    first = int(case["first_joint"][bone]) + k
    return [(first, 1 - (position - k)), (first + 1, position - k)]


def influences(case, vertex, point):
    """Bones or joints, and their weights of sum 1, in stored order; none where the vertex stays."""
    span = range(case["offsets"][vertex], case["offsets"][vertex + 1])
    pairs = [
        (bone, case["weights"][i] * share)
        for i in span
        for bone, share in joints(case, case["bones"][i], point)
    ]
    pairs = [(bone, weight) for bone, weight in pairs if weight > 0]
    total = sum(weight for _bone, weight in pairs)
    if total <= 1e-4:
        return np.empty(0, int), np.empty(0)
    return np.array([bone for bone, _weight in pairs]), np.array([weight for _bone, weight in pairs]) / total


def vertex_data(case, method):
    """What the method keeps of vertices, in armature space: by vertex, None where it keeps nothing."""
    data, to = case.get(f"data_{method}"), case["armature_from_mesh"]
    count = len(case["points"])
    if data is None:
        return [None] * count
    if method == "ddm":  # rows of moments, in any number for each vertex
        return [[moments(row, to) for row in data[data[:, 0] == v]] for v in range(count)]
    if method == "sdef":  # three points and a flag
        return [(moved_by(to, row[:9].reshape(3, 3)), row[9]) for row in data]
    return moved_by(to, data)


def moments(row, to):
    xx, yy, zz, yz, xz, xy = row[6:]
    linear, weight = to[:3, :3], row[2]
    return SimpleNamespace(
        bone=int(row[1]),
        weight=weight,
        first=linear @ row[3:6] + weight * to[:3, 3],
        second=linear @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ linear.T,
    )


def skin(case, method, parameters):
    """Rest points moved by a method, mesh object's space."""
    import methods

    pose, to, result = bones(case), case["armature_from_mesh"], case["points"].copy()
    kept = vertex_data(case, method)
    for v, x in enumerate(moved_by(to, case["points"])):
        of, weights = influences(case, v, x)
        if len(of):
            point = getattr(methods, method)(x, of, weights, pose, kept[v], **parameters)
            result[v] = moved_by(np.linalg.inv(to), point)
    return result


def result_of(case, result):
    """The points of an entry of the JSON's `results`."""
    import stages

    points = skin(case, result["method"], result["parameters"])
    for stage, values in result["stages"].items():
        after = {"is_linear": result["method"] == "lbs"} if stage == "twist_spread" else {}
        points = getattr(stages, stage)(case, points, **values, **after)
    return points


if __name__ == "__main__":
    for path in sorted(Path(__file__).parent.glob("*.npz")):
        case, about = read(path)
        print(f"{path.stem}: {about['about']}")
        for result in about["results"]:
            error = np.abs(result_of(case, result) - case[result["array"]]).max()
            print(f"    {result['array']:28} by {result['by']:8} {error:.1e}")
