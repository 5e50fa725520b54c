# SPDX-License-Identifier: GPL-3.0-or-later
"""The operations of a walk. Each does the same to the file on both sides (walk_sides), depending on its
random numbers and the file's content.

An operation raises NothingError if the file has nothing for it: choosing among nothing ends it.
"""

from __future__ import annotations

import random
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Vector
from walk_sides import (
    METHODS,
    OF_BLENDER,
    STAGES,
    Side,
    animated_paths,
    armature_modifiers,
    has_scaled_bones,
    key,
    remove_curves,
)

FRAMES = (1, 11)
# Targets of inverse kinematics.
TARGET = "target"
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
            if (kind is None or o.type == kind) and not self.side.may_react(o) and o.name != "Camera"
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


# --- Start


def make_tube(name: str, sides: int, rings: int, bones: Sequence[str]) -> bpy.types.Object:
    points, faces = [], []
    length = float(len(bones))
    for ring in range(rings):
        for side in range(sides):
            angle = 2 * np.pi * side / sides
            points.append((length * ring / (rings - 1), 0.25 * np.cos(angle), 0.25 * np.sin(angle)))
    for ring in range(rings - 1):
        for side in range(sides):
            here, beside = ring * sides + side, ring * sides + (side + 1) % sides
            faces.append((here, beside, beside + sides, here + sides))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    for index, bone in enumerate(bones):
        group = obj.vertex_groups.new(name=bone)
        for vertex, point in enumerate(points):
            weight = max(0.0, 1.0 - abs(point[0] - (index + 0.5)))
            if weight > 0.0:
                group.add([vertex], weight, "REPLACE")
    return obj


def make_rig(name: str, bones: Sequence[str], collection: bpy.types.Collection) -> bpy.types.Object:
    rig = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for index, bone_name in enumerate(bones):
        bone = rig.data.edit_bones.new(bone_name)
        bone.head, bone.tail = (index, 0.0, 0.0), (index + 1.0, 0.0, 0.0)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for index, bone in enumerate(rig.pose.bones):
        bone.rotation_mode = "XYZ"
        bone.keyframe_insert("rotation_euler", frame=FRAMES[0])
        bone.rotation_euler = (0.7, 0.5, -0.3 - 0.2 * index)
        bone.keyframe_insert("rotation_euler", frame=FRAMES[1])
    return rig


def start(walker: Walker) -> None:
    """An empty file with two armatures, three meshes that they deform, and one other mesh."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    walker.number, walker.unpushed, walker.chosen = 0, False, ""
    walker.compared = False
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FRAMES
    scene.render.engine = "WALK_RENDER"
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.filepath = str(walker.folder / "render")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    props = bpy.data.collections.new("Props")
    scene.collection.children.link(props)
    names = ("upper", "lower", "hand")
    rig = make_rig("Rig", names, scene.collection)
    other = make_rig("Other Rig", ("thigh", "shin"), scene.collection)
    arm = make_tube("Arm", 6, 9, names)
    sleeve = make_tube("Sleeve", 5, 7, names[:2])
    leg = make_tube("Leg", 6, 7, ("thigh", "shin"))
    box = make_tube("Box", 4, 3, ("nothing",))
    for obj, armature, collection in (
        (arm, rig, scene.collection),
        (sleeve, rig, props),
        (leg, other, scene.collection),
        (box, None, props),
    ):
        collection.objects.link(obj)
        if armature is not None:
            obj.modifiers.new("Armature", "ARMATURE").object = armature
        walker.side.note_flags(obj)
    bpy.context.view_layer.objects.active = arm
    scene.frame_set(1)


def make_library(walker: Walker) -> None:
    """A file with a character that Sinew deforms, to link and append from."""
    start(walker)
    for name in ("Sleeve", "Leg", "Box", "Other Rig"):
        bpy.data.objects.remove(bpy.data.objects[name])
    for kind, old, new in (
        ("objects", "Arm", "Guest"),
        ("meshes", "Arm", "Guest"),
        ("objects", "Rig", "Guest Rig"),
        ("armatures", "Rig", "Guest Rig"),
    ):
        getattr(bpy.data, kind)[old].name = new
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    walker.side.add(bpy.data.objects["Guest"], "dq", False)
    bpy.ops.wm.save_as_mainfile(filepath=str(walker.folder / "library.blend"))


# --- Sinew


def _method(r: random.Random) -> str:
    """Half of the time a method that Blender itself has."""
    return r.choice(OF_BLENDER if r.random() < 0.5 else METHODS[len(OF_BLENDER) :])


def _is_behind_hair(obj: bpy.types.Object) -> bool:
    """Sinew refuses this."""
    kinds = [modifier.type for modifier in obj.modifiers]
    return "PARTICLE_SYSTEM" in kinds[: kinds.index("ARMATURE")]


@operation(6)
def add(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            o.parent_type != "ARMATURE"
            and not w.side.has_sinew(o)
            and any(m.object for m in armature_modifiers(o))
            and not _is_behind_hair(o)
        ),
    )
    method, leave = r.choice((None, _method(r))), r.random() < 0.15
    w.object_mode()
    if not any(m.show_viewport or m.show_render for m in armature_modifiers(obj)):
        # Sinew would deform it nevertheless, until it is removed.
        for modifier in armature_modifiers(obj):
            modifier.show_viewport = modifier.show_render = True
    flags = {w.side.preserve_volume(m) for m in armature_modifiers(obj)}
    if len(flags) > 1 and method is None:
        method = "lbs"
    w.side.add(obj, method, leave)


@operation(2)
def remove(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.override_library is None and w.may_lose_sinew(o))
    w.object_mode()
    w.side.remove(obj)


@operation(0.4)
def remove_all(w: Walker, r: random.Random) -> None:
    w.object_mode()
    w.side.end_comparison()
    # Includes objects outside the current view layer.
    for obj in [o for o in w.objects("MESH") if w.side.has_sinew(o) and o.library is None]:
        # An object from a library with Sinew has it again when the file is loaded.
        if obj.override_library is None:
            w.side.remove(obj)
        else:
            w.side.set_enabled(obj, False)


@operation(6)
def method(w: Walker, r: random.Random) -> None:
    obj, name = w.mesh(r, lambda o: w.side.has_sinew(o) and not w.side.is_method_keyed(o)), _method(r)
    w.side.set_method(obj, name)


@operation(5)
def stages(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, w.side.has_sinew)
    # Without them the shape is Blender's.
    number = r.randrange(1, len(STAGES)) if r.random() < 0.5 else 0
    w.side.set_stages(obj, number)


@operation(0.5)
def parameters(w: Walker, r: random.Random) -> None:
    """Parameters of methods: changes are visible where the method is used."""
    obj, value = w.mesh(r, w.side.has_sinew), r.choice(("nlerp", "slerp"))
    # Sinew evaluates immediately, and with it what was changed before.
    w.evaluate()
    if w.side.is_sinew:
        obj.sinew.sdef.interpolation = value
    else:
        w.side.set_option(obj, "sdef.interpolation", value)


@operation(0.5)
def compute_beside(w: Walker, r: random.Random) -> None:
    on = r.random() < 0.6
    w.side.compute_beside(on)


@operation(1.5)
def sdef_keys(w: Walker, r: random.Random) -> None:
    """Data as mmd_tools stores it."""
    obj = w.editable(r)
    w.skip_if(obj.data.library is not None or obj.mode != "OBJECT" or w.users(obj.data) > 1)
    w.skip_if(obj.data.shape_keys is not None and len(obj.data.shape_keys.key_blocks) > 4)
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis")
    for name in ("mmd_sdef_c", "mmd_sdef_r0", "mmd_sdef_r1"):
        block = obj.shape_key_add(name=name, from_mix=False)
        for point in block.data:
            point.co.z += r.uniform(-0.2, 0.2)
        block.mute = True


@operation(4)
def enabled(w: Walker, r: random.Random) -> None:
    obj = w.with_sinew(r)
    on = not w.side.is_on(obj) or r.random() < 0.1
    w.side.set_enabled(obj, on)


VIEWS = ("viewport", "render")


@operation(1.5)
def icons(w: Walker, r: random.Random) -> None:
    """Clicks on the icons of Sinew's and of the Armature modifier, then on those that bring Sinew back."""
    obj = w.mesh(
        r,
        lambda o: (
            w.side.is_on(o)
            and o.visible_get()
            and o.override_library is None
            and len(armature_modifiers(o)) == 1
            and armature_modifiers(o)[0].object is not None
            and all(m.show_viewport and m.show_render for m in armature_modifiers(o))
            and not w.side.has_other_shape(o)
            and not w.side.is_method_keyed(o)
            and not any(".show_" in path for path in animated_paths(o))
        ),
    )
    clicks = [(r.choice(("Sinew", "Armature")), r.choice(VIEWS)) for _click in range(r.randint(1, 6))]
    w.object_mode()
    # One that is left to Blender has a meaning of its own for them.
    w.side.set_option(obj, "leave_small", False)
    sinew, armature = dict.fromkeys(VIEWS, True), dict.fromkeys(VIEWS, True)

    def deformers() -> dict[str, str]:
        return {v: "" if not armature[v] else "Sinew" if sinew[v] else "Armature" for v in VIEWS}

    def click(modifier: str, view: str) -> None:
        icons = sinew if modifier == "Sinew" else armature
        icons[view] = not icons[view]
        w.side.click(obj, modifier, view, deformers())
        bpy.context.view_layer.update()

    w.evaluate()
    for number, (modifier, view) in enumerate(clicks):
        click(modifier, view)
        w.rendered[f"{obj.name_full} in the render, click {number + 1}"] = w.shown_points(obj)
    w.side.before_render(obj, deformers())
    bpy.ops.render.render()
    for view in VIEWS:
        for modifier, icons in (("Sinew", sinew), ("Armature", armature)):
            if not icons[view]:
                click(modifier, view)


