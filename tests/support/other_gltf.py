# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays a .glb with other projects' code: pygltflib reads the file, scipy blends rotations, and numpy
skins, following the text of glTF 2.0. Shares no code with shaders/read_glb.py or with Sinew."""

import numpy as np
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation, Slerp

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
BLENDER_FROM_GLTF = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def array(gltf, number):
    accessor = gltf.accessors[number]
    view = gltf.bufferViews[accessor.bufferView]
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    kind, width = COMPONENTS[accessor.componentType], WIDTHS[accessor.type]
    found = np.frombuffer(gltf.binary_blob(), kind, accessor.count * width, start).reshape(-1, width)
    return found / np.iinfo(kind).max if accessor.normalized else found


def sampled(gltf, sampler, path, time):
    """The value of a sampler at a time, with step or linear interpolation."""
    times, values = array(gltf, sampler.input)[:, 0], array(gltf, sampler.output).astype(np.float64)
    time = np.clip(time, times[0], times[-1])
    if sampler.interpolation == "STEP" or len(times) == 1:
        return values[np.searchsorted(times, time, side="right") - 1]
    assert sampler.interpolation in (None, "LINEAR")
    if path == "rotation":
        return Slerp(times, Rotation.from_quat(values))(time).as_quat()
    return np.array([np.interp(time, times, column) for column in values.T])


def local_matrix(node, moved):
    matrix = np.eye(4)
    if node.matrix is not None:
        matrix = np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
    translation, rotation, scale = (
        moved.get(path, getattr(node, path)) for path in ("translation", "rotation", "scale")
    )
    if rotation is not None:
        matrix[:3, :3] = Rotation.from_quat(rotation).as_matrix()
    if scale is not None:
        matrix[:3, :3] *= np.asarray(scale)
    if translation is not None:
        matrix[:3, 3] = translation
    return matrix


def world_matrices(gltf, animation, time):
    moved = [{} for _node in gltf.nodes]
    for channel in animation.channels:
        path = channel.target.path
        moved[channel.target.node][path] = sampled(gltf, animation.samplers[channel.sampler], path, time)
    world = [None] * len(gltf.nodes)
    waiting = [(number, np.eye(4)) for number in gltf.scenes[gltf.scene].nodes]
    while waiting:
        number, parent = waiting.pop()
        world[number] = parent @ local_matrix(gltf.nodes[number], moved[number])
        waiting += [(child, world[number]) for child in gltf.nodes[number].children or ()]
    return world


def points_at(path, times, animation):
    """float64 [vertices, 3] at rest and [times, vertices, 3], in Blender's axes, for the only skinned mesh.

    animation  the name of the animation to play
    """
    gltf = GLTF2().load(str(path))
    (node,) = (each for each in gltf.nodes if each.skin is not None)
    skin = gltf.skins[node.skin]
    (played,) = (each for each in gltf.animations if each.name == animation)
    inverse = array(gltf, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    attributes = [primitive.attributes for primitive in gltf.meshes[node.mesh].primitives]
    rest, joints, weights = (
        np.concatenate([array(gltf, getattr(each, name)) for each in attributes])
        for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
    )
    rest = np.column_stack([rest, np.ones(len(rest))])
    weights = weights / weights.sum(axis=1, keepdims=True)
    shapes = []
    for time in times:
        world = world_matrices(gltf, played, time)
        bones = np.array([world[joint] for joint in skin.joints]) @ inverse
        points = np.einsum("vi,vijk,vk->vj", weights, bones[joints], rest)[:, :3]
        shapes.append(points @ BLENDER_FROM_GLTF.T)
    return rest[:, :3] @ BLENDER_FROM_GLTF.T, np.array(shapes)
