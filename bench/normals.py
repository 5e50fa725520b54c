# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures normals of vertices, and of corners with sharp edges and custom normals, on one thread: Sinew,
Blender, libigl, trimesh and numpy in one process, on a sheet of 317 x 317 vertices:
python bench/normals.py [--threads N] [--name NAME]

Once with the vertices row by row, and once in random order; as quads, and as the triangles that libigl and
trimesh need. Needs Blender 4.5 or later, where custom normals can be read. Blender starts as many threads as
it may use processors at its start. libigl and trimesh are left out if they are not installed.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from collections.abc import Callable

# Before bpy is imported, which counts its threads then.
PARSER = argparse.ArgumentParser(description=__doc__)
PARSER.add_argument("--threads", type=int, default=1, help="of Blender and Sinew; the others have one")
PARSER.add_argument("--seconds", type=float, default=3.0, help="for each candidate")
PARSER.add_argument("--name", default="normals", help="of the file in bench/results")
ARGUMENTS = PARSER.parse_args()
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: ARGUMENTS.threads])

import bpy  # noqa: E402
import common  # noqa: E402
import numpy as np  # noqa: E402
import sinew  # noqa: E402

SIDE = 317
ORDERS = ("rows", "random")
# The shares of sharp edges and faces for each case.
CASES = {"smooth": (0.0, 0.0), "sharp edges": (0.02, 0.01), "custom": (0.02, 0.01)}


def sheet(order: str) -> tuple[np.ndarray, np.ndarray]:
    """(float32 [vertices, 3], int32 [quads, 4])"""
    rng = np.random.default_rng(0)
    x, y = np.mgrid[:SIDE, :SIDE]
    points = np.stack([x, y, rng.normal(size=x.shape)], axis=-1).reshape(-1, 3).astype(np.float32)
    first = np.arange(SIDE * (SIDE - 1)).reshape(-1, SIDE)[:, :-1].ravel()
    quads = np.stack([first, first + SIDE, first + SIDE + 1, first + 1], axis=1)
    if order == "random":
        vertices = rng.permutation(len(points))
        points, quads = points[vertices], np.argsort(vertices)[quads][rng.permutation(len(quads))]
    return points, quads.astype(np.int32)


def make_mesh(points: np.ndarray, faces: np.ndarray) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Sheet")
    mesh.from_pydata(points, [], faces.tolist())
    mesh.shade_smooth()
    return mesh


def tilt(mesh: bpy.types.Mesh) -> np.ndarray:
    """Gives the mesh custom normals. Returns them as they are stored, int16 [corners, 2]."""
    normals = Blender(mesh, "corner").result() + np.float32([0.1, 0.2, -0.1])
    mesh.normals_split_custom_set(unit(normals).tolist())
    stored = mesh.attributes["custom_normal"].data
    numbers = np.empty((len(stored), 2), np.int32)
    stored.foreach_get("value", numbers.ravel())
    return numbers


def mark(mesh: bpy.types.Mesh, edges: float, faces: float) -> dict[str, np.ndarray]:
    """Makes edges and faces sharp. Returns the same as arguments of sinew.Normals."""
    rng = np.random.default_rng(1)
    ends = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    sharp = rng.random(len(mesh.edges)) < edges
    flat = rng.random(len(mesh.polygons)) < faces
    mesh.edges.foreach_set("use_edge_sharp", sharp)
    mesh.polygons.foreach_set("use_smooth", ~flat)
    mesh.update()
    return {"edges": ends, "sharp_edges": sharp, "sharp_faces": flat}


class Blender:
    """Blender's normals. A call only computes them: before it, Blender is told that the points have
    changed."""

    def __init__(self, mesh: bpy.types.Mesh, domain: str) -> None:
        self.mesh, self.normals = mesh, f"{domain}_normals"

    def prepare(self) -> None:
        self.mesh.update()

    def __call__(self) -> None:
        # Reading one normal computes all of them.
        _ = getattr(self.mesh, self.normals)[0]

    def result(self) -> np.ndarray:
        collection = getattr(self.mesh, self.normals)
        normals = np.empty((len(collection), 3), np.float32)
        collection.foreach_get("vector", normals.ravel())
        return normals


class Call:
    """A function whose result is kept."""

    def __init__(self, function: Callable[[], np.ndarray]) -> None:
        self.function = function

    def __call__(self) -> None:
        self.last = self.function()

    def result(self) -> np.ndarray:
        return np.asarray(self.last)


