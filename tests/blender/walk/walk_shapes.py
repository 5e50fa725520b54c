# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the shape of an object by a method and stages, from the data of a Blender without Sinew.

The evaluated mesh before the Armature modifiers, vertex groups, bones and poses are read here with little
code, and passed to the library. Does not support later modifiers, envelopes, bendy bones and keyed
visibility.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
import sinew
import walk_sides
import weld_reference
from sinew_addon.io import armature_io
from sinew_addon.skinning.influences import Influences
from sinew_addon.skinning.limbs import skin_of
from sinew_addon.skinning.vectors import transformed

# Parameters, by their full names.
DEFAULTS = {f"{m.name}.{p.id}": p.default for m in sinew.methods() for p in m.parameters}
# The Armature modifier treats smaller weights as none.
LEAST_WEIGHT = 1e-4


@dataclass
class _Influences:
    """The arguments of sinew.Binding for a mesh with one armature."""

    offsets: np.ndarray
    bones: np.ndarray
    weights: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.offsets, self.bones, self.weights


@dataclass
class _Armature:
    """motions           float64 [bones, 4, 4], armature space
    rest              float64 [bones, 4, 4]
    bones_from_model  float64 [4, 4]
    """

    influences: _Influences
    motions: np.ndarray
    rest: np.ndarray
    ends: tuple[np.ndarray, np.ndarray]
    bones_from_model: np.ndarray
    mask: np.ndarray | None
    multi: bool
    group_of_bone: list[int]


@dataclass
class _Read:
    """rest       float32 [vertices, 3], the input of the first Armature modifier
    own        the same for the mesh's own points; None if upstream modifiers give it other vertices
    sdef_keys  the same for the basis and SDEF's three keys, if it has these
    """

    rest: np.ndarray
    own: np.ndarray | None
    triangles: np.ndarray
    topology: tuple[np.ndarray, np.ndarray, np.ndarray]
    groups: dict[str, dict[int, float]]
    armatures: list[_Armature]
    sdef_keys: list[np.ndarray] | None


def expected(
    obj: bpy.types.Object,
    run: list[str],
    method: str,
    stages: Mapping[str, Mapping[str, Any]],
    parameters: Mapping[str, Any],
    render: bpy.types.Depsgraph | None = None,
) -> np.ndarray | None:
    """float32 [vertices, 3], object space; None if this file can not compute it.

    run         names of the Armature modifiers that Sinew replaces
    stages      the parameters of the enabled stages
    parameters  of methods, by their full names
    render      the evaluation for a render; None: that of the viewport
    """
    modifiers = list(obj.modifiers)
    places = [index for index, modifier in enumerate(modifiers) if modifier.name in run]
    shown = "show_viewport" if render is None else "show_render"
    if not places or not _is_known(obj, modifiers, places, shown):
        return None
    active = [modifiers[place] for place in places]
    active = [m for m in active if getattr(m, shown) and m.object is not None]
    is_moved = any(getattr(m, shown) for m in modifiers[: places[0]])
    if render is not None:
        if is_moved or obj.data.shape_keys is not None:
            # A render can not be evaluated without what deforms.
            return None
        read = _read(obj, obj.data, active, render)
    else:
        with _off(active):
            depsgraph = bpy.context.evaluated_depsgraph_get()
            read = _read(obj, obj.evaluated_get(depsgraph).data, active, depsgraph)
    if not active:
        return read.rest
    methods = (method, stages.get("mix", {}).get("method"))
    if read.own is None and not {"cor", "ddm"}.isdisjoint(methods):
        # Vertex data belongs to the input mesh.
        return None
    keys = obj.data.shape_keys
    if "sdef" in methods and keys is not None and (is_moved or not keys.use_relative):
        return None
    points = start_before = read.rest
    for armature in read.armatures:
        start = start_before if armature.multi else points
        start_before = start
        blended = _blend(armature, start, read, method, _mix(stages, read.groups), parameters)
        share = 1.0 if armature.mask is None else armature.mask[:, None]
        points = (points + share * (blended - points)).astype(np.float32)
    points = _limit(read, points, stages.get("bulge_limit"))
    return _mush(read, points, stages.get("delta_mush"))


