# SPDX-License-Identifier: GPL-3.0-or-later
"""Chromium without a window, for players that are pages."""

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from adapter import MissingError

OPTIONS = "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --no-first-run"


@contextmanager
def shown(address: str) -> Iterator[None]:
    """Context in which a page is open."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        raise MissingError("a program chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        words = [program, *OPTIONS.split(), f"--user-data-dir={folder}", address]
        with subprocess.Popen(words, stderr=subprocess.DEVNULL) as browser:
            try:
                yield
            finally:
                browser.terminate()
