# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a folder that others made: lbs and dq beside the Armature modifier, and every method finite.

    .venv/bin/python tests/blender/corpus.py FOLDER [FOLDER ...]

Prints a line for each skinned mesh; the exit status is 1 where one differs, is left out or is not finite.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import scenes
from sinew_addon.attach import properties
from sinew_addon.core.errors import SinewError
from sinew_addon.core.precompute import precomputations
from sinew_addon.deform import characters
from sinew_addon.io import files
from sinew_addon.prepare import prepare_blender

# A share of a mesh's diagonal.
LIMIT = 1e-5
FRAMES = 3
ENDINGS = (".blend", *files.IMPORTERS)


def results(file: Path) -> Iterator[tuple[str, str]]:
    """Yields each skinned mesh, and what is wrong with it, or "ok", with its errors."""
    files.open_file(file)
    scene = bpy.context.scene
    frames = np.unique(np.linspace(scene.frame_start, scene.frame_end, FRAMES).round()).tolist()
    for obj in characters.deformed_meshes(scene):
        try:
            errors = {method: _error(obj, method, frames) for method in ("lbs", "dq")}
            wrong = [f"{method} differs" for method, error in errors.items() if not error <= LIMIT]
            for method in properties.METHODS:
                characters.use_method(obj, method)
                if not np.isfinite(scenes.shapes(obj, frames)).all():
                    wrong.append(f"{method} is not finite")
        except SinewError as error:
            yield obj.name, f"left out: {error}"
        else:
            figures = ", ".join(f"{method} {error:.1e}" for method, error in errors.items())
            yield obj.name, f"{'; '.join(wrong) or 'ok'}: {figures}"


def _error(obj: bpy.types.Object, method: str, frames: list[float]) -> float:
    """The largest difference from the Armature modifier's shapes, as a share of the diagonal."""
    characters.use_method(obj, properties.BLENDER)
    theirs = scenes.modifier_shapes(obj, frames, preserve_volume=method == "dq")
    characters.use_method(obj, method)
    ours = scenes.shapes(obj, frames)
    return scenes.worst(ours, theirs) / (float(np.linalg.norm(np.ptp(theirs[0], axis=0))) or 1.0)


def main(folders: list[str]) -> int:
    prepare_blender()
    precomputations.waits = True
    found = [path for folder in folders for path in sorted(Path(folder).rglob("*")) if path.suffix in ENDINGS]
    failed = not found
    for file in found:
        try:
            lines = list(results(file))
        except SinewError as error:
            # Without a skinned mesh, or of a newer Blender.
            lines = [("", f"not compared: {error}")]
        for name, result in lines:
            failed |= not result.startswith(("ok", "not compared"))
            print(f"corpus: {file.name}: {name}: {result}", flush=True)
    print(f"corpus: {len(found)} files, {'failed' if failed else 'all as they should be'}", flush=True)
    return failed


if __name__ == "__main__":
    status = main(sys.argv[1:])
    # Without Blender's own end as a module.
    os._exit(status)