@operation(1)
def rebind(w: Walker, r: random.Random) -> None:
    obj = w.with_sinew(r)
    w.side.rebind(obj)


@operation(1)
def scale_rule(w: Walker, r: random.Random) -> None:
    obj, number = w.with_sinew(r), r.randrange(3)
    if w.side.is_sinew:
        rules = [item.identifier for item in obj.sinew.bl_rna.properties["scale_rule"].enum_items]
        obj.sinew.scale_rule = rules[number]
    else:
        w.side.set_option(obj, "scale_rule", number)


@operation(1.5)
def leave_small(w: Walker, r: random.Random) -> None:
    obj, on = w.with_sinew(r), r.random() < 0.4
    w.side.set_option(obj, "leave_small", on)


@operation(1.5)
def give_normals(w: Walker, r: random.Random) -> None:
    obj, who = w.with_sinew(r), r.choice(("BY_SINEW", "BY_SINEW", "SKINNED", "LEAVE"))
    w.side.set_option(obj, "normals", who)


@operation(3)
def shade(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and not o.data.is_editmode)
    mesh, what = obj.data, r.choice(("smooth", "smooth", "flat", "edges", "faces", "custom"))
    if what in ("smooth", "flat"):
        mesh.polygons.foreach_set("use_smooth", [what == "smooth"] * len(mesh.polygons))
    elif what == "custom":
        mesh.normals_split_custom_set([(r.random(), r.random(), 0.5 + r.random()) for _corner in mesh.loops])
    else:
        for each in mesh.edges if what == "edges" else mesh.polygons:
            if r.random() < 0.2:
                setattr(each, "use_edge_sharp" if what == "edges" else "use_smooth", r.random() < 0.5)
    mesh.update()


@operation(2)
def heat(w: Walker, r: random.Random) -> None:
    obj, on, quantity = w.with_sinew(r), r.random() < 0.5, r.choice(("stretch", "distance", "bulge"))
    w.side.set_heat(obj, on, quantity)


@operation(1)
def compare(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            bool(armature_modifiers(o))
            and o.override_library is None
            # Sinew refuses this.
            and not (o.parent_type == "ARMATURE" and armature_modifiers(o)[0].use_multi_modifier)
            and not _is_behind_hair(o)
        ),
    )
    methods = r.sample((*METHODS, "blender"), r.randint(1, 2))
    w.skip_if(not obj.visible_get())
    w.object_mode()
    w.side.start_comparison([obj], methods)
    # Its copies share the mesh, which some operations refuse.
    w.compared = True


@operation(1)
def end_comparison(w: Walker, r: random.Random) -> None:
    w.side.end_comparison()


@operation(0.4)
def arrange_comparison(w: Walker, r: random.Random) -> None:
    how = r.choice(("SIDE", "OVERLAY"))
    w.side.arrange_comparison(how)


# --- Characters: settings for all meshes of an armature


def _character(w: Walker, r: random.Random) -> bpy.types.Object | None:
    """The armature of a character that can be selected, and whose settings no keys or library determine."""

    def is_free(obj: bpy.types.Object) -> bool:
        return obj.library is None and obj.override_library is None and not w.side.is_method_keyed(obj)

    # As in a window between two clicks: by then Sinew knows a modifier's armature.
    w.evaluate()
    w.skip_if(not all(_has_its_armatures(obj) for obj in w.objects("MESH") if w.side.has_sinew(obj)))
    rigs = [rig for rig in w.armatures() if rig.visible_get()]
    meshes = {rig: w.side.character(rig) for rig in rigs}
    return w.one(r, [rig for rig in rigs if meshes[rig] and all(map(is_free, meshes[rig]))])


def _has_its_armatures(obj: bpy.types.Object) -> bool:
    """Sinew remembers the armature of a mesh that lost it, as part of its character."""
    modifiers = armature_modifiers(obj)
    return bool(modifiers) and all(modifier.object is not None for modifier in modifiers)


@operation(1.5)
def character_method(w: Walker, r: random.Random) -> None:
    rig, name = _character(w, r), _method(r)
    w.skip_if(not w.select(rig))
    w.side.set_character_method(rig, name)


@operation(1.5)
def own_settings(w: Walker, r: random.Random) -> None:
    rig = _character(w, r)
    obj = w.one(r, w.side.character(rig))
    w.skip_if(obj not in w.in_layer() or not w.select(obj))
    w.side.switch_own(rig, obj)


@operation(0.7)
def preset(w: Walker, r: random.Random) -> None:
    rig = _character(w, r)
    w.skip_if(not w.select(rig))
    w.side.use_preset(rig, w.folder)


# --- Features that change the mesh


@operation(1.5)
def mend(w: Walker, r: random.Random) -> None:
    """Findings of diagnostics in the weights."""
    obj, how, most = w.editable(r), r.choice(("limit", "limit", "normalize", "fill")), r.choice((1, 2, 3))
    w.skip_if(obj.mode != "OBJECT" or obj.data.is_editmode or obj.parent_type == "ARMATURE")
    modifiers = armature_modifiers(obj)
    w.skip_if(len(modifiers) != 1 or modifiers[0].object is None or modifiers[0].object.data.is_editmode)
    w.evaluate()
    w.skip_if(w.side.mend(obj, how, most) is None)


def _and_undo(w: Walker, r: random.Random, act: Callable[[], object]) -> None:
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


@operation(0.5)
def bake_to_bones(w: Walker, r: random.Random) -> None:
    obj, motion = w.mesh(r, lambda o: w.side.is_on(o) and o.visible_get()), r.choice(("keys", "pose"))
    w.skip_if(w.compared)
    is_alone = len(w.modifiers(obj)) == 1
    _and_undo(w, r, lambda: w.side.bake_to_bones(obj, motion, is_alone))


@operation(0.5)
def corrective_key(w: Walker, r: random.Random) -> None:
    obj, driven = w.mesh(r, lambda o: w.side.is_on(o) and o.visible_get()), r.random() < 0.5
    w.skip_if(w.compared)
    rig = next((m.object for m in armature_modifiers(obj) if m.object is not None), None)
    bone = w.one_or_none(r, rig.pose.bones) if driven and rig is not None else None
    _and_undo(w, r, lambda: w.side.add_corrective_key(obj, bone))


@operation(0.5)
def restart(w: Walker, r: random.Random) -> None:
    frame = r.choice((None, r.randint(*FRAMES)))
    w.object_mode()

    def between() -> None:
        if frame is not None:
            bpy.context.scene.frame_set(frame)

    w.side.restart(between)


@operation(0.3)
def delete_sinew_modifier(w: Walker, r: random.Random) -> None:
    # Blender's own button does not remove objects of a library from an override.
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.override_library is None and w.may_lose_sinew(o))
    w.skip_if(not w.side.is_on(obj))
    w.side.delete_part(obj, "modifier")


@operation(0.5)
def delete_points(w: Walker, r: random.Random) -> None:
    """What Sinew made for a mesh, and makes again."""
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.mode == "OBJECT" and o.data.library is None)
    part = r.choice(("attribute", "attribute", "driver", "nodes", "links", "sockets", "socket", "group"))
    w.skip_if(part != "attribute" and obj.override_library is not None)
    if w.side.is_sinew:
        w.side.delete_part(obj, part)


@operation(1)
def key_method(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            w.side.has_sinew(o)
            and w.side.is_on(o)
            and o.override_library is None
            # Keys of the method are keys of something else on the other side.
            and not w.shares_action(o)
        ),
    )
    frames = sorted(r.sample(range(1, 12), 2))
    w.side.key_method(obj, [(frames[0], r.choice(OF_BLENDER)), (frames[1], r.choice(OF_BLENDER))])
    w.this_frame()


@operation(1)
def unkey_method(w: Walker, r: random.Random) -> None:
    # A linked duplicate has the same keys, and on the other side a mark of its own.
    obj = w.mesh(r, lambda o: w.side.is_method_keyed(o) and not w.shares_action(o))
    name = r.choice(OF_BLENDER)
    w.skip_if(not w.side.has_sinew(obj))
    w.side.unkey_method(obj, name)


# --- Time and poses


