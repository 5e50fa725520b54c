# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: an operator, and the panel of what plays without Sinew."""

from collections.abc import Iterator
from itertools import chain

import bpy

from ...attach.feature import Feature
from ...base.frames import parse_frames
from ...base.options import options_of, read_options
from ...deform import characters, session
from ...ui import stepped
from ...ui.operators import OnSinewObjects, has_sinew_targets, sinew_targets, targets
from ...ui.options import with_options
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import tip, tr
from . import bake, bake_apart, bake_bones, bake_state, kept
from .baked_files import BONES, EXPORTS, FILES, VAT
from .helper_bones import HelperOptions
from .vat import VatOptions

WITHOUT_FILES = (bake.SHAPE_KEYS, BONES)


@with_options(HelperOptions, VatOptions)
class SINEW_OT_bake(OnSinewObjects, stepped.IntoFolder, stepped.WithDialog, bpy.types.Operator):
    bl_label = "Bake"
    bl_description = (
        "Write what Sinew deforms as data that plays without it. A bake into this file takes Sinew off"
    )
    saying = "Sinew bakes"
    stopped = "Bake stopped; nothing was written"

    kind: bpy.props.EnumProperty(
        name="To",
        description="What plays the shapes: a modifier or shape keys of this file, or another program",
        items=[
            ("shape-keys", "Shape Keys", "One a frame, with keyed values, in this file"),
            ("mdd", "MDD Cache", "A point cache and a Mesh Cache modifier, in this file"),
            ("pc2", "PC2 Cache", "A point cache and a Mesh Cache modifier, in this file"),
            (BONES, "Bones", "Helper bones and weights, in this file: what engines play"),
            ("alembic", "Alembic", "The final meshes with UVs and materials; this file stays as it is"),
            ("usd", "USD", "The final meshes with UVs and materials; this file stays as it is"),
            (
                VAT,
                "Vertex Animation Textures",
                "Positions and normals as textures, with the mesh at rest, for engines' shaders; this file "
                "stays as it is",
            ),
        ],
    )
    frames: bpy.props.StringProperty(
        name="Frames", description="Such as 1,12,40-48; empty: the scene's frames", default=""
    )
    step: bpy.props.IntProperty(
        name="Step", description="Every so many of the frames", default=1, min=1, soft_max=12
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.joints = [] if self.in_steps else bake_bones.joint_counts(sinew_targets(context))
        return super().invoke(context, event)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        of_kind = options_of(HelperOptions) if self.kind == BONES else ()
        if self.kind not in WITHOUT_FILES:
            of_kind = ("folder", "overwrite", *(options_of(VatOptions) if self.kind == VAT else ()))
        scene = context.scene
        layout.prop(self, "kind")
        layout.prop(self, "frames", placeholder=f"{scene.frame_start}-{scene.frame_end}")
        for name in ("step", *of_kind):
            layout.prop(self, name)
            if name == "helpers" and not self.helpers:
                counts = ", ".join(str(2 * count) for count in self.joints)
                draw_text(layout, "Two a joint: {count}", pixels=stepped.DIALOG, count=counts)
            if name == "error" and not self.error:
                draw_text(layout, "All of them, whatever the error", pixels=stepped.DIALOG)
        if self.kind not in FILES:
            text = "Takes Sinew off: what is baked plays without it"
            draw_text(layout, text, icon="INFO", pixels=stepped.DIALOG)

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        self.started = self._start(context)
        # In a window, Blender's exporters would block.
        is_apart = self.in_steps and self.kind in EXPORTS
        yield from bake_apart.sample(self.started) if is_apart else self.started.sample()

    def run(self, context: bpy.types.Context) -> None:
        with self.started.whole_or_nothing():
            self.started.publish()
            self.started.place()
        self.report({"INFO"}, tr("Baked {names}", names=self.started.what))
        if isinstance(self.started, bake_bones.BoneBake):
            for report in self.started.reports:
                for sentence in report.sentences(characters.length_unit(context.scene)):
                    self.report({"INFO"}, tr(sentence))

    def _start(self, context: bpy.types.Context) -> bake_state.Started:
        scene = context.scene
        frames = sorted(set(parse_frames(self.frames))) if self.frames.strip() else None
        frames = frames or list(range(scene.frame_start, scene.frame_end + 1))
        suffix = FILES.get(self.kind, ".blend")
        target = self.target(suffix, self.kind not in WITHOUT_FILES)
        meshes, frames = sinew_targets(context), frames[:: self.step]
        options = read_options(HelperOptions, self), read_options(VatOptions, self)
        return bake.start(meshes, self.kind, frames, target, self.overwrite, *options)


class SINEW_OT_use_before_bake(OnSinewObjects, bpy.types.Operator):
    bl_label = "As Before the Bake"
    bl_description = "Deform the character by the method and stages that it had when it was baked"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    @classmethod
    def description(cls, context: bpy.types.Context, _values: bpy.types.OperatorProperties) -> str:
        found = next(filter(None, map(kept.before, sinew_targets(context))), None)
        return tip(cls.bl_description) if found is None else tr(found.label)

    def run(self, context: bpy.types.Context) -> None:
        with session.changing(context):
            for obj in sinew_targets(context):
                kept.use_before(obj)


def _draw_before(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    """At the end of the character's variants."""
    if any(kept.before(obj) for obj in sinew_targets(context)):
        self.layout.operator("sinew.use_before_bake", icon="LOOP_BACK")


class SINEW_PT_bake(Sidebar, bpy.types.Panel):
    bl_label = "Bake and Export"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_sinew_targets(context) or any(map(kept.is_baked, targets(context)))

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        # Meshes of one armature share them.
        sentences = dict.fromkeys(chain(*(kept.sentences_of(obj) for obj in targets(context))))
        if sentences:
            layout.label(text="When it was baked:")
        for sentence in sentences:
            draw_text(layout, sentence, icon="CHECKMARK")
        if not has_sinew_targets(context):
            return
        layout.operator("sinew.bake", text="Bake\u2026", icon="RENDER_ANIMATION")
        layout.operator("sinew.export", text="Export\u2026", icon="EXPORT")
        draw_text(layout, "A bake into this file takes Sinew off", icon="INFO")
        layout.operator("sinew.corrective_key", icon="SHAPEKEY_DATA")


FEATURE = Feature(
    (kept.SinewBake, SINEW_OT_bake, SINEW_OT_use_before_bake, SINEW_PT_bake),
    {"Object.sinew_bake": bpy.props.PointerProperty(type=kept.SinewBake)},
    menus={"SINEW_PT_variants": _draw_before},
)
