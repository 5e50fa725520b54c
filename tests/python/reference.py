# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in float64 numpy and matrix form, from the papers: the oracle of the library.

Written from Magnenat-Thalmann et al. 1988 (lbs), Hejl 2004 with Smith 2013 section 3.6 (qv), Kavan,
Collins, Zara, O'Sullivan 2008, algorithms 1 (dq) and 3 (dib), Alexa 2002 (log), Le, Hodgins 2016 (cor),
Kavan, Zara 2005 (sbs), Le, Lewis 2019 (ddm) and mmd_tools' formula (sdef); slow, one vertex at a time, and
does not use the formulas of the library where others exist. Quaternions are (w, x, y, z).
"""

import functools

import numpy as np
import scipy.linalg
from scipy.spatial.transform import Rotation


def remembered(function):
    """Of a few matrices: many vertices have the same bones."""

    @functools.lru_cache(maxsize=2000)
    def by_content(*given):
        result = function(*(np.frombuffer(content).reshape(size, size) for size, content in given))
        for array in result if isinstance(result, tuple) else (result,):
            array.flags.writeable = False
        return result

    def of(*matrices):
        matrices = [np.ascontiguousarray(matrix, np.float64) for matrix in matrices]
        return by_content(*((len(matrix), matrix.tobytes()) for matrix in matrices))

    return functools.wraps(function)(of)


def nearest_rotation(matrix):
    """The proper rotation nearest to the 3x3 `matrix` (polar decomposition)."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def is_rigid(linear):
    return bool(np.allclose(linear.T @ linear, np.eye(3), rtol=0, atol=1e-5) and np.linalg.det(linear) > 0)


@remembered
def rotation_of_bone(posed_from_rest, rest_bone):
    """The rotation of a bone's motion, 3x3: of a scaled bone, that of its posed axes made orthonormal and
    right-handed, with Y kept and X as near as possible. Rest axes that are not quite orthonormal, as some of
    Blender's, leave it to the reader which rotation that is: Blender's reading counts."""
    if is_rigid(posed_from_rest[:3, :3]):
        return nearest_rotation(posed_from_rest[:3, :3])
    axes = axes_keeping_y(posed_from_rest[:3, :3] @ rest_bone[:3, :3])
    return rotation(quaternion_by_blender(axes @ np.linalg.inv(rest_bone[:3, :3])))


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


@remembered
def quaternion(rotation):
    """The unit quaternion of `rotation`, of either sign: the eigenvector of Bar-Itzhack's matrix."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    k = np.array(
        [
            [xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, xx - yy - zz, xy + yx, xz + zx],
            [xz - zx, xy + yx, yy - xx - zz, yz + zy],
            [yx - xy, xz + zx, yz + zy, zz - xx - yy],
        ]
    )
    return np.linalg.eigh(k)[1][:, -1]


def rotation(q):
    """The 3x3 rotation of the unit quaternion `q`."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * y * y - 2 * z * z, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y],
            [2 * x * y + 2 * w * z, 1 - 2 * x * x - 2 * z * z, 2 * y * z - 2 * w * x],
            [2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, 1 - 2 * x * x - 2 * y * y],
        ]
    )


def left_multiplication(q):
    """The 4x4 matrix that multiplies a quaternion by `q` from the left."""
    w, x, y, z = q
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def translation(real, dual):
    """Kavan et al. 2008, algorithm 1: the last column of the matrix of the blended dual quaternion."""
    w0, x0, y0, z0 = real
    we, xe, ye, ze = dual
    return 2.0 * np.array(
        [
            -we * x0 + xe * w0 - ye * z0 + ze * y0,
            -we * y0 + xe * z0 + ye * w0 - ze * x0,
            -we * z0 - xe * y0 + ye * x0 + ze * w0,
        ]
    )