@operation(10)
def frame(w: Walker, r: random.Random) -> None:
    number = r.randint(*FRAMES)
    bpy.context.scene.frame_set(number)


@operation(2)
def subframe(w: Walker, r: random.Random) -> None:
    number, part = r.randint(*FRAMES), r.random()
    bpy.context.scene.frame_set(number, subframe=part)


@operation(2)
def play(w: Walker, r: random.Random) -> None:
    first = bpy.context.scene.frame_current
    for number in range(first, first + 3):
        bpy.context.scene.frame_set(number)


@operation(1)
def scrub(w: Walker, r: random.Random) -> None:
    frames = [r.randint(*FRAMES) for _step in range(5)]
    for number in frames:
        bpy.context.scene.frame_set(number)


@operation(0.7)
def current_frame(w: Walker, r: random.Random) -> None:
    number = r.randint(*FRAMES)
    bpy.context.scene.frame_current = number


def _turn(r: random.Random) -> Euler:
    return Euler([r.uniform(-TURN, TURN) for _axis in range(3)])


@operation(6)
def pose(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = _turn(r)
    if r.random() < 0.3:
        bone.location = [r.uniform(-0.2, 0.2) for _axis in range(3)]


@operation(0.5)
def pose_scale(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    bone.scale = r.choice(((1, 1, 1), (1.3, 0.8, 1.1)))


@operation(2)
def key_pose(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    number = r.randint(*FRAMES)
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = _turn(r)
    bone.keyframe_insert("rotation_euler", frame=number)
    w.this_frame()


@operation(0.6)
def rest_position(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    rig.data.pose_position = "REST" if rig.data.pose_position == "POSE" else "POSE"


@operation(0.7)
def clear_animation(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.armatures(), *(o for o in w.meshes() if not w.side.is_method_keyed(o))])
    if obj.type == "ARMATURE":
        obj.animation_data_clear()
    else:
        remove_curves(obj, "")


@operation(0.4)
def push_action(w: Walker, r: random.Random) -> None:
    """Moves it into a strip, as for layers of animation."""
    rig = w.armature(r)
    animation = rig.animation_data
    w.skip_if(animation is None or animation.action is None or rig.override_library is not None)
    action, slot = animation.action, getattr(animation, "action_slot", None)
    strip = animation.nla_tracks.new().strips.new(w.new_name("strip"), 1, action)
    if slot is not None:
        strip.action_slot = slot
    animation.action = None
    w.this_frame()


@operation(0.7)
def constrain_bone(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    target = w.one(r, [a for a in w.armatures() if a != rig])
    w.skip_if(any(c.type == "COPY_ROTATION" for b in target.pose.bones for c in b.constraints))
    of_artist = [c for c in bone.constraints if c.type in ("COPY_ROTATION", "IK")]
    if of_artist:
        bone.constraints.remove(of_artist[0])
        return
    other = w.one(r, target.pose.bones)
    constraint = bone.constraints.new("COPY_ROTATION")
    constraint.target, constraint.subtarget, constraint.influence = target, other.name, 0.5


# --- Inverse kinematics


@operation(1.5)
def ik_chain(w: Walker, r: random.Random) -> None:
    """A chain of bones starts or stops following a target."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.is_editmode)
    bone, length = w.one(r, [bone for bone in rig.pose.bones if bone.parent is not None]), r.choice((0, 2))
    place = [r.uniform(-1, 2) for _axis in range(3)]
    there = next((c for c in bone.constraints if c.type == "IK"), None)
    if there is not None:
        bone.constraints.remove(there)
        return
    target = bpy.data.objects.new(w.new_name(TARGET), None)
    bpy.context.scene.collection.objects.link(target)
    target.location = place
    constraint = bone.constraints.new("IK")
    constraint.target, constraint.chain_count = target, length


@operation(2)
def move_target(w: Walker, r: random.Random) -> None:
    target = w.one(r, [o for o in w.objects("EMPTY") if o.name.startswith(TARGET) and o.library is None])
    frame = r.choice((None, r.randint(*FRAMES)))
    place = [r.uniform(-1, 2) for _axis in range(3)]
    target.location = place
    if frame is not None:
        target.keyframe_insert("location", frame=frame)
        w.this_frame()


# --- Positions


@operation(3)
def move_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    obj.location = [r.uniform(-1, 1) for _axis in range(3)]
    if r.random() < 0.3:
        obj.rotation_euler = _turn(r)
    if r.random() < 0.2:
        obj.scale = [r.uniform(0.7, 1.4) for _axis in range(3)]


@operation(1)
def key_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    w.skip_if(obj.override_library is not None)
    for number in r.sample(range(1, 12), 2):
        obj.location = [r.uniform(-1, 1) for _axis in range(3)]
        obj.keyframe_insert("location", frame=number)
    w.this_frame()


# These keep the shape of a mesh without size; others depend on directions that it has not.
_KEEP_COLLAPSED = {"ARMATURE", "SUBSURF", "MIRROR", "TRIANGULATE", "MASK"}


def _is_collapsed_once(obj: bpy.types.Object) -> bool:
    """Whether one transform of the mesh and its armatures has no inverse. Where two have none, or one nearly
    has none, rounding decides the shape. Where one is hidden, its transform may be an earlier one. Inverse
    kinematics of an armature without size gives bones matrices that transform nothing."""
    armatures = [modifier.object for modifier in armature_modifiers(obj) if modifier.object is not None]
    all_of = [obj, *armatures]
    are_affine = all(bone.matrix[3][3] == 1.0 for each in armatures for bone in each.pose.bones)
    if not (are_affine and all(each.visible_get() for each in all_of)):
        return False
    sizes = [abs(each.matrix_world.determinant()) for each in all_of]
    return sorted(size for size in sizes if size < 1e-6) == [0.0]


@operation(1)
def no_size(w: Walker, r: random.Random) -> None:
    """A scale of 0 or one that is not finite, at a frame that comes after two others. What is shown then
    depends on neither of them."""
    obj = w.one(r, [o for o in (*w.meshes(), *w.armatures()) if o.override_library is None])
    scale = r.choice(((0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (float("nan"), 1.0, 1.0), (1.0, float("inf"), 1.0)))
    number, others = r.randint(*FRAMES), r.sample(range(FRAMES[0], FRAMES[1] + 1), 2)
    w.object_mode()
    before, found = obj.scale[:], []
    for other in others:
        obj.scale = before
        w.before_evaluation()
        bpy.context.scene.frame_set(other)
        obj.scale = scale
        w.before_evaluation()
        bpy.context.scene.frame_set(number)
        bpy.context.view_layer.update()
        w.side.wait()
        shown = [o for o in w.meshes() if w.side.has_sinew(o) and o.visible_get()]
        found.append([w.shown_points(each) for each in shown])
    for each, *points in zip(shown, *found, strict=True):
        if not np.array_equal(*points, equal_nan=True):
            raise ValueError(f"{each.name}: without size its shape depends on the frame before")
        is_kept = _KEEP_COLLAPSED.issuperset(modifier.type for modifier in w.modifiers(each))
        if np.isfinite(scale).all() and is_kept and _is_collapsed_once(each):
            # In the world, as the direction in which a mesh has no size shows nothing. Points can be far from
            # the origin, and are as exact as that.
            world = np.array(each.matrix_world)
            points = np.vstack((points[0] @ world[:3, :3].T + world[:3, 3], np.zeros(3)))
            w.rendered[f"{each.name_full} in the render, without size"] = points
    obj.scale = before
    w.this_frame()


@operation(2)
def parent(w: Walker, r: random.Random) -> None:
    obj, rig = w.mesh(r), w.armature(r)
    kind = r.choice(("none", "OBJECT", "OBJECT", "BONE", "ARMATURE"))
    w.skip_if(obj.override_library is not None)
    obj.parent = None if kind == "none" else rig
    if kind == "none":
        obj.parent_type = "OBJECT"
        # Blender by itself keeps the shape that a parent of type Armature made.
        obj.update_tag()
        return
    obj.parent_type = kind
    if kind == "BONE":
        bone = w.one_or_none(r, rig.data.bones)
        obj.parent_bone = bone.name if bone is not None else ""


@operation(1)
def parent_as_artists_do(w: Walker, r: random.Random) -> None:
    """The command adds an Armature modifier to a mesh if none of its own points to the armature, such as
    those that Sinew has cleared."""
    obj, rig = w.mesh(r, lambda o: not w.side.has_sinew(o)), w.armature(r)
    is_plain = obj.override_library is None and obj.parent_type != "ARMATURE"
    w.skip_if(not is_plain or len(w.modifiers(obj)) > 5 or not w.select(obj, rig))
    before = len(armature_modifiers(obj))
    bpy.ops.object.parent_set(type="ARMATURE")
    for modifier in armature_modifiers(obj)[before:]:
        w.side.set_preserve_volume(modifier, False)


# --- Weights


def _vertices(w: Walker, r: random.Random, obj: bpy.types.Object) -> list[int]:
    count = len(obj.data.vertices)
    return sorted(r.sample(range(count), r.randint(1, max(1, count // 2)))) if count else []


def _show_weights(obj: bpy.types.Object) -> None:
    """If weights and names of groups are changed through an object that Blender does not evaluate, the
    change is not shown on other objects with the mesh (seen on 4.2 and 5.2)."""
    if not obj.visible_get():
        obj.data.update()


@operation(8)
def weights(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and o.mode != "EDIT" and o.data.override_library is None)
    group = w.one(r, obj.vertex_groups)
    vertices = _vertices(w, r, obj)
    if r.random() < 0.3:
        group.remove(vertices)
        _show_weights(obj)
        return
    group.add(vertices, r.uniform(0.0, 1.0), r.choice(("REPLACE", "ADD", "SUBTRACT")))
    if r.random() < 0.2:
        obj.data.update()
    _show_weights(obj)


@operation(3)
def paint_weights(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not obj.vertex_groups or not w.select(obj))
    # Under a parent of type Armature, Blender normalizes the groups of bones alone if the object has any
    # modifier, such as Sinew's that are off, and all groups if it has none.
    w.skip_if(obj.parent_type == "ARMATURE" and not w.modifiers(obj))
    w.push_undo()
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    # As in a window: tools need the armature of the modifiers, which Sinew restores meanwhile.
    w.evaluate()
    obj.vertex_groups.active_index = r.randrange(len(obj.vertex_groups))
    what = r.choice(("smooth", "normalize_all", "invert", "levels"))
    if what == "smooth":
        bpy.ops.object.vertex_group_smooth(group_select_mode="ACTIVE", factor=0.5, repeat=2)
    elif what == "normalize_all":
        bpy.ops.object.vertex_group_normalize_all(lock_active=False)
    elif what == "invert":
        bpy.ops.object.vertex_group_invert(group_select_mode="ACTIVE")
    else:
        bpy.ops.object.vertex_group_levels(group_select_mode="ACTIVE", offset=0.1)
    if r.random() < 0.7:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(2)
def groups(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and o.mode != "EDIT" and o.override_library is None)
    group, what = w.one_or_none(r, obj.vertex_groups), r.choice(("new", "rename", "delete", "move", "bone"))
    if what == "new" or group is None:
        made = obj.vertex_groups.new(name=w.new_name("group"))
        made.add(_vertices(w, r, obj), r.random(), "REPLACE")
        _show_weights(obj)
        return
    if what == "rename":
        group.name = w.new_name("group")
        _show_weights(obj)
        return
    if what == "bone":
        bones = [b.name for a in w.armatures() for b in a.data.bones]
        taken = {g.name for g in obj.vertex_groups}
        group.name = w.one(r, [b for b in dict.fromkeys(bones) if b not in taken])
        _show_weights(obj)
        return
    if what == "delete":
        obj.vertex_groups.remove(group)
        # Blender 4.2 by itself continues with the old groups.
        obj.data.update()
        return
    w.skip_if(not w.select(obj))
    obj.vertex_groups.active_index = group.index
    bpy.ops.object.vertex_group_sort(sort_type="NAME")


# --- Meshes


@operation(4)
def edit_mesh(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not w.select(obj))
    what = r.choice(("move", "move", "delete", "extrude", "subdivide", "nothing"))
    w.edit_mode()
    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.verts.ensure_lookup_table()
    count = len(mesh.verts)
    if what == "move" and count:
        for index in r.sample(range(count), max(1, count // 5)):
            mesh.verts[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    elif what == "delete" and count > 12:
        gone = [mesh.verts[index] for index in r.sample(range(count), 2)]
        bmesh.ops.delete(mesh, geom=gone, context="VERTS")
    elif what == "extrude" and len(mesh.faces) and count < 150:
        mesh.faces.ensure_lookup_table()
        face = mesh.faces[r.randrange(len(mesh.faces))]
        made = bmesh.ops.extrude_discrete_faces(mesh, faces=[face])
        for new in made["faces"]:
            bmesh.ops.translate(mesh, verts=new.verts, vec=(0.0, 0.1, 0.1))
    elif what == "subdivide" and len(mesh.edges) and count < 150:
        mesh.edges.ensure_lookup_table()
        edges = [mesh.edges[i] for i in r.sample(range(len(mesh.edges)), min(4, len(mesh.edges)))]
        bmesh.ops.subdivide_edges(mesh, edges=edges, cuts=1)
    bmesh.update_edit_mesh(obj.data)
    if r.random() < 0.75:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(2)
def leave_mode(w: Walker, r: random.Random) -> None:
    w.object_mode()


@operation(0.5)
def sculpt_mode(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not w.select(obj))
    w.push_undo()
    bpy.ops.object.mode_set(mode="SCULPT")
    if r.random() < 0.5:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(4)
def move_vertices(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and not o.data.is_editmode)
    for index in _vertices(w, r, obj):
        obj.data.vertices[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    obj.data.update()


@operation(0.7)
def rename_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None)
    obj.data.name = w.new_name("mesh")


@operation(0.8)
def swap_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.mode == "OBJECT" and o.override_library is None and not o.data.is_editmode)
    w.skip_if(obj.data.library is not None)
    mesh = obj.data.copy()
    mesh.name = w.new_name("mesh")
    obj.data = mesh


@operation(0.5)
def share_mesh(w: Walker, r: random.Random) -> None:
    meshes = [
        o for o in w.meshes() if o.mode == "OBJECT" and o.override_library is None and not o.data.is_editmode
    ]
    w.skip_if(len(meshes) < 2 or not w.select(*r.sample(meshes, 2)))
    bpy.ops.object.make_links_data(type="OBDATA")


@operation(0.4)
def join(w: Walker, r: random.Random) -> None:
    """Joins an object that Sinew does not deform to another one."""
    others = [o for o in w.meshes() if not w.side.has_sinew(o) and o.override_library is None]
    obj = w.mesh(r, lambda o: o.override_library is None and o.data.library is None)
    other = w.one(r, [o for o in others if o != obj and w.users(o.data) == 1])
    is_shaped = bool(other.data.get(SHAPED))
    w.skip_if(is_shaped and any(modifier.type == "DECIMATE" for modifier in obj.modifiers))
    w.skip_if(len(obj.data.vertices) > 200 or not w.select(other, obj))
    bpy.ops.object.join()
    if is_shaped:
        obj.data[SHAPED] = True


@operation(0.4)
def separate(w: Walker, r: random.Random) -> None:
    """Separates a part of a mesh into a new object that keeps all of the old object's data."""
    obj = w.editable(r)
    w.skip_if(len(w.meshes()) > 6 or w.users(obj.data) > 1 or len(obj.data.vertices) < 20)
    w.skip_if(not w.select(obj))
    before = set(bpy.data.objects)
    w.edit_mode()
    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.select_mode = {"FACE"}
    for number, face in enumerate(mesh.faces):
        face.select_set(number < 6)
    bmesh.update_edit_mesh(obj.data)
    bpy.ops.mesh.separate(type="SELECTED")
    bpy.ops.object.mode_set(mode="OBJECT")
    made = next(o for o in bpy.data.objects if o not in before and not w.side.may_react(o))
    made.name, made.data.name = w.new_name("object"), w.new_name("mesh")


@operation(0.2)
def remesh(w: Walker, r: random.Random) -> None:
    """Another mesh without weights."""
    obj = w.editable(r)
    is_plain = w.users(obj.data) == 1 and obj.data.shape_keys is None
    w.skip_if(not is_plain or w.compared or bool(obj.data.get(SHAPED)) or not w.select(obj))
    obj.data.remesh_voxel_size = 0.15
    bpy.ops.object.voxel_remesh()


@operation(0.3)
def replace_mesh(w: Walker, r: random.Random) -> None:
    """Changes it in all that have it, like scripts that update a mesh."""
    obj = w.editable(r)
    w.skip_if(obj.data.is_editmode or obj.mode != "OBJECT")
    old = obj.data
    new = old.copy()
    old.user_remap(new)
    bpy.data.meshes.remove(old)
    new.name = w.new_name("mesh")


@operation(0.5)
def apply_transform(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(w.users(obj.data) > 1 or w.compared or not w.select(obj))
    # As the window offers where Sinew evaluates upstream modifiers separately: two objects have the mesh
    # then.
    bpy.ops.object.transform_apply(isolate_users=True)
    obj.data.name = w.new_name("mesh")


@operation(0.4)
def apply_pose(w: Walker, r: random.Random) -> None:
    """Applied as the rest pose."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.users > 1 or not w.select(rig))
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.armature_apply(selected=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    for child in rig.children:
        # Blender gives those of bones other transforms, and evaluates these only when something else is
        # changed (seen on 4.2 and 5.2).
        child.update_tag()


@operation(0.3)
def replace_armature_data(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.is_editmode)
    rig.data = rig.data.copy()
    rig.data.name = w.new_name("armature")


# --- Bones


@operation(1.5)
def rename_bone(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None)
    bone = w.one(r, rig.data.bones)
    # Blender also renames groups of the mesh, which a comparison's copies share.
    w.skip_if(w.compared)
    bone.name = w.new_name("bone")


@operation(1)
def edit_bones(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or not w.select(rig))
    what = r.choice(("delete", "new", "move", "rename", "roll"))
    if what == "rename" and w.compared:
        what = "roll"
    w.edit_mode()
    bones = rig.data.edit_bones
    bone = w.one_or_none(r, bones)
    if what == "new" or bone is None:
        made = bones.new(w.new_name("bone"))
        made.head, made.tail = (0.5, 0.0, 0.3), (0.5, 0.0, 1.0)
        made.parent = bone
    elif what == "delete" and len(bones) > 1:
        bones.remove(bone)
    elif what == "move":
        bone.tail += Vector((0.0, r.uniform(-0.2, 0.2), r.uniform(-0.2, 0.2)))
    elif what == "rename":
        bone.name = w.new_name("bone")
    else:
        bone.roll += 0.3
    if r.random() < 0.5:
        bpy.context.view_layer.update()
    if r.random() < 0.8 or what == "delete":
        bpy.ops.object.mode_set(mode="OBJECT")
    if what == "delete":
        # Blender evaluates drivers and children of a deleted bone anew only once something touches them (seen
        # on 4.5 and 5.3).
        for obj in w.objects("MESH"):
            obj.update_tag()
            obj.data.update_tag()


@operation(1.5)
def bone_options(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None)
    bone = w.one(r, rig.data.bones)
    what = r.choice(("deform", "segments", "envelope", "inherit"))
    if what == "deform":
        bone.use_deform = not bone.use_deform
    elif what == "segments":
        bone.bbone_segments = r.choice((1, 1, 3))
    elif what == "envelope":
        bone.envelope_distance = r.uniform(0.05, 0.5)
    else:
        bone.use_inherit_rotation = not bone.use_inherit_rotation


# --- Modifiers

KINDS = (
    *("SUBSURF", "CAST", "MIRROR", "SMOOTH", "ARMATURE", "WAVE", "SOLIDIFY", "MASK"),
    *("TRIANGULATE", "DECIMATE", "VERTEX_WEIGHT_EDIT", "HOOK", "NODES"),
)
# After these modifiers, the result depends on the last bit of the shape.
IN_FRONT = ("DECIMATE", "VERTEX_WEIGHT_EDIT")
# For a mesh whose own shape was set from a deformed one, so that its last bits differ between the sides:
# Decimate makes other faces of it (also without Sinew, if a mesh changes by rounding), Remesh other weights.
SHAPED = "shaped"


def _make_nodes(name: str) -> bpy.types.NodeTree:
    """Moves vertices by half of their normals."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = (
        *("NodeGroupInput", "GeometryNodeSetPosition", "NodeGroupOutput"),
        *("GeometryNodeInputNormal", "ShaderNodeVectorMath"),
    )
    source, move, out, normal, scale = (group.nodes.new(kind) for kind in kinds)
    scale.operation = "SCALE"
    scale.inputs["Scale"].default_value = 0.05
    group.links.new(normal.outputs["Normal"], scale.inputs[0])
    group.links.new(scale.outputs["Vector"], move.inputs["Offset"])
    group.links.new(source.outputs["Geometry"], move.inputs["Geometry"])
    group.links.new(move.outputs["Geometry"], out.inputs["Geometry"])
    return group


def _set_up(
    modifier: bpy.types.Modifier,
    w: Walker,
    r: random.Random,
    obj: bpy.types.Object,
    rig: bpy.types.Object | None,
) -> None:
    if modifier.type == "SUBSURF":
        modifier.levels = modifier.render_levels = 1
    elif modifier.type == "ARMATURE":
        modifier.object = rig
        w.side.set_preserve_volume(modifier, r.random() < 0.3)
    elif modifier.type == "WAVE":
        modifier.time_offset = -10.0
    elif modifier.type == "MASK" and obj.vertex_groups:
        modifier.vertex_group = w.one(r, obj.vertex_groups).name
        modifier.invert_vertex_group = True
    elif modifier.type == "DECIMATE":
        modifier.ratio = 0.7
    elif modifier.type == "VERTEX_WEIGHT_EDIT" and obj.vertex_groups:
        modifier.vertex_group, modifier.falloff_type = w.one(r, obj.vertex_groups).name, "SMOOTH"
    elif modifier.type == "HOOK":
        # After Geometry Nodes, Blender uses the first vertices as if they were those of a list.
        modifier.object, modifier.strength = rig, 0.3
        modifier.vertex_group = w.one(r, obj.vertex_groups).name if obj.vertex_groups else ""
    elif modifier.type == "NODES":
        modifier.node_group = _make_nodes(modifier.name)


@operation(3)
def add_modifier(w: Walker, r: random.Random) -> None:
    obj, rig = w.mesh(r), w.armature(r)
    kind, front = r.choice(KINDS), r.random() < 0.4
    w.skip_if(len(w.modifiers(obj)) > 5)
    once = ("SUBSURF", "MIRROR", "SOLIDIFY", *IN_FRONT)
    w.skip_if(kind in once and any(m.type == kind for m in w.modifiers(obj)))
    front |= kind in IN_FRONT
    w.skip_if(kind in ("HOOK", *IN_FRONT) and (obj.override_library is not None or not obj.vertex_groups))
    w.skip_if(kind == "DECIMATE" and obj.data.get(SHAPED))
    modifier = obj.modifiers.new(w.new_name(kind.title()), kind)
    w.skip_if(modifier is None)
    if kind == "TRIANGULATE":
        # Where both diagonals of a quad are as long, rounding would choose one.
        modifier.quad_method = "FIXED"
    _set_up(modifier, w, r, obj, rig)
    if front and obj.override_library is None:
        obj.modifiers.move(list(obj.modifiers).index(modifier), 0)
    elif kind == "HOOK":
        # Blender puts it after modifiers that only deform, which Sinew's is not (docs/parity.md).
        obj.modifiers.move(list(obj.modifiers).index(modifier), len(obj.modifiers) - 1)


@operation(0.4)
def hair(w: Walker, r: random.Random) -> None:
    """Hair on a mesh. Its roots can be elsewhere behind Sinew, which has to say so; the mesh is the same."""
    obj = w.mesh(r, lambda o: w.is_editable(o) and o.mode == "OBJECT" and not o.data.is_editmode)
    source = r.choice(("VERT", "FACE"))
    there = next((m for m in w.modifiers(obj) if m.type == "PARTICLE_SYSTEM"), None)
    if there is not None:
        obj.modifiers.remove(there)
        return
    modifier = obj.modifiers.new(w.new_name("Hair"), "PARTICLE_SYSTEM")
    settings = modifier.particle_system.settings
    settings.type, settings.count, settings.emit_from = "HAIR", 5, source
    w.side.check_warned(obj, modifier)


@operation(0.4)
def needs_original_mesh(w: Walker, r: random.Random) -> None:
    """A modifier in front of which Sinew's can not be comes and goes, as for a sculpted character."""
    obj = w.mesh(r, lambda o: w.is_editable(o) and o.mode == "OBJECT" and not o.data.is_editmode)
    kind = r.choice(("MULTIRES", "SOFT_BODY"))
    modifier = obj.modifiers.new(w.new_name("Original"), kind)
    w.skip_if(modifier is None)
    w.side.check_refused(obj, modifier)
    obj.modifiers.remove(modifier)
    if w.side.has_sinew(obj):
        w.side.rebind(obj)


@operation(2)
def move_modifier(w: Walker, r: random.Random) -> None:
    """Moves it to just before or after another one of the artist's; Sinew's is not counted."""
    obj = w.mesh(r, lambda o: len(w.modifiers(o)) > 1 and o.override_library is None)
    w.skip_if(any(m.type in IN_FRONT for m in w.modifiers(obj)))
    here, there = r.sample(w.modifiers(obj), 2)
    names = [m.name for m in obj.modifiers]
    obj.modifiers.move(names.index(here.name), names.index(there.name))


@operation(1)
def delete_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(w.modifiers(o)) and o.override_library is None and w.may_lose_sinew(o))
    # Rarely the last Armature modifier, since few operations remain for an object without any.
    candidates = [m for m in w.modifiers(obj) if m.type != "ARMATURE" or r.random() < 0.3]
    modifier = w.one(r, candidates)
    if modifier.type == "ARMATURE":
        w.side.delete_part(obj, "armature modifier")
    obj.modifiers.remove(modifier)


@operation(1)
def rename_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(w.modifiers(o)) and o.override_library is None)
    w.one(r, w.modifiers(obj)).name = w.new_name("modifier")


@operation(2)
def toggle_modifier(w: Walker, r: random.Random) -> None:
    """Excludes those that Sinew has replaced, whose flags it stores."""
    obj = w.mesh(r)
    modifier = w.one(r, [m for m in w.modifiers(obj) if m.type != "ARMATURE" or not w.side.has_sinew(obj)])
    on = not modifier.show_viewport
    modifier.show_viewport = on
    if r.random() < 0.6:
        modifier.show_render = on


@operation(2)
def armature_options(w: Walker, r: random.Random) -> None:
    obj = w.skinned(r)
    modifier = w.one(r, armature_modifiers(obj))
    what = r.choice(("multi", "mask", "mask", "invert", "envelopes", "groups", "volume"))
    if what == "multi":
        modifier.use_multi_modifier = not modifier.use_multi_modifier
    elif what == "mask":
        group = w.one_or_none(r, obj.vertex_groups) if r.random() < 0.6 else None
        modifier.vertex_group = group.name if group is not None else ""
    elif what == "invert":
        modifier.invert_vertex_group = not modifier.invert_vertex_group
    elif what == "envelopes":
        modifier.use_bone_envelopes = not modifier.use_bone_envelopes
    elif what == "groups":
        modifier.use_vertex_groups = not modifier.use_vertex_groups
    # In a mode of the modifier, Sinew controls it temporarily, and switching it has another meaning.
    elif obj.mode in {"EDIT", "SCULPT"} or obj.data.is_editmode:
        raise NothingError
    else:
        w.side.set_preserve_volume(modifier, not w.side.preserve_volume(modifier))


@operation(0.7)
def key_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.override_library is None and not w.shares_action(o))
    modifier = w.one(r, [m for m in w.modifiers(obj) if m.type in ("CAST", "SMOOTH")])
    frames = sorted(r.sample(range(1, 12), 2))
    key(obj, modifier.path_from_id("factor"), [(frames[0], r.random()), (frames[1], r.random())])
    w.this_frame()


@operation(0.5)
def key_option(w: Walker, r: random.Random) -> None:
    """Keys an option of an Armature modifier that Sinew reads when it is bound."""
    obj = w.skinned(r)
    w.skip_if(obj.override_library is not None or w.shares_action(obj))
    modifier = w.one(r, armature_modifiers(obj))
    option = r.choice(("invert_vertex_group", "use_multi_modifier"))
    first, frames = r.random() < 0.5, sorted(r.sample(range(1, 12), 2))
    key(obj, modifier.path_from_id(option), [(frames[0], float(first)), (frames[1], float(not first))])
    w.this_frame()


@operation(1)
def another_armature(w: Walker, r: random.Random) -> None:
    obj, rig = w.skinned(r), w.armature(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    modifier.object = rig


@operation(0.7)
def key_visibility(w: Walker, r: random.Random) -> None:
    obj = w.skinned(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    path = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].show_'
    frames = sorted(r.sample(range(1, 12), 2))
    values = [(frames[0], r.choice((0.0, 1.0))), (frames[1], 1.0)]
    for where in ("viewport", "render"):
        key(obj, path + where, values)
    w.this_frame()


@operation(0.5)
def drive_visibility(w: Walker, r: random.Random) -> None:
    """Sets or removes drivers by an armature's position. Not by a bone's: what follows a bone that was in
    edit mode, Blender does not update until something else changes."""
    obj, rig = w.skinned(r), w.armature(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    paths = [modifier.path_from_id(f"show_{where}") for where in ("viewport", "render")]
    # A driver can not set what a curve sets.
    if not animated_paths(obj).isdisjoint(paths):
        for path in paths:
            obj.driver_remove(path)
        modifier.show_viewport = modifier.show_render = True
        return
    for path in paths:
        curve = obj.driver_add(path)
        driver = curve.driver
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.type = "TRANSFORMS"
        target = variable.targets[0]
        target.id, target.transform_type = rig, "LOC_X"
        for each in list(curve.modifiers):
            curve.modifiers.remove(each)
        while curve.keyframe_points:
            curve.keyframe_points.remove(curve.keyframe_points[0])
        for x, value in ((-10.0, 0.0), (-0.3, 1.0)):
            curve.keyframe_points.insert(x, value).interpolation = "CONSTANT"


@operation(0.5)
def copy_modifiers(w: Walker, r: random.Random) -> None:
    meshes = [o for o in w.meshes() if o.override_library is None and not w.side.has_sinew(o)]
    source = w.mesh(r, lambda o: o.override_library is None and not w.side.is_method_keyed(o))
    target = w.one(r, [o for o in meshes if o != source])
    w.skip_if(not w.select(target, source))
    w.skip_if(target.data.get(SHAPED) and any(m.type == "DECIMATE" for m in source.modifiers))
    bpy.ops.object.make_links_data(type="MODIFIERS")
    w.side.copied_modifiers(source, target)


@operation(0.4)
def apply_modifier(w: Walker, r: random.Random) -> None:
    """Applies what deforms, Sinew's modifier or the Armature modifier, after upstream ones."""
    obj = w.mesh(
        r,
        lambda o: (
            not w.compared
            and len(armature_modifiers(o)) == 1
            and w.modifiers(o)[-1].type == "ARMATURE"
            and o.parent_type != "ARMATURE"
            and w.users(o.data) == 1
            and o.data.shape_keys is None
            and o.override_library is None
            and w.side.is_on(o)
            and w.may_lose_sinew(o)
            and not w.side.has_other_shape(o)
            and not has_scaled_bones(o)
        ),
    )
    w.skip_if(not w.select(obj))
    in_front = [modifier.name for modifier in w.modifiers(obj)[:-1]]
    for name in in_front:
        bpy.ops.object.modifier_apply(modifier=name, single_user=True)
    w.before_evaluation()
    # A window has evaluated newly appended objects.
    bpy.context.view_layer.update()
    paths = [
        m.path_from_id(f"show_{where}") for m in armature_modifiers(obj) for where in ("viewport", "render")
    ]
    w.side.apply(obj)
    # Blender leaves drivers of what it applies, though not of what it removes.
    for path in paths:
        obj.driver_remove(path)
    obj.data.name, obj.data[SHAPED] = w.new_name("mesh"), True


@operation(0.4)
def convert_to_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.is_editable(o) and w.may_lose_sinew(o) and not has_scaled_bones(o))
    w.skip_if(w.side.has_other_shape(obj) or not w.select(obj))
    w.before_evaluation()
    bpy.ops.object.convert(target="MESH")
    obj = bpy.context.view_layer.objects.active
    obj.data.name, obj.data[SHAPED] = w.new_name("mesh"), True
    w.side.applied(obj)


# --- Shape keys


def _keys(obj: bpy.types.Object) -> list[bpy.types.ShapeKey]:
    keys = obj.data.shape_keys
    return list(keys.key_blocks)[1:] if keys is not None else []


@operation(2)
def add_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.mode == "OBJECT" and o.data.library is None and o.override_library is None)
    w.skip_if(len(_keys(obj)) > 3 or obj.data.is_editmode)
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    made = obj.shape_key_add(name=w.new_name("key"), from_mix=False)
    for index in _vertices(w, r, obj):
        made.data[index].co += Vector([r.uniform(-0.2, 0.2) for _axis in range(3)])
    made.value = r.random()


@operation(3)
def shape_key_value(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)))
    block = w.one(r, _keys(obj))
    block.value = r.random()
    if r.random() < 0.2:
        block.mute = not block.mute


