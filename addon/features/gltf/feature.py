# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF export: a check box in the exporter, stored in the scene. The panel's export, of all formats."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any

import bpy

from ...attach import attach, properties
from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from ...base.options import read_options
from ...base.output import remove, unfinished_path
from ...base.phrases import Phrase
from ...deform import characters
from ...io import files
from ...ui import stepped
from ...ui.operators import OnSinewObjects
from ...ui.options import with_options
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import counted, tr
from ..bake import bake_apart
from ..measure.measured_on import OWN, MeasuredOn
from . import export, players
from .export_check import Check, ExportOptions

# What was verified last, the largest difference first, by the session_uid of the scene. Nothing is stored in
# files.
results: dict[int, tuple[MeasuredOn, list[Check]]] = {}


class SinewGltf(bpy.types.PropertyGroup):
    """What the glTF exporter writes in addition."""

    skinning: bpy.props.BoolProperty(
        name="Skinning Data",
        description="Write for engines how Sinew deforms each mesh: its method and stages, with what these "
        "keep of its vertices and bones",
        default=False,
        options=set(),
    )


_ADDON = __package__.rpartition(".features")[0]


_ANY, _MOST = "any", 8
_OF_KIND = {".glb": ("influences", "clips"), ".fbx": ("clips",)}


def _choose(operator: bpy.types.Operator, _context: bpy.types.Context) -> None:
    """Sets the options to what a player plays best; the artist may change them then."""
    best = asdict(ExportOptions())
    if operator.player != _ANY:
        best |= players.best_options(operator.player)
        if operator.kind not in (endings := players.PLAYERS[operator.player].endings):
            operator.kind = endings[0]
    operator.clips = best["clips"]
    # The property has no number for all.
    operator.influences = best["influences"] or _MOST


@with_options(ExportOptions)
class SINEW_OT_export(OnSinewObjects, stepped.IntoFolder, stepped.WithDialog, bpy.types.Operator):
    bl_label = "Export"
    bl_description = "Write the scene for engines: bones, weights and animation. This file stays as it is"
    saying = "Sinew exports"
    stopped = "Export stopped; nothing was written"

    # Before what it chooses, so that scripts which give both have theirs.
    player: bpy.props.EnumProperty(
        name="For",
        description="Chooses what this player plays best",
        items=[
            (_ANY, "Any", "What most players take"),
            *((name, its.name, players.takes(name)) for name, its in players.PLAYERS.items() if its.endings),
        ],
        update=_choose,
    )

    kind: bpy.props.EnumProperty(
        name="To",
        description="What reads the file",
        items=[
            (
                ".glb",
                "glTF",
                "With Sinew's data, for three.js, Godot and others, and plain bones for bendy ones",
            ),
            (".usdc", "USD", "Skeletons and blend shapes, without Sinew's data"),
            (".fbx", "FBX", "For Unity and Unreal, without Sinew's data"),
            (".vrm", "VRM", "One human character, by the add-on VRM Format where it is installed"),
        ],
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        of_kind = _OF_KIND.get(self.kind, ())
        for name in ("player", "kind", *of_kind, "folder", "overwrite", "verify"):
            layout.prop(self, name)
        if self.player != _ANY:
            for sentence in self.of_player():
                draw_text(layout, sentence, icon="INFO", pixels=stepped.DIALOG)
        elif self.kind == ".glb" and self.influences > players.FOUR:
            draw_text(layout, players.more_than_four(), icon="INFO", pixels=stepped.DIALOG)

    def of_player(self) -> list[Phrase]:
        if self.kind not in players.PLAYERS[self.player].endings:
            return []
        influences = self.influences if self.kind == ".glb" else 0
        return players.sentences(self.player, self.kind, influences, self.clips)

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        if self.player != _ANY:
            players.check_ending(self.player, self.kind)
        self.path = self.target(self.kind)
        files.check_free(self.path, self.overwrite)
        deformed = attach.deformed_meshes(list(context.scene.objects))
        meshes = [obj for obj in deformed if properties.has_sinew(obj) and properties.of(obj).enabled]
        skinned = [obj.name for obj in meshes]
        self.basis = MeasuredOn.of(context.scene, meshes, OWN, "SCENE")
        options = asdict(read_options(ExportOptions, self))
        task = {"command": "write", "objects": skinned, "options": options}
        try:
            self.outcome = yield from bake_apart.follow(task, self.path)
        finally:
            remove(unfinished_path(self.path))

    def run(self, context: bpy.types.Context) -> None:
        checks = sorted(map(Check.of_json, self.outcome["checks"]), key=lambda check: -check.share)
        for check in checks:
            for sentence in check.sentences(characters.length_unit(context.scene)):
                self.report({"INFO"}, f"{check.mesh}: {tr(sentence)}")
        if self.verify and self.player != _ANY:
            for sentence in self.of_player():
                self.report({"INFO"}, tr(sentence))
        for sentence in self.outcome["left_out"]:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, tr("Wrote {path}", path=self.path))
        results[context.scene.session_uid] = self.basis, checks


class SINEW_PT_verified(Sidebar, bpy.types.Panel):
    bl_label = "Verified"
    bl_parent_id = "SINEW_PT_bake"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        _basis, checks = results.get(context.scene.session_uid, (None, []))
        return bool(checks)

    def draw(self, context: bpy.types.Context) -> None:
        layout, (basis, (worst, *others)) = self.layout, results[context.scene.session_uid]
        deformed = attach.deformed_meshes(list(context.scene.objects))
        is_old = basis.draw(layout, context.scene, filter(properties.has_sinew, deformed))
        layout = layout.column()
        layout.active = not is_old
        whole, *causes = worst.sentences(characters.length_unit(context.scene))
        draw_text(layout, f"{worst.mesh}: {tr(whole)}", alert=not worst.is_explained)
        for cause in causes:
            draw_text(layout, cause, icon="DOT")
        if others:
            more = counted(
                len(others),
                "{count} more mesh differs less; the Info editor lists it",
                "{count} more meshes differ less; the Info editor lists them",
            )
            draw_text(layout, more, icon="INFO")


def draw(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    """Draws in the exporter's sidebar."""
    header, body = layout.panel("GLTF_sinew", default_closed=False)
    header.label(text="Sinew", translate=False)
    if body is not None:
        body.use_property_split = True
        body.prop(context.scene.sinew_gltf, "skinning")


def before_export(settings: dict[str, Any]) -> None:
    """settings: the exporter's own."""
    context = bpy.context
    found, left_out = export.collect(context) if context.scene.sinew_gltf.skinning else ([], [])
    export.begin(found, left_out, settings)


def _exporters_panels() -> dict[str, Callable]:
    """Returns the functions that draw in the exporter's sidebar, by the names of extensions. Blender 4.2
    finds an extension's draw_export() by itself, and stores it here; newer ones expect it here."""
    try:
        import io_scene_gltf2
    except ImportError:
        # Blender can be built without the exporter.
        return {}
    return getattr(io_scene_gltf2, "exporter_extension_layout_draw", {})


def _begin() -> None:
    _exporters_panels()[_ADDON] = draw


def _end() -> None:
    results.clear()
    export.end()
    _exporters_panels().pop(_ADDON, None)


FEATURE = Feature(
    (SinewGltf, SINEW_OT_export, SINEW_PT_verified),
    {"Scene.sinew_gltf": bpy.props.PointerProperty(type=SinewGltf)},
    subscriptions=((subscribers.saving, export.end), (subscribers.deformed, export.end_if_failed)),
    begin=_begin,
    end=_end,
)
