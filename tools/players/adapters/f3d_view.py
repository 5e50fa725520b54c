# SPDX-License-Identifier: GPL-3.0-or-later
"""F3D, which draws."""

import f3d
import numpy as np
from adapter import DEGREES, EYE, PIXELS, TARGET, Task, main, outline


def drawn(path: str, times: list[float], clip: int = 0) -> list[np.ndarray]:
    engine = f3d.Engine.create(offscreen=True)
    engine.options.update(
        {
            "scene.animation.indices": [clip],
            "render.grid.enable": False,
            "ui.axis": False,
        }
    )
    engine.window.size = PIXELS, PIXELS
    engine.scene.add(path)
    found = []
    for time in times:
        engine.scene.animation.load_time(time)
        camera = engine.window.camera
        camera.position, camera.focal_point, camera.view_up = EYE, TARGET, (0.0, 1.0, 0.0)
        camera.view_angle = DEGREES
        image = engine.window.render_to_image()
        found.append(outline(np.frombuffer(image.content, np.uint8).reshape(PIXELS, PIXELS, -1)[::-1]))
    return found


def play(task: Task) -> dict:
    still = [drawn(path, [0.0])[0] for path in task.still]
    return {"outlines": drawn(str(task.path), task.times, task.clip), "still": still}


if __name__ == "__main__":
    main(f3d.__version__, play)
