# SPDX-License-Identifier: GPL-3.0-or-later
"""ufbx, which evaluates a scene with its skinning. It crashes where Python frees what it made, so this ends
without freeing."""

import gc
import os
from importlib.metadata import version

import numpy as np
import ufbx
from adapter import Task, main

kept = []


def keep(made: object) -> object:
    kept.append(made)
    return made


def points_of(scene: ufbx.Scene, is_posed: bool) -> np.ndarray:
    mesh = keep(keep(scene.meshes)[0])
    stream = keep(mesh.skinned_position if is_posed else mesh.vertex_position)
    return np.array([tuple(each) for each in keep(stream.values)])


def play(task: Task) -> dict:
    scene = keep(
        ufbx.load_file(str(task.path), target_axes=ufbx.axes_right_handed_z_up, target_unit_meters=1.0)
    )
    stacks = keep(scene.anim_stacks)
    names = [keep(each).name for each in stacks]
    # By name, as exporters have their own order; the file's clips are A and B.
    number = sorted(range(len(names)), key=lambda k: names[k])[task.clip]
    anim = keep(keep(stacks[number]).anim)
    posed = [keep(ufbx.evaluate_scene(scene, anim, time, evaluate_skinning=True)) for time in task.times]
    return {
        "rest": points_of(scene, is_posed=False),
        "points": [points_of(each, is_posed=True) for each in posed],
    }


if __name__ == "__main__":
    gc.disable()
    main(version("ufbx"), play)
    os._exit(0)
