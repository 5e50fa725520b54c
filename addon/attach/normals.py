# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides whether Sinew can give an object its normals along with the points, and which. Changes nothing.

Blender then has them as free custom normals of the evaluated mesh and computes none. They draw the mesh as
Blender's own normals do. But downstream modifiers could move points and keep the normals, and anything that
copies the mesh with its attributes would copy them, too. And some of Blender's normals are then means of the
given ones (seen on 4.5 and 5.2): the normal of a face, and that of a vertex where the corners have their own.

Upstream modifiers are no obstacle if Sinew knows the faces and sharp edges that they make: these stay the
same, or are read again along with the weights. Weighted Normal and Normal Edit are not part of the upstream
proxy, so Sinew does not know their result.
"""

from enum import Enum
from functools import cache

import bpy

from ..base.phrases import phrase
from ..io import mesh_io
from ..skinning.shading import NO_NORMALS, GivenNormals
from . import node_group, properties, upstream_proxy
from .layout import Layout, Modifier
from .modifier_types import ONLY_DEFORM

# False: Sinew leaves normals of the setting By Sinew to Blender, which computes them when they are read.
are_used = True
# The node Set Mesh Normal can set free normals.
ARE_SUPPORTED = bpy.app.version >= (4, 5)
# Downstream, these neither read nor change normals, points and faces.
HARMLESS_DOWNSTREAM = {
    "COLLISION",
    "UV_PROJECT",
    "UV_WARP",
    "VERTEX_WEIGHT_EDIT",
    "VERTEX_WEIGHT_MIX",
    "VERTEX_WEIGHT_PROXIMITY",
}
# Upstream, these keep faces, sharp edges and custom normals: they move points at most.
_KEEPS_SHADING = {"UV_PROJECT", "UV_WARP"} | ONLY_DEFORM.difference(
    ("CLOTH", "COLLISION", "MESH_CACHE", "PARTICLE_SYSTEM", "SURFACE")
)
# These make the same faces and sharp edges whatever the points are, but other custom normals.
_KEEPS_FACES = {"ARRAY", "MASK", "MIRROR", "SOLIDIFY", "SUBSURF"}
# Modifiers and constraints that read another object's normals or copy its attributes, and their properties
# that name it.
READERS = {"BOOLEAN", "DATA_TRANSFER", "NODES", "SHRINKWRAP"}
_POINTERS = ("object", "collection", "target", "auxiliary_target")


class Kind(Enum):
    """The normals of a mesh, by what has to be computed for them."""

    VERTEX = "vertex"
    CORNER = "corner"  # some edges or faces are sharp
    CUSTOM = "custom"  # of corners, stored relative to the computed ones


def are_given(settings: properties.SinewSettings) -> bool:
    """Whether the settings let Sinew give an object its normals."""
    return settings.normals == properties.SKINNED_NORMALS or (
        are_used and settings.normals == properties.BY_SINEW
    )


def kind_of(mesh: bpy.types.Mesh, domain: str) -> Kind | None:
    """domain: as from domain_of()."""
    if domain and mesh_io.find_attribute(mesh, mesh_io.CUSTOM_NORMALS) is not None:
        return Kind.CUSTOM
    return {"POINT": Kind.VERTEX, "CORNER": Kind.CORNER}.get(domain)


def domain_of(mesh: bpy.types.Mesh) -> str:
    """Returns the domain of the normals that draw the mesh, POINT or CORNER. Empty where Blender has to
    compute them: for flat meshes, where giving normals saves no time, and for free custom normals."""
    if not ARE_SUPPORTED or mesh.is_editmode:
        return ""
    attribute = mesh_io.find_attribute(mesh, mesh_io.CUSTOM_NORMALS)
    if attribute is not None and (attribute.data_type, attribute.domain) != ("INT16_2D", "CORNER"):
        return ""
    domain = mesh.normals_domain
    return domain if domain in ("POINT", "CORNER") else ""


def given(obj: bpy.types.Object, now: Layout) -> tuple[GivenNormals, str]:
    """Returns the normals that Sinew gives a skinned object, and why Blender computes them although the user
    wants Sinew to, as a clause."""
    settings = properties.of(obj)
    domain = domain_of(obj.data) if are_given(settings) else ""
    reason = (_obstacle(obj, now) or ("its heat map is shown" if settings.heat else "")) if domain else ""
    if not domain or reason:
        return NO_NORMALS, reason
    are_skinned = settings.normals == properties.SKINNED_NORMALS
    # A downstream modifier that is on in renders alone can need Blender's.
    return GivenNormals(domain, are_skinned, bool(_needing(now, in_renders=True))), ""


def _obstacle(obj: bpy.types.Object, now: Layout) -> str:
    """Returns why Blender has to compute the normals, as a clause; empty where it need not."""
    known = _known_upstream(obj, now)
    for modifier in now.ahead:
        if modifier.kind not in known and modifier.can_be_on:
            return phrase("{name} is in front", name=modifier.name)
    for modifier in _needing(now, in_renders=False):
        return phrase("{name} follows", name=modifier.name)
    if obj.instance_type != "NONE":
        return "it has instances on its vertices or faces"
    if is_read_by_others(obj):
        return "another object reads its mesh"
    return ""


def _known_upstream(obj: bpy.types.Object, now: Layout) -> set[str]:
    """Returns the types of upstream modifiers whose result Sinew reads often enough."""
    if upstream_proxy.changes_weights(now):
        # Then everything is read again in each frame that changes it.
        return _KEEPS_SHADING | _KEEPS_FACES | upstream_proxy.WEIGHT_CHANGERS
    has_custom = mesh_io.find_attribute(obj.data, mesh_io.CUSTOM_NORMALS) is not None
    return _KEEPS_SHADING if has_custom else _KEEPS_SHADING | _KEEPS_FACES


def _needing(now: Layout, in_renders: bool) -> list[Modifier]:
    """Returns the downstream modifiers that need or change normals and can be on."""
    return [
        each
        for each in now.behind
        if each.kind not in HARMLESS_DOWNSTREAM
        # With 0 levels a Subdivision modifier is off.
        and (any(each.keyed) or (each.shown[in_renders] and each.levels[in_renders] != 0))
    ]


def may_read_meshes(obj: bpy.types.Object) -> bool:
    """Whether one of its modifiers or constraints can read another object's normals or attributes."""
    return any(
        each.type in READERS and not (each.type == "NODES" and node_group.is_sinew(each))
        for each in (*obj.modifiers, *obj.constraints)
    )


