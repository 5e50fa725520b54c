# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's inverse kinematics constraints: their settings and bones, and their targets at a frame."""

from collections.abc import Collection

import bpy
import numpy as np
from mathutils import Matrix, Vector
from sinew_addon.base.errors import SinewError
from sinew_addon.io import spaces

from .chains import Posed, Tree
from .ik import Effector


def read_trees(armature: bpy.types.Object, only: Collection[str] | None = None) -> list[Tree]:
    """Returns the trees of bones that the IK constraints of an armature object pull, those nearest to the
    root first. Constraints whose chains begin at the same bone pull one tree, as in Blender.

    only  trees that contain one of these bones; None: all

    Raises SinewError where a constraint needs what Sinew does not support, and where there is no tree.
    """
    chains: dict[str, list[tuple[bpy.types.PoseBone, bpy.types.Constraint]]] = {}
    for bone in armature.pose.bones:
        constraint = _active(bone)
        if constraint is not None:
            chains.setdefault(_chain(bone, constraint)[0].name, []).append((bone, constraint))
    trees = [_tree(armature, pairs) for pairs in chains.values()]
    if only is not None:
        trees = [tree for tree in trees if not set(only).isdisjoint(tree.bones)]
    if not trees:
        of = "" if only is None else " that moves a selected bone"
        raise SinewError(
            f"{armature.name}: no inverse kinematics constraint{of}; add one (Pose > Inverse Kinematics), "
            "with a target"
        )
    for tree in trees:
        _check(armature, tree)
    return sorted(trees, key=lambda tree: len(armature.pose.bones[tree.bones[0]].parent_recursive))


def set_muted(armature: bpy.types.Object, names: Collection[tuple[str, str]], mute: bool) -> None:
    """Mutes or unmutes constraints. Missing ones are skipped."""
    for bone, name in names:
        owner = armature.pose.bones.get(bone)
        constraint = owner.constraints.get(name) if owner is not None else None
        if constraint is not None:
            constraint.mute = mute


def read_posed(armature: bpy.types.Object, tree: Tree) -> Posed:
    """Reads a tree, whose constraints are muted, from the evaluated scene. Raises SinewError where a target
    cannot be read."""
    graph = bpy.context.evaluated_depsgraph_get()
    evaluated = armature.evaluated_get(graph)
    goals, poles, influences = [], [], []
    for bone, name in tree.constraints:
        constraint = evaluated.pose.bones[bone].constraints[name]
        target = constraint.target.evaluated_get(graph)
        goals.append(_target(evaluated, target, constraint.subtarget))
        pole = Vector((0.0, 0.0, 0.0))
        if constraint.pole_target is not None:
            target = constraint.pole_target.evaluated_get(graph)
            pole = _target(evaluated, target, constraint.pole_subtarget).translation
        poles.append(pole)
        influences.append(constraint.influence)
    parent = evaluated.pose.bones[tree.bones[0]].parent
    return Posed(
        np.array([evaluated.pose.bones[name].matrix for name in tree.bones]),
        np.array(parent.matrix) if parent is not None else np.eye(4),
        np.array(goals),
        np.array(poles),
        np.array(influences),
    )


def _active(bone: bpy.types.PoseBone) -> bpy.types.Constraint | None:
    """Returns the one of a bone's IK constraints that Blender uses: the first with an influence."""
    found = [
        each
        for each in bone.constraints
        if each.type == "IK"
        and not each.mute
        and each.is_valid
        and each.target is not None
        and (each.target.type != "ARMATURE" or each.subtarget)
    ]
    return next((each for each in found if each.influence > 0.0), found[0] if found else None)


def _chain(bone: bpy.types.PoseBone, constraint: bpy.types.Constraint) -> list[bpy.types.PoseBone]:
    """Returns the chain from the root to the tip."""
    at = bone if constraint.use_tail or bone.parent is None else bone.parent
    chain = [at, *at.parent_recursive]
    count = constraint.chain_count
    return list(reversed(chain[:count] if count else chain))


