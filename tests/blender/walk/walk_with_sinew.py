# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk's side with Sinew: what an operation on Sinew is there (walk_sides has the other side)."""

from __future__ import annotations

import logging
import time
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

import bpy
import numpy as np
import routes
import scenes
import sinew
import sinew_addon
from sinew_addon.attach import attach, layout, other_tools, properties, stack, stage_settings, undeformed
from sinew_addon.attach.subscribers import notify, subscribers
from sinew_addon.base.errors import SinewError
from sinew_addon.deform import handlers, precompute_watch, safe_mode, session, small_meshes
from sinew_addon.features.bake import bake
from sinew_addon.features.bake.helper_bones import HelperOptions
from sinew_addon.features.compare import comparison, comparison_state
from sinew_addon.features.corrective import corrective_key
from sinew_addon.features.diagnose import diagnose, mending
from sinew_addon.features.motion_range import clip
from sinew_addon.skinning.precompute import precomputations
from sinew_addon.ui import presets
from walk_sides import (
    MENDS,
    METHODS,
    OF_BLENDER,
    Side,
    animated_paths,
    armature_modifiers,
    curves_of,
    key,
    number_of,
    remove_curves,
    whole_stages,
    world_points,
)


class Records(logging.Handler):
    """Collects messages that were logged with an exception, and how often Blender's evaluation could not
    be served."""

    def __init__(self) -> None:
        super().__init__(logging.DEBUG)
        self.errors: list[str] = []
        self.unanswered = 0

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info:
            self.errors.append(self.format(record))
        elif record.levelno == logging.DEBUG:
            self.unanswered += 1


