# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares Sinew's Python package with other packages, on the same data in the same run."""

from __future__ import annotations

import importlib
import itertools
import platform
from importlib import metadata

import common
import numpy as np
import sinew

METHODS = [method.name for method in sinew.methods()]
BONES = 100
INFLUENCES = 4
# For the scene of ddm: libigl stores ten numbers of each bone for each vertex, including bones that do not
# move it.
FEW_BONES = INFLUENCES


class Scene:
    """A cylinder along a bent and twisted chain of bones.

    rest, weights, bones: float32 [n, 3], float32 [n, 4], int32 [n, 4]; pose: float32 [bone_count, 4, 4]
    """

    def __init__(self, vertices: int, bone_count: int = BONES) -> None:
        random = np.random.default_rng(1)
        along = np.arange(vertices) / vertices * bone_count
        angle = random.uniform(0, 2 * np.pi, vertices)
        self.rest = np.stack([np.cos(angle), np.sin(angle), along], axis=1).astype(np.float32)
        first = np.clip(np.floor(along) - 1, 0, bone_count - INFLUENCES).astype(np.int32)
        self.bones = first[:, None] + np.arange(INFLUENCES, dtype=np.int32)
        away = self.bones + 0.5 - along[:, None]
        weights = np.exp(-(away**2)) + 0.02 + 0.05 * random.random((vertices, INFLUENCES))
        self.weights = (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
        heads = np.arange(float(bone_count))[:, None] * [0, 0, 1]
        bends = sinew.affine.from_screw_about([1, 2, 0.5], heads, 0.05, 0.0)
        self.pose = np.array(list(itertools.accumulate(bends, np.matmul)), dtype=np.float32)

    def deformer(self, method: str) -> sinew.Deformer:
        count = len(self.rest)
        offsets = np.arange(0, INFLUENCES * count + 1, INFLUENCES, dtype=np.int32)
        # Centres of rotation as they are for a limb: near its middle.
        data = {"cor": self.rest * np.float32([0, 0, 1])} if method == "cor" else {}
        if method == "ddm":
            data = {"ddm": self.moments()}
        own = (self.rest, offsets, self.bones.ravel(), self.weights.ravel())
        return sinew.Deformer(*own, method, vertex_data=data)

    def moments(self) -> np.ndarray:
        """The vertex data of ddm, float32 [4 n, 12]: neighbourhoods on the surface, wider along the axis."""
        centres = 0.98 * self.rest[:, None].repeat(INFLUENCES, axis=1)
        away = 0.02 * (np.arange(INFLUENCES) - (INFLUENCES - 1) / 2)
        centres[..., 2] += away - (self.weights @ away)[:, None]
        seconds = np.array([0.02, 0.02, 0.05, 0.0, 0.0, -0.01])
        of_weight = np.concatenate([centres, np.broadcast_to(seconds, (*self.bones.shape, 6))], axis=2)
        numbers = self.weights[..., None] * np.concatenate(
            [np.ones_like(centres[..., :1]), of_weight], axis=2
        )
        vertices = np.broadcast_to(np.arange(len(self.rest))[:, None], self.bones.shape)
        rows = np.concatenate([vertices[..., None], self.bones[..., None], numbers], axis=2)
        return rows.reshape(-1, 12).astype(np.float32)


def rotate(quats: np.ndarray, points: np.ndarray) -> np.ndarray:
    axis = quats[:, 1:]
    return points + 2 * np.cross(axis, np.cross(axis, points) + quats[:, :1] * points)


def numpy_candidates(scene: Scene) -> dict:
    """Straightforward numpy code for all vertices at once."""
    rest, bones, weights = scene.rest, scene.bones, scene.weights
    poses = sinew.affine.to_quat_vec(scene.pose)
    duals = sinew.affine.to_dual_quat(scene.pose)

    def signed(quats: np.ndarray) -> np.ndarray:
        of = quats[bones]
        sign = np.sign(np.einsum("vi,vki->vk", of[:, 0, :4], of[..., :4]))
        return np.where(sign < 0, -weights, weights)

    def lbs() -> np.ndarray:
        blend = np.einsum("vk,vkij->vij", weights, scene.pose[bones, :3])
        return np.einsum("vij,vj->vi", blend[:, :, :3], rest) + blend[:, :, 3]

    def qv() -> np.ndarray:
        rotation = np.einsum("vk,vki->vi", signed(poses), poses[bones][..., :4])
        rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
        return rotate(rotation, rest) + np.einsum("vk,vki->vi", weights, poses[bones][..., 4:])

    def dq() -> np.ndarray:
        blend = np.einsum("vk,vki->vi", signed(duals), duals[bones])
        blend /= np.linalg.norm(blend[:, :4], axis=1, keepdims=True)
        w, v, dual_w, dual_v = blend[:, :1], blend[:, 1:4], blend[:, 4:5], blend[:, 5:]
        return rotate(blend[:, :4], rest) + 2 * (w * dual_v - dual_w * v + np.cross(v, dual_v))

    return {"lbs": {"numpy": lbs}, "qv": {"numpy": qv}, "dq": {"numpy": dq}}


def igl_moments(scene: Scene) -> np.ndarray:
    """The moments in libigl's form, [n, 10 x bones]: the upper triangles of Omega, about the origin."""
    rows = scene.moments().astype(np.float64).reshape(len(scene.rest), INFLUENCES, 12)
    weights, firsts = rows[..., 2], rows[..., 3:6]
    xx, yy, zz, yz, xz, xy = np.moveaxis(rows[..., 6:], 2, 0)
    seconds = np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), (0, 1), (2, 3))
    centroids = firsts.sum(axis=1)[:, None]
    crossed = firsts[..., :, None] * centroids[..., None, :]
    both = centroids[..., :, None] * centroids[..., None, :]
    whole = np.empty((*weights.shape, 4, 4))
    whole[..., :3, :3] = seconds + crossed + crossed.swapaxes(2, 3) - weights[..., None, None] * both
    whole[..., :3, 3], whole[..., 3, 3] = firsts, weights
    omega = np.zeros((len(rows), len(scene.pose), 10))
    np.put_along_axis(omega, scene.bones[..., None].astype(np.int64), whole[..., *np.triu_indices(4)], axis=1)
    return omega.reshape(len(rows), -1)