@contextlib.contextmanager
def _off(modifiers: list[bpy.types.Modifier]) -> Iterator[None]:
    for modifier in modifiers:
        modifier.show_viewport = False
    yield
    for modifier in modifiers:
        modifier.show_viewport = True


def _is_known(
    obj: bpy.types.Object, modifiers: list[bpy.types.Modifier], places: list[int], shown: str
) -> bool:
    replaced = [modifiers[place] for place in places]
    return (
        obj.mode == "OBJECT"
        and not any(".show_" in path for path in walk_sides.animated_paths(obj))
        and obj.parent_type != "ARMATURE"
        and all(not getattr(m, shown) for m in modifiers[places[-1] + 1 :])
        and places == list(range(places[0], places[-1] + 1))
        and not any(m.use_bone_envelopes or not m.use_vertex_groups for m in replaced)
        and all(_is_plain(modifier.object) for modifier in replaced if modifier.object is not None)
    )


def _is_plain(rig: bpy.types.Object) -> bool:
    return not rig.data.is_editmode and not any(
        bone.bbone_segments > 1 or bone.use_envelope_multiply for bone in rig.data.bones
    )


def _triangles(mesh: bpy.types.Mesh) -> np.ndarray:
    mesh.calc_loop_triangles()
    corners = [tuple(triangle.vertices) for triangle in mesh.loop_triangles]
    return np.array(corners, dtype=np.int32).reshape(-1, 3)


