# SPDX-License-Identifier: MIT
"""What the shaders read of bones, made of their poses: for an engine to write in its own language."""

import numpy as np


def bone_buffer(posed, rest):
    """float32 [bones, 4, 4]: for each bone the rows of its motion, then the rotation in it as a quaternion
    x, y, z, w.

    posed, rest  float [bones, 4, 4], by rows, from the bone's own axes to one space, that of the armature; Y
                 is along the bone. At rest they are the inverses of glTF's inverse bind matrices.

    Bones that are not scaled are rotated by the 3x3 part of their motion. Those that are, by Blender's rule:
    by what takes the rest axes to the posed ones, made perpendicular with Y kept.
    """
    posed, rest = np.asarray(posed, np.float64), np.asarray(rest, np.float64)
    buffer = np.empty((len(posed), 4, 4), np.float32)
    buffer[:, :3] = (posed @ np.linalg.inv(rest))[:, :3]
    for bone, (now, before) in enumerate(zip(posed, rest, strict=True)):
        buffer[bone, 3] = quaternion(perpendicular(now) @ perpendicular(before).T)
    return buffer


def perpendicular(matrix):
    """Axes of unit length in columns, right-handed: Y as it is, X as near as it can be."""
    y = matrix[:3, 1] / np.linalg.norm(matrix[:3, 1])
    x = matrix[:3, 0] - y * (matrix[:3, 0] @ y)
    x /= np.linalg.norm(x)
    return np.column_stack([x, y, np.cross(x, y)])


def quaternion(r):
    """x, y, z, w of a 3x3 rotation, from its largest component on (Shepperd 1978)."""
    squares = np.array([r[0, 0], r[1, 1], r[2, 2], np.trace(r)])
    largest = int(squares.argmax())
    if largest == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + squares[3]])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.empty(4)
        q[i] = 1 + r[i, i] - r[j, j] - r[k, k]
        q[j], q[k], q[3] = r[i, j] + r[j, i], r[i, k] + r[k, i], r[k, j] - r[j, k]
    # With w >= 0, as Blender has them: the sign decides where bones are more than 180 degrees apart.
    return q / np.linalg.norm(q) * (-1 if q[3] < 0 else 1)
