# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of bones that Sinew solves live, in place of Blender's IK constraints.

Each such tree has a follower: an armature object with the same bones, in no scene. It is needed as bones can
depend on other objects' bones, but not on what is computed from their own channels. Each tree has its own, as
Blender evaluates all drivers of an object where it evaluates one.
- A driver of the follower depends on everything that the tree's pose depends on: its bones' own channels, the
  tree's parent bone, targets and poles. Its last variable reads a property whose getter solves the tree
  (ik_in_depsgraph) and writes the follower's channels.
- Each bone copies its pose from the follower's by a constraint, so children, meshes and renders get it in the
  same evaluation.
- Blender's constraints are muted. Their settings still define the problem.

All this is part of Blender's own graph: no handler acts at a change of frame. A saved file has none of it,
and Blender's constraints play; the bones store which of them Sinew solves (ik_records).
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from contextlib import contextmanager

import bpy

from ...attach import references
from ...core import ik as core
from ...core.errors import SinewError
from ...deform import safe_mode
from ...io import ik_io
from .ik_checks import check_not_switched
from .ik_records import live_constraints

SAFE_MODE = "Safe mode: Blender's own constraints play"


class _Session:
    """What is known of armatures, by their session_uid."""

    def __init__(self) -> None:
        # The trees, and the result of _state() for them.
        self.attached: dict[int, tuple[list[core.Tree], list]] = {}
        # Why constraints that Sinew should solve are not solved live; until the settings change, or for good.
        self.problems: dict[int, str] = {}
        self.failed: set[int] = set()
        self.suspended: set[int] = set()
        # Armatures whose follower was made or changed since Blender's last undo step, so that no step has it.
        self.in_no_step: set[int] = set()
        # The followers that existed before an undo step.
        self.before_step: set[int] = set()


_session = _Session()


def is_live(armature: bpy.types.Object) -> bool:
    """Whether it is switched on for any tree, even if it does not work now."""
    return armature.type == "ARMATURE" and bool(live_constraints(armature))


def was_switched_on(armature: bpy.types.Object) -> bool:
    """Whether bones may follow: it was switched on for a tree, whose bones may be deleted since."""
    return armature.type == "ARMATURE" and armature.sinew_ik_is_live


def problem_of(armature: bpy.types.Object) -> str:
    """Returns why Blender's constraints play although Sinew is switched on, in one sentence; otherwise ""."""
    if not is_live(armature):
        return ""
    return SAFE_MODE if safe_mode.is_on() else _session.problems.get(armature.session_uid, "")


def switch_on(armature: bpy.types.Object, only: Collection[str] | None = None) -> list[core.Tree]:
    """Solves the trees of these bones, or all, live from now on. Raises SinewError where that is not
    possible."""
    live = live_constraints(armature)
    trees = ik_io.read_trees(armature, only, live)
    check(armature, trees)
    check_apart([*trees, *(ik_io.read_trees(armature, list(live), live) if live else ())])
    armature.sinew_ik_is_live = True
    for tree in trees:
        for bone, name in tree.constraints:
            armature.pose.bones[bone].sinew_ik_live = name
    _session.failed.discard(armature.session_uid)
    _session.attached.pop(armature.session_uid, None)
    sync(armature)
    return trees


def switch_off(armature: bpy.types.Object, only: Collection[str] | None = None) -> None:
    """Lets Blender's constraints play again, for the trees of these bones or for all; with the last tree,
    everything made for it is removed."""
    live = live_constraints(armature)
    detach(armature)
    try:
        trees = ik_io.read_trees(armature, only)
        meant = {bone for tree in trees for bone, _name in tree.constraints}
    except SinewError:
        meant = set(live)
    for bone in live if only is None else meant.intersection(live):
        armature.pose.bones[bone].sinew_ik_live = ""
    sync(armature)


