# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals of polygon meshes in float64, by Blender's definition: the oracle of sinew.Normals.

A mesh is its points, its faces as lists of vertices, its edges as pairs, and what is sharp. Definitions are
those of the header deform/normals.h, computed here one face, vertex and fan at a time.
"""

from __future__ import annotations

import numpy as np

SHORTEST = 1e-35  # squared: a shorter vector has no direction


def unit(vector):
    squared = vector @ vector
    return vector / np.sqrt(squared) if squared > SHORTEST else np.zeros(3)


def angle(cosine):
    """Blender's polynomial for acos."""
    m = min(abs(cosine), 1.0)
    polynomial = 1.5707963267 + m * (-0.213300989 + m * (0.077980478 + m * -0.02164095))
    angle_of_size = np.sqrt(1.0 - m) * polynomial
    return np.pi - angle_of_size if cosine < 0 else angle_of_size


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
    """Of all corners, face by face."""
    angles = []
    for face in faces:
        ring = np.asarray(points, np.float64)[face]
        to_before = [unit(d) for d in np.roll(ring, 1, axis=0) - ring]
        to_next = [unit(d) for d in np.roll(ring, -1, axis=0) - ring]
        angles += [angle(a @ b) for a, b in zip(to_before, to_next, strict=True)]
    return np.array(angles)


def sums(points, faces, group_of_corner, count):
    """Of `count` groups of corners: the unit vectors of their faces' normals weighted by their angles."""
    of_corner = np.repeat(face_normals(points, faces), [len(face) for face in faces], axis=0)
    weighted = of_corner * corner_angles(points, faces)[:, None]
    total = np.zeros((count, 3))
    np.add.at(total, group_of_corner, weighted)
    return np.array([unit(vector) for vector in total]).reshape(-1, 3)


def vertex_normals(points, faces):
    """Of all corners at a vertex; a vertex without faces has the direction of its point."""
    corners = np.array([vertex for face in faces for vertex in face], int)
    normals = sums(points, faces, corners, len(points))
    loose = np.setdiff1d(np.arange(len(points)), corners)
    normals[loose] = [unit(point) for point in np.asarray(points, np.float64)[loose]]
    return normals


def corner_fans(faces, edges, sharp_edges=(), sharp_faces=()):
    """Which fan each corner is in: corners of a vertex whose faces meet at smooth edges there. An edge is
    smooth that is not sharp, nor of a sharp face, and has two faces which go along it in opposite ways."""
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
    fan = list(range(first))

    def root(corner):
        while fan[corner] != corner:
            corner = fan[corner]
        return corner

    for edge, of_edge in users.items():
        if edge in sharp or len(of_edge) != 2:
            continue
        (a, start_a, end_a), (b, start_b, end_b) = of_edge
        if a == b:
            continue
        for corner, other in ((start_a, end_b), (end_a, start_b)):
            fan[root(corner)] = root(other)
    return np.unique([root(corner) for corner in range(first)], return_inverse=True)[1]


def corner_normals(points, faces, edges, sharp_edges=(), sharp_faces=()):
    """Of fans; a corner that is a fan by itself has its face's normal."""
    fans = corner_fans(faces, edges, sharp_edges, sharp_faces)
    sizes = np.bincount(fans)
    of_face = np.repeat(face_normals(points, faces), [len(face) for face in faces], axis=0)
    of_fan = sums(points, faces, fans, len(sizes))[fans]
    return np.where((sizes[fans] == 1)[:, None], of_face, of_fan)
