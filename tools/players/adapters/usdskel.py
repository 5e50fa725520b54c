# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixar's UsdSkel, as it computes skinned points at a time."""

import numpy as np
from adapter import Task, main
from pxr import Usd, UsdGeom, UsdSkel, Vt


def placed(prim: Usd.Prim, points: object, time: object) -> np.ndarray:
    matrix = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(time))
    return np.asarray(points, dtype=np.float64) @ matrix[:3, :3] + matrix[3, :3]


def play(task: Task) -> dict:
    stage = Usd.Stage.Open(str(task.path))
    (mesh,) = [each for each in stage.Traverse() if each.IsA(UsdGeom.Mesh)]
    (root,) = [UsdSkel.Root(each) for each in stage.Traverse() if each.IsA(UsdSkel.Root)]
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    skinning = cache.GetSkinningQuery(mesh)
    skeleton = cache.GetSkelQuery(UsdSkel.BindingAPI(mesh).GetInheritedSkeleton())
    blending = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(mesh))
    rest = UsdGeom.Mesh(mesh).GetPointsAttr().Get()
    found = []
    for time in (time * stage.GetTimeCodesPerSecond() for time in task.times):
        points = Vt.Vec3fArray(rest)
        if skinning.HasBlendShapes():
            weights = skinning.GetBlendShapeMapper().Remap(
                skeleton.GetAnimQuery().ComputeBlendShapeWeights(time)
            )
            parts = blending.ComputeSubShapeWeights(weights)
            blending.ComputeDeformedPoints(
                *parts,
                blending.ComputeBlendShapePointIndices(),
                blending.ComputeSubShapePointOffsets(),
                points,
            )
        skinning.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(time), points, time)
        # In the space of the skeleton.
        found.append(placed(skeleton.GetPrim(), points, time))
    return {"rest": placed(mesh, rest, Usd.TimeCode.Default()), "points": found}


if __name__ == "__main__":
    main(".".join(map(str, Usd.GetVersion()[1:])), play)
