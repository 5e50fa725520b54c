# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew info`: facts and warnings of each armature-deformed mesh."""

import argparse
from pathlib import Path

from ..base.errors import SinewError
from .arguments import add_files, add_json
from .console import Console

SUMMARY = "list the armature-deformed meshes of files"
HELP = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_json(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    from ..io import files

    failed = False
    reports = []
    for path in args.files:
        try:
            console.note_on(path, files.open_file(path))
            meshes = describe_file(path)
            report = {"file": str(path), "meshes": meshes, "left_to_blender": left_to_blender()}
        except SinewError as error:
            failed = True
            report = {"file": str(path), "error": str(error)}
            console.complain(error)
        reports.append(report)
    if args.json:
        console.say_json(reports)
    else:
        for report in reports:
            if "meshes" in report:
                _show(report, console)
    return 1 if failed else 0


def describe_file(path: Path) -> list[dict[str, object]]:
    """Returns a dictionary for each mesh that an armature deforms, in any scene of the open file."""
    import bpy

    from ..attach import attach
    from ..deform import survey

    meshes = []
    for obj in attach.deformed_meshes(list(bpy.data.objects)):
        armature = attach.armature_of(obj)
        if armature is None:
            raise SinewError(f"{path}: {obj.name} was deformed by Sinew, and its armature is missing")
        facts = survey.describe_in_file(obj)
        meshes.append(
            {
                "object": obj.name,
                "armature": armature.name,
                "vertices": facts.vertices,
                "bones": facts.bones,
                "bones_with_weights": facts.weighted_bones,
                "influences_mean": round(facts.mean_influences, 4),
                "influences_most": facts.most_influences,
                "warnings": list(facts.warnings),
            }
        )
    return meshes


def left_to_blender() -> list[str]:
    """Returns the objects of the open file, other than meshes, that an armature deforms."""
    import bpy

    from ..attach import attach

    return [f"{obj.name} ({obj.type.title()})" for obj in attach.not_meshes(list(bpy.data.objects))]


def _show(report: dict, console: Console) -> None:
    meshes = report["meshes"]
    console.say(
        f"{report['file']}: {len(meshes) or 'no'} armature-deformed mesh{'' if len(meshes) == 1 else 'es'}"
    )
    if report["left_to_blender"]:
        names = ", ".join(report["left_to_blender"])
        console.say(f"No meshes, left to their Armature modifiers: {names}")
    if not meshes:
        return
    console.table(
        ("mesh", "armature", "vertices", "bones", "influences", "warnings"),
        [
            (
                str(mesh["object"]),
                str(mesh["armature"]),
                f"{mesh['vertices']:,}",
                f"{mesh['bones']} ({mesh['bones_with_weights']} with weights)",
                f"mean {mesh['influences_mean']:.2f}, most {mesh['influences_most']}",
                "; ".join(mesh["warnings"]) or "none",
            )
            for mesh in meshes
        ],
    )
