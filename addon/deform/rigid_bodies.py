# SPDX-License-Identifier: GPL-3.0-or-later
"""Deforming rigid bodies of source Deform.

Blender builds the simulation at its second frame, beside the evaluation of its objects. A mesh whose
modifiers are still being evaluated has no deformed mesh then: it becomes a box, which stays at rest. Any
modifier of Geometry Nodes that takes some time brings that about, without Sinew too, on two processors or
more (seen on 4.2.23, 4.5.15 and 5.3.0; RIGIDBODY_REBUILD in Blender's dependency graph waits for no
geometry). So Blender makes these shapes again, which it does where the geometry is ready.
"""

from collections.abc import Iterable

import bpy


def make_again(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object]) -> None:
    """Called after a change of frame of a scene with rigid bodies. Where Blender has just built the
    simulation, it makes the shapes of these objects again at the next step; not those of one that is
    baked."""
    cache = scene.rigidbody_world.point_cache
    if scene.frame_current == cache.frame_start + 1 and not cache.is_baked:
        for obj in objects:
            body = obj.rigid_body
            if body is not None and body.use_deform and body.mesh_source == "DEFORM":
                body.collision_shape = body.collision_shape
