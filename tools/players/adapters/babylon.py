# SPDX-License-Identifier: GPL-3.0-or-later
"""Babylon.js, of the lock `babylon`, in Chromium without a window: babylon.html."""

import functools
import http.server
import importlib.util
import json
import queue
import threading
from pathlib import Path

from adapter import NoSkinError, Task, main, z_up
from chromium import shown

VERSION, SECONDS = "8.46.2", 90
PAGE = Path(__file__).with_suffix(".html")


def modules() -> Path:
    """The module of the viewer."""
    package = Path(next(iter(importlib.util.find_spec("gradio").submodule_search_locations)))
    found = (package / "templates/frontend/assets").glob("lib-*.js")
    (viewer,) = [path for path in found if "CreateViewerForCanvas" in path.read_text(encoding="utf-8")]
    return viewer


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves the modules, the page and the file, and takes what the page found."""

    def __init__(self, file: Path, found: queue.Queue, *others: object, **options: object) -> None:
        self.own, self.found = {"/page.html": PAGE, "/file.glb": file}, found
        super().__init__(*others, **options)

    def translate_path(self, path: str) -> str:
        return str(self.own.get(path.partition("?")[0]) or super().translate_path(path))

    def do_POST(self) -> None:
        self.found.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


def play(task: Task) -> dict:
    viewer, answers = modules(), queue.Queue()
    handler = functools.partial(Handler, task.path, answers, directory=viewer.parent)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        times = ",".join(map(str, task.times))
        address = f"http://127.0.0.1:{server.server_port}/page.html"
        with shown(f"{address}?module=./{viewer.name}&times={times}&clip={task.clip}"):
            found = answers.get(timeout=SECONDS)
        server.shutdown()
    if "error" in found:
        raise RuntimeError(found["error"])
    assert found["version"] == VERSION
    if "said" in found:
        raise NoSkinError(found["said"])
    return {"rest": z_up(found["rest"]), "points": z_up(found["points"])}


if __name__ == "__main__":
    main(VERSION, play)
