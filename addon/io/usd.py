# SPDX-License-Identifier: GPL-3.0-or-later
"""USD, by Pixar's modules where Blender lends them, and what Blender's importer makes of animation."""

from importlib import import_module
from pathlib import Path
from typing import Any

import bpy
import numpy as np

ENDINGS = (".usd", ".usda", ".usdc", ".usdz")
# Of a pose and of channels: smaller differences are rounding of half floats.
_SAME = 1e-3


def has_pxr() -> bool:
    """Whether this Blender lends USD's Python modules, as from 4.4 on."""
    return hasattr(bpy.utils, "expose_bundled_modules")


def pxr(*names: str) -> list[Any]:
    """USD's modules of these names."""
    bpy.utils.expose_bundled_modules()
    return [import_module(f"pxr.{name}") for name in names]


def lost_in_import(path: Path) -> list[str]:
    """Returns a sentence for each skeleton whose animation Blender's importer changes (seen on 4.5 and 5.3):
    it leaves out a pose without time samples, and does not interpolate between the samples of a channel where
    another has one. None where this Blender has no USD for scripts."""
    if not has_pxr():
        return []
    usd, skel = pxr("Usd", "UsdSkel")
    stage = usd.Stage.Open(str(path))
    cache, found = skel.Cache(), []
    for prim in stage.Traverse():
        if prim.IsA(skel.Root):
            cache.Populate(skel.Root(prim), usd.PrimDefaultPredicate)
    for prim in stage.Traverse():
        query = cache.GetSkelQuery(skel.Skeleton(prim)) if prim.IsA(skel.Skeleton) else None
        animation = query.GetAnimQuery() if query else None
        if animation:
            found += [f"{prim.GetName()}: {each}" for each in _lost(stage, query, animation, usd, skel)]
    return found


def _lost(stage: Any, query: Any, animation: Any, usd: Any, skel: Any) -> list[str]:
    its = skel.Animation(animation.GetPrim())
    channels = [its.GetTranslationsAttr(), its.GetRotationsAttr(), its.GetScalesAttr()]
    times = sorted({time for channel in channels for time in channel.GetTimeSamples()})
    if not times:
        posed, rest = (np.array(query.ComputeJointLocalTransforms(0.0, at_rest)) for at_rest in (False, True))
        if posed.shape == rest.shape and np.abs(posed - rest).max(initial=0.0) > _SAME:
            return ["its pose has no time sample, and Blender's importer leaves it out; give it one"]
        return []
    values = []
    for kind in (usd.InterpolationTypeLinear, usd.InterpolationTypeHeld):
        stage.SetInterpolationType(kind)
        values.append([[_numbers(channel.Get(time)) for time in times] for channel in channels])
    stage.SetInterpolationType(usd.InterpolationTypeLinear)
    stepped = [
        channel.GetName()
        for channel, linear, held in zip(channels, *values, strict=True)
        if any(np.abs(a - b).max(initial=0.0) > _SAME for a, b in zip(linear, held, strict=True))
    ]
    if not stepped:
        return []
    return [
        f"its {' and '.join(stepped)} have no samples at some times of other channels, and Blender's "
        "importer does not interpolate there; write all channels at the same times"
    ]


def _numbers(value: Any) -> np.ndarray:
    """Of an array of vectors or quaternions, whose sign has no meaning."""
    if value is None or not len(value):
        return np.zeros((0, 3))
    if hasattr(value[0], "GetReal"):
        rows = np.array([[each.GetReal(), *each.GetImaginary()] for each in value], dtype=np.float64)
        return rows * np.where(rows[:, :1] < 0.0, -1.0, 1.0)
    return np.array(value, dtype=np.float64)
