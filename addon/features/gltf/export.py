# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes how Sinew deforms a mesh to a glTF file: the extension SINEW_skinning of the mesh names the method
and stages, that of its skin has what stages know of bones, and application-specific vertex attributes (glTF
2.0, 3.7.2.1: names that begin with an underscore) have the method's vertex data.

Meshes have these attributes only during an export, as the exporter splits vertices at seams, and copies
attributes to the right ones. They are made when it calls before an export, and removed when it has read all.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

import bpy
import numpy as np

from ...attach import properties, stage_settings
from ...attach.updates import may_change_file
from ...base.errors import SinewError
from ...deform import pose, session
from ...io import armature_io, mesh_io, spaces
from ...skinning.engines import ENGINES
from ...skinning.rig import Bones
from ...skinning.skin_stack import LINEAR
from ...skinning.vectors import transformed

# Raised when readers of earlier files could not read new ones correctly.
VERSION = 1
# Of a skin with limbs that are not along Y.
WITH_AXES = 2
# As far as that from Y a limb is along it.
_ALONG = 1e-4
CENTRE, SHARE = "_SINEW_CENTRE", "_SINEW_MIX"
# The weights of the vertex groups of stages, where they have one.
AMOUNTS = {"twist_spread": "_SINEW_TWIST_SPREAD", "bulge_limit": "_SINEW_BULGE_LIMIT"}
ATTRIBUTES = (CENTRE, SHARE, *AMOUNTS.values())
EXTENSION = "SINEW_skinning"

_Y = np.array([0.0, 1.0, 0.0])
# In glTF's axes: x, z, -y.
_Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


@dataclass
class Skinning:
    """How one mesh is deformed.

    content  of the extension
    centres  float32 [vertices, 3], object space; None where its methods have none
    values   float32 [vertices] by the names of attributes: of the mixed method, of stages
    bones    what stages know of bones; None without stages
    """

    obj: bpy.types.Object
    content: dict[str, Any]
    centres: np.ndarray | None = None
    values: dict[str, np.ndarray] = field(default_factory=dict)
    bones: StageBones | None = None


@dataclass
class StageBones:
    """
    armature  the name of the object
    limbs     of its bones, by their names, [3] each in the bone's own axes
    twists    as in the file, with bones' names
    """

    armature: str
    limbs: dict[str, np.ndarray]
    twists: list[dict[str, Any]]

    @classmethod
    def of(cls, evaluated_armature: bpy.types.Object, bones: Bones) -> StageBones:
        twists, found = bones.twists, []
        inputs = armature_io.read_twists(evaluated_armature, bones)
        for (bone, base, tip, is_from_parent), (amount, curve, *_channels) in zip(
            twists.rows, inputs, strict=True
        ):
            names = {"bone": bones.names[bone], "base": bones.names[base], "tip": bones.names[tip]}
            values = {"amount": round(amount, 6), "curve": round(curve, 6)}
            found.append({**names, "from": "parent" if is_from_parent else "child", **values})
        limbs = dict(zip(bones.names, bones.limbs_in_bones, strict=True))
        return cls(evaluated_armature.name, limbs, found)

    def content(self, joints: Sequence[str]) -> dict[str, Any]:
        """Of the extension of a skin with joints of these names."""
        numbers = {name: number for number, name in enumerate(joints)}
        twists = [
            {key: numbers[value] if key in ("bone", "base", "tip") else value for key, value in twist.items()}
            for twist in self.twists
            if {twist["bone"], twist["base"], twist["tip"]} <= numbers.keys()
        ]
        limbs = np.array([self.limbs.get(name, np.zeros(3)) for name in joints]).reshape(-1, 3)
        lengths = np.linalg.norm(limbs, axis=1)
        axes = np.divide(
            limbs, lengths[:, None], out=np.tile(_Y, (len(limbs), 1)), where=lengths[:, None] > 0.0
        )
        content = {"version": VERSION, "lengths": lengths.tolist(), "twists": twists}
        if np.abs(axes - _Y).max(initial=0.0) > _ALONG:
            content |= {"version": WITH_AXES, "axes": axes.round(7).tolist()}
        return content


