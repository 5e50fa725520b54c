# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says changed in an update."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy


@dataclass
class Changes:
    """The data touched since the last update, by session_uid.

    touched    objects and meshes that were touched in any way
    objects    whose geometry was touched
    moved      that were moved
    gated      whose modifiers rested, which touches their geometry and mesh
    meshes     whose geometry was touched: points, weights, topology, shape keys
    armatures  whose bones may differ
    structure  objects may have come, gone or been hidden
    frame      this is a change of frame
    complete   whatever is not listed is as it was at the last update; else all may have changed
    """

    touched: set[int] = field(default_factory=set)
    objects: set[int] = field(default_factory=set)
    moved: set[int] = field(default_factory=set)
    gated: set[int] = field(default_factory=set)
    meshes: set[int] = field(default_factory=set)
    armatures: set[int] = field(default_factory=set)
    structure: bool = False
    frame: bool = False
    complete: bool = False

    @staticmethod
    def are_of_meshes_only(depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether nothing changed but meshes, and what animation moves: all that an artist changes of an
        object or of its data makes Blender list the mesh, the armature or the scene, too (seen on 4.2 and
        5.2)."""
        changed = depsgraph.id_type_updated
        return not (changed("ARMATURE") or changed("SCENE") or changed("COLLECTION"))

    @staticmethod
    def are_motion_only(depsgraph: bpy.types.Depsgraph) -> bool:
        return not depsgraph.id_type_updated("MESH") and Changes.are_of_meshes_only(depsgraph)

    @staticmethod
    def meshes_in(depsgraph: bpy.types.Depsgraph) -> set[int] | None:
        """Those whose geometry was touched, by session_uid, without reading all the rest; None where no mesh
        was touched in any way."""
        if not depsgraph.id_type_updated("MESH"):
            return None
        return {
            update.id.original.session_uid
            for update in depsgraph.updates
            if update.is_updated_geometry and isinstance(update.id, bpy.types.Mesh)
        }

    @classmethod
    def read(cls, depsgraph: bpy.types.Depsgraph, frame: bool, complete: bool) -> Changes:
        changes = cls(frame=frame, complete=complete)
        for update in depsgraph.updates:
            what = update.id
            if isinstance(what, bpy.types.Object):
                uid = what.original.session_uid
                changes.touched.add(uid)
                if update.is_updated_geometry:
                    changes.objects.add(uid)
                if update.is_updated_transform:
                    changes.moved.add(uid)
            elif isinstance(what, bpy.types.Mesh):
                uid = what.original.session_uid
                changes.touched.add(uid)
                if update.is_updated_geometry:
                    changes.meshes.add(uid)
            elif isinstance(what, bpy.types.Armature):
                changes.armatures.add(what.original.session_uid)
            elif isinstance(what, bpy.types.Scene | bpy.types.Collection):
                changes.structure = True
        return changes
