# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the sheets of methods beside each other, and photographs the pages of commands: what Sinew's command
line makes, as the documents show it.

    python docs/draw_sheets.py [--out docs] [--only page.png]

human.blend is found in the folder SINEW_RIGS. Pages want Chromium, as `chromium` of Debian.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
BLEND_FILES = REPOSITORY / "blend_files"
SINEW = Path(sys.executable).with_name("sinew")
# In the order of the documents.
SIX = "lbs,dq,cor,sbs,log,dib"
# For each sheet its file, methods, frame, width of a picture, and what `sinew compare` is told beside.
SHEETS = {
    "wrist.png": ("wrist.blend", "lbs,qv,dq", 24, 420, ()),
    "human.png": ("human.blend", "lbs,dq", 16, 420, ()),
    "methods-wrist.png": ("wrist.blend", SIX, 24, 300, ()),
    "methods-elbow.png": ("elbow.blend", SIX, 24, 300, ()),
    "methods-shoulder.png": ("shoulder.blend", "lbs,dq,cor,sbs", 24, 300, ()),
    "methods-stages.png": (
        "elbow.blend",
        "lbs,dq,cor",
        24,
        300,
        ("bulge_limit=on", "delta_mush=on", "delta_mush.iterations=20"),
    ),
}


def find(name: str) -> Path:
    folders = [BLEND_FILES, Path(os.environ.get("SINEW_RIGS") or BLEND_FILES)]
    return next(folder / name for folder in folders if (folder / name).exists())


def sinew(*words: str | Path) -> None:
    subprocess.run([SINEW, *words], check=True, stdout=subprocess.DEVNULL)


def draw_sheet(target: Path) -> None:
    name, methods, frame, size, settings = SHEETS[target.name]
    options = [word for setting in settings for word in ("--set", setting)]
    sinew(
        *("compare", find(name), "--methods", methods, "--frame", str(frame), "--size", str(size), *options),
        *("--out", target),
    )


def photograph(page: Path, target: Path, width: int, height: int) -> None:
    """The top of a page, of so many pixels."""
    with tempfile.TemporaryDirectory() as profile:
        subprocess.run(
            [
                *("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
                *("--force-device-scale-factor=1", f"--user-data-dir={profile}"),
                *(f"--window-size={width},{height}", f"--screenshot={target}", page.as_uri()),
            ],
            check=True,
            stderr=subprocess.DEVNULL,
        )


def photograph_report(target: Path) -> None:
    """Of a batch, in which one file is broken."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place, "characters")
        shutil.copytree(BLEND_FILES, folder, ignore=shutil.ignore_patterns("report_*"))
        (folder / "broken.blend").write_text("no file of Blender's\n")
        words = [SINEW, "reskin", folder, "--method", "dq", "--out", Path(place, "out")]
        # One file fails, so the batch does.
        assert subprocess.run(words, stdout=subprocess.DEVNULL, check=False).returncode == 1
        page = Path(place, "out/report.html")
        text = page.read_text(encoding="utf-8").replace(place, "/srv/film")
        page.write_text(text, encoding="utf-8")
        photograph(page, target, 1000, 780)


def photograph_page(target: Path) -> None:
    with tempfile.TemporaryDirectory() as place:
        sinew("compare", find("human.blend"), "--methods", "lbs,cor,dq", "--pictures", "0", "--out", place)
        photograph(Path(place, "human.html"), target, 1300, 1310)


def photograph_heat_map(target: Path) -> None:
    """Of a page, the section on the stretch of edges."""
    with tempfile.TemporaryDirectory() as place:
        sinew(
            *("compare", find("elbow.blend"), "--methods", "lbs,cor,dq", "--frames", "24", "--size", "320"),
            *("--out", place),
        )
        page = Path(place, "elbow.html")
        text = page.read_text(encoding="utf-8")
        head = text[: text.index("<h1>")]
        section = re.search(r"<h2>Edge stretch at frame.*?(?=<h2>)", text, re.DOTALL)
        assert section
        page.write_text(head + section[0], encoding="utf-8")
        photograph(page, target, 1160, 768)


PICTURES: dict[str, Callable[[Path], None]] = {
    **dict.fromkeys(SHEETS, draw_sheet),
    "batch-report.png": photograph_report,
    "page.png": photograph_page,
    "heat.png": photograph_heat_map,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs")
    parser.add_argument("--only", choices=PICTURES, action="append", help="this picture")
    options = parser.parse_args()
    for name in options.only or PICTURES:
        PICTURES[name](options.out.resolve() / name)
        print(options.out / name, flush=True)


if __name__ == "__main__":
    main()
