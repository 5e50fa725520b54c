# SPDX-License-Identifier: GPL-3.0-or-later
"""panda3d with panda3d-gltf, skinned on the processor."""

import gltf
import numpy as np
from adapter import NoSkinError, Task, main
from panda3d import core


def points_of(model: core.NodePath, is_posed: bool) -> np.ndarray:
    found = []
    for path in model.find_all_matches("**/+GeomNode"):
        matrix = np.array(path.get_mat(model)).reshape(4, 4)
        for geom in path.node().get_geoms():
            data = geom.get_vertex_data()
            if is_posed:
                data = data.animate_vertices(True, core.Thread.get_current_thread())
            reader = core.GeomVertexReader(data, "vertex")
            while not reader.is_at_end():
                found.append([*reader.get_data3(), 1.0] @ matrix)
    return np.array(found)[:, :3]


def play(task: Task) -> dict:
    model = core.NodePath(gltf.load_model(str(task.path)))
    characters = model.find_all_matches("**/+Character")
    if not characters:
        raise NoSkinError("loaded without a Character")
    character = characters[0].node()
    rest = points_of(model, is_posed=False)
    controls = core.AnimControlCollection()
    core.auto_bind(character, controls, ~0)
    names = sorted(controls.get_anim_name(k) for k in range(controls.get_num_anims()))
    control = controls.find_anim(names[task.clip])
    points = []
    for time in task.times:
        control.pose(time * control.get_frame_rate())
        character.force_update()
        points.append(points_of(model, is_posed=True))
    return {"rest": rest, "points": points}


if __name__ == "__main__":
    main(core.PandaSystem.get_version_string(), play)
