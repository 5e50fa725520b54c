# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: an operator, and the panel of what plays without Sinew."""

from collections.abc import Iterator

import bpy

from ...attach.feature import Feature
from ...base.frames import parse_frames
from ...base.options import options_of, read_options
from ...deform import characters
from ...ui import stepped
from ...ui.operators import OfSkinned, OnSinewObjects, sinew_targets
from ...ui.options import with_options
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import tr
from . import bake, bake_apart, bake_bones, bake_state
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

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        of_kind = options_of(HelperOptions) if self.kind == BONES else ()
        if self.kind not in WITHOUT_FILES:
            of_kind = ("folder", "overwrite", *(options_of(VatOptions) if self.kind == VAT else ()))
        for name in ("kind", "frames", "step", *of_kind):
            layout.prop(self, name)
        if self.kind not in FILES:
            layout.label(text="Takes Sinew off: what is baked plays without it", icon="INFO")

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


class SINEW_PT_bake(Sidebar, OfSkinned, bpy.types.Panel):
    bl_label = "Bake and Export"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator("sinew.bake", text="Bake\u2026", icon="RENDER_ANIMATION")
        layout.operator("sinew.export", text="Export\u2026", icon="EXPORT")
        draw_text(layout, "A bake into this file takes Sinew off", icon="INFO")
        layout.operator("sinew.corrective_key", icon="SHAPEKEY_DATA")


FEATURE = Feature((SINEW_OT_bake, SINEW_PT_bake))
