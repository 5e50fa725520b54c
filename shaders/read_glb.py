# SPDX-License-Identifier: MIT
"""A character of a .glb, skinned as the shaders do, with numpy: the mesh and its attributes as trimesh reads
them, the skin and the animation by glTF 2.0, and SINEW_skinning by docs/engines.md.

    python read_glb.py character.glb points.npz --times 0,0.5,1

points.npz has for each skinned mesh the points [times, vertices, 3] in Blender's axes, by the name of its
node.
"""

import argparse
import json
import struct
from pathlib import Path

import numpy as np
import trimesh
from bone_buffer import bone_buffer
from skinning import Skinning, deformed

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class File:
    """The header of a .glb and its accessors."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.header, self._binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(self, number):
        accessor = self.header["accessors"][number]
        view = self.header["bufferViews"][accessor["bufferView"]]
        assert "byteStride" not in view, "interleaved attributes are left out here"
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        kind, width = COMPONENTS[accessor["componentType"]], WIDTHS[accessor["type"]]
        return np.frombuffer(self._binary, kind, accessor["count"] * width, start).reshape(-1, width)


def local_matrix(node):
    quaternion = np.roll(np.asarray(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64), 1)
    matrix = trimesh.transformations.quaternion_matrix(quaternion)
    matrix[:3, :3] *= np.asarray(node.get("scale", (1.0, 1.0, 1.0)))
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def world_matrices(file, animation, time):
    """float64 [nodes, 4, 4] at a time in seconds."""
    nodes = [dict(node) for node in file.header["nodes"]]
    for channel in animation["channels"] if animation else ():
        sampler = animation["samplers"][channel["sampler"]]
        times, values = file.array(sampler["input"])[:, 0], file.array(sampler["output"])
        # At a key. Between two, rotations are to be blended on the sphere.
        at = [np.interp(time, times, column) for column in values.T]
        nodes[channel["target"]["node"]][channel["target"]["path"]] = at
    parents = {child: number for number, node in enumerate(nodes) for child in node.get("children", ())}
    found = {}

    def world(number):
        if number not in found:
            own = local_matrix(nodes[number])
            found[number] = world(parents[number]) @ own if number in parents else own
        return found[number]

    return np.array([world(number) for number in range(len(nodes))])


def parents_of(file, joints):
    """For each joint the place of the nearest above it, -1 for none."""
    above = {child: n for n, node in enumerate(file.header["nodes"]) for child in node.get("children", ())}
    found = []
    for joint in joints:
        while (joint := above.get(joint, -1)) >= 0 and joint not in joints:
            pass
        found.append(joints.index(joint) if joint >= 0 else -1)
    return found


def influences(file, attributes):
    """Joints and weights [vertices, 4 n]."""
    sets = range(sum(name.startswith("JOINTS_") for name in attributes))
    joints, weights = (
        np.hstack([file.array(attributes[f"{name}_{number}"]) for number in sets])
        for name in ("JOINTS", "WEIGHTS")
    )
    return joints, weights.astype(np.float64)


def points_at(path, times, animation_name=None):
    """For each skinned mesh float64 [times, vertices, 3], in Blender's axes, by the name of its node."""
    file, scene = File(path), trimesh.load(path, process=False)
    animations = file.header.get("animations", [])
    chosen = [each for each in animations if animation_name in (None, each["name"])]
    worlds = [world_matrices(file, chosen[0] if chosen else None, time) for time in times]
    result = {}
    for node in file.header["nodes"]:
        if "skin" in node:
            result[node["name"]] = np.array([_mesh_at(file, scene, node, world) for world in worlds])
    return result


def _mesh_at(file, scene, node, world):
    mesh, skin = file.header["meshes"][node["mesh"]], file.header["skins"][node["skin"]]
    # By columns; their inverses are the joints' axes at rest.
    from_rest = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    own = skin.get("extensions", {}).get("SINEW_skinning", {})
    twists = own.get("twists", [])
    content = mesh.get("extensions", {}).get("SINEW_skinning", {"method": "lbs"})
    values, stages = content.get("parameters", {}), content.get("stages", [])
    bones = bone_buffer(
        world[skin["joints"]],
        np.linalg.inv(from_rest.astype(np.float64)),
        parents_of(file, skin["joints"]),
        own.get("lengths"),
        [(each["bone"], each["base"], each["tip"], each["from"] == "parent") for each in twists],
        [each["amount"] * values.get("twist_spread.amount", 1.0) for each in twists],
        [each["curve"] for each in twists],
        np.array(own["axes"]) if "axes" in own else None,
    )
    # trimesh has a geometry for each primitive, in the order of the file.
    before = sum(len(each["primitives"]) for each in file.header["meshes"][: node["mesh"]])
    geometries = list(scene.geometry.values())[before:]
    parts = []
    for primitive, geometry in zip(mesh["primitives"], geometries, strict=False):
        attributes = geometry.vertex_attributes
        by = Skinning(content["method"], content.get("mix", content["method"]))
        by.by_hierarchy = [name for name in ("dq", "cor") if values.get(f"{name}.signs") == "hierarchy"]
        if "mix" in content:
            by.share = attributes["_SINEW_MIX"]
        if "twist_spread" in stages:
            by.twist = attributes.get("_SINEW_TWIST_SPREAD", 1.0)
        if "bulge_limit" in stages:
            by.bulge = values["bulge_limit.strength"] * attributes.get("_SINEW_BULGE_LIMIT", np.ones(1))
            by.form = values["bulge_limit.form"]
        influencing = influences(file, primitive["attributes"])
        centres = attributes.get("_SINEW_CENTRE")
        parts.append(deformed(by, np.asarray(geometry.vertices), centres, *influencing, bones))
    x, y, z = np.vstack(parts).T
    return np.column_stack([x, -z, y])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("glb", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--times", default="0", help="in seconds, at keys")
    parser.add_argument("--animation", help="its name (default: the first)")
    args = parser.parse_args()
    times = [float(time) for time in args.times.split(",")]
    np.savez(args.out, **points_at(args.glb, times, args.animation))
