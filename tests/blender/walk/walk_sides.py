# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk's side without Sinew: what an operation on Sinew is there. walk_with_sinew has the other side.

It stores Sinew's settings in properties that change no shape and that Blender itself copies,
undoes, links and saves with their owner: an object's pass index, and whether an Armature modifier is
expanded. An expanded one has its own Preserve Volume on; the flag itself currently follows Sinew's method.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import sinew

OF_BLENDER = ("lbs", "dq")
METHODS = (*OF_BLENDER, *(m.name for m in sinew.methods() if m.name not in OF_BLENDER))
# The stages that an object may have, as parameters that differ from the defaults; the first entry has none.
# Their groups are those of the tubes, which may be missing like any others.
STAGES: tuple[dict[str, dict[str, object]], ...] = (
    {},
    {"mix": {"method": "dq", "group": "lower"}},
    {"mix": {"method": "cor", "group": "upper"}},
    {"bulge_limit": {"strength": 0.8}},
    {"bulge_limit": {"form": "kim_han", "group": "shin"}},
    {"delta_mush": {"iterations": 4}},
    {"delta_mush": {"radius": 0.2, "smooth_type": "length_weighted", "group": "lower"}},
    {"delta_mush": {"pin_boundary": True, "group": "thigh", "invert_group": True, "scale": 0.5}},
    {
        "mix": {"method": "lbs", "group": "lower"},
        "bulge_limit": {"group": "upper"},
        "delta_mush": {"factor": 0.9, "iterations": 3},
    },
)
# Bits of the pass index. ADOPTED: Sinew itself chooses what it does with the object, and when, until it is
# attached. CHANGED: other settings differ from before, since Blender's undo checks whether anything does.
DRIVEN, ON, KEYED, ADOPTED, CHANGED = 1, 2, 4, 8, 16
# Numbers in the bits above: indices into METHODS and STAGES, four bits each.
METHOD, STAGE, FIELD = 32, 512, 15
# Above these: it has its own settings within its character; an error prevents Sinew.
OWN, REFUSED = 8192, 16384


def whole_stages(number: int) -> dict[str, dict[str, object]]:
    """All parameters of STAGES[number], in the form of claims."""
    known = {stage.name: stage for stage in sinew.stages()}
    found = {}
    for name, given in STAGES[number].items():
        values = {p.id: "" if p.kind == "vertex_group" else p.default for p in known[name].parameters}
        found[name] = {**values, "enabled": True, **given} if "enabled" in values else {**values, **given}
    return found


def number_of(stages: dict[str, dict[str, object]]) -> int:
    """The index into STAGES for an object's settings; -1 if they are none of them."""

    def rounded(of: dict[str, dict[str, object]]) -> dict:
        return {
            name: {key: round(v, 5) if isinstance(v, float) else v for key, v in values.items()}
            for name, values in of.items()
        }

    return next((n for n in range(len(STAGES)) if rounded(whole_stages(n)) == rounded(stages)), -1)