@operation(1)
def shape_key_points(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.mode == "OBJECT" and o.data.library is None)
    w.skip_if(obj.data.is_editmode)
    block = w.one(r, _keys(obj))
    for index in _vertices(w, r, obj):
        block.data[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    obj.data.update()


@operation(1)
def key_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None)
    block = w.one(r, _keys(obj))
    for number in r.sample(range(1, 12), 2):
        block.value = r.random()
        block.keyframe_insert("value", frame=number)
    w.this_frame()


@operation(0.7)
def drive_shape_key(w: Walker, r: random.Random) -> None:
    """Sets or removes a driver by a bone, as for correctives."""
    obj, rig = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None), w.armature(r)
    bone = w.one(r, rig.pose.bones)
    block = w.one(r, _keys(obj))
    animation = obj.data.shape_keys.animation_data
    path = block.path_from_id("value")
    if animation is not None and any(d.data_path == path for d in animation.drivers):
        block.driver_remove("value")
        return
    driver = block.driver_add("value").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    target = variable.targets[0]
    target.id, target.bone_target = rig, bone.name
    target.transform_type, target.transform_space = "ROT_X", "LOCAL_SPACE"


@operation(1)
def delete_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.mode == "OBJECT" and o.data.library is None)
    w.skip_if(obj.override_library is not None)
    if r.random() < 0.3:
        obj.shape_key_clear()
    else:
        obj.shape_key_remove(w.one(r, _keys(obj)))


