# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a walk in its own process, started by walk.py, as its Blender may crash.

    python walk_child.py sinew|blender fast|safe FOLDER

Reads pickled requests from its input and answers each on its output. Blender's own output is discarded, and
its error output is searched for exceptions.
"""

from __future__ import annotations

import os
import pickle
import random
import re
import sys
import zlib
from importlib import import_module
from pathlib import Path

import operations
import walk_script


def coordinates_of(evaluated):
    """The points that Generated texture coordinates are made from. Blender 5.3 leaves those of loose edges
    behind a Subdivision as they lay in memory."""
    import bpy
    import numpy as np
    import walk_sides

    points = walk_sides.points_of(evaluated.data.vertices, "undeformed_co")
    if bpy.app.version >= (5, 3):
        corners = np.empty(len(evaluated.data.loops), np.int32)
        evaluated.data.loops.foreach_get("vertex_index", corners)
        points[np.setdiff1d(np.arange(len(points)), corners)] = 0.0
    return points


def make_engine(walker, points_of) -> type:
    import bpy

    class WalkRender(bpy.types.RenderEngine):
        """Draws nothing, and stores the shapes: any other engine needs a second for a render."""

        bl_idname = "WALK_RENDER"
        bl_label = "Walk"

        def render(self, depsgraph) -> None:
            scene = depsgraph.scene
            for obj in depsgraph.objects:
                if obj.type == "MESH" and not walker.side.is_helper(obj.original):
                    name = f"{obj.original.name_full} in the render, frame {scene.frame_current}"
                    walker.rendered[name] = points_of(obj)
                    walker.rendered[f"{name}, coordinates"] = coordinates_of(obj)
                    walker.expect_rendered(name, obj.original, depsgraph)
            result = self.begin_result(0, 0, 4, 4)
            self.end_result(result)

    return WalkRender


class Child:
    def __init__(self, role: str, route: str, folder: Path, errors: Path) -> None:
        import bpy
        import numpy as np
        import walk_shapes
        import walk_sides
        import walk_start
        import walker

        self.bpy, self.np, self.operations, self.sides = bpy, np, walker.OPERATIONS, walk_sides
        self.start_file, self.nothing_error = walk_start.start, walker.NothingError
        for part in operations.PARTS:
            import_module(f"operations.{part}")
        self.shapes_of = walk_shapes
        self.errors = errors
        self.read_to = 0
        if role == "sinew":
            import walk_with_sinew

            self.side = walk_with_sinew.SinewSide()
        else:
            self.side = walk_sides.BlenderSide()
        self.side.prepare(safe=route == "safe")
        self.walker = walker.Walker(self.side, folder)
        self.walker.before_evaluation = self.before_evaluation
        self.walker.expect_rendered = self.expect_rendered
        self.walker.points_of = self.points_of
        bpy.utils.register_class(make_engine(self.walker, self.points_of))
        self.claims: dict = {}
        self.wrong: list[str] = []
        walk_start.make_library(self.walker)

    # --- Requests

    def start(self, _request: dict) -> dict:
        self.claims, self.wrong = {}, []
        self.side.set_safe(False)
        self.side.compute_beside(False)
        self.start_file(self.walker)
        self.bpy.ops.ed.undo_push(message="start")
        # Those of a file that an earlier walk left broken.
        self.problems()
        return {"said": "start", "problems": self.problems(), **self.look(check=True)}

    def step(self, request: dict) -> dict:
        name, seed = request["operation"], request["seed"]
        # Sinew's side reports its settings before this operation and after it.
        self.claims = request.get("claims_before") or {}
        self.wrong = []
        if not self.side.is_sinew:
            # The objects that an operation can choose depend on it.
            self.side.adopt(self.claims)
        words = request["words"]
        numbers = walk_script.Chosen(seed, words) if words else random.Random(seed)
        if words:
            self.walker.chosen = ""
        operation = self.operations[name]
        self.walker.rendered, self.walker.rendered_by_library = {}, {}
        outcome = "done"
        try:
            said = operation.act(self.walker, numbers)
        except self.nothing_error:
            outcome, said = "nothing", name
        except Exception as error:
            outcome, said = "refused", f"{name}: {type(error).__name__}: {error}"
            if not isinstance(error, RuntimeError) and type(error).__name__ != "SinewError":
                outcome = "failed"
        if outcome == "done" and name not in ("undo", "redo"):
            self.walker.unpushed = True
            if request["push"]:
                self.walker.push_undo()
        self.claims = request.get("claims_after") or {}
        if not self.side.is_sinew:
            self.wrong = []
        result = {"outcome": outcome, "said": said, **self.look(request["check"])}
        result["rendered"] = self.walker.rendered
        result["rendered by library"] = self.walker.rendered_by_library
        if self.side.is_sinew and name == "remove_all" and not result["claims"]:
            result["left over"] = self.side.left_over()
        result["problems"] = self.problems()
        if words and (outcome != "done" or numbers.words):
            left = f", {numbers.words} not chosen" if numbers.words else ""
            result["problems"].append(f"ScriptError: {name} {words}: {outcome}, {said}{left}")
        return result

    def open(self, request: dict) -> dict:
        """The shapes of a file that the other side saved, as seen without Sinew."""
        self.bpy.ops.wm.open_mainfile(filepath=request["path"])
        self.bpy.context.view_layer.update()
        shapes, _skipped = self.shapes(self.bpy.context.evaluated_depsgraph_get())
        return {"shapes": shapes, "problems": self.problems()}

    def before_evaluation(self) -> None:
        if not self.side.is_sinew:
            self.wrong += self.side.bring_in_line(self.claims)

    def problems(self) -> list[str]:
        """Exceptions that were printed or logged since the last call."""
        sys.stderr.flush()
        with self.errors.open("rb") as file:
            file.seek(self.read_to)
            text = file.read()
            self.read_to = file.tell()
        found = []
        printed = text.decode(errors="replace")
        if "Traceback" in printed:
            found.append(printed[printed.index("Traceback") :].strip())
        if self.side.is_sinew:
            found += self.side.records.errors
            self.side.records.errors = []
        return found

    # --- State

    def look(self, check: bool) -> dict:
        """The state of the file: Sinew's settings and, after an evaluation, the shapes."""
        if not check:
            if not self.side.is_sinew:
                return {}
            return {"claims": self.side.claims()}
        found: dict = {}
        if not self.side.is_sinew:
            self.wrong += self.side.bring_in_line(self.claims)
        self.bpy.context.view_layer.update()
        if self.side.is_sinew:
            self.side.wait()
            self.bpy.context.view_layer.update()
        depsgraph = self.bpy.context.evaluated_depsgraph_get()
        found["shapes"], found["skipped"] = self.shapes(depsgraph)
        found["state"] = self.state()
        if self.side.is_sinew:
            found["claims"] = self.side.claims()
            found["copies"] = self.copies(depsgraph)
            found["unanswered"] = self.side.records.unanswered
            self.side.records.unanswered = 0
        else:
            found["wrong"] = self.wrong
            found["expected"] = self.all_expected()
        return found

    def all_expected(self) -> dict:
        """Points of visible objects whose shape Blender can not compute."""
        found = {}
        for obj in self.bpy.context.view_layer.objects:
            if obj.type != "MESH" or not obj.visible_get():
                continue
            if self.side.has_other_shape(obj):
                points = self.expected(obj)
                if points is not None:
                    found[obj.name_full] = points
        self.bpy.context.view_layer.update()
        return found

    def points_of(self, evaluated):
        return self.sides.points_of(evaluated.data.vertices)

    def shapes(self, depsgraph) -> tuple[dict, list[str]]:
        """Points and matrix of each mesh in the visible view layer; the names of those whose shape the
        other side can not know."""
        found, skipped = {}, []
        # Blender evaluates a rigid body that reads its deformed mesh before it places it. An Armature
        # modifier deforms it where it was before, until the next evaluation (seen on 5.3 without Sinew).
        bodies = [obj for obj in self.bpy.context.view_layer.objects if obj.rigid_body is not None]
        for obj in bodies:
            obj.update_tag(refresh={"DATA"})
        if bodies:
            self.bpy.context.view_layer.update()
        for obj in self.bpy.context.view_layer.objects:
            if obj.type != "MESH" or self.side.is_helper(obj) or not obj.visible_get():
                continue
            evaluated = obj.evaluated_get(depsgraph)
            found[obj.name_full] = (self.points_of(evaluated), self.np.array(evaluated.matrix_world))
            # Hair has Blender make them, which modifiers behind it may drop. Views that draw colours of
            # attributes, as for heat maps, keep them; the other side has no such views.
            last = next((m for m in reversed(self.walker.modifiers(obj)) if m.show_viewport), None)
            if last is not None and last.type == "PARTICLE_SYSTEM":
                name = f"{obj.name_full} in the render, coordinates in the viewport"
                self.walker.rendered[name] = coordinates_of(evaluated)
            if self.side.is_sinew:
                import walk_normals

                points = found[obj.name_full][0]
                self.side.records.errors += walk_normals.faults(obj, evaluated.data, points)
        # Renders show what is hidden here, and other view layers.
        for obj in self.walker.objects("MESH"):
            in_its_mode = obj.data.is_editmode or self.sides.shows_own_shape_in_its_mode(obj)
            if in_its_mode or (not self.side.is_sinew and self.is_unknown(obj)):
                skipped.append(obj.name_full)
        return found, skipped

    def is_unknown(self, obj) -> bool:
        """Whether Blender's side can not compute Sinew's shape."""
        side = self.side
        if obj.library is not None:
            # Saved as Sinew had it.
            return True
        if not side.has_sinew(obj):
            return False
        if side.is_method_keyed(obj):
            paths = {c.data_path for c in self.sides.curves_of(obj)}
            run = (self.claims.get(obj.name_full) or {"run": []})["run"]
            keyed = {
                modifier.name
                for modifier in self.sides.armature_modifiers(obj)
                if f'modifiers["{modifier.name}"].use_deform_preserve_volume' in paths
            }
            # Sinew's method is that of its run, and the walk keys all of them.
            if keyed != set(run) or not side.is_on(obj):
                return True
        if not side.is_on(obj):
            return False
        return side.has_other_shape(obj) or self.has_other_scale(obj)

    def expect_rendered(self, name: str, obj, depsgraph) -> None:
        if not self.side.is_sinew and self.side.has_other_shape(obj):
            points = self.expected(obj, depsgraph)
            if points is not None:
                self.walker.rendered_by_library[name] = points

    def expected(self, obj, render=None):
        """The points of an object whose shape Blender can not compute; None if they are unknown."""
        side, claim = self.side, self.claims.get(obj.name_full)
        if obj.library is not None or side.is_method_keyed(obj) or self.has_other_scale(obj):
            return None
        if claim is None or not side.is_on(obj) or obj.data.is_editmode:
            return None
        return self.shapes_of.expected(
            obj, claim["run"], claim["method"], claim["stages in mesh"], claim["parameters"], render
        )

    def has_other_scale(self, obj) -> bool:
        """Whether Sinew deforms scaled bones differently from the modifier."""
        rule = (self.claims.get(obj.name_full) or {"rule": ""})["rule"]
        return rule != "4.0" and self.sides.has_scaled_bones(obj)

    def copies(self, depsgraph) -> dict:
        return {
            (original, method): self.points_of(obj.evaluated_get(depsgraph))
            for obj, original, method in self.side.copies()
            if obj.visible_get()
        }

    def shapes_by(self, request: dict) -> dict:
        """The shapes by each method of a comparison's originals, if these have one Armature modifier."""
        found = {}
        for name, method in request["copies"]:
            obj = self.bpy.context.view_layer.objects.get(name)
            modifiers = self.sides.armature_modifiers(obj) if obj is not None else []
            animated = self.sides.animated_paths(obj) if obj is not None else set()
            if (
                any(".show_" in path for path in animated)
                or len(modifiers) != 1
                or method not in ("blender", *self.sides.OF_BLENDER)
                # As after Add, its copies deform nevertheless.
                or (method != "blender" and not (modifiers[0].show_viewport or modifiers[0].show_render))
                or (method != "blender" and self.side.stages(obj))
                or (method != "blender" and self.has_other_scale(obj))
                or obj.data.is_editmode
                or not obj.visible_get()
            ):
                continue
            modifier = modifiers[0]
            before = modifier.use_deform_preserve_volume
            if method != "blender":
                modifier.use_deform_preserve_volume = method == "dq"
            else:
                modifier.use_deform_preserve_volume = modifier.show_expanded
            depsgraph = self.bpy.context.evaluated_depsgraph_get()
            found[name, method] = self.points_of(obj.evaluated_get(depsgraph))
            modifier.use_deform_preserve_volume = before
        self.bpy.context.view_layer.update()
        return found

    def state(self) -> dict[str, object]:
        """The content of the file besides shapes, without Sinew's own."""
        bpy = self.bpy
        found: dict[str, object] = {
            "scene": bpy.context.scene.name,
            "frame": bpy.context.scene.frame_current,
            # Whether unused linked data stays depends on user counts, which Blender also keeps for settings.
            # Includes objects in no scene.
            "objects": [
                o.name_full for o in self.walker.objects() if o.library is None and o.users_collection
            ],
        }
        there = [o for o in self.walker.objects("MESH") if o.library is None and o.users_collection]
        found["meshes"] = sorted({obj.data.name_full for obj in there})
        of_helpers = {o.data for o in bpy.data.objects if self.side.is_helper(o)}
        found["armatures"] = sorted(
            a.name_full for a in bpy.data.armatures if not (a.library or a in of_helpers)
        )
        found["collections"] = [c.name for c in self.walker.collections()]
        for obj in self.walker.objects("MESH"):
            if obj.library is None and obj.users_collection:
                found[f"object {obj.name_full}"] = self.object_state(obj)
        for obj in self.walker.objects("ARMATURE"):
            if obj.library is None and obj.users_collection:
                # Changes in edit mode become visible to others when Blender next needs them.
                bones = [] if obj.data.is_editmode else [bone.name for bone in obj.data.bones]
                found[f"armature {obj.name_full}"] = bones
        return found

    def object_state(self, obj) -> dict[str, object]:
        side = self.side
        keys = obj.data.shape_keys
        found: dict[str, object] = {
            "mesh": obj.data.name_full,
            "mode": obj.mode,
            "vertices": len(obj.data.vertices) if not obj.data.is_editmode else "edited",
            "groups": [g.name for g in obj.vertex_groups],
            "keys": [b.name for b in keys.key_blocks] if keys is not None else [],
            "parent": obj.parent.name_full if obj.parent is not None else "",
            "hidden": (obj.hide_viewport, obj.hide_render),
            "driven": side.has_sinew(obj),
        }
        found["modifiers"] = [(m.name, m.type) for m in self.walker.modifiers(obj)]
        if obj.mode == "OBJECT" and obj.override_library is None and not obj.data.is_editmode:
            found["weights"] = zlib.crc32(
                repr([(g.group, round(g.weight, 6)) for v in obj.data.vertices for g in v.groups]).encode()
            )
        keyed = self.sides.animated_paths(obj)
        if not side.is_on(obj) and obj.mode == "OBJECT":
            found["armature modifiers"] = [
                {
                    "name": m.name,
                    # Keyed values are those that Blender evaluated last, which it does not do while they are
                    # hidden.
                    "on": [
                        getattr(m, name) if m.path_from_id(name) not in keyed else "animated"
                        for name in ("show_viewport", "show_render")
                    ],
                    "object": m.object.name_full if m.object is not None else "",
                    "volume": side.preserve_volume(m),
                    "options": (m.use_multi_modifier, m.vertex_group, m.invert_vertex_group),
                    "by": (m.use_bone_envelopes, m.use_vertex_groups),
                }
                for m in self.sides.armature_modifiers(obj)
            ]
        if not side.has_sinew(obj):
            found["parent type"] = obj.parent_type
        return found


def main() -> int:
    role, route, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    answers = os.fdopen(os.dup(1), "wb")
    requests = os.fdopen(os.dup(0), "rb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    errors = folder / "errors.txt"
    # Opened for appending, so that others' writing does not depend on how far this file was read.
    file = os.open(errors, os.O_CREAT | os.O_RDWR | os.O_APPEND | os.O_TRUNC)
    os.dup2(file, 2)
    sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
    child = Child(role, route, folder, errors)
    ways = {"start": child.start, "step": child.step, "shapes by": child.shapes_by, "open": child.open}

    def answer(what: object) -> None:
        pickle.dump(what, answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()

    answer({"blender": child.bpy.app.version_string})
    while True:
        try:
            request = pickle.load(requests)
        except EOFError:
            break
        answer(ways[request["what"]](request))
    # Skips the exit of Blender as a module, which can crash or hang by itself.
    os._exit(0)


if __name__ == "__main__":
    if not re.fullmatch("sinew|blender", sys.argv[1] if len(sys.argv) > 1 else ""):
        sys.exit(__doc__)
    main()
