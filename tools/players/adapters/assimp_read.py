# SPDX-License-Identifier: GPL-3.0-or-later
"""assimp, which reads bones, weights and keys and leaves skinning to who asks: its own program writes what it
read as JSON, with six digits and without shapes, and this blends it linearly, between keys as its documents
say."""

import json
import os
import subprocess
import tempfile
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from adapter import NoSkinError, Task, blended, main, z_up
from scipy.spatial.transform import Rotation, Slerp

PREFIX = Path(next(iter(find_spec("cmeel").submodule_search_locations))).parent / "cmeel.prefix"


def read(path: Path) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out.json")
        words = PREFIX / "bin/assimp", "export", path, out, "-fassjson"
        env = {**os.environ, "LD_LIBRARY_PATH": str(PREFIX / "lib")}
        subprocess.run(words, env=env, capture_output=True, check=True)
        return json.loads(out.read_text(encoding="utf-8"))


def interpolated(keys: list, time: float) -> np.ndarray:
    times, values = [key[0] for key in keys], np.array([key[1] for key in keys])
    return np.array([np.interp(time, times, column) for column in values.T])


def matrix_at(channel: dict, time: float) -> np.ndarray:
    matrix = np.identity(4)
    keys = channel["rotationkeys"]
    turns = Rotation.from_quat([np.roll(key[1], -1) for key in keys])
    times = [key[0] for key in keys]
    turn = Slerp(times, turns)(np.clip(time, times[0], times[-1])) if len(keys) > 1 else turns[0]
    matrix[:3, :3] = turn.as_matrix() * interpolated(channel["scalingkeys"], time)
    matrix[:3, 3] = interpolated(channel["positionkeys"], time)
    return matrix


def world(node: dict, channels: dict, time: float, above: np.ndarray, found: dict) -> dict:
    own = channels.get(node["name"])
    matrix = above @ (matrix_at(own, time) if own else np.reshape(node["transformation"], (4, 4)))
    found[node["name"]] = matrix
    for child in node.get("children", ()):
        world(child, channels, time, matrix, found)
    return found


def play(task: Task) -> dict:
    scene = read(task.path)
    (mesh,) = scene["meshes"]
    if "bones" not in mesh:
        raise NoSkinError("a mesh without bones")
    rest = np.reshape(mesh["vertices"], (-1, 3))
    bones = mesh["bones"]
    weights = np.zeros((len(rest), len(bones)))
    for number, bone in enumerate(bones):
        for vertex, weight in bone["weights"]:
            weights[vertex, number] = weight
    slots = np.tile(np.arange(len(bones)), (len(rest), 1))
    animation = sorted(scene["animations"], key=lambda each: each["name"])[task.clip]
    channels = {each["name"]: each for each in animation["channels"]}
    points = []
    for time in task.times:
        nodes = world(scene["rootnode"], channels, time * animation["tickspersecond"], np.identity(4), {})
        motions = [nodes[bone["name"]] @ np.reshape(bone["offsetmatrix"], (4, 4)) for bone in bones]
        points.append(blended(rest, slots, weights, motions))
    if task.path.suffix == ".fbx":
        # Rest points as the file has them, and a world of centimetres.
        return {"rest": rest, "points": z_up(points) / 100.0}
    return {"rest": z_up(rest), "points": z_up(points)}


if __name__ == "__main__":
    main(version("cmeel-assimp"), play)
