# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read from an object once, to deform it on every frame: mesh, weights, bones, modifiers' options."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..attach import attach, properties, stage_settings
from ..attach.layout import Layout
from ..attach.modifier_options import ModifierOptions
from ..attach.properties import METHODS
from ..base.phrases import phrase
from ..io import armature_io, spaces
from ..io.actions import animated_paths
from ..skinning import sdef
from ..skinning.arrays import are_equal
from ..skinning.rig import Bones, Weighting
from ..skinning.shading import GivenNormals
from ..skinning.skin_stack import ModifierSkin, SkinDeformer, SkinStack
from ..skinning.stage_mesh import StageMesh
from ..skinning.stages import StagesAfter
from ..skinning.vertex_data import VertexData
from . import source
from .source import Source


@dataclass(frozen=True)
class Bound:
    """It is replaced where any of it may be out of date; one that is bound to the same modifiers, bones and
    weights keeps the skin stack, with what that has computed.

    armatures   the session_uid of each Armature modifier's armature, 0 for none
    options     of each Armature modifier
    source      rest points and weights
    skin_stack  deforms them: one stage for each Armature modifier, then those of the library's list
    groups      the vertex group of each stage of the library's list that has one, by the stage's name
    """

    armatures: list[int]
    options: list[ModifierOptions]
    source: Source
    skin_stack: SkinStack
    groups: dict[str, str]

    def is_of_another_stack(self, other: Bound | None) -> bool:
        """Whether modifiers, bones or weights differ from the other's: more than the rest points."""
        return other is None or self.skin_stack is not other.skin_stack

    def take_over(self, old: Bound) -> None:
        """Has the skin stack, if it is the old one's, work with the surface that was read since. Called under
        the lock of what deforms by it."""
        if self.is_of_another_stack(old):
            return
        skins = self.skin_stack.skins
        for skin in () if self.source.has_same_surface(old.source) else skins:
            skin.deformer.vertex_data = _vertex_data(skin.deformer.weighting, self.source, skin)
        self.skin_stack.set_stage_mesh(_stage_mesh(self.source, skins))

    @property
    def data_versions(self) -> list[int]:
        """The version of the methods' vertex data, for each Armature modifier."""
        data = (skin.deformer.vertex_data for skin in self.skin_stack.skins)
        return [0 if each is None else each.version for each in data]

    def lacks(self, methods: Iterable[str]) -> list[str]:
        """Returns a sentence for each of the methods that has to work without something that the mesh
        lacks."""
        lacks_keys = sdef.METHOD in methods and self.source.sdef_keys is None
        triangles = self.source.triangles
        return [
            *([sdef.LACKS_KEYS] if lacks_keys else []),
            *(
                phrase(
                    "The mesh has no faces, which {method} needs: its vertices are blended linearly",
                    method=phrase(METHODS[name].label),
                )
                for name in methods
                if name in METHODS and "topology" in METHODS[name].needs
                if triangles is not None and not len(triangles)
            ),
        ]

    def write_normals(
        self, points: np.ndarray, rest_points: np.ndarray, given: GivenNormals, out: np.ndarray
    ) -> None:
        """Computes the normals that belong to the points.

        points       float32 [vertices, 3], the shape of the last frame
        rest_points  float32 [vertices, 3], the points it was deformed from
        out          float32 [vertices or corners, 3], C-contiguous; zeros, which mean no normals, where the
                     mesh from upstream has normals of another domain
        """
        source = self.source
        if source.from_upstream and source.normals_domain != given.domain:
            out[:] = 0.0
            return
        if given.are_skinned:
            vertices = None if given.domain == "POINT" else source.topology.corner_vertices
            rest_normals = source.rest_normals(rest_points, given.domain)
            if self.skin_stack.write_skinned_normals(points, rest_normals, vertices, out):
                return
        source.normals.write(points, given.domain, out)

    @property
    def first_deformer(self) -> SkinDeformer:
        """Deforms by the first Armature modifier."""
        return self.skin_stack.skins[0].deformer


def read(
    obj: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    now: Layout,
    old: Bound | None = None,
    has_same_bones: bool = False,
) -> Bound:
    """Reads the object. Binds again only what has changed; the skin stack is the old one where modifiers,
    bones and weights have not. Returns `old` itself where nothing has.

    now             the object's layout
    old             given where neither modifiers nor their options changed since
    has_same_bones  its armatures are known to have the bones of `old`

    Requires source.is_ready().
    """
    read_now = source.read(obj, depsgraph, needs_surface(obj), None if old is None else old.source)
    groups = stage_settings.vertex_groups(properties.of(obj))
    if old is not None and has_same_bones and read_now is old.source and old.groups == groups:
        return old
    pairs = attach.replaced_modifiers(obj, now)
    known = (
        [] if old is None or not has_same_bones else [skin.deformer.bones for skin in old.skin_stack.skins]
    )
    if len(known) == len(pairs) and all(each.skin is None for each in known):
        bones = known
    else:
        bones = [_read_bones(replaced.armature, depsgraph) for _modifier, replaced in pairs]
    spaces_now = [_bones_from_model(obj, replaced.armature, depsgraph) for _modifier, replaced in pairs]
    if old is not None and old.groups == groups and _equals_but_for_points(old, read_now, bones, spaces_now):
        return replace(old, source=read_now)
    options = _options_of(obj, now, depsgraph)
    masks = _masks(read_now, groups)
    skins = []
    before = () if old is None else old.skin_stack.skins
    for option, its_bones, space, its_old in itertools.zip_longest(options, bones, spaces_now, before):
        if option is None:
            break
        its_known = None if its_old is None else its_old.deformer.bones
        if its_known is not None and its_known.skin is None and its_bones.equals(its_known):
            # With all that was made of them.
            its_bones = its_known
        weighting = option.weighting(read_now.group_names, read_now.weights, its_bones)
        weighting = weighting.with_skin(read_now.surface_points, space)
        deformer = SkinDeformer(weighting, masks.get("mix"), _vertex_data(weighting, read_now, its_old))
        skins.append(
            ModifierSkin(deformer, option.mask_weights(read_now.group_names, read_now.weights), option.multi)
        )
    armatures = [uid(replaced.armature) for _modifier, replaced in pairs]
    skin_stack = SkinStack(skins, StagesAfter(_stage_mesh(read_now, skins), masks))
    return Bound(armatures, options, read_now, skin_stack, groups)


