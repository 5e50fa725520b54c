# SPDX-License-Identifier: GPL-3.0-or-later
"""Open3D's reader of meshes."""

import numpy as np
import open3d
from adapter import Task, main, z_up


def play(task: Task) -> dict:
    points = z_up(np.asarray(open3d.io.read_triangle_mesh(str(task.path)).vertices))
    return {"rest": points, "points": [points] * len(task.times)}


if __name__ == "__main__":
    main(open3d.__version__, play)