def armature_modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    return [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE"]


def has_scaled_bones(obj: bpy.types.Object) -> bool:
    """Whether its shape can depend on the scale rule."""
    # A constraint between armatures of different sizes scales a bone that has no scale of its own.
    return any(
        tuple(round(s, 5) for s in bone.scale) != (1, 1, 1) or len(bone.constraints)
        for modifier in armature_modifiers(obj)
        if modifier.object is not None and modifier.object.pose is not None
        for bone in modifier.object.pose.bones
    )


def shows_own_shape_in_its_mode(obj: bpy.types.Object) -> bool:
    """Whether Sinew leaves the object to the Armature modifiers in its current mode."""
    if obj.mode != "WEIGHT_PAINT":
        return obj.mode in {"EDIT", "SCULPT"}
    keyed = animated_paths(obj)
    return any(
        f'modifiers["{modifier.name}"].show_{where}' in keyed
        for modifier in armature_modifiers(obj)
        for where in ("viewport", "render")
    )


def curves_of(owner: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves that an ID's animation plays, in 4.2 to 5.2."""
    animation = owner.animation_data
    action = animation.action if animation is not None else None
    if action is None:
        return []
    if not hasattr(action, "layers"):
        return list(action.fcurves)
    slot = animation.action_slot
    bags = [s.channelbag(slot) for layer in action.layers for s in layer.strips] if slot is not None else []
    return [curve for bag in bags if bag is not None for curve in bag.fcurves]


# Operators that repair weights, by finding: those that both sides can run.
MENDS = {"no_weights": ("fill",), "small_sums": ("normalize", "fill"), "many_influences": ("limit",)}


def points_of(vertices: bpy.types.bpy_prop_collection, name: str = "co") -> np.ndarray:
    """float32 [vertices, 3] of a mesh or a shape key."""
    points = np.empty((len(vertices), 3), dtype=np.float32)
    vertices.foreach_get(name, points.ravel())
    return points


def world_points(obj: bpy.types.Object) -> np.ndarray:
    """float64 [vertices, 3], as Blender shows it."""
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    return points_of(evaluated.data.vertices) @ matrix[:3, :3].T + matrix[:3, 3]


def animated_paths(obj: bpy.types.Object) -> set[str]:
    """What its curves and drivers set."""
    animation = obj.animation_data
    drivers = animation.drivers if animation is not None else ()
    return {curve.data_path for curve in (*curves_of(obj), *drivers)}


def remove_curves(owner: bpy.types.ID, end: str) -> None:
    """Removes the curves whose data path ends with this, and with the last of them the action, which others
    would share."""
    action = owner.animation_data.action if owner.animation_data is not None else None
    for curve in [c for c in curves_of(owner) if c.data_path.endswith(end)]:
        if not hasattr(action, "layers"):
            action.fcurves.remove(curve)
            continue
        for layer in action.layers:
            for strip in layer.strips:
                for bag in strip.channelbags:
                    if curve in list(bag.fcurves):
                        bag.fcurves.remove(curve)
                        break
    if action is not None and not curves_of(owner):
        owner.animation_data.action = None


def key(owner: bpy.types.ID, path: str, values: list[tuple[int, float]]) -> None:
    """Keys a property, whatever its current value."""
    for frame, _value in values:
        owner.keyframe_insert(path, frame=frame)
    curve = next(c for c in curves_of(owner) if c.data_path == path)
    at = dict(values)
    for point in curve.keyframe_points:
        if point.co.x in at:
            point.co.y = at[point.co.x]
            point.interpolation = "CONSTANT"
    curve.update()


class Side:
    """What one of the two sides has nothing to do for."""

    def nothing(self, *_given: object, **_options: object) -> None:
        pass

    prepare = set_safe = compute_beside = wait = nothing
    is_helper = own_modifier = nothing
    check_warned = check_refused = check_said_gone = before_render = note_flags = nothing
    bake_to_bones = add_corrective_key = play_motion_range = applied = copied_modifiers = nothing
    start_comparison = end_comparison = arrange_comparison = nothing


class BlenderSide(Side):
    """The Blender without Sinew."""

    is_sinew = False

    def __init__(self) -> None:
        # The modifiers that Sinew reports as replaced, by the name of each object.
        self.runs: dict[str, list[str]] = {}
        # Those that Sinew's side reported an error for when it was last asked, whatever undo has restored.
        self.refused: set[str] = set()

    def has_sinew(self, obj: bpy.types.Object) -> bool:
        return bool(obj.pass_index & DRIVEN)

    def is_on(self, obj: bpy.types.Object) -> bool:
        return bool(obj.pass_index & ON) and not obj.pass_index & REFUSED

    def method(self, obj: bpy.types.Object) -> str:
        return METHODS[self._field(obj, METHOD)]

    def stages(self, obj: bpy.types.Object) -> int:
        """The index into STAGES."""
        return self._field(obj, STAGE)

    def has_other_shape(self, obj: bpy.types.Object) -> bool:
        """Whether it has a shape that Blender can not compute."""
        return self.is_on(obj) and (self.method(obj) not in OF_BLENDER or self.stages(obj) != 0)

    @staticmethod
    def _field(obj: bpy.types.Object, first: int) -> int:
        return obj.pass_index // first & FIELD

    def _set_field(self, obj: bpy.types.Object, first: int, number: int) -> None:
        value = obj.pass_index & ~(FIELD * first) | number * first
        if obj.pass_index != value:
            obj.pass_index = value

    def _set(self, obj: bpy.types.Object, bit: int, on: bool) -> None:
        value = obj.pass_index | bit if on else obj.pass_index & ~bit
        if obj.pass_index != value:
            obj.pass_index = value

    def note_flags(self, obj: bpy.types.Object) -> None:
        """Called when the walk itself has set Preserve Volume."""
        for modifier in armature_modifiers(obj):
            modifier.show_expanded = modifier.use_deform_preserve_volume

    def preserve_volume(self, modifier: bpy.types.Modifier) -> bool:
        """The modifier's own value."""
        return modifier.show_expanded

    def set_preserve_volume(self, modifier: bpy.types.Modifier, on: bool) -> None:
        modifier.show_expanded = on
        # The flag itself has the keys of Sinew's method.
        if not self.is_method_keyed(modifier.id_data):
            modifier.use_deform_preserve_volume = on

    def add(self, obj: bpy.types.Object, method: str | None, leave_small: bool) -> None:
        first = next((m for m in armature_modifiers(obj) if m.object is not None), None)
        if self.has_sinew(obj) or first is None:
            return
        self._set(obj, ADOPTED, False)
        self._set(obj, DRIVEN, True)
        self._set(obj, ON, True)
        self.set_method(obj, method or ("dq" if first.show_expanded else "lbs"))

    def remove(self, obj: bpy.types.Object) -> None:
        if self.has_sinew(obj):
            self.unkey_method(obj, self.method(obj))
            obj.pass_index = 0

    def set_method(self, obj: bpy.types.Object, method: str) -> None:
        self._set_field(obj, METHOD, METHODS.index(method))

    def set_stages(self, obj: bpy.types.Object, number: int) -> None:
        self._set_field(obj, STAGE, number)

    def set_enabled(self, obj: bpy.types.Object, on: bool) -> None:
        if on and not self.is_on(obj):
            self._use_keyed_flags(obj)
        self._set(obj, ON, on)

    def click(self, obj: bpy.types.Object, which: str, view: str, deformers: dict[str, str]) -> None:
        """A click on one of the icons.

        which      Sinew or Armature, a modifier
        deformers  for each view, which of them then deforms; empty for none
        """
        self._show(obj, deformers, "viewport")

    def before_render(self, obj: bpy.types.Object, deformers: dict[str, str]) -> None:
        self._show(obj, deformers, "render")

    def _show(self, obj: bpy.types.Object, deformers: dict[str, str], shown: str) -> None:
        (modifier,) = armature_modifiers(obj)
        for view, deformer in deformers.items():
            setattr(modifier, f"show_{view}", deformer != "")
        is_dq = self.method(obj) == "dq" if deformers[shown] == "Sinew" else modifier.show_expanded
        modifier.use_deform_preserve_volume = is_dq

    def rebind(self, obj: bpy.types.Object) -> None:
        self.set_enabled(obj, True)

    def _use_keyed_flags(self, obj: bpy.types.Object) -> None:
        """While it was off, the values were the artist's own; Blender sets keyed ones in the next frame."""
        scene = bpy.context.scene
        values = {c.data_path: c.evaluate(scene.frame_current_final) for c in curves_of(obj)}
        for modifier in armature_modifiers(obj):
            value = values.get(modifier.path_from_id("use_deform_preserve_volume"))
            if value is not None:
                modifier.use_deform_preserve_volume = value >= 0.5

    # --- Characters: all meshes of an armature that Sinew deforms, in the scene's order

    def character(self, rig: bpy.types.Object) -> list[bpy.types.Object]:
        def armature_of(obj: bpy.types.Object) -> bpy.types.Object | None:
            modifiers, run = armature_modifiers(obj), self.runs.get(obj.name_full, [])
            # A renamed one may not be known by its name yet.
            chosen = [modifier for modifier in modifiers if modifier.name in run] or modifiers
            return next((modifier.object for modifier in chosen if modifier.object is not None), None)

        return [
            obj
            for obj in bpy.context.scene.objects
            if obj.type == "MESH" and self.has_sinew(obj) and armature_of(obj) == rig
        ]

    def is_own(self, obj: bpy.types.Object) -> bool:
        return bool(obj.pass_index & OWN)

    def set_character_method(self, rig: bpy.types.Object, method: str) -> None:
        """With the armature selected."""
        for obj in self._followers(rig):
            self.set_method(obj, method)

    def switch_own(self, rig: bpy.types.Object, obj: bpy.types.Object) -> None:
        """With the mesh selected."""
        own = not self.is_own(obj)
        self._set(obj, OWN, own)
        others = [other for other in self._followers(rig) if other != obj]
        if not own and others:
            self._share(others[0], obj)

    def use_preset(self, rig: bpy.types.Object, folder: Path) -> None:
        """Sets one of the character's own settings, which all its meshes then have, and the groups of its
        stages."""
        followers = self._followers(rig)
        for obj in followers[1:]:
            self._share(followers[0], obj)

    def _followers(self, rig: bpy.types.Object) -> list[bpy.types.Object]:
        return [obj for obj in self.character(rig) if not self.is_own(obj)]

    def _share(self, source: bpy.types.Object, target: bpy.types.Object) -> None:
        self.set_method(target, self.method(source))
        self.set_stages(target, self.stages(source))

    # --- Features that change the mesh

    def mend(self, obj: bpy.types.Object, how: str, most: int) -> str | None:
        """What was found and repaired; None for nothing. Uses only the library's weights, not the
        add-on's interpretation."""
        from sinew_addon.attach.modifier_options import ModifierOptions
        from sinew_addon.features.diagnose.mend import WeightMender
        from sinew_addon.features.measure.diagnostics import check_weights
        from sinew_addon.io import armature_io, mesh_io, spaces
        from sinew_addon.skinning.vectors import transformed

        depsgraph = bpy.context.evaluated_depsgraph_get()
        (modifier,) = armature_modifiers(obj)
        evaluated = modifier.object.evaluated_get(depsgraph)
        bones, weights = armature_io.read_bones(evaluated), mesh_io.read_group_weights(obj.data)
        weighting = ModifierOptions.read(modifier).weighting(obj.vertex_groups.keys(), weights, bones)
        space = spaces.bones_from_model(obj.evaluated_get(depsgraph), evaluated)
        points = mesh_io.read_points(obj.data)
        points = points if space is None else transformed(points, space)
        names = [group.name for group in obj.vertex_groups]
        findings = check_weights(weighting, points, weights, names, most)
        found = next((each for each in findings if how in MENDS.get(each.name, ())), None)
        if found is None:
            return None
        mender = WeightMender(weights, bones.of_groups(names) >= 0, np.zeros(len(names), dtype=bool))
        vertices = found.vertices.tolist()
        if how == "limit":
            rows = mender.limited(vertices, most)
        elif how == "normalize":
            rows = mender.normalized(vertices)
        else:
            rows = mender.filled(vertices, mesh_io.read_topology(obj.data).edges, most)
        if not rows:
            return None
        mesh_io.write_group_weights(obj, rows)
        return found.name

    def set_option(self, obj: bpy.types.Object, name: str, value: object) -> None:
        """A modifier that changes no shape."""
        obj.pass_index ^= CHANGED

    def set_heat(self, obj: bpy.types.Object, on: bool, quantity: str) -> None:
        self.set_option(obj, "heat", on)

    def key_method(self, obj: bpy.types.Object, values: list[tuple[int, str]]) -> None:
        self._set(obj, KEYED, True)
        if self.method(obj) not in OF_BLENDER:
            self.set_method(obj, "lbs")
        for modifier in armature_modifiers(obj):
            path = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].use_deform_preserve_volume'
            key(obj, path, [(frame, float(method == "dq")) for frame, method in values])

    def unkey_method(self, obj: bpy.types.Object, method: str) -> None:
        remove_curves(obj, ".use_deform_preserve_volume")
        self._set(obj, KEYED, False)
        self.set_method(obj, method)

    def is_method_keyed(self, obj: bpy.types.Object) -> bool:
        return bool(obj.pass_index & KEYED)

    def restart(self, between: object) -> None:
        between()

    def delete_part(self, obj: bpy.types.Object, what: str) -> None:
        """The artist deletes a modifier that Sinew needs: Sinew is removed, or reports it and is off."""
        if what.endswith("modifier") and self.has_sinew(obj):
            self._set(obj, ADOPTED, True)

    def copied_modifiers(self, source: bpy.types.Object, target: bpy.types.Object) -> None:
        self._set(target, ADOPTED, True)

    def applied(self, obj: bpy.types.Object) -> None:
        obj.pass_index = 0

    def apply(self, obj: bpy.types.Object) -> None:
        # If Sinew is off in the viewport, the Armature modifier is applied with Sinew, too, which then
        # reports that it is missing.
        is_shown = all(modifier.show_viewport for modifier in armature_modifiers(obj))
        for modifier in armature_modifiers(obj):
            if not is_shown:
                # By its own choice, not by Sinew's method.
                modifier.use_deform_preserve_volume = modifier.show_expanded
            bpy.ops.object.modifier_apply(modifier=modifier.name)
        if is_shown:
            obj.pass_index = 0
        else:
            self._set(obj, ADOPTED, True)

    def bring_in_line(self, claims: dict[str, dict]) -> list[str]:
        """Makes the modifiers blend as Sinew's side reports it. Returns a line for each object for which
        Sinew's report differs from what the walk has set.

        claims  by the name of each object with Sinew
        """
        wrong = []
        self.runs = {name: claim["run"] for name, claim in claims.items()}
        for obj in bpy.data.objects:
            if obj.type != "MESH":
                continue
            claim = claims.get(obj.name_full)
            if obj.library is None:
                wrong += self._adopt(obj, claim)
            run = self.runs.get(obj.name_full, [])
            was_refused = obj.name_full in self.refused
            if claim is not None and claim["error"]:
                self.refused.add(obj.name_full)
            else:
                self.refused.discard(obj.name_full)
            if self.is_on(obj) and self.is_method_keyed(obj):
                if was_refused:
                    self._use_keyed_flags(obj)
                continue
            on = self.has_sinew(obj) and self.is_on(obj) and not shows_own_shape_in_its_mode(obj)
            for modifier in armature_modifiers(obj):
                replaced = on and modifier.name in run
                wanted = self.method(obj) == "dq" if replaced else modifier.show_expanded
                if obj.override_library is not None:
                    # Blender's undo restores an override's flag, but evaluates it as before.
                    obj.update_tag()
                if modifier.use_deform_preserve_volume != wanted:
                    modifier.use_deform_preserve_volume = wanted
        return wrong

    def adopt(self, claims: dict[str, dict]) -> None:
        """Sets what Sinew itself chooses as Sinew's side reports it."""
        for obj in bpy.data.objects:
            claim = claims.get(obj.name_full)
            if obj.type != "MESH" or obj.library is not None:
                continue
            if obj.pass_index & ADOPTED:
                self._adopt(obj, claim)
            elif claim is not None:
                self._set(obj, REFUSED, bool(claim["error"]))

    def _adopt(self, obj: bpy.types.Object, claim: dict | None) -> list[str]:
        if obj.pass_index & ADOPTED:
            if claim is None and self.is_method_keyed(obj):
                self.unkey_method(obj, self.method(obj))
            self._set(obj, DRIVEN, claim is not None)
            self._set(obj, ON, claim is not None and claim["on"])
            self._set(obj, REFUSED, claim is not None and bool(claim["error"]))
            self._set(obj, OWN, claim is not None and claim["own"])
            if claim is not None:
                self.set_method(obj, claim["method"])
            self.set_stages(obj, 0 if claim is None else number_of(claim["stages"]))
            return []
        if self.has_sinew(obj) != (claim is not None):
            return [f"{obj.name_full} is{'' if claim else ' not'} Sinew's, against the walk's list"]
        if claim is None:
            return []
        self._set(obj, REFUSED, bool(claim["error"]))
        if bool(obj.pass_index & ON) != claim["on"]:
            return [f"{obj.name_full}: Sinew is {'on' if claim['on'] else 'off'} against the walk's list"]
        if not self.is_method_keyed(obj) and claim["method"] != self.method(obj):
            return [f"{obj.name_full}: method {claim['method']}, the walk's list has {self.method(obj)}"]
        if number_of(claim["stages"]) != self.stages(obj):
            return [f"{obj.name_full}: stages {claim['stages']}, the walk's list has {self.stages(obj)}"]
        return []