def in_one_hemisphere(quaternions, weights):
    """Signs that bring each quaternion into the hemisphere of the weighted sum of those before it, and how
    far the closest of them is from a tie (1: none is near)."""
    signs, total, margin = [], np.zeros(4), 1.0
    for q, weight in zip(quaternions, weights, strict=True):
        along = q @ total
        if total.any():
            margin = min(margin, abs(along) / np.linalg.norm(total))
        signs.append(-1.0 if along < 0.0 else 1.0)
        total = total + signs[-1] * weight * q
    return np.array(signs), margin


def along_chain(transforms, parents, turns=None):
    """Quaternions [bones, 4] with the signs that continue the parents', and how far each, and those before
    it, are from a tie. A bone that mirrors has its parent's.

    turns  [bones, 4] or fewer, as sinew.Deformer.deform takes them: within 5 degrees of a bone their signs
           count
    """
    quaternions, margins = [], []
    told = np.zeros((len(transforms), 4))
    if turns is not None:
        told[: len(turns)] = turns
    for matrix, parent, turn in zip(transforms[:, :3, :3], parents, told, strict=True):
        at_root = np.array([1.0, 0, 0, 0]), 1.0
        before, margin = at_root if parent < 0 else (quaternions[parent], margins[parent])
        q = before
        if np.linalg.det(matrix) >= 0.0:
            lengths = np.linalg.norm(matrix, axis=0)
            q = quaternion_by_blender(matrix / np.where(lengths > 0.0, lengths, 1.0))
        along = q @ before
        if turn.any():
            by_turn = q @ (left_multiplication(before) @ turn) / np.linalg.norm(turn)
            if abs(by_turn) > np.cos(np.radians(2.5)):
                along = by_turn
            margin = min(margin, 1e3 * abs(abs(by_turn) - np.cos(np.radians(2.5))))
        quaternions.append(-q if along < 0.0 else q)
        margins.append(min(margin, abs(along)))
    return np.array(quaternions), np.array(margins)


def signs_of(quaternions, weights, kept):
    """As in_one_hemisphere(); `kept`: quaternions whose signs are taken instead, and the margin is also
    the length of the sum."""
    if kept is None:
        return in_one_hemisphere(quaternions, weights)
    along = (quaternions * kept).sum(axis=1)
    signs = np.where(along < 0.0, -1.0, 1.0)
    return signs, min(np.abs(along).min(), np.linalg.norm((signs * weights) @ quaternions))


def lbs(point, motions, rotations, weights):
    blended = np.tensordot(weights, motions, axes=1)
    return (blended @ np.append(point, 1.0))[:3], 1.0


def rigid_terms(point, motions, rotations):
    """For each bone the rigid motion with its rotation that moves `point` as the whole bone does."""
    translations = (motions @ np.append(point, 1.0))[:, :3] - rotations @ point
    return np.array([quaternion(r) for r in rotations]), translations


def qv(point, motions, rotations, weights):
    quaternions, translations = rigid_terms(point, motions, rotations)
    signs, margin = in_one_hemisphere(quaternions, weights)
    blended = (signs * weights) @ quaternions
    return rotation(blended / np.linalg.norm(blended)) @ point + weights @ translations, margin


def dq(point, motions, rotations, weights, kept=None):
    quaternions, translations = rigid_terms(point, motions, rotations)
    rotated, translated, margin = blended_motion(quaternions, translations, weights, kept)
    return rotated @ point + translated, margin


def blended_motion(quaternions, translations, weights, kept=None):
    """Rotation and translation of the sum of unit dual quaternions, and the margin."""
    duals = np.array(
        [0.5 * left_multiplication([0.0, *t]) @ q for q, t in zip(quaternions, translations, strict=True)]
    )
    signs, margin = signs_of(quaternions, weights, kept)
    real, dual = (signs * weights) @ quaternions, (signs * weights) @ duals
    length = np.linalg.norm(real)
    return rotation(real / length), translation(real / length, dual / length), margin


