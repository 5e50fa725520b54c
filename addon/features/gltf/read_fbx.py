# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the skinned meshes of an .fbx by ufbx, which is no part of the extension: `pip install ufbx`.

It is read in a process of its own, as ufbx 0.0.5 crashes where Python frees what was read. This file is what
that process runs; it imports nothing of Sinew's.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

if __package__:
    from ...base.errors import SinewError
    from .played import Played, of_sum_one


def read_fbx(
    path: Path, played: Mapping[str, Mapping[str, float]], rate: float, frames: Sequence[float]
) -> list[Played]:
    """The skinned meshes of an .fbx, at some frames.

    played  for each mesh what plays, by OBJECT|ACTION, with its first frames, which are at 0 in the file; its
            first animation plays where it has none of these
    rate    frames per second

    Raises SinewError where ufbx is not installed, or can not read it.
    """
    if find_spec("ufbx") is None:
        raise SinewError("FBX files are verified by ufbx: install it for Blender's Python (pip install ufbx)")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "read.npz")
        request = json.dumps([str(path), str(out), played, rate, list(frames)])
        paths = os.pathsep.join(dict.fromkeys(_folder_of(name) for name in ("ufbx", "numpy")))
        done = subprocess.run(
            [sys.executable, __file__, request],
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        if not out.exists():
            raise SinewError(f"{path}: ufbx can not read it: {done.stderr.strip() or done.returncode}")
        with np.load(out) as arrays:
            read = dict(arrays)
    return [_played(read, number, list(frames)) for number in range(int(read["count"]))]


def _folder_of(name: str) -> str:
    """Returns the folder that a module is imported from."""
    found = find_spec(name)
    assert found is not None
    assert found.origin is not None
    file = Path(found.origin)
    return str(file.parent.parent if found.submodule_search_locations else file.parent)


def _played(read: dict[str, np.ndarray], number: int, frames: list[float]) -> Played:
    own = {name: read[f"{name} {number}"] for name in _ARRAYS}
    motions, shapes = own["motions"], own["shapes"]
    return Played(
        str(own["name"]),
        own["rest"],
        own["targets"],
        tuple(map(str, own["joints"])),
        own["slots"],
        of_sum_one(own["weights"]),
        lambda frame: motions[frames.index(frame)],
        lambda frame: shapes[frames.index(frame)],
    )


_ARRAYS = ("name", "rest", "targets", "joints", "slots", "weights", "motions", "shapes")
# All that ufbx made: each object that Python frees takes a reference from the scene that it did not add.
_kept: list[Any] = []


def _keep(made: Any) -> Any:
    _kept.append(made)
    return made


def _list(made: Any) -> list[Any]:
    _keep(made)
    return [_keep(made[number]) for number in range(len(made))]


def _read(path: str, played: dict[str, dict[str, float]], rate: float, frames: list[float]) -> dict[str, Any]:
    ufbx = import_module("ufbx")
    scene = _keep(ufbx.load_file(path, target_axes=ufbx.axes_right_handed_z_up, target_unit_meters=1.0))
    stacks = {each.name: _keep(each.anim) for each in _list(scene.anim_stacks)}
    anims = [*stacks.values(), _keep(scene.anim)]
    nodes = _list(scene.nodes)
    meshes = [(n.name, _keep(n.mesh)) for n in nodes if n.attrib_type == ufbx.ElementType.MESH]
    skins = [(name, mesh, _list(mesh.skin_deformers)) for name, mesh in meshes]
    found: dict[str, Any] = {"count": 0}
    for name, mesh, skin in skins:
        if skin:
            first, anim = next(
                ((first, stacks[a]) for a, first in played.get(name, {}).items() if a in stacks),
                (0.0, anims[0]),
            )
            times = [(frame - first) / rate for frame in frames]
            posed = [_list(_keep(ufbx.evaluate_scene(scene, anim, time)).nodes) for time in times]
            values = (name, *_mesh(mesh, skin[0], posed, anim, times))
            found |= {f"{key} {found['count']}": value for key, value in zip(_ARRAYS, values, strict=True)}
            found["count"] += 1
    return found


def _mesh(mesh: Any, skin: Any, posed: list[list[Any]], anim: Any, times: list[float]) -> tuple[Any, ...]:
    rest = np.array([tuple(point) for point in _keep(mesh.vertices)], dtype=np.float64).reshape(-1, 3)
    clusters = _list(skin.clusters)
    bones = [_keep(cluster.bone_node) for cluster in clusters]
    numbers, names = [bone.typed_id for bone in bones], [bone.name for bone in bones]
    rows: list[list[tuple[int, float]]] = [[] for _vertex in rest]
    for joint, cluster in enumerate(clusters):
        for vertex, weight in zip(_keep(cluster.vertices), _keep(cluster.weights), strict=True):
            rows[vertex].append((joint, weight))
    width = max((len(row) for row in rows), default=1)
    slots, weights = np.zeros((len(rest), width), dtype=int), np.zeros((len(rest), width))
    for vertex, row in enumerate(rows):
        for slot, (joint, weight) in enumerate(row):
            slots[vertex, slot], weights[vertex, slot] = joint, weight
    inverses = np.array([_matrix(cluster.geometry_to_bone) for cluster in clusters])
    motions = [np.array([_matrix(nodes[number].node_to_world) for number in numbers]) for nodes in posed]
    channels = [each for deformer in _list(mesh.blend_deformers) for each in _list(deformer.channels)]
    targets = np.zeros((len(channels), len(rest), 3))
    for target, channel in zip(targets, channels, strict=True):
        shape = _keep(_list(channel.keyframes)[-1].shape)
        for vertex, offset in zip(_keep(shape.offset_vertices), _keep(shape.position_offsets), strict=True):
            target[vertex] = tuple(offset)
    shapes = np.array([[c.evaluate_blend_weight(anim, time) for c in channels] for time in times])
    moved = np.array(motions) @ inverses
    return rest, targets, names, slots, weights, moved, shapes.reshape(len(times), -1)


def _matrix(matrix: Any) -> np.ndarray:
    result = np.identity(4)
    result[:3] = np.array([tuple(column) for column in (matrix.c0, matrix.c1, matrix.c2, matrix.c3)]).T
    return result


if __name__ == "__main__":
    gc.disable()
    source, out, *given = json.loads(sys.argv[1])
    np.savez(out, **_read(source, *given))
    # Without freeing anything.
    os._exit(0)
