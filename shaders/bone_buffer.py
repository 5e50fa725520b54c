# SPDX-License-Identifier: MIT
"""What the shaders read of bones, made of their poses: for an engine to write in its own language.

Matrices are by rows, [bones, 4, 4], quaternions x, y, z, w. A twist is (bone, base, tip, is_from_parent): the
twist of `tip` against `base` is spread along `bone`.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

Twists: TypeAlias = Sequence[tuple[int, int, int, bool]] | np.ndarray
Numbers: TypeAlias = Sequence[float] | np.ndarray


def bone_buffer(
    posed: np.ndarray,
    rest: np.ndarray,
    parents: Numbers | None = None,
    lengths: Numbers | None = None,
    twists: Twists = (),
    amounts: Numbers = (),
    curves: Numbers = (),
    axes: np.ndarray | None = None,
) -> np.ndarray:
    """float32 [bones, 8, 4]: see docs/engines.md.

    posed, rest      float [bones, 4, 4], from the bone's own axes to one space, that of the armature. At rest
                     they are the inverses of glTF's inverse bind matrices.
    parents          -1 for none: only signs by hierarchy need them
    lengths          [bones], of each bone's limb: only the stages need them
    amounts, curves  [twists], 0 to 1 and -1 to 1
    axes             [bones, 3], the limb's direction in the bone's own axes; None: Y of each
    """
    posed, rest = posed.astype(np.float64), rest.astype(np.float64)
    motions = posed @ np.linalg.inv(rest)
    rotations = quaternions(perpendicular(posed) @ perpendicular(rest).swapaxes(1, 2))
    if parents is not None:
        rotations = along_chain(rotations, parents, np.linalg.det(motions[:, :3, :3]) < 0)
    buffer = of_motions(motions, rotations)
    if lengths is not None:
        heads, own = rest[:, :3, 3], np.tile([0.0, 1.0, 0.0], (len(rest), 1)) if axes is None else axes
        limbs = np.einsum("bij,bj->bi", rest[:, :3, :3], own)
        add_segments(buffer, heads, heads + np.asarray(lengths)[:, None] * limbs)
        angles, swings = twist_angles(motions, rest, twists, limbs)
        add_twists(buffer, twists, np.asarray(amounts) * angles * fade(np.abs(angles)) * fade(swings), curves)
    return buffer


def of_motions(motions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """The buffer for methods alone.

    rotations  [bones, 4]: of a bone that is not scaled, the 3x3 part of its motion. Of one that is, by
               Blender's rule: what takes the rest axes to the posed ones, both made perpendicular with Y kept
    """
    buffer = np.zeros((len(motions), 8, 4), np.float32)
    buffer[:, :3], buffer[:, 3] = motions[:, :3], rotations
    return buffer


def perpendicular(matrices: np.ndarray) -> np.ndarray:
    """Axes of unit length in columns, right-handed: Y as it is, X as near as it can be; [bones, 3, 3]."""
    x, y = matrices[:, :3, 0], matrices[:, :3, 1]
    y = y / np.linalg.norm(y, axis=1, keepdims=True)
    x = x - y * (x * y).sum(axis=1, keepdims=True)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def quaternions(r: np.ndarray) -> np.ndarray:
    """Of rotations [n, 3, 3], with w >= 0, as Blender has them."""
    x, y, z = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    squares = 1 + np.array([x - y - z, y - x - z, z - x - y, x + y + z])
    yz, xz, xy = r[:, 2, 1] + r[:, 1, 2], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 0] + r[:, 0, 1]
    xw, yw, zw = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    # Each row is q times four of its components. Any that is large will do; this choice is Blender's.
    rows = np.array(
        [
            [squares[0], xy, xz, xw],
            [xy, squares[1], yz, yw],
            [xz, yz, squares[2], zw],
            [xw, yw, zw, squares[3]],
        ]
    )
    chosen = np.where(z < 0, np.where(x > y, 0, 1), np.where(x < -y, 2, 3))
    q = rows[chosen, :, np.arange(len(r))]
    return q / np.linalg.norm(q, axis=1, keepdims=True) * np.where(q[:, 3:] < 0, -1, 1)


# --- Signs by hierarchy


def along_chain(
    rotations: np.ndarray, parents: Numbers, mirrors: np.ndarray, turns: np.ndarray | None = None
) -> np.ndarray:
    """The same quaternions, each with the sign that brings it nearest to its parent's; a bone that mirrors
    counts as its parent for those that it carries.

    turns  of the first bones: w, x, y, z of the rotation of each against its parent as its own angles give
           it, where w < 0 is more than half a turn; 0: unknown
    """
    found = rotations.copy()
    nearby: dict[int, np.ndarray] = {-1: np.array([0.0, 0.0, 0.0, 1.0])}

    def visit(bone: int) -> np.ndarray:
        if bone not in nearby:
            before = visit(int(parents[bone]))
            along = found[bone] @ before
            if turns is not None and bone < len(turns) and turns[bone].any():
                told = found[bone] @ product(before, np.roll(turns[bone], -1))
                # Otherwise something else turns the bone.
                along = told if abs(told) > np.cos(np.radians(2.5)) else along
            found[bone] *= -1 if along < 0 else 1
            nearby[bone] = before if mirrors[bone] else found[bone]
        return nearby[bone]

    for bone in range(len(found)):
        visit(bone)
    return found


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of two quaternions."""
    return np.array([*(a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])), a[3] * b[3] - a[:3] @ b[:3]])