class SinewSide(Side):
    """The Blender with Sinew."""

    is_sinew = True

    def __init__(self) -> None:
        self.records = Records()

    def prepare(self, safe: bool) -> None:
        logger = logging.getLogger("sinew")
        logger.setLevel(logging.DEBUG)
        logger.propagate = False
        logger.handlers[:] = [self.records]
        sinew_addon.register()
        self._is_safe = safe
        routes.force(routes.UPDATE if safe else routes.EVALUATION)

        # Nobody paints in between.
        precompute_watch.PAUSE = 0.0
        # The walk itself sets which meshes are left to Blender.
        small_meshes.is_used = True

    def is_helper(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew made it for another object."""
        return properties.is_helper(obj) or properties.is_copy(obj)

    def own_modifier(self, obj: bpy.types.Object) -> bpy.types.Modifier | None:
        return stack.sinew_modifier(obj)

    def has_sinew(self, obj: bpy.types.Object) -> bool:
        return properties.has_sinew(obj)

    def is_on(self, obj: bpy.types.Object) -> bool:
        return self.has_sinew(obj) and obj.sinew.enabled and not obj.sinew.error

    def has_other_shape(self, obj: bpy.types.Object) -> bool:
        return self.is_on(obj) and (obj.sinew.method not in OF_BLENDER or bool(self._stages(obj)))

    @staticmethod
    def _stages(obj: bpy.types.Object) -> dict[str, dict[str, object]]:
        """All parameters of the enabled stages, as the panel shows them."""
        return {
            name: {
                each.id: getattr(getattr(obj.sinew, name), each.id)
                for each in stage_settings.STAGES[name].parameters
            }
            for name in stage_settings.names_on(obj.sinew)
        }

    def _stages_in_mesh(self, obj: bpy.types.Object) -> dict[str, dict[str, object]]:
        """The same with lengths in units of the mesh."""
        return {
            name: shown | stage_settings.values_of(obj.sinew, name)
            for name, shown in self._stages(obj).items()
        }

    def preserve_volume(self, modifier: bpy.types.Modifier) -> bool:
        obj = modifier.id_data
        if self.has_sinew(obj) and obj.sinew.before.has_nearest_volume:
            kept = obj.sinew.replaced_modifiers.get(modifier.name)
            if kept is not None and not kept.was_nearest:
                return kept.preserve_volume
        return modifier.use_deform_preserve_volume

    def set_preserve_volume(self, modifier: bpy.types.Modifier, on: bool) -> None:
        modifier.use_deform_preserve_volume = on

    def add(self, obj: bpy.types.Object, method: str | None, leave_small: bool) -> None:
        if not self.has_sinew(obj):
            attach.add(obj, method)
            obj.sinew.leave_small = leave_small
            # As the button does.
            session.forget()
            session.refresh(bpy.context)

    def remove(self, obj: bpy.types.Object) -> None:
        if self.has_sinew(obj):
            attach.remove(obj)
            session.forget()

    def set_method(self, obj: bpy.types.Object, method: str) -> None:
        obj.sinew.method = method

    def set_stages(self, obj: bpy.types.Object, number: int) -> None:
        """Like a user who clicks: first, what is on is switched off."""
        wanted = whole_stages(number)
        for stage in sinew.stages():
            off = {stage.parameters[0].id: "OFF" if stage.name == "mix" else False}
            for parameter, value in wanted.get(stage.name, off).items():
                # Where its Armature modifier is gone, a change takes Sinew off, and its settings with it.
                if self.has_sinew(obj):
                    setattr(getattr(obj.sinew, stage.name), parameter, value)

    def set_enabled(self, obj: bpy.types.Object, on: bool) -> None:
        obj.sinew.enabled = on

    def click(self, obj: bpy.types.Object, which: str, view: str, deformers: dict[str, str]) -> None:
        modifier = self.own_modifier(obj) if which == "Sinew" else armature_modifiers(obj)[0]
        setattr(modifier, f"show_{view}", not getattr(modifier, f"show_{view}"))

    def check_said_gone(self, meshes: list[bpy.types.Object], rig: bpy.types.Object) -> None:
        """meshes  those that were on before the armature was gone"""
        for obj in meshes:
            is_known = any(each.armature == rig for each in obj.sinew.replaced_modifiers)
            if is_known and "in no collection" not in obj.sinew.error:
                raise ValueError(f"{obj.name}: nothing says that {rig.name} is gone")

    def check_warned(self, obj: bpy.types.Object, modifier: bpy.types.ParticleSystemModifier) -> None:
        own = [obj.modifiers[name] for name in layout.read(obj).own]
        others = {each.type for each in obj.modifiers if each != modifier and each not in own}
        if self.has_sinew(obj) and others == {"ARMATURE"}:
            is_warned = any(text.startswith(f"{modifier.name}: ") for text in other_tools.warnings(obj))
            if is_warned != (modifier.particle_system.settings.emit_from != "VERT"):
                raise ValueError(f"{obj.name}: {'a' if is_warned else 'no'} warning about {modifier.name}")

    def check_refused(self, obj: bpy.types.Object, modifier: bpy.types.Modifier) -> None:
        if modifier.name not in {each.name for each in layout.read(obj).behind} or not obj.visible_get():
            return
        if self.has_sinew(obj):
            if not obj.sinew.enabled:
                return
            bpy.context.view_layer.update()
            said = obj.sinew.error
        else:
            # Reading the settings would make them.
            try:
                attach.add(obj)
                said = ""
            except SinewError as error:
                said = str(error)
        sentences = (
            f"in front of {modifier.name} Blender permits",
            "its armature was deleted",
            "is a Multi Modifier",
            "is a simulation",
        )
        if not any(sentence in said for sentence in sentences):
            raise ValueError(f"{obj.name}: nothing says that Sinew can not be in front of {modifier.name}")

    def rebind(self, obj: bpy.types.Object) -> None:
        scenes.rebind(obj)

    def set_option(self, obj: bpy.types.Object, name: str, value: object) -> None:
        setattr(obj.sinew, name, value)

    def set_heat(self, obj: bpy.types.Object, on: bool, quantity: str) -> None:
        if on:
            bpy.context.scene.sinew_measures.quantity = quantity
        obj.sinew.heat = on

    def set_safe(self, on: bool) -> None:
        safe_mode.set_forced(on or self._is_safe)
        # As the preference does.
        session.refresh(bpy.context)
        notify(subscribers.safe_mode_changed)

    def compute_beside(self, on: bool) -> None:
        """Precomputations run on a thread, as in a window, or before the first frame."""
        precomputations.blocks = not on

    def character(self, rig: bpy.types.Object) -> list[bpy.types.Object]:
        return [
            obj
            for obj in bpy.context.scene.objects
            if obj.type == "MESH"
            and self.has_sinew(obj)
            and not self.is_helper(obj)
            and attach.armature_of(obj) == rig
        ]

    def is_own(self, obj: bpy.types.Object) -> bool:
        return obj.sinew.is_own

    def set_character_method(self, rig: bpy.types.Object, method: str) -> None:
        bpy.ops.sinew.use_method(method=method)

    def switch_own(self, rig: bpy.types.Object, obj: bpy.types.Object) -> None:
        bpy.ops.sinew.own_settings(name=obj.name)

    def use_preset(self, rig: bpy.types.Object, folder: Path) -> None:
        followers = [obj for obj in self.character(rig) if not obj.sinew.is_own]
        if not followers:
            return
        stages = number_of(self._stages(followers[0]))
        character = bpy.context.scene.sinew_character
        # In the form in which Blender writes presets.
        lines = [f"{path} = {eval(path, {'character': character})!r}" for path in presets.PATHS]
        text = "\n".join(["import bpy", *presets.DEFINES, *lines])
        # A new file for each text: Blender caches compiled files by size and time in seconds.
        path = folder / f"preset {zlib.crc32(text.encode())}.py"
        path.write_text(text)
        bpy.ops.sinew.method_preset(filepath=str(path))
        for obj in followers[1:]:
            self.set_stages(obj, stages)

    def mend(self, obj: bpy.types.Object, how: str, most: int) -> str | None:
        diagnose.check(bpy.context.scene, [obj], most)
        findings = diagnose.of(obj).findings
        found = next((each for each in findings if how in MENDS.get(each.name, ())), None)
        if found is None:
            return None
        try:
            mending.mend(obj, found.name, how, most)
        except SinewError:
            return None
        return found.name

    def bake_to_bones(self, obj: bpy.types.Object, motion: str, is_alone: bool) -> str:
        """is_alone  only one Armature modifier changes the mesh, so the played shape has the reported
        error"""
        scene = bpy.context.scene
        frames = sorted({scene.frame_start, scene.frame_current, scene.frame_end})
        expected = world_points(obj)
        try:
            options = HelperOptions(helpers=2, motion=motion)
            started = bake.start([obj], "bones", frames, Path("walk.blend"), overwrite=True, helpers=options)
            for _share in started.sample():
                pass
        except SinewError as refused:
            return f"refused: {refused}"
        started.place()
        bpy.context.view_layer.update()
        (report,) = started.reports
        # The reported error is of armature space, scaled by one number.
        scale = np.abs(attach.armature_of(obj).matrix_world.to_scale())
        if is_alone and len(expected) and scale.max() <= 1.01 * scale.min():
            distance = np.linalg.norm(world_points(obj) - expected, axis=1).max()
            if not distance <= 1.01 * report.after.worst + 1e-4 * report.diagonal:
                raise ValueError(f"{obj.name}: baked it is {distance:.3g} off, not {report.after.worst:.3g}")
        return f"{report.helpers} helper bones"

    def add_corrective_key(self, obj: bpy.types.Object, bone: bpy.types.PoseBone | None) -> str:
        try:
            name, before, after = corrective_key.add(obj, bpy.context.evaluated_depsgraph_get(), bone)
        except SinewError as refused:
            return f"refused: {refused}"
        bpy.context.view_layer.update()
        return f"{name}, {before:.3g} to {after:.3g}"

    def play_motion_range(self, obj: bpy.types.Object, frame: int) -> str:
        """Goes to a frame of it, and has all come back."""
        scene, rigs = bpy.context.scene, properties.of(obj).armatures
        try:
            for rig in rigs:
                clip.start(scene, rig, [obj])
        except SinewError as refused:
            return f"refused: {refused}"
        finally:
            scene.frame_set(frame)
            for rig in clip.armatures_on():
                clip.restore(rig)
            bpy.context.view_layer.update()
        return f"at {frame}"

    def wait(self) -> None:
        """Does what timers of the window do: no object waits for a thread's computation, or for what
        Blender evaluates without notification."""
        until = time.monotonic() + 30.0
        while precompute_watch.check() is not None:
            if time.monotonic() > until:
                raise RuntimeError("what methods need is still computed after half a minute")
            time.sleep(0.002)
        handlers.check_unannounced()

    def key_method(self, obj: bpy.types.Object, values: list[tuple[int, str]]) -> None:
        numbers = {m.name: m.number for m in properties.METHODS.values()}
        key(obj, "sinew.method", [(frame, float(numbers[method])) for frame, method in values])

    def unkey_method(self, obj: bpy.types.Object, method: str) -> None:
        remove_curves(obj, "sinew.method")
        self.set_method(obj, method)

    def is_method_keyed(self, obj: bpy.types.Object) -> bool:
        return any(curve.data_path == "sinew.method" for curve in curves_of(obj))

    def start_comparison(self, meshes: list[bpy.types.Object], methods: list[str]) -> None:
        comparison.start(bpy.context, meshes, methods, np.array((1.0, 0.0, 0.0)))

    def end_comparison(self) -> None:
        comparison.end(bpy.context)

    def arrange_comparison(self, arrangement: str) -> None:
        state = comparison_state.of_scene(bpy.context.scene)
        if state is not None:
            state.arrangement = arrangement

    def restart(self, between: Callable[[], None]) -> None:
        """Off and on again in the preferences."""
        sinew_addon.unregister()
        between()
        sinew_addon.register()

    def delete_part(self, obj: bpy.types.Object, what: str) -> None:
        modifier = self.own_modifier(obj)
        if modifier is None or not self.is_on(obj):
            return
        if what == "modifier":
            obj.modifiers.remove(modifier)
        elif what == "attribute":
            for name in [a.name for a in obj.data.attributes if a.name.lstrip(".").startswith("sinew")]:
                obj.data.attributes.remove(obj.data.attributes[name])
        elif what == "driver":
            for curve in obj.animation_data.drivers if obj.animation_data is not None else ():
                names = curve.driver.variables.keys()
                curve.mute |= bool(names) and all(name.startswith("sinew_") for name in names)
        elif what == "group":
            modifier.node_group = None
        elif what in ("nodes", "links") and modifier.node_group is not None:
            getattr(modifier.node_group, what).clear()
        elif what == "sockets" and modifier.node_group is not None:
            modifier.node_group.interface.clear()
        elif what == "socket" and modifier.node_group is not None:
            modifier.node_group.interface.items_tree[0].name = "Renamed"

    def apply(self, obj: bpy.types.Object) -> None:
        modifier = self.own_modifier(obj)
        # Sinew's modifier is on whatever an animation does to the Armature modifiers, and shows their result.
        paths = animated_paths(obj)
        keyed = [m for m in armature_modifiers(obj) if m.path_from_id("show_viewport") in paths]
        is_shown = modifier is not None and modifier.show_viewport and all(m.show_viewport for m in keyed)
        if self.is_on(obj) and is_shown:
            bpy.ops.object.modifier_apply(modifier=modifier.name)
        else:
            for armature in armature_modifiers(obj):
                bpy.ops.object.modifier_apply(modifier=armature.name)

    def claims(self) -> dict[str, dict]:
        """Sinew's report for each object that it deforms, by name."""
        return {
            obj.name_full: {
                "on": obj.sinew.enabled,
                "own": obj.sinew.is_own,
                "method": obj.sinew.method,
                "rule": obj.sinew.scale_rule,
                "stages": self._stages(obj),
                "stages in mesh": self._stages_in_mesh(obj),
                "parameters": stage_settings.method_values(obj.sinew, METHODS),
                "error": obj.sinew.error,
                "run": [each.name for each in self._run(obj)],
            }
            for obj in bpy.data.objects
            if self.has_sinew(obj) and not self.is_helper(obj)
        }

    def _run(self, obj: bpy.types.Object) -> Iterable:
        # While Sinew is off, it does not follow the stack, which still says whose character the object is.
        return obj.sinew.replaced_modifiers if obj.sinew.enabled else stack.armature_modifiers(obj)

    def copies(self) -> list[tuple[bpy.types.Object, str, str]]:
        """The copies of comparisons: object, original's name, method."""
        return [
            (obj, obj.sinew.identity.copied.name_full, obj.sinew.identity.method)
            for obj in bpy.data.objects
            if properties.is_copy(obj) and obj.sinew.identity.copied is not None
        ]

    def left_over(self) -> list[str]:
        """What remains of Sinew in a file where it deforms nothing."""
        # As a window's timer, the next frame and saving do.
        undeformed.remove_leftovers()
        # Without a user it is not saved; it belonged to a deleted object.
        objects = [o for o in bpy.data.objects if o.library is None and o.users]
        used = {o.data for o in objects}
        found = [f"object {o.name}" for o in objects if self.is_helper(o)]
        found += [f"settings of {o.name}" for o in objects if o.is_property_set("sinew")]
        for obj in bpy.data.objects:
            if obj.library is not None:
                continue
            found += [f"modifier {m.name} of {obj.name}" for m in obj.modifiers if "Sinew" in m.name]
            drivers = obj.animation_data.drivers if obj.animation_data is not None else ()
            own = [d for d in drivers if not d.data_path.endswith((".show_viewport", ".show_render"))]
            found += [f"driver {d.data_path} of {obj.name}" for d in own]
        for mesh in bpy.data.meshes:
            names = mesh.attributes.keys() if mesh.library is None and mesh in used else ()
            found += [f"attribute {name} of {mesh.name}" for name in names if "sinew" in name.lower()]
        for kind in ("meshes", "node_groups", "materials", "collections", "actions", "texts"):
            items = (i for i in getattr(bpy.data, kind) if i.library is None and i.users)
            items = (i for i in items if kind != "meshes" or i in used)
            found += [f"{kind}: {item.name}" for item in items if "sinew" in item.name.lower()]
        return found
