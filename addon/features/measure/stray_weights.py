# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds weights of bones where these should have none, over all meshes of a character, without a pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...attach import attach
from ...io import mesh_io
from ...skinning.influences import joined as influences_of_all
from ...skinning.surface import joined
from ...skinning.vectors import transformed
from .character import SAME_PATCH, Character, share_in
from .diagnostics import Finding
from .limits import LIMITS
from .rigs import Rig, rig_in, skeleton_of
from .subjects import Edited
from .weight_check import WeightCheck


def stray_weights(meshes: Sequence[Edited]) -> list[list[Finding]]:
    """Returns those of each mesh, one for each bone and patch.

    meshes  of one character or of several, with points at rest
    """
    found: list[list[Finding]] = [[] for _mesh in meshes]
    character = _character(meshes)
    known = np.zeros((len(character.skeleton.names), character.surface.vertex_count), bool)
    numbers = {mesh.obj.name: number for number, mesh in enumerate(meshes)}
    for value in WeightCheck(character).stray():
        limit, own = LIMITS[value.name], known[value.bone]
        if not limit.is_beyond(value.value) or share_in(own, value.vertices) >= SAME_PATCH:
            continue
        own[value.vertices] = True
        bone = character.skeleton.names[value.bone]
        for name, vertices in character.by_mesh(value.vertices).items():
            finding = Finding(value.name, limit.label, vertices, limit.meaning, limit.advice, bone=bone)
            found[numbers[name]].append(finding)
    return found


def _character(meshes: Sequence[Edited]) -> Character:
    rigs: dict[int, Rig] = {}
    own = []
    for mesh in meshes:
        armature = attach.armature_of(mesh.obj)
        own.append(rig_in(rigs, armature, mesh.weighting.bones, np.array(armature.matrix_world)))
    influences = [mesh.weighting.influences_over_joints(mesh.rest_points) for mesh in meshes]
    return Character(
        joined([mesh_io.read_surface(mesh.obj.data) for mesh in meshes]),
        np.concatenate(
            [transformed(mesh.rest_points, rig.world) for mesh, rig in zip(meshes, own, strict=True)]
        ),
        influences_of_all(influences, [len(mesh.weighting.bones.rest) for mesh in meshes]),
        np.concatenate(
            [mesh.weighting.bones.owners + rig.first for mesh, rig in zip(meshes, own, strict=True)]
        ),
        skeleton_of(list(rigs.values())),
        [(mesh.obj.name, len(mesh.rest_points)) for mesh in meshes],
    )