# --- The stages


def add_segments(buffer: np.ndarray, heads: np.ndarray, tails: np.ndarray) -> None:
    """Each bone from its head to its tail at rest, and how much longer its motion makes what is across it,
    seen along its image, at most."""
    along, linear = tails - heads, buffer[:, :3, :3].astype(np.float64)
    image = np.einsum("bij,bj->bi", linear, along)
    across, unaffected = (np.eye(3) - projection(vectors) for vectors in (along, image))
    stretches = np.linalg.norm(unaffected @ linear @ across, 2, axis=(1, 2))
    points = np.linalg.norm(linear, axis=(1, 2)) / np.sqrt(3)
    buffer[:, 4, :3], buffer[:, 5, :3] = heads, along
    buffer[:, 4, 3] = np.where(along.any(axis=1), stretches, points)


def projection(vectors: np.ndarray) -> np.ndarray:
    """Onto each of vectors [n, 3], float [n, 3, 3]; 0 for a vector without length."""
    squares = (vectors * vectors).sum(axis=1)[:, None, None]
    return vectors[:, :, None] * vectors[:, None, :] / np.where(squares > 0, squares, 1)


def add_twists(buffer: np.ndarray, twists: Twists, angles: np.ndarray, curves: Numbers) -> None:
    """angles: radians, with their amounts."""
    for number, ((bone, _base, _tip, is_from_parent), angle, curve) in enumerate(
        zip(twists, angles, curves, strict=True), 1
    ):
        if angle != 0.0:
            buffer[bone, 5, 3] = curve
            buffer[bone, 6, :3] = (-angle, 0, number) if is_from_parent else (0, angle, number)


def add_turns(
    buffer: np.ndarray, twists: Twists, around: np.ndarray, parts: np.ndarray, parents: Numbers
) -> None:
    """Only where angles tell of more than half a turn.

    around  whole turns beyond that, [twists]
    parts   of each twist that is spread, 0 to 1
    """
    children: dict[int, list[int]] = {}
    for bone, parent in enumerate(parents):
        children.setdefault(int(parent), []).append(bone)
    # Those that a bone carries follow it at once.
    order: list[int] = []
    left, ends = children.get(-1, [])[::-1], {}
    while left:
        bone = left.pop()
        if bone < 0:
            ends[~bone] = len(order)
            continue
        order.append(bone)
        left += [~bone, *children.get(bone, [])[::-1]]
    buffer[order, 7, 0] = np.arange(len(order))
    for (bone, _base, tip, _is_from_parent), turns, part in zip(twists, around, parts, strict=True):
        buffer[bone, 7, 1:] = buffer[tip, 7, 0], ends[tip], turns
        buffer[bone, 6, 3] = part


def twist_angles(
    motions: np.ndarray, rest: np.ndarray, twists: Twists, limbs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of the rotation of each tip against its base: its angle about the bone's limb at rest, and that of the
    rest of it, radians [twists]. Both fade, as a matrix does not tell which way round the tip went.

    limbs  [bones, 3], along each, of any length
    """
    if not len(twists):
        return np.empty(0), np.empty(0)
    bones, bases, tips, _from_parent = np.array(twists).T
    axes = perpendicular(rest)
    # A base without volume: its scale is not known.
    is_flat = np.linalg.det(motions[bases, :3, :3]) == 0
    of_bases = np.where(is_flat[:, None, None], np.eye(3), motions[bases, :3, :3])
    relative = np.linalg.inv(of_bases) @ motions[tips, :3, :3] @ rest[tips, :3, :3]
    q = quaternions(perpendicular(relative) @ axes[tips].swapaxes(1, 2))
    about = limbs[bones] / np.maximum(np.linalg.norm(limbs[bones], axis=1, keepdims=True), 1e-30)
    along = (q[:, :3] * about).sum(axis=1)
    angles = 2 * np.arctan2(along, q[:, 3])
    swings = 2 * np.arccos(np.minimum(np.hypot(along, q[:, 3]), 1))
    return angles, swings


def fade(angles: np.ndarray) -> np.ndarray:
    """From 1 at 150 degrees to 0 at 180."""
    t = np.clip((np.degrees(angles) - 150) / 30, 0, 1)
    return 1 - t * t * (3 - 2 * t)
