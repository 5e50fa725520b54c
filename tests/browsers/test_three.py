# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects shaders/sinew-three.js: by it three.js plays files of the golden set as that has them."""

import functools
import http.server
import importlib.util
import json
import re
import struct
import threading
from pathlib import Path

import numpy as np
import pytest
import read_glb
from conftest import REPOSITORY
from test_shaders import GOLDEN, Mesh
from trimesh.transformations import quaternion_from_matrix

WIDTHS = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
COMPONENTS = {np.dtype("f4"): 5126, np.dtype("u2"): 5123}


class Writer:
    """A .glb with accessors of arrays."""

    def __init__(self):
        self.header = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self.binary = b""

    def add(self, values, kind="f4", **others):
        array = np.asarray(values, kind).reshape(len(values), -1)
        self.header["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": array.nbytes}
        )
        self.binary += array.tobytes()
        about = {
            "componentType": COMPONENTS[array.dtype],
            "count": len(array),
            "type": WIDTHS[array.shape[1]],
        }
        about |= {"bufferView": len(self.header["accessors"]), **others}
        self.header["accessors"].append(about)
        return len(self.header["accessors"]) - 1

    def write(self, path):
        self.header["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.header).encode()
        text += b" " * (-len(text) % 4)
        total = 28 + len(text) + len(self.binary)
        parts = struct.pack("<4sIII4s", b"glTF", 2, total, len(text), b"JSON"), text
        path.write_bytes(b"".join([*parts, struct.pack("<I4s", len(self.binary), b"BIN\0"), self.binary]))


def values_of(matrix):
    """Translation, rotation and scale of a matrix [4, 4]."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    scale[0] *= np.sign(np.linalg.det(matrix[:3, :3]))
    rotation = np.eye(4)
    rotation[:3, :3] = matrix[:3, :3] / scale
    return {
        "translation": matrix[:3, 3],
        "rotation": np.roll(quaternion_from_matrix(rotation), -1),
        "scale": scale,
    }


def write(mesh, path, influences):
    """A .glb with a mesh for each result that a file can have, by the name of its array, at rest; the pose is
    a second later. Returns these results."""
    case, made = mesh.case, Writer()
    results = [result for result in mesh.results if result["array"] != "turned"]
    if case["segments"].max() > 1:
        # Segments of a bendy bone are no joints' own.
        results = [result for result in results if "bulge_limit" not in result["stages"]]
    rest, posed, parents, count = case["rest"], case["posed"], case["parents"].tolist(), len(case["rest"])
    # glTF wants weights of sum 1. A joint of its own, the last, has the vertices that stay.
    sums = mesh.weights.sum(axis=1, keepdims=True)
    stays = sums[:, 0] <= 1e-4
    joints, weights = mesh.bones[:, :4].copy(), mesh.weights[:, :4] / np.where(sums > 1e-4, sums, 1)
    joints[stays], weights[stays] = count, (1, 0, 0, 0)
    # Of eight, those behind the first have no weight.
    joints, weights = (np.insert(values, [1] * (influences - 4), 0, axis=1) for values in (joints, weights))
    shared = {
        "POSITION": made.add(
            mesh.points, min=mesh.points.min(axis=0).tolist(), max=mesh.points.max(axis=0).tolist()
        ),
        "NORMAL": made.add(mesh.normals),
        "_SINEW_CENTRE": made.add(mesh.centres),
    }
    for k in range(influences // 4):
        shared[f"JOINTS_{k}"] = made.add(joints[:, 4 * k : 4 * k + 4], "u2")
        shared[f"WEIGHTS_{k}"] = made.add(weights[:, 4 * k : 4 * k + 4])
    painted = made.add(mesh.painted)
    nodes = [{"name": f"bone.{bone}"} for bone in range(count + 1)]
    times, channels, samplers = made.add([0.0, 1.0, 2.0], min=[0.0], max=[2.0]), [], []
    for bone, parent in enumerate(parents):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(bone)
        at_rest, at_pose = (
            values_of(np.linalg.inv(m[parent]) @ m[bone] if parent >= 0 else m[bone]) for m in (rest, posed)
        )
        nodes[bone] |= {name: value.tolist() for name, value in at_rest.items()}
        for name, value in at_pose.items():
            samplers.append({"input": times, "output": made.add([at_rest[name], value, value])})
            channels.append({"sampler": len(channels), "target": {"node": bone, "path": name}})
    roots = [bone for bone, parent in enumerate(parents) if parent < 0] + [count]
    meshes = []
    for result in results:
        stages, attributes = dict(result["stages"]), dict(shared)
        content = {"version": 1, "method": result["method"], "parameters": {}}
        content["parameters"] = {
            f"{result['method']}.{key}": value for key, value in result["parameters"].items()
        }
        if "mix" in stages:
            content["mix"], attributes["_SINEW_MIX"] = stages.pop("mix")["method"], painted
        for name, values in stages.items():
            content.setdefault("stages", []).append(name)
            content["parameters"] |= {f"{name}.{key}": value for key, value in values.items()}
            attributes[f"_{'SINEW_' + name.upper()}"] = painted
        nodes.append({"name": result["array"], "mesh": len(meshes), "skin": 0})
        primitives = [{"attributes": attributes}]
        meshes.append({"primitives": primitives, "extensions": {"SINEW_skinning": content}})
    twists = [
        {
            "bone": int(bone),
            "base": int(bone),
            "tip": int(bone) + 1,
            "from": "child",
            "amount": 1.0,
            "curve": 0.0,
        }
        for bone in np.flatnonzero(case["segments"][:-1] == 1)
    ]
    lengths = [*case["lengths"].tolist(), *[0.0] * (count + 1 - len(case["lengths"]))]
    inverses = np.concatenate([np.linalg.inv(rest), np.eye(4)[None]]).swapaxes(1, 2)
    skin = {"joints": list(range(count + 1)), "inverseBindMatrices": made.add(inverses.reshape(-1, 16))}
    skin["extensions"] = {"SINEW_skinning": {"version": 1, "lengths": lengths, "twists": twists}}
    made.header |= {"nodes": nodes, "meshes": meshes, "skins": [skin], "extensionsUsed": ["SINEW_skinning"]}
    made.header |= {"scene": 0, "scenes": [{"nodes": roots + list(range(count + 1, len(nodes)))}]}
    made.header["animations"] = [{"name": "pose", "channels": channels, "samplers": samplers}]
    made.write(path)
    return results


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder and its address: pages of files may not import modules."""
    folder = tmp_path_factory.mktemp("three")
    package = Path(importlib.util.find_spec("nicegui").origin).parent
    (folder / "three").symlink_to(package / "elements/scene/dist")
    for name in ("sinew.glsl", "sinew-three.js"):
        (folder / name).symlink_to(REPOSITORY / "shaders" / name)
    document = (REPOSITORY / "docs/engines.md").read_text(encoding="utf-8")
    (documented,) = re.findall(r"^```js\n(.*?)^```$", document, re.MULTILINE | re.DOTALL)
    page = Path(__file__).with_name("three.html").read_text(encoding="utf-8")
    (folder / "three.html").write_text(page.replace("DOCUMENTED", documented), encoding="utf-8")
    # The module has three.js as an object, under the name of no package.
    source = (folder / "sinew-three.js").read_text(encoding="utf-8")
    (names,) = re.findall(r'import {([^}]*)} from "three"', source)
    shim = 'import { THREE, GLTFLoader } from "./three/index.js"; export { GLTFLoader };'
    (folder / "shim.js").write_text(f"{shim} export const {{{names}}} = THREE;", encoding="utf-8")
    handler = functools.partial(Quiet, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield folder, f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def end_headers(self):
        # Each test has its own file.
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *_):
        pass


@pytest.mark.parametrize(
    ("case", "how", "influences"),
    [
        *[(path.stem, "", 4) for path in sorted(GOLDEN.glob("*.npz"))],
        ("weights", "moved", 8),
        ("twisted", "cloned", 4),
    ],
)
def test_points_and_normals_are_golden(browser, site, case, how, influences):
    folder, address = site
    mesh = Mesh(GOLDEN / f"{case}.npz")
    file = folder / "human.glb"
    results = write(mesh, file, influences)
    browser.open(f"{address}/three.html?{how}")
    said = browser.wait("window.sinew ? 'drawn' : document.getElementById('message').textContent")
    assert said == "drawn", said
    assert browser.run("return window.sinew.error") == 0
    world = browser.floats("window.sinew.matrix").reshape(4, 4).T.astype(np.float64)
    read = read_glb.points_at(file, [1.0])
    for result in results:
        found = browser.floats(f"window.sinew.points.{result['array']}").reshape(-1, 7)
        assert np.all(found[:, 3] == 1)
        points = (found[:, :3] - world[:3, 3]) @ np.linalg.inv(world[:3, :3]).T
        x, y, z = points.T
        assert np.abs(np.column_stack([x, -z, y]) - read[result["array"]][0]).max() <= mesh.tolerance, result
        mesh.assert_is(result, points)
        normals = found[:, 4:] @ world[:3, :3]
        mesh.assert_has_normals(result, normals / np.linalg.norm(normals, axis=1, keepdims=True))
