# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends every joint of the characters of a file: for `sinew flex`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy

from ...attach import properties
from ...base.output import write_text
from ...base.steps import result_of
from ...deform import characters
from ...features.flex import flex as bending
from ...features.flex import page as flex_page
from ...features.measure.limits import Table, read_table
from ...io import files
from ...skinning.variants import is_key, parse


def flex(task: dict, report: Callable[..., None]) -> dict:
    """Judges the file "source" of a task by its "settings": "tables", each with a hash; "methods" and keys of
    variants to try; "object", only that mesh, or None; "viewer", a page to write, or None.

    "joints": as from Verdict.to_dict(); "left_out": a sentence for each mesh that could not be judged;
    "notes": remarks on the file. Raises SinewError where it cannot be judged.
    """
    path, settings, table = Path(task["source"]), task["settings"], Table()
    for each, _hash in settings["tables"]:
        table = read_table(Path(each), table)
    report("opening it")
    notes = files.open_file(path)
    scene, methods, page = bpy.context.scene, settings["methods"], settings["viewer"]
    used = [parse(name).method if is_key(name) else name for name in methods]
    own_methods = {
        obj: properties.of(obj).method
        for obj in scene.objects
        if properties.has_sinew(obj) and properties.of(obj).enabled
    }
    meshes, left_out = characters.deformable_meshes(scene, path, ["dq", *used], settings["object"])
    own: dict[bpy.types.Object, str | None] = {}
    for obj in meshes:
        # Linear blending may be left to the Armature modifier, where nothing could be bent.
        characters.use_method(obj, own_methods.get(obj, "dq"))
        own[obj] = None if obj in own_methods else properties.BLENDER
    of_bending = 0.5 if page else 1.0
    steps = bending.flex(meshes, methods, table, own)
    result = result_of(steps, lambda done: report("bending it", share=of_bending * done))
    if page:
        steps = flex_page.page(scene, path.stem, meshes, result, left_out)
        text = result_of(
            steps, lambda done: report("reading it for the page", share=of_bending * (1.0 + done))
        )
        write_text(Path(page), text)
    return {**result.verdict.to_dict(), "left_out": left_out, "notes": notes}