@contextmanager
def suspended(armature: bpy.types.Object) -> Iterator[None]:
    """Context in which Blender's constraints play, as if nothing were live."""
    uid = armature.session_uid
    _session.suspended.add(uid)
    detach(armature)
    try:
        yield
    finally:
        _session.suspended.discard(uid)
        sync(armature)


def forget() -> None:
    """Forgets what was known of the file's objects."""
    _session.attached.clear()
    _session.problems.clear()
    _session.failed.clear()


def remove_unrecorded() -> None:
    """Called before undo: removes references to what is in no undo step (references)."""
    for armature in [obj for obj in bpy.data.objects if obj.session_uid in _session.in_no_step]:
        detach(armature)
        remove_followers(armature)
    _session.before_step = {follower.session_uid for follower in _all_followers()}
    note_step()


def remove_returned() -> None:
    """Called after undo: removes followers that it restored. A view layer that was not shown would use its
    evaluated copy of the deleted follower, which writes to bones that are gone (4.2 to 5.2). sync() makes new
    ones."""
    for follower in _all_followers():
        if follower.session_uid not in _session.before_step:
            _remove(follower)


def note_step() -> None:
    """Notes that everything that exists now will be in the next undo step."""
    _session.in_no_step.clear()


def fail(armature: bpy.types.Object, text: str) -> bool:
    """Notes that it could not be solved: Blender's constraints play until it is switched on again. Returns
    whether Sinew's played."""
    _session.failed.add(armature.session_uid)
    _session.problems[armature.session_uid] = text
    return detach(armature)


def check(armature: bpy.types.Object, trees: list[core.Tree]) -> None:
    """Raises SinewError for what cannot be solved live."""
    if not armature.is_editable:
        raise SinewError(f"{armature.name} is linked: only in its own file is inverse kinematics live")
    if armature.override_library is not None:
        raise SinewError(
            f"{armature.name} is a library override, whose bones can not follow what Sinew solves; bake it "
            "instead, or make it local (Object > Relations > Make Local)"
        )
    check_not_switched(armature, trees)
    for tree in trees:
        for constraint, (bone, _name) in zip(
            ik_io.constraints_of(armature, tree), tree.constraints, strict=True
        ):
            for target, part in (
                (constraint.target, constraint.subtarget),
                (constraint.pole_target, constraint.pole_subtarget),
            ):
                wanted = armature.pose.bones.get(part) if target == armature and part else None
                above = () if wanted is None else (wanted, *wanted.parent_recursive)
                if any(each.name in tree.bones for each in above):
                    raise SinewError(
                        f"{armature.name}: {bone}'s target {part} hangs on the chain that it pulls; choose "
                        "another one"
                    )


def check_apart(trees: list[core.Tree]) -> None:
    """Raises SinewError where trees share a bone, as it can follow only one."""
    roots: dict[str, str] = {}
    for tree in trees:
        for bone in tree.bones:
            if roots.setdefault(bone, tree.bones[0]) != tree.bones[0]:
                raise SinewError(
                    f"{bone} is pulled by chains that begin at different bones, {roots[bone]} and "
                    f"{tree.bones[0]}; have them begin at one (Chain Length), or bake them"
                )


def sync(armature: bpy.types.Object) -> bool:
    """Updates an armature's constraints and its followers to what is switched on. Returns whether any
    changed."""
    uid = armature.session_uid
    trees, state = _session.attached.get(uid, ([], []))
    if trees and not safe_mode.is_on() and _state(armature, trees) == state:
        return False
    _drop_what_the_artist_switched_off(armature)
    live = live_constraints(armature)
    may_run = not (safe_mode.is_on() or uid in _session.failed or uid in _session.suspended)
    if not live:
        return _end(armature)
    if not (may_run and armature.is_editable):
        return detach(armature)
    try:
        trees = ik_io.read_trees(armature, list(live), live)
        check(armature, trees)
        check_apart(trees)
        _attach(armature, trees)
    except SinewError as error:
        _session.problems[uid] = str(error)
        return detach(armature)
    _session.problems.pop(uid, None)
    _session.attached[uid] = trees, _state(armature, trees)
    return True