def by_sinew(points: np.ndarray, faces: np.ndarray, domain: str, **sharp: np.ndarray) -> Call:
    offsets = np.arange(len(faces) + 1, dtype=np.int32) * faces.shape[1]
    normals = sinew.Normals(len(points), offsets, faces.ravel(), **sharp)
    out = np.empty((getattr(normals, f"{domain}_count"), 3), np.float32)
    return Call(lambda: normals.compute(points, domain, out, ARGUMENTS.threads))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def by_numpy(points: np.ndarray, faces: np.ndarray) -> Call:
    """Straightforward code for all faces at once."""

    def compute() -> np.ndarray:
        ring = points[faces]
        along = unit(np.roll(ring, -1, axis=1) - ring)
        normals = unit(np.cross(ring, np.roll(ring, -1, axis=1)).sum(axis=1))
        angles = np.arccos(np.clip(-(along * np.roll(along, 1, axis=1)).sum(axis=-1), -1, 1))
        weighted = (angles[..., None] * normals[:, None]).reshape(-1, 3)
        sums = [np.bincount(faces.ravel(), weighted[:, i], len(points)) for i in range(3)]
        return unit(np.stack(sums, axis=1))

    return Call(compute)


def by_igl(points: np.ndarray, triangles: np.ndarray) -> Call:
    igl = importlib.import_module("igl")
    doubles, faces = points.astype(np.float64), triangles.astype(np.int64)
    weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
    return Call(lambda: igl.per_vertex_normals(doubles, faces, weighting))


def by_trimesh(points: np.ndarray, triangles: np.ndarray) -> Call:
    trimesh = importlib.import_module("trimesh")
    doubles = points.astype(np.float64)
    return Call(lambda: trimesh.Trimesh(doubles, triangles, process=False, validate=False).vertex_normals)


def candidates_of(points: np.ndarray, faces: np.ndarray, case: str) -> dict:
    mesh = make_mesh(points, faces)
    sharp = mark(mesh, *CASES[case])
    if case == "custom":
        sharp["custom_normals"] = tilt(mesh)
    if case != "smooth":
        return {"sinew": by_sinew(points, faces, "corner", **sharp), "blender": Blender(mesh, "corner")}
    candidates = {
        "sinew": by_sinew(points, faces, "vertex"),
        "blender": Blender(mesh, "vertex"),
        "numpy": by_numpy(points, faces),
    }
    if faces.shape[1] == 3:
        for name, make in (("libigl", by_igl), ("trimesh", by_trimesh)):
            try:
                candidates[name] = make(points, faces)
            except ImportError as error:
                print(f"without {name}: {error}")
    return candidates


def main() -> None:
    facts = {"blender": bpy.app.version_string, "threads": ARGUMENTS.threads}
    facts |= {name: common.version_of(name) for name in ("numpy", "libigl", "trimesh")}
    facts = common.begin(f"normals, {SIDE * SIDE:,} vertices", **facts)
    print("Nanoseconds a vertex, the least of many runs; how many times Sinew's; how far from Sinew's.\n")
    results = {}
    for order in ORDERS:
        points, quads = sheet(order)
        triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        for case, faces in (
            ("smooth", quads),
            ("smooth", triangles),
            ("sharp edges", quads),
            ("custom", quads),
        ):
            candidates = candidates_of(points, faces, case)
            kind = f"{case}, {'quads' if faces.shape[1] == 4 else 'triangles'}, {order}"
            # Processor time on one thread, which other programs change less.
            clock = time.process_time if ARGUMENTS.threads == 1 else time.perf_counter
            times = common.alternate(candidates, ARGUMENTS.seconds, clock)
            normals = {name: candidate.result() for name, candidate in candidates.items()}
            for name, spread in times.items():
                spread["per_vertex"] = spread["least"] / len(points) * 1e9
                spread["away"] = float(np.abs(normals[name] - normals["sinew"]).max())
                results[f"{kind}/{name}"] = spread
                ratio = spread["least"] / times["sinew"]["least"]
                print(
                    f"{kind:32}{name:9}{spread['per_vertex']:10.1f}{ratio:10.1f} x{spread['away']:12.0e}",
                    flush=True,
                )
    common.write(ARGUMENTS.name, machine=facts, seconds=results)
    sys.stdout.flush()
    # As a module, Blender may hang when it exits.
    os._exit(0)


if __name__ == "__main__":
    main()
