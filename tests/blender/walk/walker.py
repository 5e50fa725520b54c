# SPDX-License-Identifier: GPL-3.0-or-later
"""What operations of a walk choose from: the open file. An operation raises NothingError if the file has
nothing for it: choosing among nothing ends it."""

from __future__ import annotations

import random
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from walk_sides import Side, armature_modifiers

FRAMES = (1, 11)
# Targets of inverse kinematics.
TARGET = "target"
# For a mesh whose own shape was set from a deformed one, so that its last bits differ between the sides:
# Decimate makes other faces of it (also without Sinew, if a mesh changes by rounding), Remesh other weights.
SHAPED = "shaped"
# Rotations of a bone relative to another stay below 180 degrees, where dual quaternions are discontinuous.
TURN = 0.8


@dataclass
class Operation:
    name: str
    weight: float
    act: Callable[[Walker, random.Random], str]


class NothingError(Exception):
    """The file has nothing for an operation."""


OPERATIONS: dict[str, Operation] = {}


def operation(weight: float):
    """weight  its relative frequency"""

    def register(act: Callable) -> Callable:
        def attempt(walker: Walker, r: random.Random) -> str:
            """Returns what it chooses, but for samples and numbers from 0 to 1, as a script says it."""
            walker.words = [act.__name__]

            def noting(choose: Callable) -> Callable:
                def choose_and_note(*given: object):
                    chosen = choose(*given)
                    walker.words.append(str(getattr(chosen, "name", chosen)))
                    return chosen

                return choose_and_note

            r.choice, r.randrange = noting(r.choice), noting(r.randrange)
            act(walker, r)
            return shlex.join(walker.words)

        OPERATIONS[act.__name__] = Operation(act.__name__, weight, attempt)
        return act

    return register


