# SPDX-License-Identifier: GPL-3.0-or-later
"""viser, in Chromium without a window. It plays a file's clips by the clock: so that what it draws does not
depend on when, this shows it a file for each time, in which all keys are those of that time."""

import tempfile
import time
from pathlib import Path

import numpy as np
import viser
from adapter import DEGREES, EYE, PIXELS, Task, main
from chromium import shown
from glb import Glb

# Half a turn about X: to look along -Z, with Y up.
FORWARD = (0.0, 1.0, 0.0, 0.0)


def stopped(path: Path, seconds: float) -> bytes:
    file = Glb(path)
    for animation in file.header.get("animations", ()):
        for sampler in animation["samplers"]:
            times, values = file.array(sampler["input"])[:, 0], file.array(sampler["output"])
            values = values.reshape(len(times), -1)
            one = values[np.abs(times - seconds).argmin()]
            own = file.header["accessors"][sampler["output"]]["type"]
            rows = np.tile(one, (len(times), 1))
            sampler["output"] = file.add(rows.reshape(-1, 1) if own == "SCALAR" else rows)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "stopped.glb")
        file.write(out)
        return out.read_bytes()


def client_of(server: viser.ViserServer) -> viser.ClientHandle:
    while not server.get_clients():
        time.sleep(0.1)
    return next(iter(server.get_clients().values()))


def seen(client: viser.ClientHandle) -> np.ndarray:
    time.sleep(0.3)
    picture = client.get_render(
        PIXELS, PIXELS, wxyz=FORWARD, position=EYE, fov=float(np.radians(DEGREES)), transport_format="png"
    )
    return picture[:, :, 3] > 127


def drawn(client: viser.ClientHandle, server: viser.ViserServer, data: bytes) -> np.ndarray:
    """After the one before is gone, and when two pictures are alike."""
    while seen(client).any():
        pass
    handle = server.scene.add_glb("/tube", data)
    before, found = seen(client), seen(client)
    while not found.any() or (found != before).any():
        before, found = found, seen(client)
    handle.remove()
    return found


def play(task: Task) -> dict:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with shown(f"http://127.0.0.1:{server.get_port()}"):
        client = client_of(server)
        still = [drawn(client, server, Path(path).read_bytes()) for path in task.still]
        outlines = [drawn(client, server, stopped(task.path, each)) for each in task.times]
    server.stop()
    return {"outlines": outlines, "still": still}


if __name__ == "__main__":
    main(viser.__version__, play)
