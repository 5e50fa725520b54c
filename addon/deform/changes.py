# SPDX-License-Identifier: GPL-3.0-or-later
"""What an update of Blender's lists as changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy

from ..attach import node_group
from ..skinning.rig import Bones
from .events import others_precede

Find = Callable[[bpy.types.ID], bpy.types.ID | None]

_LISTS = (
    (bpy.types.Object, "objects"),
    (bpy.types.Mesh, "meshes"),
    (bpy.types.Key, "shape_keys"),
    (bpy.types.Armature, "armatures"),
)


def finder(event: str, function: Callable) -> Find:
    """Returns a function that finds the original of an evaluated object, mesh, shape key or armature,
    for use in `function`, which Blender calls at the event. The function returns None where another add-on's
    function may have deleted or renamed the original.

    Blender frees at once what a handler deletes, but goes on listing its evaluated copy. The `original` of
    that is a dangling pointer, and reading it can crash Blender.
    """
    return _by_name if others_precede(event, function) else lambda evaluated: evaluated.original


def _by_name(evaluated: bpy.types.ID) -> bpy.types.ID | None:
    name = next(name for kind, name in _LISTS if isinstance(evaluated, kind))
    library = evaluated.library
    return getattr(bpy.data, name).get((evaluated.name, library.filepath if library is not None else None))


@dataclass
class Changes:
    """The data touched since the last update, by session_uid.

    touched     objects, meshes and shape keys that were touched in any way
    objects     objects whose geometry was touched, or a setting that Blender evaluates nothing for, such as
                whether a modifier is on in renders
    moved       objects that were moved
    meshes      meshes whose own geometry was touched: points, weights, topology, shape keys; not those that
                only follow their shape keys' animation
    armatures   armatures whose bones may differ
    edited      the `objects` themselves, unless a change of frame touched them
    node_groups one of Sinew's node groups was touched
    structure   objects may have been added, removed or hidden
    frame       this is a change of frame
    complete    everything not listed is as it was at the last update; otherwise anything may have changed
    lost        something listed cannot be found, as a handler deleted or renamed it: any mesh may have
                changed
    after_step  these are the changes of an undo or redo step: what is listed was read anew, however little of
                it Blender reports as touched
    bones       those of armature objects, as read for this event
    """

    touched: set[int] = field(default_factory=set)
    objects: set[int] = field(default_factory=set)
    moved: set[int] = field(default_factory=set)
    meshes: set[int] = field(default_factory=set)
    armatures: set[int] = field(default_factory=set)
    edited: list[bpy.types.Object] = field(default_factory=list)
    node_groups: bool = False
    structure: bool = False
    frame: bool = False
    complete: bool = False
    lost: bool = False
    after_step: bool = False
    bones: dict[int, Bones] = field(default_factory=dict)

    @staticmethod
    def are_of_meshes_only(depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether nothing changed but meshes and what animation moves. For anything else that an artist
        changes about an object or its data, Blender also lists the mesh, the armature or the scene (seen on
        4.2 and 5.2)."""
        changed = depsgraph.id_type_updated
        return not (changed("ARMATURE") or changed("SCENE") or changed("COLLECTION"))

    @staticmethod
    def are_motion_only(depsgraph: bpy.types.Depsgraph) -> bool:
        return not depsgraph.id_type_updated("MESH") and Changes.are_of_meshes_only(depsgraph)

    @staticmethod
    def meshes_in(depsgraph: bpy.types.Depsgraph, original: Find) -> set[int] | None:
        """Returns the same as `meshes` without reading all updates, with GONE where one cannot be found; None
        where no mesh was touched in any way."""
        if not depsgraph.id_type_updated("MESH"):
            return None
        return _changed_meshes(depsgraph.updates, _uid_by(original))

    @classmethod
    def of_poses(cls, depsgraph: bpy.types.Depsgraph, original: Find) -> Changes | None:
        """Returns the changes where only poses changed, and perhaps bones at rest; None for any others.

        For whatever else an artist changes about a mesh object, Blender also lists the mesh, the scene or an
        action, or lists the object without a part that differs. It lists nothing more than for a pose where
        the same update changes the object's name, or a switch of a modifier for renders (seen on 4.2, 4.5 and
        5.2).
        """
        changes = cls(complete=True)
        for update in depsgraph.updates:
            is_object = isinstance(update.id, bpy.types.Object)
            if not (is_object or isinstance(update.id, bpy.types.Armature)):
                return None
            if not (update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading):
                return None
            found = original(update.id)
            if found is None:
                return None
            (changes.touched if is_object else changes.armatures).add(found.session_uid)
        return changes

    @classmethod
    def read(
        cls,
        depsgraph: bpy.types.Depsgraph,
        frame: bool,
        complete: bool,
        original: Find,
        after_step: bool = False,
    ) -> Changes:
        """original: as from finder()."""
        updates = depsgraph.updates
        meshes = _changed_meshes(updates, _uid_by(original)) - {GONE}
        changes = cls(frame=frame, complete=complete, after_step=after_step, meshes=meshes)
        for update in updates:
            what = update.id
            if isinstance(what, bpy.types.Scene | bpy.types.Collection):
                changes.structure = True
            elif isinstance(what, bpy.types.NodeTree):
                changes.node_groups |= bool(what.get(node_group.MARK))
            elif isinstance(what, bpy.types.Object | bpy.types.Mesh | bpy.types.Key | bpy.types.Armature):
                found = original(what)
                if found is None:
                    changes.structure, changes.complete, changes.lost = True, False, True
                else:
                    changes._add_update(update, found)
        return changes

    def _add_update(self, update: bpy.types.DepsgraphUpdate, original: bpy.types.ID) -> None:
        uid = original.session_uid
        if isinstance(original, bpy.types.Armature):
            self.armatures.add(uid)
            return
        self.touched.add(uid)
        if self.after_step and isinstance(original, bpy.types.Mesh):
            self.meshes.add(uid)
        if self.after_step and isinstance(original, bpy.types.Key):
            self.meshes.add(original.user.session_uid)
        if isinstance(original, bpy.types.Object):
            if update.is_updated_geometry and not self.frame:
                self.edited.append(original)
            if update.is_updated_geometry or not (update.is_updated_transform or update.is_updated_shading):
                self.objects.add(uid)
            if update.is_updated_transform:
                self.moved.add(uid)

    def add(self, other: Changes) -> None:
        """Adds the changes of another evaluation to these."""
        for name in ("touched", "objects", "moved", "meshes", "armatures"):
            getattr(self, name).update(getattr(other, name))
        for name in ("node_groups", "structure", "lost", "after_step"):
            setattr(self, name, getattr(self, name) or getattr(other, name))
        self.edited += other.edited
        self.complete &= other.complete