@remembered
def logarithm(rotation):
    """scipy's matrix logarithm of a 3x3 rotation, and the 3x3 matrix that makes the last column of the rigid
    4x4 matrix's logarithm of its translation: the inverse of the exponential's integral over unit time."""
    angular = scipy.linalg.logm(rotation).real
    block = np.zeros((6, 6))
    block[:3, :3], block[:3, 3:] = angular, np.eye(3)
    return angular, np.linalg.inv(scipy.linalg.expm(block)[:3, 3:])


def log(point, motions, rotations, weights):
    """The tie is at 180 degrees from rest."""
    _, translations = rigid_terms(point, motions, rotations)
    total, margin = np.zeros((4, 4)), 1.0
    for rotated, translated, weight in zip(rotations, translations, weights, strict=True):
        angular, by_translation = logarithm(rotated)
        total[:3, :3] += weight * angular
        total[:3, 3] += weight * (by_translation @ translated)
        margin = min(margin, abs(quaternion(rotated)[0]))
    return (scipy.linalg.expm(total) @ np.append(point, 1.0))[:3], margin


def rigid_parts(motions, rotations, heads):
    """The translations of the bones' rigid motions: with its rotation each takes the bone's head where the
    whole bone takes it."""
    return np.array(
        [(m @ np.append(h, 1.0))[:3] - r @ h for m, r, h in zip(motions, rotations, heads, strict=True)]
    )


def blended_rotation(rotations, weights, kept=None):
    """The 3x3 rotation of the sum of quaternions, and the margin."""
    quaternions = np.array([quaternion(r) for r in rotations])
    signs, margin = signs_of(quaternions, weights, kept)
    blended = (signs * weights) @ quaternions
    return rotation(blended / np.linalg.norm(blended)), margin


def about(centre, point, motions, rotations, weights, heads, kept):
    """Rotated by the blend about `centre`, which the rigid motions' mean moves; then what bones scale."""
    translations = rigid_parts(motions, rotations, heads)
    rotated, margin = blended_rotation(rotations, weights, kept)
    scaled = (motions @ np.append(point, 1.0))[:, :3] - rotations @ point - translations
    return rotated @ (point - centre) + weights @ (rotations @ centre + translations + scaled), margin


def cor(point, motions, rotations, weights, heads, centre=None, kept=None):
    return about(point if centre is None else centre, point, motions, rotations, weights, heads, kept)


def sdef(point, motions, rotations, weights, heads, spheres=None, interpolation="nlerp"):
    """spheres: C, R0, R1 and whether they are used, [10]."""
    used = np.flatnonzero(weights > 0.0)
    if spheres is None or spheres[9] == 0.0 or len(used) != 2:
        return lbs(point, motions, rotations, weights)
    motions, rotations, weights = motions[used], rotations[used], weights[used]
    translations = rigid_parts(motions, rotations, heads[used])
    centre, ends = spheres[:3], spheres[3:9].reshape(2, 3)
    ends = centre + ends - weights @ ends
    middles = (centre + ends) / 2.0
    rotated, margin = blended_rotation(rotations, weights)
    if interpolation == "slerp":
        # The short way is that of the logarithm.
        between = Rotation.from_matrix(rotations[0].T @ rotations[1]).as_rotvec()
        rotated = rotations[0] @ Rotation.from_rotvec(weights[1] * between).as_matrix()
    scaled = (motions @ np.append(point, 1.0))[:, :3] - rotations @ point - translations
    moved = np.einsum("kij,kj->ki", rotations, middles) + translations + scaled
    return rotated @ (point - centre) + weights @ moved, margin


# Rotations of a set that differ by less along a direction leave its centre free there.
SAME_ROTATION = 1e-3


