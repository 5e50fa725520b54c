# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: an operator, and the panel of what plays without Sinew."""

from collections.abc import Iterator

import bpy

from ...attach.feature import Feature
from ...base.frames import parse_frames
from ...deform import characters
from ...ui import stepped
from ...ui.operators import OfSkinned, OnSinewObjects, sinew_targets
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import tr
from . import bake, bake_apart, bake_bones, bake_state
from .baked_files import BONES, EXPORTS, FILES, VAT
from .helper_bones import KEYS, POSE, HelperOptions
from .vat import EXR, EXR_HALF, PNG, VatOptions

INFLUENCES = {
    "name": "Influences",
    "description": "How many bones move a vertex at most; most engines take four",
    "default": 4,
    "min": 1,
    "soft_max": 8,
}
WITHOUT_FILES = (bake.SHAPE_KEYS, BONES)


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
    helpers: bpy.props.IntProperty(
        name="Helper Bones",
        description="How many each armature gets at most; 0: two a joint",
        default=0,
        min=0,
        soft_max=200,
    )
    error: bpy.props.FloatProperty(
        name="Error",
        description="No more helper bones are added once the rms error is this much of the meshes' diagonal; "
        "0: all of them",
        default=0.0,
        min=0.0,
        max=100.0,
        precision=3,
        subtype="PERCENTAGE",
    )
    influences: bpy.props.IntProperty(**INFLUENCES)
    motion: bpy.props.EnumProperty(
        name="Motion",
        description="What moves helper bones",
        items=[
            (KEYS, "Keys", "Plain keys over these frames, of bones that do not change size: for any engine"),
            (POSE, "Pose", "Constraints by which they follow the pose: other animation has them, too"),
        ],
    )

    axes: bpy.props.EnumProperty(
        name="Engine",
        description="Whose axes and units the textures have",
        items=[
            ("unreal", "Unreal", "Z up, Y to the other side, centimetres"),
            ("unity", "Unity", "Y up, X to the other side, metres"),
            ("gltf", "Godot, three.js", "Y up, metres, as glTF has them"),
        ],
    )
    texels: bpy.props.EnumProperty(
        name="Texels",
        description="How exact they are",
        items=[
            (EXR, "EXR, Float", "32 bits: exact"),
            (EXR_HALF, "EXR, Half", "16 bits of floating point: half the size, to a part in 2,000"),
            (PNG, "PNG, 16 Bits", "Whole numbers between the bounds: to a part in 130,000 of these"),
        ],
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        of_kind = ("motion", "helpers", "error", "influences") if self.kind == BONES else ()
        if self.kind not in WITHOUT_FILES:
            of_kind = ("folder", "overwrite", *(("axes", "texels") if self.kind == VAT else ()))
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
        helpers = HelperOptions(self.helpers, self.error, self.influences, self.motion)
        meshes, frames = sinew_targets(context), frames[:: self.step]
        vat = VatOptions(self.axes, self.texels)
        return bake.start(meshes, self.kind, frames, target, self.overwrite, helpers, vat)


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