def names_of_changed_meshes(depsgraph: bpy.types.Depsgraph) -> set[str]:
    """Returns the full name of each mesh of Changes.meshes, read from evaluated data alone: handlers may have
    deleted the originals."""
    if not depsgraph.id_type_updated("MESH"):
        return set()
    return _changed_meshes(depsgraph.updates, lambda evaluated: evaluated.name_full)


# Stands for the session_uid of deleted data; Blender's are positive.
GONE = 0


def _uid_by(original: Find) -> Callable[[bpy.types.ID], int]:
    def uid(evaluated: bpy.types.ID) -> int:
        found = original(evaluated)
        return GONE if found is None else found.session_uid

    return uid


def _changed_meshes(updates: bpy.types.bpy_prop_collection, identity: Callable) -> set:
    """Returns the meshes whose own geometry was touched. Animated shape keys touch only the geometry of their
    mesh. Few edits do the same, and for these Blender does not list the keys (seen on 4.2 and 5.2)."""
    keys, meshes = set(), []
    for update in updates:
        if isinstance(update.id, bpy.types.Key):
            keys.add(identity(update.id))
        elif isinstance(update.id, bpy.types.Mesh) and update.is_updated_geometry:
            meshes.append((update.id, update.is_updated_shading or update.is_updated_transform))
    return {
        identity(mesh)
        for mesh, whole in meshes
        if whole or mesh.shape_keys is None or identity(mesh.shape_keys) not in keys
    }