def _tree(armature: bpy.types.Object, pairs: list[tuple[bpy.types.PoseBone, bpy.types.Constraint]]) -> Tree:
    chains = [_chain(bone, constraint) for bone, constraint in pairs]
    names = list(dict.fromkeys(bone.name for chain in chains for bone in chain))
    index = {name: number for number, name in enumerate(names)}
    bones = [armature.pose.bones[name] for name in names]
    effectors = []
    for chain, (_bone, constraint) in zip(chains, pairs, strict=True):
        effectors.append(
            Effector(
                index[chain[-1].name],
                constraint.weight if constraint.use_location else 0.0,
                constraint.orient_weight if constraint.use_rotation else 0.0,
                # As in Blender, a pole counts only where a position is wanted, and for a single constraint.
                len(pairs) == 1 and constraint.pole_target is not None and constraint.use_location,
                constraint.pole_angle,
            )
        )
    limits = np.full((len(bones), 3, 2), (-np.inf, np.inf))
    for bone, of in zip(bones, limits, strict=True):
        for axis, letter in enumerate("xyz"):
            if getattr(bone, f"use_ik_limit_{letter}"):
                of[axis] = getattr(bone, f"ik_min_{letter}"), getattr(bone, f"ik_max_{letter}")

    def of_axes(name: str) -> np.ndarray:
        return np.array([[getattr(bone, f"{name}_{letter}") for letter in "xyz"] for bone in bones])

    return Tree(
        tuple(names),
        np.array([index[b.parent.name] if b.parent and b.name != names[0] else -1 for b in bones], np.int32),
        np.array([bone.bone.matrix for bone in bones], dtype=np.float64),
        np.array([bone.bone.length for bone in bones]),
        of_axes("lock_ik"),
        limits,
        np.minimum(of_axes("ik_stiffness"), 0.99),
        tuple((bone.name, constraint.name) for bone, constraint in pairs),
        tuple(effectors),
    )


def _check(armature: bpy.types.Object, tree: Tree) -> None:
    """Raises SinewError for anything that would silently be lost or wrong."""
    for bone, own_name in tree.constraints:
        constraint = armature.pose.bones[bone].constraints[own_name]
        stretched = [name for name in tree.bones if armature.pose.bones[name].ik_stretch > 0.0]
        if constraint.use_stretch and stretched:
            raise SinewError(
                f"{armature.name}: {', '.join(stretched)} may stretch, which Sinew's bones do not; set IK "
                f"Stretch to 0, or switch Stretch off in {bone}'s constraint"
            )
        for target, part in (
            (constraint.target, constraint.subtarget),
            (constraint.pole_target, constraint.pole_subtarget),
        ):
            if target is not None and part and target.type != "ARMATURE":
                raise SinewError(
                    f"{armature.name}: {bone}'s target is a vertex group of {target.name}, which Sinew does "
                    "not follow; choose an object or a bone"
                )
    own = set(tree.constraints)
    for name in tree.bones:
        for constraint in armature.pose.bones[name].constraints:
            acts = not constraint.mute and constraint.influence > 0.0
            if acts and (name, constraint.name) not in own and constraint.type != "IK":
                raise SinewError(
                    f"{armature.name}: {name} has the constraint {constraint.name} besides, which Sinew does "
                    "not solve; mute it"
                )


def _target(armature: bpy.types.Object, target: bpy.types.Object, part: str) -> Matrix:
    """Returns the target in armature space; all arguments are evaluated."""
    if target.type != "ARMATURE" or not part:
        return spaces.bones_from_object(armature, target)
    bone = target.pose.bones.get(part)
    if bone is None:
        raise SinewError(
            f"{armature.name}: {target.name} has no bone {part!r}, an IK target; choose another one"
        )
    if target == armature:
        return bone.matrix.copy()
    return spaces.bones_from_object(armature, target) @ bone.matrix