@operation(1)
def pin_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)))
    obj.active_shape_key_index = r.randrange(len(obj.data.shape_keys.key_blocks))
    obj.show_only_shape_key = not obj.show_only_shape_key
    if obj.override_library is None and obj.data.library is None:
        group = w.one_or_none(r, obj.vertex_groups) if r.random() < 0.5 else None
        obj.active_shape_key.vertex_group = group.name if group is not None else ""


@operation(0.4)
def absolute_shape_keys(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None)
    keys = obj.data.shape_keys
    keys.use_relative = not keys.use_relative
    keys.eval_time = r.uniform(0.0, 20.0)


# --- Objects


@operation(1)
def rename_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    w.skip_if(obj.override_library is not None)
    obj.name = w.new_name("object")


def _delete(w: Walker, obj: bpy.types.Object, by_script: bool) -> None:
    w.object_mode()
    if by_script:
        bpy.data.objects.remove(obj)
    else:
        w.skip_if(not w.select(obj))
        bpy.ops.object.delete()


@operation(0.6)
def delete_object(w: Walker, r: random.Random) -> None:
    obj, by_script = w.mesh(r), r.random() < 0.5
    w.skip_if(len(w.meshes()) <= 2)
    _delete(w, obj, by_script)


@operation(0.2)
def delete_armature(w: Walker, r: random.Random) -> None:
    rig, by_script = w.armature(r), r.random() < 0.4
    # A comparison's copies keep it in the file.
    w.skip_if(len(w.armatures()) < 2 or w.compared)
    # So does being on an object with Sinew, if the command does not remove that from the file itself.
    by_script |= any(w.side.has_sinew(obj) for obj in w.objects("MESH"))
    _delete(w, rig, by_script)


