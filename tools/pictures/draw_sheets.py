# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the sheets of methods beside each other, and photographs the pages of commands: what Sinew's command
line makes, as the documents show it.

    python tools/pictures/draw_sheets.py [--out docs] [--only page.png]

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
from collections.abc import Callable, Sequence
from pathlib import Path

import sinew as library
from PIL import Image, ImageChops, ImageDraw, ImageFont

REPOSITORY = Path(__file__).resolve().parents[2]
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

# In which it is bent by some 130 degrees, and where the joint is in a picture of 512 pixels: left, top, right
# and bottom.
ELBOW_FRAME, ELBOW = 21, (212, 102, 500, 390)


def find(name: str) -> Path:
    folders = [BLEND_FILES, Path(os.environ.get("SINEW_RIGS") or BLEND_FILES)]
    return next(folder / name for folder in folders if (folder / name).exists())


def sinew(*words: str | Path) -> None:
    subprocess.run([SINEW, *words], check=True, stdout=subprocess.DEVNULL)


def sheet(name: str, methods: str, frame: int, size: int, settings: Sequence[str] = ()) -> Image.Image:
    """The pictures of methods side by side: whole, and where they differ most."""
    options = [word for setting in settings for word in ("--set", setting)]
    labels = {method.name: method.label for method in library.methods()}
    font, margin = ImageFont.load_default(size=20), 16
    with tempfile.TemporaryDirectory() as place:
        sinew(
            *("compare", find(name), "--methods", methods, "--frames", str(frame), "--size", str(size)),
            *(*options, "--out", place),
        )
        pictures = Path(place, Path(name).stem, "pictures")
        names = (f"{frame}", f"distance-{frame}-close-clay")
        columns = [
            [Image.open(pictures / f"{method}-{end}.png").convert("RGBA") for end in names]
            for method in methods.split(",")
        ]
    wide = max(picture.width for column in columns for picture in column) + margin
    high = 20 + 2 * margin + sum(picture.height + margin for picture in columns[0])
    drawn = Image.new("RGB", (wide * len(columns) + margin, high), (38, 40, 44))
    for number, (method, column) in enumerate(zip(methods.split(","), columns, strict=True)):
        x, y = margin + number * wide, 20 + 2 * margin
        ImageDraw.Draw(drawn).text((x, margin), labels[method], font=font, fill=(232, 232, 232))
        for picture in column:
            drawn.paste(picture, (x + (wide - margin - picture.width) // 2, y), picture)
            y += picture.height + margin
    return drawn


def draw_sheet(target: Path) -> None:
    sheet(*SHEETS[target.name]).save(target)


def draw_elbows(_target: Path) -> None:
    """One elbow under each method, for the tab's list: always written to the extension."""
    folder, methods = REPOSITORY / "addon/ui/pictures", [method.name for method in library.methods()]
    with tempfile.TemporaryDirectory() as place:
        sinew(
            *("compare", find("elbow.blend"), "--methods", ",".join(methods), "--frames", str(ELBOW_FRAME)),
            *("--size", "512", "--pictures", "1", "--out", place),
        )
        for method in methods:
            picture = Image.open(Path(place, f"elbow/pictures/{method}-{ELBOW_FRAME}.png")).convert("RGBA")
            cut = picture.crop(ELBOW).resize((128, 128), Image.Resampling.LANCZOS)
            # The limb goes on to the left: it fades out there.
            fade = Image.linear_gradient("L").rotate(90).point(lambda far: min(5 * far, 255))
            cut.putalpha(ImageChops.multiply(cut.getchannel("A"), fade.resize(cut.size)))
            cut.save(folder / f"{method}.png", optimize=True)


def photograph(page: Path, target: Path, width: int, height: int) -> None:
    """The top of a page, of so many pixels."""
    with tempfile.TemporaryDirectory() as profile:
        subprocess.run(
            [
                *("chromium", "--headless", "--no-sandbox", "--hide-scrollbars"),
                # WebGL in software, and time for what a page does after it has loaded.
                *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--virtual-time-budget=9000"),
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


def photograph_viewer(target: Path) -> None:
    """The page that turns, with the stretch of edges on one side of a wrist as on the other."""
    with tempfile.TemporaryDirectory() as place:
        page = Path(place, "wrist.html")
        sinew("compare", find("wrist.blend"), "--methods", "lbs,dq,cor", "--viewer", page)
        text = page.read_text(encoding="utf-8").replace("measure: 0,", "measure: 2,")
        page.write_text(text, encoding="utf-8")
        photograph(page, target, 1180, 640)


def photograph_sheet(target: Path) -> None:
    """The page of a contact sheet, as it begins."""
    variants = "blender, dq, cor, dq+twist_spread+delta_mush"
    with tempfile.TemporaryDirectory() as place:
        words = "--sheet", Path(place, "human.png"), "--viewer", Path(place, "human.html")
        sinew("compare", find("human.blend"), "--variants", variants, *words)
        photograph(Path(place, "human.html"), target, 1280, 780)
    # Of few colours.
    Image.open(target).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)


def photograph_flex(target: Path) -> None:
    """The page of a character that was bent, at a fault of a finger."""
    with tempfile.TemporaryDirectory() as place:
        page = Path(place, "human.html")
        words = [SINEW, "flex", find("human.blend"), "--viewer", page]
        # Its fingers have faults, so the command fails.
        assert subprocess.run(words, stdout=subprocess.DEVNULL, check=False).returncode == 1
        click = 'choose(findings.findIndex(({ measure }) => measure === "Flipped faces"));\nwindow.sinew = {'
        text = page.read_text(encoding="utf-8").replace("window.sinew = {", click)
        page.write_text(text, encoding="utf-8")
        photograph(page, target, 1180, 640)


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
    "viewer.png": photograph_viewer,
    "viewer-sheet.png": photograph_sheet,
    "viewer-flex.png": photograph_flex,
    "heat.png": photograph_heat_map,
    "elbows": draw_elbows,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs")
    parser.add_argument("--only", choices=PICTURES, action="append", help="this picture")
    options = parser.parse_args()
    for name in options.only or PICTURES:
        PICTURES[name](options.out.resolve() / name)
        print(name, flush=True)


if __name__ == "__main__":
    main()
