# SPDX-License-Identifier: GPL-3.0-or-later
"""Each method for one vertex: its point by the pose, armature space.

The papers are Magnenat-Thalmann et al. 1988 (lbs), Hejl 2004 with Smith 2013, section 3.6 (qv), Kavan,
Collins, Zara, O'Sullivan 2008, algorithms 1 (dq) and 3 (dib), Alexa 2002 (log), Le, Hodgins 2016 (cor),
Kavan, Zara 2005 (sbs) and Le, Lewis 2019 (ddm); sdef is mmd_tools' formula.

x           the rest point
of          int [n], its bones or joints, in stored order
w           float [n], their weights, of sum 1
pose        skin.bones(): of all bones and joints
kept        what the method keeps of this vertex; None: nothing
"""

import numpy as np
from skin import moved_by


def multiply(p, q):
    a, b, c, d = p
    return np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]]) @ q


def rotation_of(q):  # 3x3, of a quaternion of any length
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def signs(quaternions, w):  # each into the hemisphere of the sum of those before it, in stored order
    total, result = np.zeros(4), []
    for q, weight in zip(quaternions, w, strict=True):
        result.append(-1.0 if q @ total < 0 else 1.0)
        total = total + result[-1] * weight * q
    return np.array(result)


def blended(quaternions, w):
    return (signs(quaternions, w) * w) @ quaternions


def signed(of, w, pose, by):  # the quaternions of bones, with signs by a rule
    if by == "hierarchy":
        return pose.along_chain[of]
    return signs(pose.quaternion[of], w)[:, None] * pose.quaternion[of]


def by_whole_bones(x, of, pose):  # [n, 3]: where each bone puts x, scale included
    return np.array([moved_by(pose.motion[b], x) for b in of])


def by_rigid_bones(x, of, pose):  # [n, 3]: the same without the scale of bones
    return np.array([pose.rotation[b] @ x + pose.translation[b] for b in of])


def scaled(x, of, w, pose):  # what the scale of bones adds, for methods that blend rigid motions
    return w @ (by_whole_bones(x, of, pose) - by_rigid_bones(x, of, pose))


def about(centre, x, of, w, pose, signs):  # rotated about a centre, which linear blending moves
    rotation = rotation_of(w @ signed(of, w, pose, signs))
    return rotation @ (x - centre) + w @ by_rigid_bones(centre, of, pose) + scaled(x, of, w, pose)


def lbs(x, of, w, pose, kept):
    return w @ by_whole_bones(x, of, pose)


def translations(
    x, of, pose
):  # [n, 3]: with its rotation about the origin, each bone's that moves x as the whole bone
    return by_whole_bones(x, of, pose) - np.array([pose.rotation[b] @ x for b in of])


def dq(x, of, w, pose, kept, signs="blender"):
    real, dual = dual_blend(x, of, w, pose, signs)
    conjugate = real * [1, -1, -1, -1]
    return multiply(multiply(real, [0.0, *x]) + 2 * dual, conjugate)[1:] / (real @ real)


def dual_blend(x, of, w, pose, signs="blender"):
    q, t = signed(of, w, pose, signs), translations(x, of, pose)
    duals = np.array([multiply([0.0, *b], a) / 2 for a, b in zip(q, t, strict=True)])
    return w @ q, w @ duals


def qv(x, of, w, pose, kept):
    return rotation_of(blended(pose.quaternion[of], w)) @ x + w @ translations(x, of, pose)


def cor(x, of, w, pose, kept, signs="blender"):
    return about(kept, x, of, w, pose, signs)


def sbs(x, of, w, pose, kept, signs="blender"):
    """The centre is the point that the bones move most alike; of several the nearest to their heads' mean."""
    centre, count = pose.head[of].mean(axis=0), len(of)
    first, second = np.triu_indices(count, 1)
    r, t = pose.rotation[of], pose.translation[of]
    equations = (r[first] - r[second]).reshape(-1, 3)
    wanted = (t[second] - t[first]).ravel() - equations @ centre
    # Directions along which rotations agree are free.
    u, sizes, vt = np.linalg.svd(equations, full_matrices=False)
    for left, size, right in zip(u.T, sizes, vt, strict=True):
        if size > 1e-3 * count:
            centre = centre + (left @ wanted) / size * right
    return about(centre, x, of, w, pose, signs)


