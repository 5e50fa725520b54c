# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the skinned meshes of a .usdc by Pixar's UsdSkel, which Blender brings along."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import SinewError
from ...io.usd import has_pxr, pxr
from .played import Played, of_sum_one


def read_usd(path: Path) -> list[Played]:
    """The skinned meshes of a file whose time codes are frames.

    Raises SinewError where this Blender keeps UsdSkel to itself, as before 4.4.
    """
    if not has_pxr():
        raise SinewError("USD files are verified by Blender 4.4 and newer")
    usd, skel, geom = pxr("Usd", "UsdSkel", "UsdGeom")
    stage = usd.Stage.Open(str(path))
    cache, found = skel.Cache(), []
    prims = list(stage.Traverse())
    for root in prims:
        if root.IsA(skel.Root):
            cache.Populate(skel.Root(root), usd.PrimDefaultPredicate)
    for prim in prims:
        skinning = cache.GetSkinningQuery(prim) if prim.IsA(geom.Mesh) else None
        if skinning and skinning.HasJointInfluences():
            binding = skel.BindingAPI(prim)
            skeleton = cache.GetSkelQuery(binding.GetInheritedSkeleton())
            # What plays later refers to the stage and the cache, which Python must not end before.
            found.append(_mesh(prim, skinning, skeleton, geom, skel, (stage, cache)))
    return found


def _mesh(prim: Any, skinning: Any, skeleton: Any, geom: Any, skel: Any, kept: object) -> Played:
    rest = np.array(geom.Mesh(prim).GetPointsAttr().Get(), dtype=np.float64)
    slots, weights = skinning.ComputeVaryingJointInfluences(len(rest))
    width = skinning.GetNumInfluencesPerComponent()
    slots = np.array(slots, dtype=np.int64).reshape(-1, width)
    weights = of_sum_one(np.array(weights, dtype=np.float64).reshape(-1, width))
    order = skinning.GetJointOrder() or skeleton.GetJointOrder()
    bind, mapper = _matrix(skinning.GetGeomBindTransform()), skinning.GetJointMapper()

    def motions(frame: float, _kept: object = kept) -> np.ndarray:
        own = skeleton.ComputeSkinningTransforms(frame)
        if mapper is not None and not mapper.IsIdentity():
            own = mapper.Remap(own)
        place = geom.Imageable(skeleton.GetPrim()).ComputeLocalToWorldTransform(frame)
        return _matrix(place) @ np.array([_matrix(each) for each in own]) @ bind

    targets, shapes = _shapes(prim, skeleton, skel, len(rest))
    # Blender's mesh is in a transform with the name of the object.
    name = prim.GetParent().GetName()
    joints = tuple(str(path).rpartition("/")[2] for path in order)
    return Played(name, rest, targets, joints, slots, weights, motions, shapes)


def _shapes(
    prim: Any, skeleton: Any, skel: Any, vertices: int
) -> tuple[np.ndarray, Callable[[float], np.ndarray]]:
    """Offsets [targets, vertices, 3], and the weights of each at a frame."""
    binding = skel.BindingAPI(prim)
    names = [str(name) for name in binding.GetBlendShapesAttr().Get() or ()]
    paths = binding.GetBlendShapeTargetsRel().GetTargets() if names else []
    targets = np.zeros((len(names), vertices, 3))
    for target, path in zip(targets, paths, strict=True):
        shape = skel.BlendShape(prim.GetStage().GetPrimAtPath(path))
        rows = shape.GetPointIndicesAttr().Get()
        offsets = np.array(shape.GetOffsetsAttr().Get(), dtype=np.float64).reshape(-1, 3)
        target[np.array(rows) if rows else slice(None)] = offsets
    animation = skeleton.GetAnimQuery()

    def weights(frame: float) -> np.ndarray:
        if not names or animation is None or not animation:
            return np.zeros(len(names))
        order = [str(name) for name in animation.GetBlendShapeOrder()]
        own = dict(zip(order, animation.ComputeBlendShapeWeights(frame), strict=True)) if order else {}
        return np.array([float(own.get(name, 0.0)) for name in names])

    return targets, weights


def _matrix(matrix: Any) -> np.ndarray:
    """UsdSkel multiplies row vectors."""
    return np.array(matrix, dtype=np.float64).reshape(4, 4).T