class Walker:
    """What operations choose from: the open file without what Sinew has added to it."""

    def __init__(self, side: Side, folder: Path) -> None:
        self.side = side
        self.folder = folder
        self.number = 0
        self.rendered: dict[str, np.ndarray] = {}
        # The expected data of renders for shapes that Blender can not compute, where known.
        self.rendered_by_library: dict[str, np.ndarray] = {}
        self.expect_rendered: Callable[[str, bpy.types.Object, bpy.types.Depsgraph], None] = (
            lambda *_arguments: None
        )
        self.chosen = ""
        self.words: list[str] = []
        self.compared = False
        # Changed since the last undo step: Blender's own operators always push one.
        self.unpushed = False
        # What must be set before an operation that itself evaluates.
        self.before_evaluation: Callable[[], None] = lambda: None
        # The points of an evaluated object.
        self.points_of: Callable[[bpy.types.Object], np.ndarray]

    # --- Content of the file

    def objects(self, kind: str | None = None) -> list[bpy.types.Object]:
        found = [
            o
            for o in bpy.data.objects
            if (kind is None or o.type == kind) and not self.side.is_helper(o) and o.name != "Camera"
        ]
        return sorted(found, key=lambda o: o.name_full)

    def meshes(self) -> list[bpy.types.Object]:
        """Objects of the current view layer, without those of other files."""
        there = self.in_layer()
        return [o for o in self.objects("MESH") if o.library is None and o in there]

    def armatures(self) -> list[bpy.types.Object]:
        there = self.in_layer()
        return [o for o in self.objects("ARMATURE") if o.library is None and o in there]

    def in_layer(self) -> set[bpy.types.Object]:
        """The content of the current view layer; this query makes Blender include newly linked objects."""
        bpy.context.scene.camera.visible_get()
        return set(bpy.context.view_layer.objects)

    def modifiers(self, obj: bpy.types.Object) -> list[bpy.types.Modifier]:
        own = self.side.own_modifier(obj)
        return [m for m in obj.modifiers if m != own and not m.name.startswith("Sinew")]

    def collections(self) -> list[bpy.types.Collection]:
        return sorted(
            (c for c in bpy.data.collections if c.library is None and not c.name.startswith("Sinew")),
            key=lambda c: c.name,
        )

    def users(self, mesh: bpy.types.Mesh) -> int:
        """Objects with this data, without Sinew's own."""
        return sum(obj.data == mesh for obj in self.objects("MESH"))

    def shares_action(self, obj: bpy.types.Object) -> bool:
        def action(each: bpy.types.Object) -> bpy.types.Action | None:
            return each.animation_data.action if each.animation_data is not None else None

        own = action(obj)
        return own is not None and any(o != obj and action(o) == own for o in self.objects())

    def may_lose_sinew(self, obj: bpy.types.Object) -> bool:
        """Excludes one that plays keys of the method together with a linked duplicate: Sinew leaves them
        to that one, but on the other side they are keys of Preserve Volume, which also apply without
        Sinew."""
        return not (self.side.is_method_keyed(obj) and self.shares_action(obj))

    def new_name(self, kind: str) -> str:
        self.number += 1
        return f"{kind} {self.number}"

    # --- Choosing

    @staticmethod
    def skip_if(is_so: bool) -> None:
        if is_so:
            raise NothingError

    @staticmethod
    def one_or_none(r: random.Random, choices: Sequence):
        choices = list(choices)
        return r.choice(choices) if choices else None

    @classmethod
    def one(cls, r: random.Random, choices: Sequence):
        chosen = cls.one_or_none(r, choices)
        cls.skip_if(chosen is None)
        return chosen

    def mesh(self, r: random.Random, wanted: Callable | None = None) -> bpy.types.Object:
        """Often the last chosen one, since faults result from several operations on one object."""
        choices = [o for o in self.meshes() if wanted is None or wanted(o)]
        again = next((o for o in choices if o.name == self.chosen), None)
        chosen = self.one(r, choices)
        if again is not None and r.random() < 0.5:
            chosen, self.words[-1] = again, again.name
        self.chosen = chosen.name
        return chosen

    def skinned(self, r: random.Random) -> bpy.types.Object:
        return self.mesh(r, lambda o: bool(armature_modifiers(o)))

    def with_sinew(self, r: random.Random) -> bpy.types.Object:
        return self.mesh(r, self.side.has_sinew)

    def editable(self, r: random.Random) -> bpy.types.Object:
        """Objects with a mesh that can be edited."""
        return self.mesh(r, self.is_editable)

    @staticmethod
    def is_editable(obj: bpy.types.Object) -> bool:
        return obj.data.library is None and obj.override_library is None

    def armature(self, r: random.Random) -> bpy.types.Object:
        return self.one(r, self.armatures())

    # --- Actions

    def object_mode(self) -> None:
        active = bpy.context.view_layer.objects.active
        if active is not None and active.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
            self.unpushed = True

    def push_undo(self) -> None:
        if self.unpushed:
            # Where data was created or deleted, such as Sinew does for itself, a step of edit mode is
            # accompanied by one of the whole file.
            bpy.data.texts.remove(bpy.data.texts.new("walk"))
            bpy.ops.ed.undo_push(message="step")
        self.unpushed = False

    def evaluate(self) -> None:
        """As a window does between two events."""
        self.before_evaluation()
        bpy.context.view_layer.update()

    def this_frame(self) -> None:
        """Restores what was changed without a key where there are keys: such changes are not expected to
        last."""
        self.before_evaluation()
        bpy.context.scene.frame_set(bpy.context.scene.frame_current)

    def this_scene(self) -> None:
        """Updates the originals of animated data to the visible scene. If another scene's frame has set
        them, Blender copies them at any edit (4.2 and 4.5: at an edit of another armature) without
        evaluating what depends on them. What is shown would then depend on what else was touched, which
        differs with Sinew."""
        self.before_evaluation()
        # This makes the evaluation that of the window, which is the only one that writes to originals.
        bpy.context.evaluated_depsgraph_get()
        self.this_frame()

    def shown_points(self, obj: bpy.types.Object) -> np.ndarray:
        """As they are now, to be compared like a render's."""
        return self.points_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))

    def edit_mode(self) -> None:
        """Includes the undo step that Blender's own keying operator pushes: undo without one crashes it
        (5.2). Earlier changes have their own step: whether Blender makes one for them depends on what
        else is in the file."""
        self.push_undo()
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.ed.undo_push(message="edit mode")

    def select(self, *objects: bpy.types.Object) -> bool:
        """Selects these; the last one becomes active. Returns whether all can be selected."""
        self.object_mode()
        for obj in bpy.context.view_layer.objects:
            if obj.select_get():
                obj.select_set(False)
        for obj in objects:
            if not obj.visible_get():
                return False
            obj.select_set(True)
        bpy.context.view_layer.objects.active = objects[-1]
        return True


def some_vertices(w: Walker, r: random.Random, obj: bpy.types.Object) -> list[int]:
    count = len(obj.data.vertices)
    return sorted(r.sample(range(count), r.randint(1, max(1, count // 2)))) if count else []


def and_undo(w: Walker, r: random.Random, act: Callable[[], object]) -> None:
    """Does what only Sinew's side can do, and undoes it. No redo leads there again."""
    w.object_mode()
    w.this_frame()
    w.unpushed = True
    w.push_undo()
    act()
    for message in ("done", "after"):
        w.unpushed = True
        w.push_undo()
        if message == "done":
            bpy.ops.ed.undo()