def _vertex_data(weighting: Weighting, read_now: Source, before: ModifierSkin | None) -> VertexData:
    """before: the skin of the same modifier as it was last bound."""
    old = None if before is None else before.deformer.vertex_data
    given = {}
    if read_now.sdef_keys is not None:
        basis, *keys = read_now.sdef_keys
        groups = sdef.group_of_bone(weighting.bones.names, read_now.group_names)
        influences = weighting.entries.influences()
        given[sdef.METHOD] = sdef.vertex_data(basis, np.array(keys), influences, groups)
    return VertexData(weighting, read_now.surface_points, read_now.triangles, read_now.stored, old, given)


def lacks_surface(obj: bpy.types.Object, bound: Bound) -> bool:
    """Whether a method that needs the mesh's triangles was chosen since."""
    return bound.source.triangles is None and needs_surface(obj)


def is_of_other_modifiers(
    obj: bpy.types.Object, now: Layout, bound: Bound, depsgraph: bpy.types.Depsgraph
) -> bool:
    """Whether it was bound to other armatures, options or vertex groups of stages."""
    pairs = attach.replaced_modifiers(obj, now)
    return (
        bound.armatures != [uid(replaced.armature) for _modifier, replaced in pairs]
        or bound.options != _options_of(obj, now, depsgraph)
        or bound.groups != stage_settings.vertex_groups(properties.of(obj))
    )


def _options_of(obj: bpy.types.Object, now: Layout, depsgraph: bpy.types.Depsgraph) -> list[ModifierOptions]:
    """Returns those of each Armature modifier at this evaluation."""
    evaluated = obj.evaluated_get(depsgraph).modifiers
    return [
        # Of a hidden object, what the artist changes is not evaluated.
        skin.armature.options or ModifierOptions.read(evaluated.get(skin.name, obj.modifiers[skin.name]))
        for skin in now.skins
    ]


def uid(data: bpy.types.ID | None) -> int:
    """Returns the session_uid, or 0 for None."""
    return 0 if data is None else data.session_uid


def _equals_but_for_points(
    old: Bound, read_now: Source, bones: list[Bones], spaces_now: list[np.ndarray | None]
) -> bool:
    known = [skin.deformer.weighting for skin in old.skin_stack.skins]
    # Where a bone is the mesh's parent, poses move its space: the one in which it was bound decides.
    has_same_skin = are_equal(read_now.surface_points, old.source.surface_points)
    return read_now.has_same_weights(old.source) and all(
        now.equals(before.bones) and (has_same_skin or _has_same_limbs(before, read_now, space))
        for now, before, space in zip(bones, known, spaces_now, strict=False)
    )


def _has_same_limbs(before: Weighting, read_now: Source, space: np.ndarray | None) -> bool:
    """Whether the limbs of bones, some of which only their skin tells, are where they were."""
    known = before.bones.limbs
    if not known.by_skin.any():
        return True
    now = before.with_skin(read_now.surface_points, space).bones.limbs
    return are_equal(now.vectors, known.vectors) and are_equal(now.known, known.known)


def _bones_from_model(
    obj: bpy.types.Object, armature: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph
) -> np.ndarray | None:
    return None if armature is None else spaces.bones_from_model_in(depsgraph, obj, armature)


def _masks(read_now: Source, groups: dict[str, str]) -> dict[str, np.ndarray]:
    """Returns float32 [vertices], 0 to 1, by the stage's name. As with Blender's modifiers, there is no mask
    for a missing group or for a mesh without weights."""
    names, weights = read_now.group_names, read_now.weights
    return {
        stage: weights.of_group(names.index(name))
        for stage, name in groups.items()
        if name in names and len(weights.groups) > 0
    }


def _stage_mesh(read_now: Source, skins: list[ModifierSkin]) -> StageMesh:
    weightings = [skin.deformer.weighting for skin in skins]
    masks = [skin.mask for skin in skins]
    return StageMesh(read_now.topology, read_now.own_points, weightings, masks, skins[0].deformer.mix_weights)


def _read_bones(armature: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> Bones:
    if armature is None or armature.data.is_editmode:
        return Bones.none()
    return armature_io.read_current_bones(armature, depsgraph)


def methods_of(obj: bpy.types.Object) -> list[str]:
    """Returns the methods that its settings name now, each once."""
    settings = properties.of(obj)
    named = dict.fromkeys([settings.method, settings.mixed_method, *settings.methods])
    return [name for name in named if name in METHODS]


def is_method_animated(obj: bpy.types.Object) -> bool:
    """Whether keys or drivers choose one of the methods."""
    return any(path.startswith("sinew.") and path.endswith("method") for path in animated_paths(obj))


def needs_surface(obj: bpy.types.Object) -> bool:
    """Whether one of its methods needs the mesh's triangles. If methods are animated, any could be chosen."""
    return any("topology" in METHODS[name].needs for name in methods_of(obj)) or is_method_animated(obj)
