# SPDX-License-Identifier: GPL-3.0-or-later
"""PyVista's `read` of glTF, which has no time."""

import numpy as np
import pyvista
from adapter import Task, main, z_up


def play(task: Task) -> dict:
    found = pyvista.read(task.path)
    points = z_up(np.concatenate([each.points for each in found.recursive_iterator()]))
    return {"rest": points, "points": [points] * len(task.times)}


if __name__ == "__main__":
    main(pyvista.__version__, play)