@dataclass
class _Export:
    """The current export, or the last one.

    written     contents of the extension by the names of objects
    left_out    a sentence for each object without the extension
    bones       by the names of armature objects
    meshes      that have attributes during the export
    all_custom  the artist exports the meshes' other attributes that begin with an underscore, too
    """

    written: dict[str, dict[str, Any]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    bones: dict[str, StageBones] = field(default_factory=dict)
    meshes: list[bpy.types.Mesh] = field(default_factory=list)
    all_custom: bool = True


current = _Export()


def collect(context: bpy.types.Context) -> tuple[list[Skinning], list[str]]:
    """Returns how Sinew deforms the meshes now, and a sentence for each mesh for which a file cannot say it.
    Call it while Sinew still deforms them."""
    found, left_out = [], []
    depsgraph = context.evaluated_depsgraph_get()
    objects = [
        obj for obj in context.scene.objects if properties.has_sinew(obj) and not properties.is_copy(obj)
    ]
    for obj in objects:
        if not properties.of(obj).enabled:
            continue
        try:
            found.append(_skinning_of(obj, depsgraph))
            if session.deformed_now([obj], depsgraph)[0][1].bound.first_deformer.bends:
                left_out.append(
                    f"{obj.name}: exported without the bends of its bendy bones; run `sinew export`, or bake "
                    "to bones first"
                )
        except SinewError as error:
            left_out.append(f"{obj.name}: exported without Sinew's skinning data: {error}")
    return found, left_out


def _skinning_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Skinning:
    states = session.deformed_now([obj], depsgraph)
    if not states or properties.of(obj).armature is None:
        raise SinewError("Sinew does not deform it")
    if len(properties.of(obj).replaced_modifiers) != 1:
        raise SinewError("several Armature modifiers deform it")
    if obj.data.library is not None or obj.mode == "EDIT":
        raise SinewError("its mesh is linked or in edit mode")
    settings = properties.of(obj)
    deformer = states[0][1].bound.first_deformer
    mixed = settings.mixed_method
    if deformer.mix_weights is None or mixed == settings.method or settings.method in ENGINES:
        mixed = ""
    # What an engine makes of the skin is for itself to do.
    method = LINEAR if settings.method in ENGINES else settings.method
    skinning = Skinning(obj, {"version": VERSION, "method": method})
    if mixed:
        skinning.content["mix"] = mixed
        skinning.values[SHARE] = deformer.mix_weights
    parameters = stage_settings.method_values(settings, [method, mixed])
    after, stages = states[0][1].bound.skin_stack.stages_after, []
    for name, own in pose.stage_values(settings).items() if after is not None else ():
        stages.append(name)
        parameters |= {f"{name}.{key}": value for key, value in own.items() if key != "enabled"}
        if name in AMOUNTS and name in after.masks:
            skinning.values[AMOUNTS[name]] = after.masks[name]
    # As the skin's positions, which the exporter writes in world space.
    scale = spaces.scale_of(obj)
    lengths = stage_settings.LENGTHS & parameters.keys()
    parameters |= {name: round(scale * parameters[name], 6) for name in lengths}
    skinning.content |= {
        name: value for name, value in (("parameters", parameters), ("stages", stages)) if value
    }
    armature = settings.armature
    assert armature is not None
    if not AMOUNTS.keys().isdisjoint(stages):
        skinning.bones = StageBones.of(armature.evaluated_get(depsgraph), deformer.bones)
    if "cor" in (settings.method, mixed):
        assert deformer.vertex_data is not None
        space = spaces.bones_from_model_in(depsgraph, obj, armature)
        skinning.centres = deformer.vertex_data.of("cor", space)
    return skinning


def begin(found: Sequence[Skinning], left_out: Sequence[str], settings: dict[str, Any]) -> None:
    """Adds the attributes to meshes.

    found, left_out  from collect()
    settings         the exporter's own
    """
    end()
    current.written, current.left_out, current.bones = {}, list(left_out), {}
    current.all_custom = settings["gltf_attributes"]
    for skinning in found:
        _add(skinning, y_up=settings["gltf_yup"])
    if current.meshes:
        settings["gltf_attributes"] = True
    for sentence in current.left_out:
        settings["log"].warning(sentence)
    if not bpy.app.background:
        # An exporter that fails while it reads does not announce its end.
        bpy.app.timers.register(end, first_interval=0.0)


def _add(skinning: Skinning, y_up: bool) -> None:
    obj, mesh = skinning.obj, skinning.obj.data
    if mesh in current.meshes:
        current.left_out.append(
            f"{obj.name}: exported without Sinew's skinning data: another object has its mesh; make it a "
            "single user (Object > Relations)"
        )
        return
    current.written[obj.name] = skinning.content
    if skinning.bones is not None:
        current.bones[skinning.bones.armature] = skinning.bones
    if skinning.centres is not None:
        # In world space, as the exporter writes the positions of a skin.
        space = np.array(obj.matrix_world, dtype=np.float64)
        space = _Y_UP @ space if y_up else space
        mesh_io.write_vectors(mesh, CENTRE, transformed(skinning.centres, space).astype(np.float32))
    for name, values in skinning.values.items():
        mesh_io.write_values(mesh, name, np.clip(values, 0.0, 1.0))
    if skinning.centres is not None or skinning.values:
        current.meshes.append(mesh)


def end() -> None:
    """Removes the attributes again."""
    meshes, current.meshes = current.meshes, []
    for mesh in meshes:
        # After an export that failed, another file may be open.
        with suppress(ReferenceError):
            for name in ATTRIBUTES:
                mesh_io.remove_attribute(mesh, name)


def end_if_failed(*_: Any) -> None:
    """Called with each evaluation, as no timer runs without a window."""
    if current.meshes and may_change_file() and not _is_exporting():
        end()


def _is_exporting() -> bool:
    """Whether the exporter is among the callers: it evaluates frames."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith("io_scene_gltf2"):
            return True
        frame = frame.f_back
    return False


def _extend(of: Any, content: dict[str, Any]) -> None:
    """of: a mesh or a skin of the exporter's"""
    from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

    made = Extension(EXTENSION, content, required=False)
    of.extensions = {**(of.extensions or {}), EXTENSION: made}


def _remove_own(exported: Any, source: bpy.types.ID) -> None:
    """Removes Sinew's settings from the custom properties that the exporter found, as Blender (up to 4.5)
    stores registered properties among these.

    exported  a node, mesh or scene of the exporter's
    """
    if isinstance(exported.extras, dict):
        own = {p.identifier for p in source.bl_rna.properties if p.is_runtime and "sinew" in p.identifier}
        exported.extras = {name: it for name, it in exported.extras.items() if name not in own} or None


class GltfExtension:
    """The functions that the exporter calls while it reads meshes, and when it has read all."""

    def gather_node_hook(self, node: Any, obj: bpy.types.Object, *_: Any) -> None:
        if isinstance(obj, bpy.types.ID):
            _remove_own(node, obj)

    def gather_scene_hook(self, gltf_scene: Any, scene: bpy.types.Scene, *_: Any) -> None:
        _remove_own(gltf_scene, scene)

    def gather_attribute_keep(self, attribute: Any, _settings: dict[str, Any]) -> None:
        """Keeps attributes that begin with an underscore: all or only these, as the artist chose."""
        if not current.all_custom and attribute.attr_name not in ATTRIBUTES:
            attribute.keep = False

    def gather_mesh_hook(
        self, gltf_mesh: Any, _mesh: bpy.types.Mesh, obj: bpy.types.Object | None, *_: Any
    ) -> None:
        """obj: the object that the mesh is exported for, None for one without a skin."""
        content = current.written.get(obj.name) if obj is not None else None
        if content is not None:
            _extend(gltf_mesh, content)
            return
        # The attributes belong to another object with this mesh.
        for primitive in gltf_mesh.primitives:
            for name in ATTRIBUTES:
                primitive.attributes.pop(name, None)

    def gather_skin_hook(self, skin: Any, armature: bpy.types.Object, *_: Any) -> None:
        bones = current.bones.get(armature.name)
        if bones is not None:
            _extend(skin, bones.content([joint.name for joint in skin.joints]))

    def gather_gltf_hook(self, *_: Any) -> None:
        """Called before anything is written, which can fail."""
        end()