def sbs(point, motions, rotations, weights, heads, kept=None):
    """The centre by the singular values of all pairs' equations; the tie is also where one is left out."""
    translations = rigid_parts(motions, rotations, heads)
    start, count, margin = heads.mean(axis=0), len(rotations), 1.0
    centre = start
    if count > 1:
        first, second = np.triu_indices(count, 1)
        equations = (rotations[first] - rotations[second]).reshape(-1, 3)
        wanted = (translations[second] - translations[first]).ravel()
        u, sizes, vt = np.linalg.svd(equations, full_matrices=False)
        least = SAME_ROTATION * count
        is_held = sizes > least
        inverse = np.where(is_held, 1.0 / np.where(is_held, sizes, 1.0), 0.0)
        centre = start + vt.T @ (inverse * (u.T @ (wanted - equations @ start)))
        margin = np.abs(sizes / least - 1.0).min()
    result, of_signs = about(centre, point, motions, rotations, weights, heads, kept)
    return result, min(margin, of_signs)


def logarithms(rotations, translations, longer=None):
    """Of rigid motions [n]: rotation vectors, by scipy, and what the exponential's integral over unit time
    takes to the translations.

    longer  bool [n]: those that take the longer way
    """
    vectors = Rotation.from_matrix(rotations).as_rotvec()
    if longer is not None:
        angles = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)
        vectors = np.where(longer[:, None], vectors * (1.0 - 2.0 * np.pi / angles), vectors)
    return vectors, np.linalg.solve(integral(vectors), translations[..., None])[..., 0]