def _topology(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    faces = [tuple(face.vertices) for face in mesh.polygons]
    edges = [tuple(edge.vertices) for edge in mesh.edges]
    offsets = np.cumsum([0, *map(len, faces)])
    corners = [vertex for face in faces for vertex in face]
    return (
        offsets.astype(np.int32),
        np.array(corners, dtype=np.int32),
        np.array(edges, dtype=np.int32).reshape(-1, 2),
    )


def _groups(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> dict[str, dict[int, float]]:
    """The weights of vertices by the name of the group, in the order in which vertices have them."""
    names = [group.name for group in obj.vertex_groups]
    found: dict[str, dict[int, float]] = {name: {} for name in names}
    for vertex in mesh.vertices:
        for element in vertex.groups:
            if element.group < len(names):
                found[names[element.group]][vertex.index] = element.weight
    return found


def _weights_of(groups: dict[str, dict[int, float]], name: str, count: int) -> np.ndarray | None:
    """float32 [vertices]; None without a group, or for a mesh without any weights."""
    if name not in groups or not any(groups.values()):
        return None
    weights = np.zeros(count, dtype=np.float32)
    weights[list(groups[name])] = list(groups[name].values())
    return weights


def _read(
    obj: bpy.types.Object,
    mesh: bpy.types.Mesh,
    modifiers: list[bpy.types.ArmatureModifier],
    depsgraph: bpy.types.Depsgraph,
) -> _Read:
    groups = _groups(mesh, obj)
    return _Read(
        walk_sides.points_of(mesh.vertices),
        walk_sides.points_of(obj.data.vertices) if len(mesh.vertices) == len(obj.data.vertices) else None,
        _triangles(obj.data),
        _topology(mesh),
        groups,
        [_read_armature(obj, mesh, modifier, groups, depsgraph) for modifier in modifiers],
        _sdef_keys(obj.data),
    )


def _sdef_keys(mesh: bpy.types.Mesh) -> list[np.ndarray] | None:
    blocks = {} if mesh.shape_keys is None else mesh.shape_keys.key_blocks
    names = ("mmd_sdef_c", "mmd_sdef_r0", "mmd_sdef_r1")
    if not all(name in blocks for name in names):
        return None
    of = (mesh.shape_keys.reference_key, *(blocks[name] for name in names))
    return [walk_sides.points_of(block.data) for block in of]


def _read_armature(
    obj: bpy.types.Object,
    mesh: bpy.types.Mesh,
    modifier: bpy.types.ArmatureModifier,
    groups: dict[str, dict[int, float]],
    depsgraph: bpy.types.Depsgraph,
) -> _Armature:
    rig = modifier.object.evaluated_get(depsgraph)
    bones = modifier.object.data.bones
    count = len(mesh.vertices)
    mask = _weights_of(groups, modifier.vertex_group, count)
    if mask is not None and modifier.invert_vertex_group:
        mask = 1.0 - mask
    posed = np.array([np.array(rig.pose.bones[bone.name].matrix) for bone in bones]).reshape(-1, 4, 4)
    rest = np.array([np.array(bone.matrix_local) for bone in bones]).reshape(-1, 4, 4)
    place = np.array(obj.evaluated_get(depsgraph).matrix_world)
    influences = _influences(mesh, [group.name for group in obj.vertex_groups], bones)
    space = np.linalg.inv(np.array(rig.matrix_world, dtype=np.float64)) @ place
    heads = np.array([bone.head_local[:] for bone in bones], dtype=np.float32).reshape(-1, 3)
    return _Armature(
        influences,
        posed.astype(np.float64) @ np.linalg.inv(rest.astype(np.float64)),
        rest,
        (heads, heads + _limbs(rig, mesh, influences, space)),
        space,
        mask,
        modifier.use_multi_modifier,
        [obj.vertex_groups.find(bone.name) for bone in bones],
    )


def _limbs(
    rig: bpy.types.Object, mesh: bpy.types.Mesh, influences: _Influences, space: np.ndarray
) -> np.ndarray:
    """Where the limb of each bone goes, which test_twist_spread and test_battery check."""
    bones, points = armature_io.read_bones(rig), walk_sides.points_of(mesh.vertices)
    everywhere = np.ones(len(bones.names), bool)
    skin = skin_of(Influences(*influences.arrays), transformed(points, space), everywhere)
    return replace(bones, skin=skin).limbs.vectors.astype(np.float32)


def _influences(mesh: bpy.types.Mesh, names: list[str], bones: bpy.types.bpy_prop_collection) -> _Influences:
    number = {bone.name: index for index, bone in enumerate(bones) if bone.use_deform}
    offsets, of, weights = [0], [], []
    for vertex in mesh.vertices:
        own = [(e.group, e.weight) for e in vertex.groups if e.group < len(names)]
        own = [(number[names[g]], weight) for g, weight in own if names[g] in number and weight > 0.0]
        if sum(weight for _bone, weight in own) > LEAST_WEIGHT:
            of += [bone for bone, _weight in own]
            weights += [weight for _bone, weight in own]
        offsets.append(len(of))
    return _Influences(np.array(offsets), np.array(of, dtype=np.int32), np.array(weights, dtype=np.float32))


def _mix(
    stages: Mapping[str, Mapping[str, Any]], groups: dict[str, dict[int, float]]
) -> tuple[str, dict[int, float]] | None:
    """The second method and its weights, or None."""
    mix = stages.get("mix")
    if mix is None or mix["group"] not in groups or not any(groups.values()):
        return None
    return mix["method"], groups[mix["group"]]


def _blend(
    armature: _Armature,
    points: np.ndarray,
    read: _Read,
    method: str,
    mix: tuple[str, dict[int, float]] | None,
    parameters: Mapping[str, Any],
) -> np.ndarray:
    influences = armature.influences.arrays
    shapes = []
    for name in (method,) if mix is None else (method, mix[0]):
        data = {}
        if name == "sdef":
            keys = read.sdef_keys
            data[name] = None if keys is None else _spheres(keys, armature)
        elif name == "cor":
            data[name] = sinew.centres_of_rotation(read.own, *influences, read.triangles).result()
        elif name == "ddm":
            data[name] = _moments(read, armature.influences, parameters)
        binding = sinew.Binding(points, *influences, rest_bones=armature.rest, vertex_data=data)
        shapes.append(
            sinew.Deformer(binding, name).deform(
                armature.motions,
                bones_from_model=armature.bones_from_model,
                parameters=parameters,
            )
        )
    if mix is None:
        return shapes[0]
    share = np.zeros((len(points), 1))
    share[list(mix[1]), 0] = list(mix[1].values())
    return shapes[0] + np.clip(share, 0.0, 1.0) * (shapes[1].astype(np.float64) - shapes[0])


def _spheres(keys: list[np.ndarray], armature: _Armature) -> np.ndarray:
    """Vertex data for sinew.Binding: R0 belongs to the bone whose vertex group comes first."""
    basis, centres, first, second = keys
    own, found = armature.influences, np.zeros((len(basis), 10), dtype=np.float32)
    for vertex in range(len(basis)):
        bones = own.bones[own.offsets[vertex] : own.offsets[vertex + 1]]
        ends = [first[vertex], second[vertex]]
        if len(bones) == 2 and armature.group_of_bone[bones[0]] > armature.group_of_bone[bones[1]]:
            ends.reverse()
        is_used = len(bones) == 2 and (centres[vertex] != basis[vertex]).any()
        found[vertex] = [*centres[vertex], *ends[0], *ends[1], float(is_used)]
    return found


def _limit(read: _Read, points: np.ndarray, options: Mapping[str, Any] | None) -> np.ndarray:
    """The shape by the first armature."""
    if options is None:
        return points
    armature = read.armatures[0]
    mask = _weights_of(read.groups, options["group"], len(points))
    if armature.mask is not None:
        whole = (armature.mask >= 1.0).astype(np.float32)
        mask = whole if mask is None else whole * mask
    stage = sinew.BulgeLimit(
        sinew.Binding(read.rest, *armature.influences.arrays),
        *armature.ends,
        bones_from_model=armature.bones_from_model,
        weights=mask,
    )
    return stage.apply(points, armature.motions, strength=options["strength"], form=options["form"])


def _mush(read: _Read, points: np.ndarray, options: Mapping[str, Any] | None) -> np.ndarray:
    if options is None:
        return points
    weights = _weights_of(read.groups, options["group"], len(points))
    if weights is not None and options["invert_group"]:
        weights = 1.0 - weights
    bound = {
        name: options[name] for name in ("iterations", "radius", "factor", "smooth_type", "pin_boundary")
    }
    rest = read.rest if read.own is None else read.own
    first = list(range(len(points)))
    if options["weld"] and read.own is not None:
        rows = [weld_reference.rows_of(*a.influences.arrays) for a in read.armatures]
        masks = [mask for mask in (weights, *(a.mask for a in read.armatures)) if mask is not None]
        first = weld_reference.standing_for(rest, *rows, *masks)

    def smooth(
        kept: list[int], start: np.ndarray, faces: list[list[int]], edges: np.ndarray, own: np.ndarray | None
    ) -> np.ndarray:
        offsets = np.cumsum([0, *map(len, faces)])
        corners = [vertex for face in faces for vertex in face]
        stage = sinew.DeltaMush(rest[kept], offsets, corners, edges, weights=own, **bound)
        return stage.apply(start, scale=options["scale"])

    offsets, corners, edges = read.topology
    faces = [corners[begin:end].tolist() for begin, end in itertools.pairwise(offsets)]
    return weld_reference.smoothed_by_places(smooth, first, points, faces, edges, weights)


def _moments(read: _Read, influences: _Influences, parameters: Mapping[str, Any]) -> np.ndarray:
    """The data of ddm: of each place, for all vertices that are one there."""
    options = DEFAULTS | parameters
    rows = weld_reference.rows_of(*influences.arrays)
    first = list(range(len(rows)))
    if options["ddm.weld"]:
        first = weld_reference.standing_for(read.own, rows)
    kept = sorted(set(first))
    place = np.searchsorted(kept, first)
    triangles = [each for each in place[read.triangles].tolist() if len(set(each)) == 3]
    offsets = np.cumsum([0, *(len(rows[vertex]) for vertex in kept)])
    bones, weights = np.array([pair for vertex in kept for pair in rows[vertex]]).reshape(-1, 2).T
    found = sinew.direct_delta_mush(
        read.own[kept],
        offsets,
        bones.astype(np.int32),
        weights.astype(np.float32),
        np.array(triangles, np.int32).reshape(-1, 3),
        options["ddm.radius"],
    ).result()
    of_places = [found[found[:, 0] == number] for number in range(len(kept))]
    of_vertices = [of_places[number].copy() for number in place]
    for vertex, own in enumerate(of_vertices):
        own[:, 0] = vertex
    return np.concatenate(of_vertices)