@operation(0.3)
def unlink_armature(w: Walker, r: random.Random) -> None:
    """It is then in no collection, as a deleted one is while Sinew knows it. Sinew has to say so. Undone, as
    Blender does not save such an armature where no other data has it."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or w.compared)

    def act() -> None:
        bpy.context.view_layer.update()
        meshes = [o for o in w.objects("MESH") if o.library is None and w.side.is_on(o)]
        for collection in rig.users_collection:
            collection.objects.unlink(rig)
        bpy.context.view_layer.update()
        w.side.check_said_gone(meshes, rig)

    _and_undo(w, r, act)


@operation(1.5)
def duplicate(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.override_library is None and o.data.library is None)
    linked, by_script = r.random() < 0.4, r.random() < 0.4
    w.skip_if(len(w.meshes()) > 6)
    if by_script:
        w.object_mode()
        made = obj.copy()
        if not linked:
            made.data = obj.data.copy()
        if made.animation_data is not None and made.animation_data.action is not None:
            # As Blender's own operator does: keys of a method are keys of other things on the other side.
            slot = getattr(made.animation_data, "action_slot", None)
            made.animation_data.action = made.animation_data.action.copy()
            if slot is not None:
                made.animation_data.action_slot = made.animation_data.action.slots[slot.identifier]
        bpy.context.scene.collection.objects.link(made)
    else:
        w.skip_if(not w.select(obj))
        bpy.ops.object.duplicate(linked=linked)
        made = bpy.context.view_layer.objects.active
    made.name = w.new_name("object")
    if not linked:
        made.data.name = w.new_name("mesh")


@operation(0.5)
def duplicate_armature(w: Walker, r: random.Random) -> None:
    rig, linked = w.armature(r), r.random() < 0.5
    w.skip_if(len(w.armatures()) > 4 or rig.override_library is not None)
    w.object_mode()
    made = rig.copy()
    if not linked:
        made.data = rig.data.copy()
        made.data.name = w.new_name("armature")
    bpy.context.scene.collection.objects.link(made)
    made.name = w.new_name("object")
    made.location.y += 0.5


@operation(0.5)
def single_user(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.users(o.data) > 1 and o.override_library is None)
    w.skip_if(not w.select(obj))
    bpy.ops.object.make_single_user(type="SELECTED_OBJECTS", object=True, obdata=True)
    obj = bpy.context.view_layer.objects.active
    obj.data.name = w.new_name("mesh")


@operation(1.5)
def hide(w: Walker, r: random.Random) -> None:
    obj, how = w.one(r, [*w.meshes(), *w.armatures()]), r.choice(("viewport", "render", "eye", "eye"))
    if how == "eye":
        hidden = not obj.hide_get()
        if obj.mode != "OBJECT":
            w.object_mode()
        obj.hide_set(hidden)
    else:
        name = f"hide_{how}"
        hidden = not getattr(obj, name)
        w.object_mode()
        setattr(obj, name, hidden)


@operation(1)
def hide_collection(w: Walker, r: random.Random) -> None:
    layers = [c for c in bpy.context.view_layer.layer_collection.children if not c.name.startswith("Sinew")]
    layer, how = w.one(r, sorted(layers, key=lambda c: c.name)), r.choice(("exclude", "eye", "viewport"))
    w.object_mode()
    if how == "exclude":
        layer.exclude = not layer.exclude
    elif how == "eye":
        layer.hide_viewport = not layer.hide_viewport
    else:
        layer.collection.hide_viewport = not layer.collection.hide_viewport


@operation(0.7)
def move_to_collection(w: Walker, r: random.Random) -> None:
    obj, collection = w.mesh(r), w.one(r, w.collections())
    w.skip_if(obj.mode != "OBJECT")
    if collection in list(obj.users_collection):
        w.skip_if(len([c for c in obj.users_collection if not c.name.startswith("Sinew")]) == 1)
        collection.objects.unlink(obj)
    else:
        collection.objects.link(obj)


@operation(0.5)
def show_all(w: Walker, r: random.Random) -> None:
    w.object_mode()
    for layer in bpy.context.view_layer.layer_collection.children:
        if not layer.name.startswith("Sinew"):
            layer.exclude = layer.hide_viewport = layer.collection.hide_viewport = False
    for obj in [*w.meshes(), *w.armatures()]:
        obj.hide_set(False)
        obj.hide_viewport = False


# --- Scenes


@operation(0.5)
def scene(w: Walker, r: random.Random) -> None:
    w.object_mode()
    if len(bpy.data.scenes) == 1:
        made = bpy.data.scenes.new("Second")
        made.render.engine = "WALK_RENDER"
        made.render.resolution_x = made.render.resolution_y = 4
        made.render.filepath = bpy.context.scene.render.filepath
        made.camera = bpy.context.scene.camera
        made.frame_start, made.frame_end = FRAMES
        for obj in [*w.meshes(), *w.armatures()]:
            if r.random() < 0.7:
                made.collection.objects.link(obj)
        return
    other = next(s for s in bpy.data.scenes if s != bpy.context.scene)
    if r.random() < 0.3:
        other.frame_set(r.randint(*FRAMES))
    else:
        w.evaluate()
        bpy.context.window.scene = other
    w.this_scene()


@operation(0.5)
def simplify(w: Walker, r: random.Random) -> None:
    render = bpy.context.scene.render
    render.use_simplify = not render.use_simplify
    render.simplify_subdivision = render.simplify_subdivision_render = r.randint(0, 1)


@operation(0.3)
def edit_elsewhere(w: Walker, r: random.Random) -> None:
    """Edits an object of a scene that no window shows, and evaluates that."""
    others = [scene for scene in bpy.data.scenes if scene != bpy.context.scene]
    found = [o for scene in others for o in scene.objects if o.type == "MESH" and not w.side.may_react(o)]
    obj = w.one(r, sorted(found, key=lambda o: o.name_full))
    w.skip_if(obj.library is not None or obj.data.library is not None or obj.data.is_editmode)
    for index in r.sample(range(len(obj.data.vertices)), min(3, len(obj.data.vertices))):
        obj.data.vertices[index].co.z += 0.1
    obj.data.update()
    others[0].view_layers[0].update()


@operation(0.3)
def rigid_body(w: Walker, r: random.Random) -> None:
    """Makes it one that reads its deformed mesh, or none again."""
    obj = w.mesh(r, lambda o: o.override_library is None and o.library is None)
    w.skip_if(not w.select(obj))
    if obj.rigid_body is not None:
        bpy.ops.rigidbody.object_remove()
        return
    if bpy.context.scene.rigidbody_world is None:
        bpy.ops.rigidbody.world_add()
        # It would move what comes into its collection, depending on how often Blender evaluates.
        bpy.context.scene.rigidbody_world.enabled = False
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    body = obj.rigid_body
    body.kinematic, body.collision_shape, body.use_deform = True, "MESH", True
    body.mesh_source = r.choice(("DEFORM", "BASE"))


@operation(0.2)
def copy_scene(w: Walker, r: random.Random) -> None:
    """As the menu does, with all objects or copies of them."""
    whole = r.random() < 0.5
    w.skip_if(len(bpy.data.scenes) > 1 or (whole and len(w.objects("MESH")) > 5) or w.compared)
    w.object_mode()
    # Blender shows the new scene only by keys until something is added or removed in it, such as Sinew's
    # helper objects: then changes without keys are visible again.
    w.this_frame()
    bpy.ops.scene.new(type="FULL_COPY" if whole else "LINK_COPY")
    bpy.context.scene.name = "Second"
    # As a window does immediately.
    bpy.context.view_layer.update()


@operation(0.4)
def view_layer(w: Walker, r: random.Random) -> None:
    w.object_mode()
    layers = bpy.context.scene.view_layers
    if len(layers) == 1:
        layers.new("Second")
    other = next(layer for layer in layers if layer != bpy.context.view_layer)
    # As a window does: Blender sends no notification of a view layer's first evaluation.
    w.evaluate()
    bpy.context.window.view_layer = other
    # As a window does immediately.
    bpy.context.view_layer.update()


# --- Files


@operation(5)
def undo(w: Walker, r: random.Random) -> None:
    steps = r.choice((1, 1, 2))
    w.push_undo()
    for _step in range(steps):
        bpy.ops.ed.undo()
    for obj in filter(w.shares_action, w.objects()):
        # Blender itself evaluates only one of the objects whose action has changed.
        obj.update_tag(refresh={"OBJECT"})
    if r.random() < 0.3:
        if r.random() < 0.5:
            bpy.context.view_layer.update()
        bpy.ops.ed.redo()


@operation(2.5)
def redo(w: Walker, r: random.Random) -> None:
    w.push_undo()
    bpy.ops.ed.redo()


@operation(1)
def save(w: Walker, r: random.Random) -> None:
    w.this_frame()
    bpy.ops.wm.save_as_mainfile(filepath=str(w.folder / "walk.blend"))


@operation(0.5)
def save_copy(w: Walker, r: random.Random) -> None:
    w.this_frame()
    bpy.ops.wm.save_as_mainfile(filepath=str(w.folder / "copy.blend"), copy=True)


def _read_keys_of_hidden() -> None:
    """Sinew makes Blender read all keys with the first evaluation of a file. Hidden objects that appear
    in a later evaluation have these values then, and without Sinew those that were saved."""
    for obj in bpy.data.objects:
        if obj.animation_data is not None:
            obj.update_tag(refresh={"TIME"})


@operation(1)
def save_and_load(w: Walker, r: random.Random) -> None:
    """Sometimes in the mode that an object is in. Others are then compared before it is left."""
    if r.random() < 0.6:
        w.object_mode()
    w.this_frame()
    path = str(w.folder / "walk.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    _read_keys_of_hidden()
    modes = {o.mode for o in w.objects()}
    w.evaluate()
    for obj in w.meshes() if modes != {"OBJECT"} else ():
        if obj.visible_get() and obj.mode == "OBJECT" and not obj.data.is_editmode:
            w.rendered[f"{obj.name_full} in the render, opened"] = w.shown_points(obj)
    w.object_mode()


@operation(0.5)
def revert(w: Walker, r: random.Random) -> None:
    w.skip_if(Path(bpy.data.filepath).name != "walk.blend")
    bpy.ops.wm.revert_mainfile()
    _read_keys_of_hidden()


def _from_library(w: Walker, link: bool) -> list[bpy.types.Object]:
    path = str(w.folder / "library.blend")
    w.object_mode()
    with bpy.data.libraries.load(path, link=link) as (_source, target):
        target.objects = ["Guest", "Guest Rig"]
    for obj in target.objects:
        # Linked again, it is the same one.
        if obj not in list(bpy.context.scene.collection.objects):
            bpy.context.scene.collection.objects.link(obj)
    return list(target.objects)


def _has_guest() -> bool:
    # Others are left over from undo: Sinew's settings keep an armature as its user, which no modifier does.
    shown = [o for o in bpy.data.objects if o.users_collection]
    return any(o.library is not None or o.override_library is not None for o in shown)


@operation(0.5)
def append(w: Walker, r: random.Random) -> None:
    w.skip_if(len(w.meshes()) > 6)
    guest, rig = _from_library(w, link=False)
    guest.name, guest.data.name = w.new_name("object"), w.new_name("mesh")
    rig.name, rig.data.name = w.new_name("object"), w.new_name("armature")


@operation(0.4)
def link(w: Walker, r: random.Random) -> None:
    w.skip_if(_has_guest())
    _from_library(w, link=True)


@operation(0.6)
def override(w: Walker, r: random.Random) -> None:
    if not _has_guest():
        _from_library(w, link=True)
    guest = next((o for o in w.objects("MESH") if o.library is not None), None)
    w.skip_if(guest is None or guest not in w.in_layer())
    w.object_mode()
    guest.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer, do_fully_editable=True)


@operation(0.5)
def reload_library(w: Walker, r: random.Random) -> None:
    w.skip_if(not bpy.data.libraries)
    w.object_mode()
    bpy.data.libraries[0].reload()


@operation(0.7)
def purge(w: Walker, r: random.Random) -> None:
    bpy.data.orphans_purge(do_recursive=r.random() < 0.7)


@operation(1.5)
def render(w: Walker, r: random.Random) -> None:
    w.object_mode()
    w.before_evaluation()
    w.rendered = {}
    if r.random() < 0.3:
        scene = bpy.context.scene
        first = r.randint(1, 10)
        scene.frame_start, scene.frame_end = first, first + 1
        bpy.ops.render.render(animation=True)
        scene.frame_start, scene.frame_end = FRAMES
    else:
        bpy.ops.render.render()


def meddle(obj: bpy.types.Object, what: str, modifier: str, new: str, vertices: list[int]) -> None:
    """Another add-on's operation on an object, and on the modifier with that name."""
    if what == "add":
        obj.modifiers.new(new, "CAST")
    elif what == "weights" and obj.vertex_groups:
        obj.vertex_groups[0].add(vertices, 0.3, "REPLACE")
    elif what == "move":
        obj.location.z += 0.1
    elif what == "name":
        obj.name = new
    elif what == "mesh":
        obj.data = obj.data.copy()
        obj.data.name = new
        for vertex in obj.data.vertices:
            vertex.co.y *= 1.3
    elif what == "rename":
        obj.modifiers[modifier].name = new
    elif what == "toggle":
        obj.modifiers[modifier].show_viewport = not obj.modifiers[modifier].show_viewport
    elif what == "delete":
        obj.modifiers.remove(obj.modifiers[modifier])