def is_read_by_others(obj: bpy.types.Object) -> bool:
    """Whether another object reads, or may read, its evaluated mesh, directly or through a collection."""
    sources = {obj, *_collections_of(obj)}
    users = {user for source in sources for user in users_of_all().get(source, ())} - {obj}
    return any(_reads(user, sources) for user in users)


@cache
def users_of_all() -> dict[bpy.types.ID, set[bpy.types.ID]]:
    """Returns who uses each object, mesh and so on, without Sinew's helpers, and without the copies of a
    comparison, which do not read their originals. Found once: each event clears the cache."""
    own = {obj for obj in bpy.data.objects if properties.is_helper(obj) or properties.is_copy(obj)}
    return {used: users - own for used, users in bpy.data.user_map().items()}


def _collections_of(obj: bpy.types.Object) -> set[bpy.types.Collection]:
    """Returns the collections that it is in, and the parents of these."""
    found, known = set(obj.users_collection), set()
    while found:
        known |= found
        found = {c for c in bpy.data.collections if any(child in found for child in c.children)} - known
    return known


def _reads(user: bpy.types.ID, sources: set[bpy.types.ID]) -> bool:
    # Hair curves refer to the mesh that they grow on.
    if isinstance(user, bpy.types.GeometryNodeTree | bpy.types.ParticleSettings | bpy.types.Curves):
        return True
    if not isinstance(user, bpy.types.Object):
        return False
    bones = user.pose.bones if user.pose is not None else ()
    constraints = [*user.constraints, *(each for bone in bones for each in bone.constraints)]
    readers = [each for each in (*user.modifiers, *constraints) if each.type in READERS]
    # Any Geometry Nodes group counts, as its inputs can be of any kind.
    return any(
        (each.type == "NODES" and not node_group.is_sinew(each))
        or any(getattr(each, name, None) in sources for name in _POINTERS)
        for each in readers
    )