def _end(armature: bpy.types.Object) -> bool:
    """Removes everything made for trees of which none is left. Returns whether any played."""
    _session.problems.pop(armature.session_uid, None)
    followed = detach(armature)
    if armature.is_editable and armature.sinew_ik_is_live:
        remove_followers(armature)
        armature.property_unset("sinew_ik")
        armature.property_unset("sinew_ik_is_live")
        for bone in armature.pose.bones if armature.pose is not None else ():
            bone.property_unset("sinew_ik_live")
    return followed


def detach(armature: bpy.types.Object) -> bool:
    """Lets Blender's constraints play; the followers stay, without users. Returns whether Sinew's played."""
    _session.attached.pop(armature.session_uid, None)
    if armature.pose is None or not armature.is_editable:
        return False
    followed = False
    for bone in armature.pose.bones:
        for constraint in [each for each in bone.constraints if ik_io.follows(each)]:
            bone.constraints.remove(constraint)
            followed = True
    if followed:
        ik_io.set_muted(armature, list(live_constraints(armature).items()), False)
    return followed


def remove_followers(armature: bpy.types.Object | None, but: Collection[bpy.types.Object] = ()) -> None:
    """Removes the followers of an armature; None: those whose armature is gone."""
    for follower in [each for each in _followers(armature) if each not in but]:
        _remove(follower)


def _remove(follower: bpy.types.Object) -> None:
    data = follower.data
    bpy.data.objects.remove(follower)
    if data is not None and not data.users:
        bpy.data.armatures.remove(data)


@contextmanager
def out_of_the_file() -> Iterator[None]:
    """Context in which Blender can save: followers are not written, as neither they nor their bones have a
    user."""
    remove_followers(None)
    bones = {}
    for armature in [obj for obj in bpy.data.objects if obj.type == "ARMATURE"]:
        if was_switched_on(armature):
            detach(armature)
        for follower in _followers(armature):
            bones[follower], follower.data = follower.data, armature.data
    try:
        yield
    finally:
        for follower, data in bones.items():
            follower.data = data


def _drop_what_the_artist_switched_off(armature: bpy.types.Object) -> None:
    """Gives constraints back to Blender that are deleted, unmuted while Sinew solves them, or muted while it
    does not. A renamed one is still recognised."""
    for bone, name in live_constraints(armature).items():
        owner = armature.pose.bones[bone]
        constraint = owner.constraints.get(name)
        if constraint is None:
            renamed = [each for each in owner.constraints if each.type == "IK" and each.mute]
            constraint = renamed[0] if len(renamed) == 1 else None
            owner.sinew_ik_live = constraint.name if constraint is not None else ""
        if constraint is None:
            continue
        tip = owner if constraint.use_tail or owner.parent is None else owner.parent
        if constraint.mute != any(map(ik_io.follows, tip.constraints)):
            owner.sinew_ik_live = ""


def _state(armature: bpy.types.Object, trees: list[core.Tree]) -> list:
    """Changes with everything that _attach() depends on and makes; empty where a bone is gone."""
    state: list[object] = []
    bones = armature.pose.bones
    for tree in trees:
        settings = ik_io.settings_of(armature, tree)
        if not settings:
            return []
        state.append(settings)
        state += [constraint.mute for constraint in ik_io.constraints_of(armature, tree)]
        for name in tree.bones:
            state += [
                (constraint.type, constraint.name, constraint.mute, constraint.is_valid)
                for constraint in bones[name].constraints
            ]
            followed = bones[name].constraints.get(ik_io.FOLLOWS)
            state.append(followed is not None and followed.target)
    return state


