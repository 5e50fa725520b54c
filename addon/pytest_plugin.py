# SPDX-License-Identifier: GPL-3.0-or-later
"""A pytest fixture for render tests of one's own rigs; loaded by pytest where sinew-blender is installed.

    def test_elbow(sinew_render):
        sinew_render("hero.blend", "golden/hero", method="dq", frames="1,12,24")

`pytest --sinew-update` makes or renews the golden pictures.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PROGRAM = "from sinew_addon.cli import run; run()"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.getgroup("sinew").addoption(
        "--sinew-update",
        action="store_true",
        help="make golden pictures again instead of comparing with them",
    )


@pytest.fixture
def sinew_render(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., None]:
    """sinew_render(file, golden, method=..., frames=..., tolerance=..., **options) fails where a frame of
    `file` differs from its golden picture.

    file, golden  paths, relative to the test's folder
    method        of `sinew methods`, or "blender"
    frames        such as "1,12,40-48"
    tolerance     percent of the pixels that may differ visibly
    options       other options of `sinew render`: object="Body", size=320, engine="cycles", own_look=True
    """
    here = request.path.parent
    calls = iter(range(1_000_000))

    def render(
        file: str | Path,
        golden: str | Path,
        *,
        method: str,
        frames: str | int,
        tolerance: float | None = None,
        **options: object,
    ) -> None:
        __tracebackhide__ = True
        pictures = here / golden
        arguments = ["render", here / file, "--method", method, "--frames", frames, *_as_arguments(options)]
        if request.config.getoption("--sinew-update"):
            arguments += ["--out", pictures]
        elif not pictures.is_dir():
            pytest.fail(
                f"{pictures}: no golden pictures; make them with pytest --sinew-update", pytrace=False
            )
        else:
            arguments += ["--against", pictures, "--out", tmp_path / f"render-{next(calls)}"]
            if tolerance is not None:
                arguments += ["--tolerance", tolerance]
        # In a separate process: it opens files, and the test may have one open.
        result = subprocess.run(
            [sys.executable, "-c", PROGRAM, *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=False,
        )
        if result.returncode != 0:
            pytest.fail(f"{result.stdout}{result.stderr}".strip(), pytrace=False)

    return render


def _as_arguments(options: dict[str, object]) -> list[object]:
    arguments: list[object] = []
    for name, value in options.items():
        if value is True:
            arguments.append(f"--{name.replace('_', '-')}")
        elif value not in (None, False):
            # In one argument: a value that begins with a dash would be taken for an option.
            arguments.append(f"--{name.replace('_', '-')}={value}")
    return arguments