def sdef(x, of, w, pose, kept, interpolation):
    points, is_spherical = kept
    if not is_spherical or len(of) != 2:
        return lbs(x, of, w, pose, None)
    centre, ends = points[0], points[1:]
    middles = (centre + centre + ends - w @ ends) / 2
    a, b = pose.quaternion[of]
    b = -b if a @ b < 0 else b
    q = w[0] * a + w[1] * b
    if interpolation == "slerp":
        angle = np.arccos(min(a @ b, 1.0))
        if angle > 1e-6:
            q = np.sin(w[0] * angle) * a + np.sin(w[1] * angle) * b
    moved = np.array([by_rigid_bones(m, [bone], pose)[0] for m, bone in zip(middles, of, strict=True)])
    return rotation_of(q) @ (x - centre) + w @ moved + scaled(x, of, w, pose)


def ddm(x, of, w, pose, kept, variant, radius):
    """kept: moments of the vertex's neighbourhood, one for each bone. The radius is in them."""
    rows, c, centroid, target, correlation = neighbourhood(kept, pose)
    rotation = rotation_of(blended(pose.quaternion[rows], c))
    if variant == "0" and has_extent(kept):
        u, sizes, vt = np.linalg.svd(correlation)
        mirrored = np.sign(np.linalg.det(u @ vt))
        # Where two rotations are as near as each other, the blended quaternion stands.
        if 2 * (sizes[1] + mirrored * sizes[2]) > 1e-6 * np.abs(correlation).max():
            rotation = u @ np.diag([1, 1, mirrored]) @ vt
    if variant == "4":
        target = c @ by_rigid_bones(centroid, rows, pose)
    return rotation @ (x - centroid) + target + scaled(x, of, w, pose)


def neighbourhood(kept, pose):  # bones, weights, the centroid, its image, and how both correlate
    rows, c = np.array([m.bone for m in kept]), np.array([m.weight for m in kept])
    first, second = np.array([m.first for m in kept]), np.array([m.second for m in kept])
    r, t, centroid = pose.rotation[rows], pose.translation[rows], first.sum(axis=0)
    target = np.einsum("bij,bj->i", r, first) + c @ t
    moved = r @ centroid + t - target
    return rows, c, centroid, target, (r @ second).sum(axis=0) + moved.T @ (first - c[:, None] * centroid)


def has_extent(kept):  # more than a point
    centroid = sum((m.first for m in kept), np.zeros(3))
    return sum(np.trace(m.second) for m in kept) > 1e-10 * centroid @ centroid


def cross_matrix(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def integral(vector):  # takes the linear part of a twist of this rotation vector to the translation
    angle, k = np.linalg.norm(vector), cross_matrix(vector)
    if angle < 1e-4:
        return np.eye(3) + k / 2 + k @ k / 6
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * k @ k


def logarithm(q, translation, is_kept=False):  # of a rigid motion: rotation vector and linear part
    q = -q if q[0] < 0 and not is_kept else q  # at most 180 degrees, unless the sign is kept
    sine = np.linalg.norm(q[1:])
    vector = 2 * np.arctan2(sine, q[0]) / sine * q[1:] if sine > 1e-12 else 2 * q[1:]
    return vector, np.linalg.solve(integral(vector), translation)


def exponential(vector, linear):  # rotation as a quaternion, and translation
    half = np.linalg.norm(vector) / 2
    return np.array([np.cos(half), *(np.sinc(half / np.pi) / 2 * vector)]), integral(vector) @ linear


def log(x, of, w, pose, kept):
    twists = [logarithm(q, t) for q, t in zip(pose.quaternion[of], translations(x, of, pose), strict=True)]
    vector, linear = (w @ np.array(part) for part in zip(*twists, strict=True))
    q, t = exponential(vector, linear)
    return rotation_of(q) @ x + t


def dib(x, of, w, pose, kept, signs="blender"):
    for q, t, _left in corrections(x, of, w, pose, signs):
        point = rotation_of(q) @ x + t
    return point


def corrections(x, of, w, pose, signs):
    """The blend of dq, corrected by the mean of the motions that are left until nothing is: after each step
    the quaternion, the translation, and the rotation vectors of what was left."""
    is_kept = signs == "hierarchy"
    real, dual = dual_blend(x, of, w, pose, signs)
    length = np.linalg.norm(real)
    q, t = real / length, 2 * multiply(dual, real * [1, -1, -1, -1])[1:] / length**2
    rotations, moved = signed(of, w, pose, signs), translations(x, of, pose)
    for _step in range(100):
        inverse, rotation = q * [1, -1, -1, -1], rotation_of(q)
        left = [
            logarithm(multiply(inverse, each), rotation.T @ (to - t), is_kept)
            for each, to in zip(rotations, moved, strict=True)
        ]
        vectors, linears = (np.array(part) for part in zip(*left, strict=True))
        vector, linear = w @ vectors, w @ linears
        step, by = exponential(vector, linear)
        q, t = multiply(q, step), t + rotation @ by
        yield q, t, vectors
        if np.abs(vector).max() < 1e-12 and np.abs(linear).max() < 1e-12:
            break
