# SPDX-License-Identifier: GPL-3.0-or-later
"""MuJoCo's compiler, of a model with the file as its mesh."""

import mujoco
from adapter import NoSkinError, Task, main

MODEL = """<mujoco>
  <asset><mesh name="tube" file="{}"/></asset>
  <worldbody><geom type="mesh" mesh="tube"/></worldbody>
</mujoco>"""


def play(task: Task) -> dict:
    try:
        mujoco.MjModel.from_xml_string(MODEL.format(task.path))
    except ValueError as error:
        raise NoSkinError(str(error).splitlines()[0]) from None
    raise NoSkinError("a mesh without a skin")


if __name__ == "__main__":
    main(mujoco.__version__, play)