@operation(0.7)
def export(w: Walker, r: random.Random) -> None:
    """The data that another program receives."""
    obj = w.mesh(r)
    w.skip_if(not w.select(obj))
    w.evaluate()
    path = w.folder / "walk.obj"
    bpy.ops.wm.obj_export(
        filepath=str(path),
        export_selected_objects=True,
        export_materials=False,
        export_uv=False,
        export_normals=False,
        forward_axis="Y",
        up_axis="Z",
    )
    lines = (line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v "))
    points = np.array(list(lines), dtype=np.float32).reshape(-1, 3)
    w.rendered = {f"{obj.name_full} in the render, exported": points}


@operation(0.3)
def safe_mode(w: Walker, r: random.Random) -> None:
    on = r.random() < 0.5
    w.side.set_safe(on)


@operation(1)
def neighbour(w: Walker, r: random.Random) -> None:
    """Another add-on's handler, called once, at a change of frame."""
    obj, when = w.mesh(r), r.choice(("frame_change_pre", "frame_change_post", "depsgraph_update_post"))
    what, number = (
        r.choice(("rename", "toggle", "add", "delete", "weights", "move", "name", "mesh")),
        r.randint(*FRAMES),
    )
    w.skip_if(obj.override_library is not None or obj.mode != "OBJECT" or obj.data.library is not None)
    modifier = w.one_or_none(r, [m for m in w.modifiers(obj) if m.type != "ARMATURE"])
    w.skip_if(what in ("rename", "toggle", "delete") and modifier is None)
    name, vertices, new = obj.name, _vertices(w, r, obj), w.new_name("neighbour")
    modifier_name = modifier.name if modifier is not None else ""
    handlers = getattr(bpy.app.handlers, when)

    def act(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
        handlers.remove(act)
        meddle(bpy.data.objects[name], what, modifier_name, new, vertices)

    handlers.append(act)
    if when == "depsgraph_update_post":
        obj.update_tag()
        w.evaluate()
        # Objects touched before and again in a handler are compared at the next event.
        w.this_frame()
    else:
        # So are newly set ones, because that touches the mesh, too.
        w.evaluate()
        bpy.context.scene.frame_set(number)
        if what in ("move", "weights") and when == "frame_change_post":
            # Changes by another handler are visible at the next event after the update, and weights where
            # there is an upstream modifier (docs/guide.md).
            w.this_frame()
    if act in handlers:
        handlers.remove(act)


@operation(0.5)
def touch(w: Walker, r: random.Random) -> None:
    obj, what = w.one(r, [*w.meshes(), *w.armatures()]), r.choice(("object", "data", "all"))
    if what == "object":
        obj.update_tag()
    elif what == "data":
        obj.data.update_tag()
    else:
        obj.update_tag(refresh={"OBJECT", "DATA", "TIME"})


@operation(2)
def update(w: Walker, r: random.Random) -> None:
    w.evaluate()


@operation(0)
def says(w: Walker, r: random.Random) -> None:
    """For scripts: what Sinew has to say about a mesh."""
    obj = w.mesh(r)
    if w.side.is_sinew and not any(str(word) in obj.sinew.error for word in r.words):
        raise ValueError(f"{obj.name}: says {obj.sinew.error!r}")
    r.words.clear()