def _attach(armature: bpy.types.Object, trees: list[core.Tree]) -> None:
    detach(armature)
    if references.are_between_steps():
        _session.in_no_step.add(armature.session_uid)
    followers = []
    for tree in trees:
        follower = _follower_of(armature, tree)
        followers.append(follower)
        follower.sinew_ik_follower.constraints = json.dumps(tree.constraints)
        _add_driver(follower, armature, tree)
        for bone, name in tree.constraints:
            armature.pose.bones[bone].sinew_ik_live = name
        for name in tree.bones:
            constraint = armature.pose.bones[name].constraints.new("COPY_TRANSFORMS")
            constraint.name = ik_io.FOLLOWS
            constraint.target, constraint.subtarget = follower, name
            # Through the channels, so that each bone inherits from its own parent as usual.
            constraint.owner_space = constraint.target_space = "LOCAL"
        ik_io.set_muted(armature, tree.constraints, True)
    remove_followers(armature, but=followers)


def _add_driver(follower: bpy.types.Object, armature: bpy.types.Object, tree: core.Tree) -> None:
    """Adds the driver to an unused property of the follower's root bone: everything below is posed after
    it."""
    follower.animation_data_clear()
    curve = follower.driver_add(f"{_path(tree.bones[0])}.ik_stretch")
    # The modifier maps any value of the variables to 0.
    curve.modifiers.new("GENERATOR").coefficients.foreach_set((0.0, 0.0))
    curve.driver.type = "SUM"
    curve.driver.expression = ""
    reads = [(armature, "matrix_world[0][0]")]
    owners = [bone for bone, _name in tree.constraints if bone not in tree.bones]
    # Reading a bone's channel waits for keys and drivers of the bone and of its constraints.
    reads += [(armature, f"{_path(name)}.location[0]") for name in (*tree.bones, *owners)]
    above = armature.pose.bones[tree.bones[0]].parent
    if above is not None:
        reads.append((armature, f"{_path(above.name)}.matrix[0][0]"))
    for constraint in ik_io.constraints_of(armature, tree):
        for target, part in (
            (constraint.target, constraint.subtarget),
            (constraint.pole_target, constraint.pole_subtarget),
        ):
            if target is not None:
                reads.append((target, "matrix_world[0][0]"))
                if target.type == "ARMATURE" and part in target.pose.bones:
                    reads.append((target, f"{_path(part)}.matrix[0][0]"))
    # Whenever Blender poses the follower again, the tree is solved again.
    reads += [(follower, f"{_path(name)}.location[0]") for name in tree.bones[1:]]
    reads.append((follower, "sinew_ik_follower.request"))
    for number, (obj, path) in enumerate(dict.fromkeys(reads)):
        variable = curve.driver.variables.new()
        variable.name = f"sinew_{number}"
        variable.targets[0].id = obj
        variable.targets[0].data_path = path


def _path(bone: str) -> str:
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"]'


def _follower_of(armature: bpy.types.Object, tree: core.Tree) -> bpy.types.Object:
    """Returns the existing follower, if it has these bones; otherwise a new one."""
    root, data = tree.bones[0], None
    for follower in _followers(armature):
        if set(tree.bones) <= set(follower.data.bones.keys()):
            if follower.sinew_ik_follower.root == root:
                return follower
            data = follower.data
    name = f"{armature.name} {root} {ik_io.FOLLOWS}"
    follower = bpy.data.objects.new(name, armature.data)
    if data is None:
        # With the artist's own armature data, that would have a second user.
        data = armature.data.copy()
        data.name = name
        data.animation_data_clear()
    # Assigning the data makes its pose bones.
    follower.data = data
    follower.sinew_ik_is_follower = True
    follower.sinew_ik_follower.root = root
    return follower


def _followers(armature: bpy.types.Object | None) -> list[bpy.types.Object]:
    """Returns the followers of an armature; None: those whose armature is gone."""
    return [follower for follower in _all_followers() if _followed_by(follower) == armature]


def _all_followers() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if obj.type == "ARMATURE" and obj.sinew_ik_is_follower]


def _followed_by(follower: bpy.types.Object) -> bpy.types.Object | None:
    animation = follower.animation_data
    if animation is None or not animation.drivers or not animation.drivers[0].driver.variables:
        return None
    return animation.drivers[0].driver.variables[0].targets[0].id
