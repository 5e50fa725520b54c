# SPDX-License-Identifier: GPL-3.0-or-later
"""pygfx, which skins in its shader, drawn without a window."""

import numpy as np
import pygfx
from adapter import DEGREES, EYE, PIXELS, TARGET, Task, main, outline
from rendercanvas.offscreen import OffscreenRenderCanvas


def drawn(path: str, times: list[float], clip: int = 0) -> list[np.ndarray]:
    canvas = OffscreenRenderCanvas(size=(PIXELS, PIXELS), pixel_ratio=1)
    renderer = pygfx.renderers.WgpuRenderer(canvas, pixel_ratio=1, ppaa="none")
    loaded = pygfx.load_gltf(path, quiet=True)
    scene = pygfx.Scene()
    scene.add(pygfx.Background.from_color("#fff"), loaded.scene)
    for each in scene.iter(lambda each: isinstance(each, pygfx.Mesh)):
        each.material = pygfx.MeshBasicMaterial(color="#000", side="both")
    camera = pygfx.PerspectiveCamera(DEGREES, 1.0, depth_range=(1.0, 100.0))
    camera.local.position = EYE
    camera.look_at(TARGET)
    mixer, found = pygfx.AnimationMixer(), []
    if loaded.animations:
        mixer.clip_action(loaded.animations[clip]).play()
    for time in times:
        mixer.set_time(time)
        for each in scene.iter(lambda each: isinstance(each, pygfx.SkinnedMesh)):
            each.skeleton.update()
        canvas.request_draw(lambda: renderer.render(scene, camera))
        found.append(outline(np.asarray(canvas.draw())[:, :, :3]))
    return found


def play(task: Task) -> dict:
    still = [drawn(path, [0.0])[0] for path in task.still]
    return {"outlines": drawn(str(task.path), task.times, task.clip), "still": still}


if __name__ == "__main__":
    main(pygfx.__version__, play)
