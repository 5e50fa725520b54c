# SPDX-License-Identifier: GPL-3.0-or-later
"""viser, in Chromium without a window. It plays a file's clips by the clock: so that what it draws does not
depend on when, this shows it a file for each time, in which all keys are those of that time."""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import viser
from adapter import DEGREES, EYE, PIXELS, MissingError, Task, main
from glb import Glb

# Half a turn about X: to look along -Z, with Y up.
FORWARD = (0.0, 1.0, 0.0, 0.0)
OPTIONS = "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --no-first-run"


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


@contextmanager
def client_of(server: viser.ViserServer) -> Iterator[viser.ClientHandle]:
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        raise MissingError("a program chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        words = [program, *OPTIONS.split(), f"--user-data-dir={folder}"]
        address = f"http://127.0.0.1:{server.get_port()}"
        with subprocess.Popen([*words, address], stderr=subprocess.DEVNULL) as browser:
            try:
                while not server.get_clients():
                    time.sleep(0.1)
                yield next(iter(server.get_clients().values()))
            finally:
                browser.terminate()


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
    with client_of(server) as client:
        still = [drawn(client, server, Path(path).read_bytes()) for path in task.still]
        outlines = [drawn(client, server, stopped(task.path, each)) for each in task.times]
    server.stop()
    return {"outlines": outlines, "still": still}


if __name__ == "__main__":
    main(viser.__version__, play)
