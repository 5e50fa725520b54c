# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals of polygon meshes in float64, by Blender's definition: the oracle for sinew.Normals.

A mesh consists of its points, its faces as lists of vertices, its edges as pairs, and its sharp edges and
faces. The definitions are those in the header normals.h, computed here one face, vertex and fan at a
time.
"""

from __future__ import annotations

import numpy as np
from delta_mush_reference import angle, unit


def face_normals(points, faces):
    """Newell's method; (0, 0, 1) for a face without area."""
    normals = np.empty((len(faces), 3))
    for i, face in enumerate(faces):
        ring = np.asarray(points, np.float64)[face]
        before = np.roll(ring, 1, axis=0)
        newell = [
            ((before[:, b] - ring[:, b]) * (before[:, c] + ring[:, c])).sum()
            for b, c in ((1, 2), (2, 0), (0, 1))
        ]
        normal = unit(np.array(newell))
        normals[i] = normal if normal.any() else (0.0, 0.0, 1.0)
    return normals


def corner_angles(points, faces):
    """The angles of all corners, face by face."""
    angles = []
    for face in faces:
        ring = np.asarray(points, np.float64)[face]
        to_before = [unit(d) for d in np.roll(ring, 1, axis=0) - ring]
        to_next = [unit(d) for d in np.roll(ring, -1, axis=0) - ring]
        angles += [angle(a @ b) for a, b in zip(to_before, to_next, strict=True)]
    return np.array(angles)


def sums(points, faces, group_of_corner, count):
    """For each of `count` groups of corners, the unit vector of their faces' normals weighted by their
    angles."""
    of_corner = np.repeat(face_normals(points, faces), [len(face) for face in faces], axis=0)
    weighted = of_corner * corner_angles(points, faces)[:, None]
    total = np.zeros((count, 3))
    np.add.at(total, group_of_corner, weighted)
    return np.array([unit(vector) for vector in total]).reshape(-1, 3)


def vertex_normals(points, faces):
    """The vertex normals, from all corners at each vertex; without faces, the direction of the vertex's
    point."""
    corners = np.array([vertex for face in faces for vertex in face], int)
    normals = sums(points, faces, corners, len(points))
    loose = np.setdiff1d(np.arange(len(points)), corners)
    normals[loose] = [unit(point) for point in np.asarray(points, np.float64)[loose]]
    return normals


def smooth_edges(faces, edges, sharp_edges=(), sharp_faces=()):
    """{edge: the two corners along it} for smooth edges: those that are not sharp, not of a sharp face,
    and have two faces that traverse them in opposite directions. A corner is (vertex, itself, the next)."""
    sharp = {frozenset(map(int, edges[i])) for i in np.flatnonzero(sharp_edges)}
    users = {}
    first = 0
    for i, face in enumerate(faces):
        for k, vertex in enumerate(face):
            following = (k + 1) % len(face)
            edge = frozenset((vertex, face[following]))
            if len(sharp_faces) and sharp_faces[i]:
                sharp.add(edge)
            users.setdefault(edge, []).append((vertex, first + k, first + following))
        first += len(face)
    return {
        edge: corners
        for edge, corners in users.items()
        if edge not in sharp and len(corners) == 2 and corners[0][0] != corners[1][0]
    }


def corner_fans(faces, edges, sharp_edges=(), sharp_faces=()):
    """The fan of each corner. A fan is corners of a vertex whose faces meet at smooth edges there."""
    fan = list(range(sum(map(len, faces))))

    def root(corner):
        while fan[corner] != corner:
            corner = fan[corner]
        return corner

    for (_, start, end), (_, other_start, other_end) in smooth_edges(
        faces, edges, sharp_edges, sharp_faces
    ).values():
        for corner, other in ((start, other_end), (end, other_start)):
            fan[root(corner)] = root(other)
    return np.unique([root(corner) for corner in range(len(fan))], return_inverse=True)[1]


def corner_normals(points, faces, edges, sharp_edges=(), sharp_faces=()):
    """Normals of fans. A corner that is a fan by itself has its face's normal."""
    fans = corner_fans(faces, edges, sharp_edges, sharp_faces)
    sizes = np.bincount(fans)
    of_face = np.repeat(face_normals(points, faces), [len(face) for face in faces], axis=0)
    of_fan = sums(points, faces, fans, len(sizes))[fans]
    return np.where((sizes[fans] == 1)[:, None], of_face, of_fan)


def fan_edges(fan, faces, first_corners, smooth):
    """(vertex of the fan, the ends of its edges in the order of Blender's walk, the last of them).

    The walk goes from a corner's following edge to its preceding one. It starts at the corner whose
    following edge is the fan's boundary, or at the first corner if there is none. The edge where it started
    is not listed twice.

    fan: its corners, ascending; first_corners: of each face; smooth: the smooth edges
    """
    before, starts = {}, []
    for corner in fan:
        face = np.searchsorted(first_corners, corner, side="right") - 1
        ring, k = faces[face], corner - first_corners[face]
        vertex, following = ring[k], ring[(k + 1) % len(ring)]
        before[following] = ring[k - 1]
        if frozenset((vertex, following)) not in smooth:
            starts.insert(0, following)
        starts.append(following)
    walk = [starts[0]]
    for _ in fan:
        walk.append(before[walk[-1]])
    other = walk[-1]
    return vertex, walk[:-1] if other == walk[0] else walk, other


TOO_STEEP = 0.9999


def fan_normal(normal, reference, other, edges, custom):
    """The custom normal `custom`, two int16, of a fan whose normal would be `normal`.

    reference, other: directions of its first and last edge; edges: directions of all
    """
    along = [normal @ reference, normal @ other]
    if max(map(abs, along)) >= TOO_STEEP:
        return np.zeros(3)
    if custom[0] == 0:
        return normal
    alpha = np.mean([angle(edge @ normal) for edge in edges])
    x = unit(reference - along[0] * normal)
    y = unit(np.cross(normal, x))
    last = unit(other - along[1] * normal)
    beta = 2 * np.pi
    if x @ last < TOO_STEEP:
        beta = angle(x @ last)
        beta = 2 * np.pi - beta if y @ last < 0 else beta
    if alpha == 0 or beta == 0:
        return normal
    tilt, turn = np.clip(np.asarray(custom) / 32767, -1, 1)
    tilt *= alpha if tilt > 0 else 2 * np.pi - alpha
    turn *= beta if turn > 0 else 2 * np.pi - beta
    return np.cos(tilt) * normal + np.sin(tilt) * (np.cos(turn) * x + np.sin(turn) * y)


def custom_normals(points, faces, edges, custom, sharp_edges=(), sharp_faces=()):
    """Custom normals of corners: int16 [corners, 2], relative to the space of each fan."""
    points = np.asarray(points, np.float64)
    first_corners = np.cumsum([0, *map(len, faces)])[:-1]
    sharp = edges, sharp_edges, sharp_faces
    smooth, fans = smooth_edges(faces, *sharp), corner_fans(faces, *sharp)
    normals = corner_normals(points, faces, *sharp)
    for number in range(fans.max() + 1):
        fan = np.flatnonzero(fans == number)
        vertex, walk, last = fan_edges(fan, faces, first_corners, smooth)
        directions = [unit(points[end] - points[vertex]) for end in walk]
        other = unit(points[last] - points[vertex])
        mean = np.trunc(np.asarray(custom, int)[fan].sum(axis=0) / len(fan))
        normals[fan] = fan_normal(normals[fan[0]], directions[0], other, directions, mean)
    return normals