def igl_candidates(scene: Scene) -> dict:
    igl = importlib.import_module("igl")
    dense = np.zeros((len(scene.rest), BONES))
    np.put_along_axis(dense, scene.bones.astype(np.int64), scene.weights, axis=1)
    blend = igl.lbs_matrix(scene.rest.astype(np.float64), dense)

    # A stack of transposed 3 x 4 matrices.
    def stacked(pose: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(pose[:, :3].astype(np.float64).transpose(0, 2, 1).reshape(-1, 3))

    pose = stacked(scene.pose)
    sparse = importlib.import_module("scipy.sparse").csr_matrix(blend)
    found = {"lbs": {"igl lbs_matrix": lambda: blend @ pose, "the same, sparse": lambda: sparse @ pose}}
    if "ddm" in METHODS and hasattr(igl, "direct_delta_mush"):
        few = Scene(len(scene.rest), FEW_BONES)
        own = few.rest.astype(np.float64), stacked(few.pose), igl_moments(few)
        found["ddm"] = {"igl": lambda: igl.direct_delta_mush(*own)}
    return found


def usd_candidates(scene: Scene) -> dict:
    skel = importlib.import_module("pxr.UsdSkel")
    vt = importlib.import_module("pxr.Vt")
    gf = importlib.import_module("pxr.Gf")
    identity = gf.Matrix4f(1)
    # For row vectors.
    pose = vt.Matrix4fArray.FromNumpy(np.ascontiguousarray(scene.pose.transpose(0, 2, 1)))
    bones = vt.IntArray.FromNumpy(scene.bones.ravel())
    weights = vt.FloatArray.FromNumpy(scene.weights.ravel())

    def skin(method: str, serial: bool):
        def run() -> np.ndarray:
            # Works in place: the rest points are copied first, as its users have to do.
            points = vt.Vec3fArray.FromNumpy(scene.rest)
            if not skel.SkinPoints(method, identity, pose, bones, weights, INFLUENCES, points, serial):
                raise RuntimeError("UsdSkel.SkinPoints refused its input")
            return np.asarray(points)

        return run

    return {
        name: {"UsdSkel": skin(method, True), "UsdSkel, threads": skin(method, False)}
        for name, method in (("lbs", "classicLinear"), ("dq", "dualQuaternion"))
    }


def sinew_candidates(scene: Scene) -> dict:
    def candidates(method: str) -> dict:
        own = Scene(len(scene.rest), FEW_BONES) if method == "ddm" else scene
        deformer, out = own.deformer(method), np.empty_like(own.rest)
        return {
            name: lambda threads=threads: deformer.deform(own.pose, out=out, threads=threads)
            for name, threads in (("sinew", 1), ("sinew, threads", None))
        }

    return {method: candidates(method) for method in METHODS}


PEERS = {
    "sinew-skinning": sinew_candidates,
    "numpy": numpy_candidates,
    "libigl": igl_candidates,
    "usd-core": usd_candidates,
}


def collect(scene: Scene) -> tuple[dict, dict, dict]:
    """({method: {name: function}}, {distribution: version}, {distribution: reason why it is missing})."""
    candidates = {method: {} for method in METHODS}
    versions, missing = {}, {}
    for distribution, make in PEERS.items():
        try:
            versions[distribution] = metadata.version(distribution)
            made = make(scene)
        except (ImportError, AttributeError) as error:
            missing[distribution] = str(error)
            continue
        for method, functions in made.items():
            candidates[method] |= functions
    return candidates, versions, missing


def main() -> None:
    arguments = common.options(__doc__, "peers", "10,000 vertices").parse_args()
    vertices = 10_000 if arguments.quick else 100_000
    scene = Scene(vertices)
    candidates, versions, missing = collect(scene)
    title = f"peers, {vertices:,} vertices of {INFLUENCES} influences"
    facts = common.begin(title, python=platform.python_version(), **versions)
    for distribution, reason in missing.items():
        print(f"without {distribution}: {reason}")
    print("Nanoseconds a vertex, the least of many runs; how far the points are from Sinew's, as a part")
    print("of the size.\n")
    results = {}
    for method, functions in candidates.items():
        points = {name: np.array(call()) for name, call in functions.items()}
        size = np.ptp(points["sinew"], axis=0).max()
        for name, spread in common.alternate(functions, 0.5 if arguments.quick else 1.5).items():
            away = float(np.abs(points[name] - points["sinew"]).max() / size)
            spread |= {"per_vertex": spread["least"] / vertices * 1e9, "away": away}
            results[f"{method}/{name}"] = spread
            ratio = spread["least"] / results[f"{method}/sinew"]["least"]
            print(f"{method:5}{name:18}{spread['per_vertex']:10.2f}{ratio:10.1f} x{away:12.0e}", flush=True)
    common.write(arguments.name, machine=facts, missing=missing, seconds=results)


if __name__ == "__main__":
    main()
