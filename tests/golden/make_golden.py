# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes small rigs and their shapes by Blender's Armature modifier and Sinew, for engines that want to match
them.

    python tests/golden/make_golden.py [FOLDER]

FOLDER is tests/golden by default; its README describes a case.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
import sinew
import sinew_addon
from mathutils import Euler, Quaternion
from sinew_addon.attach.stage_settings import LENGTHS
from sinew_addon.deform import characters, session
from sinew_addon.io import mesh_io, spaces
from sinew_addon.skinning.parameters import Value

sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))
import scenes

FOLDER = Path(__file__).resolve().parent
# Incremented if readers of earlier files would misread these.
FORMAT = 2
GROUP = "painted"

# Blender's own methods, with the names of their arrays.
BLENDERS = {"lbs": "linear", "dq": "preserve_volume"}
# Values for parameters of methods that are no choice, if the default does not suit such coarse meshes.
METHOD_VALUES: dict[str, dict[str, Value]] = {"ddm": {"radius": 0.3}}
# For each stage: the methods before it, and its parameters except choices.
STAGE_VALUES: dict[str, list[tuple[str, dict[str, Value]]]] = {
    "mix": [(a, {"method": b, "group": GROUP}) for a, b in (("lbs", "dq"), ("dq", "cor"), ("cor", "lbs"))],
    "twist_spread": [(method, {"amount": 0.9, "group": GROUP}) for method in ("lbs", "dq")],
    "bulge_limit": [("dq", {"strength": 0.8, "group": GROUP})],
    "delta_mush": [("lbs", {"iterations": 4, "factor": 0.6, "scale": 0.9, "group": GROUP})],
}


def turned(obj: bpy.types.Object, armature: bpy.types.Object, degrees: float = 80.0) -> None:
    """Every bone rotated about an axis of its own, both objects moved."""
    scenes.forget_keys(armature)
    for index, bone in enumerate(armature.pose.bones):
        axis = ((1.0, 0.2, 0.1), (0.3, 1.0, -0.2), (-0.4, 0.5, 1.0))[index % 3]
        bone.rotation_quaternion = Quaternion(axis, math.radians(degrees))
        bone.location = (0.0, 0.0, 0.0)
    obj.location, obj.rotation_euler, obj.scale = (0.5, -0.2, 0.1), Euler((0.3, 0.1, -0.6)), (1.2, 0.9, 1.1)
    armature.location, armature.rotation_euler = (-0.1, 0.3, 0.2), Euler((-0.2, 0.4, 0.1))