def integral(vectors):
    """The 3x3 matrices by which exponentials of rotation vectors [n] make translations of linear parts."""
    x, y, z = vectors.T
    k = np.zeros((len(vectors), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -z, y, -x
    k -= k.transpose(0, 2, 1)
    angle = np.maximum(np.linalg.norm(vectors, axis=1), 1e-4)[:, None, None]
    return np.eye(3) + (1.0 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * (k @ k)


def dib(point, motions, rotations, weights, kept=None):
    """Iterated to the end. The ties are at 180 degrees from the result, at 360 where signs are kept, and
    where the iteration is slow."""
    quaternions, shifts = rigid_terms(point, motions, rotations)
    rotated, translated, margin = blended_motion(quaternions, shifts, weights, kept)
    most, longer, blended = np.pi, None, None
    if kept is not None:
        signs, _margin = signs_of(quaternions, weights, kept)
        most, quaternions = 2.0 * np.pi, signs[:, None] * quaternions
        blended = weights @ quaternions
    steps = 0
    while steps < 200:
        steps += 1
        if blended is not None:
            near = quaternion(rotated)
            blended = -near if near @ blended < 0.0 else near
            longer = quaternions @ blended < 0.0
        angular, linear = logarithms(rotated.T @ rotations, (shifts - translated) @ rotated, longer)
        vector, along = weights @ angular, weights @ linear
        translated = translated + rotated @ (integral(vector[None])[0] @ along)
        rotated = rotated @ Rotation.from_rotvec(vector).as_matrix()
        margin = min(margin, most - np.linalg.norm(angular, axis=1).max())
        if max(np.abs(vector).max(), np.abs(along).max() / max(1.0, np.abs(linear).max())) < 1e-9:
            break
    return rotated @ point + translated, margin if steps < 40 else 0.0


# Of singular values over the largest: nearer to a tie, the polar factor depends on rounding.
LEAST_SINGULAR = 0.05
LEAST_EXTENT = 1e-10


def ddm(point, motions, rotations, weights, heads, neighbourhood=None, variant="0", radius=None, weld=True):
    """neighbourhood: its moments [bones, 10], and motions, rotations and heads of these bones. The polar
    factor is by singular values, whose tie counts where there is one."""
    if neighbourhood is None:
        return lbs(point, motions, rotations, weights)
    moments, its_motions, its_rotations, its_heads = neighbourhood
    translations = rigid_parts(its_motions, its_rotations, its_heads)
    centroid = moments[:, 1:4].sum(axis=0)
    psi = np.array([second_moments(row, centroid) for row in moments])
    rigid = np.tile(np.eye(4), (len(moments), 1, 1))
    rigid[:, :3, :3], rigid[:, :3, 3] = its_rotations, translations
    rotated, margin = blended_rotation(its_rotations, moments[:, 0])
    moved = np.einsum("kij,kjl->il", rigid, psi)
    target, correlation = moved[:3, 3], moved[:3, :3] - np.outer(moved[:3, 3], centroid)
    if variant == "4":
        target = (np.tensordot(moments[:, 0], rigid, axes=1) @ np.append(centroid, 1.0))[:3]
    sizes = np.linalg.svd(correlation)[1]
    # A point has no rotation of its own.
    if variant == "0" and moments[:, 4:7].sum() > LEAST_EXTENT * centroid @ centroid:
        smallest = sizes[1] + np.sign(np.linalg.det(correlation)) * sizes[2]
        rotated, margin = nearest_rotation(correlation), 1.0 if smallest > LEAST_SINGULAR * sizes[0] else 0.0
    own = rigid_parts(motions, rotations, heads)
    scaled = (motions @ np.append(point, 1.0))[:, :3] - rotations @ point - own
    return rotated @ (point - centroid) + target + weights @ scaled, margin


def second_moments(row, centroid):
    """The 4x4 matrix that Le and Lewis call Psi."""
    weight, first, (xx, yy, zz, yz, xz, xy) = row[0], row[1:4], row[4:]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shifted = np.outer(first, centroid) + np.outer(centroid, first) - weight * np.outer(centroid, centroid)
    psi = np.empty((4, 4))
    psi[:3, :3], psi[:3, 3], psi[3, :3], psi[3, 3] = about + shifted, first, first, weight
    return psi


METHODS = {
    "lbs": lbs,
    "qv": qv,
    "dq": dq,
    "cor": cor,
    "ddm": ddm,
    "sdef": sdef,
    "sbs": sbs,
    "log": log,
    "dib": dib,
}
# Those that also read where bones are at rest, and those that keep something of each vertex.
WITH_HEADS = {"cor", "ddm", "sbs", "sdef"}
WITH_VERTEX_DATA = {"cor", "sdef"}


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
    values = {name[len(prefix) :]: v for name, v in (parameters or {}).items() if name.startswith(prefix)}
    rotations = np.array([rotation_of_bone(m, b) for m, b in zip(transforms, rest_bones, strict=True)])
    points = np.asarray(rest_points, np.float64).copy()
    margins = np.ones(len(points))
    parents = values.pop("parents", np.full(len(transforms), -1))
    turns = values.pop("turns", None)
    along = values.pop("signs", "blender") == "hierarchy"
    quaternions, of_chain = along_chain(transforms, parents, turns) if along else (None, None)
    for vertex in range(len(points)):
        span = slice(offsets[vertex], offsets[vertex + 1])
        share = np.asarray(weights[span], np.float64)
        if share.sum() > 0.0:
            of = bones[span]
            more = [rest_bones[of, :3, 3]] if method in WITH_HEADS else []
            if method in WITH_VERTEX_DATA and vertex_data is not None and method in vertex_data:
                more.append(vertex_data[method][vertex].astype(np.float64))
            if method == "ddm" and vertex_data is not None and method in vertex_data:
                rows = np.asarray(vertex_data[method], np.float64)
                rows = rows[slice(*np.searchsorted(rows[:, 0], (vertex, vertex + 1)))]
                its = rows[:, 1].astype(int)
                if len(rows):
                    more.append((rows[:, 2:], transforms[its], rotations[its], rest_bones[its, :3, 3]))
            if quaternions is not None:
                values["kept"] = quaternions[of]
            points[vertex], margins[vertex] = METHODS[method](
                points[vertex], transforms[of], rotations[of], share / share.sum(), *more, **values
            )
            if quaternions is not None:
                margins[vertex] = min(margins[vertex], of_chain[of].min())
    return points, margins
