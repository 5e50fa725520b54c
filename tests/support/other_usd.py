# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays a .usdc by Pixar's UsdSkel, which bpy brings along; its own skinning, in double precision."""

import bpy
import numpy as np

bpy.utils.expose_bundled_modules()
from pxr import Usd, UsdGeom, UsdSkel  # noqa: E402, only there after the call


def points_at(path, frames):
    """float64 [vertices, 3] at rest and [frames, vertices, 3], world space, for the only skinned mesh."""
    stage = Usd.Stage.Open(str(path))
    cache = UsdSkel.Cache()
    (root,) = (prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))
    cache.Populate(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
    (prim,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    skinning = cache.GetSkinningQuery(prim)
    skeleton = cache.GetSkelQuery(UsdSkel.BindingAPI(prim).GetInheritedSkeleton())
    rest = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), dtype=np.float64)
    bind = _matrix(skinning.GetGeomBindTransform())
    joints, weights = skinning.ComputeVaryingJointInfluences(len(rest))
    width = skinning.GetNumInfluencesPerComponent()
    joints, weights = np.array(joints).reshape(-1, width), np.array(weights, np.float64).reshape(-1, width)
    weights /= weights.sum(axis=1, keepdims=True)
    # UsdSkel multiplies row vectors.
    bound = np.column_stack([rest, np.ones(len(rest))]) @ bind
    mapper, shapes = skinning.GetJointMapper(), []
    for frame in frames:
        motions = skeleton.ComputeSkinningTransforms(frame)
        if mapper is not None and not mapper.IsIdentity():
            motions = mapper.Remap(motions)
        motions = np.array([_matrix(each) for each in motions])
        skinned = np.einsum("vi,vk,vkij->vj", bound, weights, motions[joints])
        place = _matrix(UsdGeom.Imageable(skeleton.GetPrim()).ComputeLocalToWorldTransform(frame))
        shapes.append((skinned @ place)[:, :3])
    at_rest = _matrix(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(frames[0]))
    return (np.column_stack([rest, np.ones(len(rest))]) @ at_rest)[:, :3], np.array(shapes)


def _matrix(matrix):
    return np.array(matrix, dtype=np.float64).reshape(4, 4)