def rotated(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones rotated by 80 degrees, both objects moved"""
    turned(obj, armature)


def weights(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Weights of any sum, zeros, sums below the threshold, vertices without weights"""
    turned(obj, armature)
    rng = np.random.default_rng(1)
    for vertex in range(len(obj.data.vertices)):
        for group in obj.vertex_groups:
            fate = rng.random()
            if fate < 0.2:
                group.remove([vertex])
            elif fate < 0.3:
                group.add([vertex], 0.0, "REPLACE")
            elif fate < 0.5:
                group.add([vertex], float(10.0 ** rng.uniform(-7, -4.5)), "REPLACE")
            else:
                group.add([vertex], float(rng.uniform(0.05, 1.0)), "REPLACE")


def scaled(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones scaled along their axes, children inheriting it with shear"""
    turned(obj, armature)
    armature.pose.bones[0].scale, armature.pose.bones[1].scale = (1.3, 0.8, 1.1), (0.7, 1.4, 1.0)


def mirrored(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """A bone mirrored by a negative scale"""
    turned(obj, armature)
    armature.pose.bones[1].scale = (-1.0, 1.0, 1.2)


def antipodal(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones more than 180 degrees apart: every other vertex has its groups in the opposite order"""
    turned(obj, armature, degrees=150.0)
    for vertex in range(0, len(obj.data.vertices), 2):
        entries = [(e.group, e.weight) for e in obj.data.vertices[vertex].groups]
        for group, _weight in entries:
            obj.vertex_groups[group].remove([vertex])
        for group, weight in reversed(entries):
            obj.vertex_groups[group].add([vertex], weight, "ADD")


def twisted(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones twisted by 160 degrees each, vertices of the first and the last: other signs by hierarchy"""
    turned(obj, armature)
    for bone in armature.pose.bones:
        bone.rotation_quaternion = Quaternion((0.0, 1.0, 0.0), math.radians(160.0))
    for group in (obj.vertex_groups[0], obj.vertex_groups[-1]):
        group.add(range(len(obj.data.vertices)), 0.3, "ADD")


def bendy(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bendy bones of four segments with straight mapping, curved and rolled"""
    turned(obj, armature)
    for bone in armature.data.bones:
        bone.bbone_segments = 4
    for bone in armature.pose.bones:
        bone.bbone_curveinx, bone.bbone_curveoutz, bone.bbone_rollout = 0.2, -0.15, 0.6


CASES = (
    rotated,
    weights,
    scaled,
    mirrored,
    antipodal,
    twisted,
    bendy,
)


@dataclass
class Result:
    """The description of an array of points: an entry of the JSON's `results`."""

    array: str
    by: str
    method: str
    parameters: dict[str, Value] = field(default_factory=dict)
    stages: dict[str, dict[str, Value]] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, Value]:
        """The values of all parameters, by full names."""
        owners = {self.method: self.parameters, **self.stages}
        values = {f"{owner}.{name}": value for owner, own in owners.items() for name, value in own.items()}
        switches = {f"{stage}.enabled": True for stage in self.stages if stage != "mix"}
        return values | switches


def results() -> list[Result]:
    """All results, from the lists of methods and stages, each with all its choices."""
    return [
        *(Result(array, "Blender", method) for method, array in BLENDERS.items()),
        *(
            Result(array, "Sinew", method.name, METHOD_VALUES.get(method.name, {}) | chosen)
            for method in sinew.methods()
            for array, chosen in choices(method)
            if array not in BLENDERS
        ),
        *(
            Result(f"{array}_after_{first}", "Sinew", first, {}, {stage.name: values | chosen})
            for stage in sinew.stages()
            for first, values in STAGE_VALUES[stage.name]
            for array, chosen in choices(stage)
        ),
    ]


def choices(owner: sinew.Method | sinew.Stage) -> Iterator[tuple[str, dict[str, Value]]]:
    """Each result with the name of its array, in which Blender's way is not named."""
    kinds = [parameter for parameter in owner.parameters if parameter.kind == "enum"]
    for chosen in itertools.product(*(kind.choices for kind in kinds)):
        name = "_".join([owner.name, *(choice for choice in chosen if choice != "blender")])
        yield name, {k.id: c for k, c in zip(kinds, chosen, strict=True)}


SetUp = Callable[[bpy.types.Object, bpy.types.Object], None]


def make(set_up: SetUp) -> tuple[dict, dict[str, np.ndarray]]:
    """One case: the content of its JSON, and the arrays of its npz."""
    obj, armature = make_rig(set_up)
    influences = zip(("offsets", "bones", "weights"), scenes.weights_of(obj), strict=True)
    arrays = {**dict(influences), **bones(armature), **topology(obj.data)}
    arrays["points"] = scenes.rest_points(obj)
    arrays["armature_from_mesh"] = np.array(
        armature.matrix_world.inverted() @ obj.matrix_world, dtype=np.float32
    )
    arrays[GROUP] = scenes.shares_of(obj, GROUP).astype(np.float32)
    names = [bone.name for bone in armature.data.bones]
    made = results()
    for result in made:
        obj, _armature = make_rig(set_up)
        if result.by == "Blender":
            arrays[result.array] = scenes.modifier_shapes(obj, [1], result.method == "dq")[0]
            continue
        # Lengths are in the unit of the mesh's positions, and settings in that of the scene.
        scale = spaces.scale_of(obj)
        values = {name: v * scale if name in LENGTHS else v for name, v in result.values.items()}
        characters.set_parameters(values)
        characters.use_method(obj, result.method)
        arrays[result.array] = scenes.final_points(obj)
        data = vertex_data(obj, result.method)
        if data is not None:
            arrays[f"data_{result.method}"] = data
    about = {
        "format": FORMAT,
        "about": set_up.__doc__,
        "blender": bpy.app.version_string,
        "bones": names,
        "results": [vars(result) for result in made],
        "arrays": {name: f"{a.dtype} {list(a.shape)}" for name, a in sorted(arrays.items())},
    }
    return about, arrays


def make_rig(set_up: SetUp) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Makes, in an empty file, a posed arm with a painted vertex group and with the shape keys that sdef
    reads."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, armature = scenes.make_arm(bones=3, sides=6, rings=10)
    set_up(obj, armature)
    # With runs of 0 and of 1, and values in between.
    scenes.paint(obj, GROUP, np.random.default_rng(2).uniform(-0.5, 1.5, len(obj.data.vertices)))
    # Of every vertex but each seventh.
    scenes.add_spheres(obj, (v for v in range(len(obj.data.vertices)) if v % 7), seed=3)
    bpy.context.view_layer.update()
    return obj, armature


def vertex_data(obj: bpy.types.Object, method: str) -> np.ndarray | None:
    """The method's vertex data in the library's form."""
    state = session.skinned_of(obj)
    assert state is not None
    kept = state.bound.first_deformer.vertex_data
    return None if kept is None else kept.of(method, np.eye(4))


def topology(mesh: bpy.types.Mesh) -> dict[str, np.ndarray]:
    read = mesh_io.read_topology(mesh)
    return {"face_offsets": read.face_offsets, "corner_vertices": read.corner_vertices, "edges": read.edges}


def bones(armature: bpy.types.Object) -> dict[str, np.ndarray]:
    """Bones first, then the joints of bendy bones."""
    posed = scenes.evaluated(armature).pose.bones
    rest_matrices = [np.array(bone.matrix_local) for bone in armature.data.bones]
    pose_matrices = [np.array(bone.matrix) for bone in posed]
    number = {bone.name: index for index, bone in enumerate(armature.data.bones)}
    parents = [number[bone.parent.name] if bone.parent else -1 for bone in armature.data.bones]
    first = []
    for index, bone in enumerate(armature.data.bones):
        first.append(len(rest_matrices))
        for k in range(bone.bbone_segments + 1 if bone.bbone_segments > 1 else 0):
            joint = posed[index].bbone_segment_matrix
            rest_matrices.append(rest_matrices[index] @ np.array(joint(k, rest=True)))
            pose_matrices.append(pose_matrices[index] @ np.array(joint(k, rest=False)))
            parents.append(index)
    return {
        "rest": np.array(rest_matrices, dtype=np.float32),
        "posed": np.array(pose_matrices, dtype=np.float32),
        "lengths": np.array([bone.length for bone in armature.data.bones], dtype=np.float32),
        "segments": np.array([bone.bbone_segments for bone in armature.data.bones], dtype=np.int32),
        "first_joint": np.array(first, dtype=np.int32),
        "parents": np.array(parents, dtype=np.int32),
    }


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    # Results of earlier runs must not be used.
    os.environ["SINEW_CACHE"] = "0"
    sinew_addon.register()
    for set_up in CASES:
        about, arrays = make(set_up)
        # A line for each result and array.
        text = re.sub(r"\n {6,}|\n {4}(?=})", " ", json.dumps(about, indent=2))
        (folder / f"{set_up.__name__}.json").write_text(text + "\n")
        np.savez_compressed(folder / f"{set_up.__name__}.npz", **arrays)
        print(f"{folder / set_up.__name__}.npz")


if __name__ == "__main__":
    main()
