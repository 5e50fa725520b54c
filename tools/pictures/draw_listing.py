# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the pictures of the extension's page on a platform: the icon, the picture at the top, and photographs
of Blender's window.

    .venv/bin/python tools/pictures/draw_listing.py dist/sinew-VERSION.zip [--only icon.png]

human.blend is found in the folder SINEW_RIGS, the Blender with a window by SINEW_FULL_BLENDER (docs/dev.md).
"""

from __future__ import annotations

import argparse
import os
import subprocess
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon
from PIL import Image

HERE = Path(__file__).resolve().parent
LISTING = HERE.parents[1] / "docs" / "listing"
# Pixels, as extensions.blender.org asks for them.
ICON, PICTURE = (256, 256), (1920, 1080)
BACKGROUND, BONE, FIBRES = "#262626", "#f2ead8", ("#8c2f24", "#b5402f", "#d9583d", "#ee7f55")
# For each script that photographs the window, the pictures that it makes.
PHOTOGRAPHS = {
    "photograph_panel.py": ("1-panel",),
    "photograph_comparison.py": ("2-compare",),
    "photograph_heat.py": ("3-heat-map", "4-diagnostics"),
    "photograph_sculpt.py": ("5-sculpt",),
}


def draw_icon(path: Path) -> None:
    """Two bones at a bent elbow, and the fibres that follow them."""
    figure = Figure(figsize=(ICON[0] / 100, ICON[1] / 100), dpi=100, facecolor="none")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.axis("off")
    box = FancyBboxPatch((0.02, 0.02), 0.96, 0.96, boxstyle="round,pad=0,rounding_size=0.18", lw=0)
    box.set_facecolor(BACKGROUND)
    axes.add_patch(box)
    shoulder, elbow, hand = np.array([0.26, 0.84]), np.array([0.40, 0.40]), np.array([0.84, 0.26])
    control = 2 * elbow - (shoulder + hand) / 2
    along = np.linspace(0, 1, 80)[:, None]
    middle = (1 - along) ** 2 * shoulder + 2 * along * (1 - along) * control + along**2 * hand
    across = np.gradient(middle, axis=0) @ [[0, 1], [-1, 0]]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    width = 0.04 + 0.13 * np.sin(np.pi * along)
    for place, colour in zip(np.linspace(-1, 1, len(FIBRES)), FIBRES, strict=True):
        axes.plot(*(middle - width * place * across).T, color=colour, lw=20, solid_capstyle="round")
    for head, tail in ((shoulder, elbow), (elbow, hand)):
        axis = tail - head
        side = np.array([-axis[1], axis[0]]) * 0.11
        corners = [head, head + 0.2 * axis + side, tail, head + 0.2 * axis - side]
        bone = Polygon(corners, facecolor=BONE, edgecolor=BACKGROUND, lw=2, joinstyle="round", zorder=3)
        axes.add_patch(bone)
    figure.savefig(path, transparent=True)


def draw_top(path: Path) -> None:
    """Three methods beside each other."""
    from draw_sheets import sheet

    fitted(sheet("wrist.blend", "lbs,dq,cor", 24, 620)).save(path, quality=90)


def fitted(drawn: Image.Image) -> Image.Image:
    """As large as it fits, on the colour of its own corner."""
    whole = Image.new("RGB", PICTURE, drawn.getpixel((0, 0)))
    factor = min(PICTURE[0] / drawn.width, PICTURE[1] / drawn.height)
    drawn = drawn.resize(
        (round(drawn.width * factor), round(drawn.height * factor)), Image.Resampling.LANCZOS
    )
    whole.paste(drawn, ((PICTURE[0] - drawn.width) // 2, (PICTURE[1] - drawn.height) // 2))
    return whole


def photograph(script: str, package: Path, names: tuple[str, ...]) -> None:
    human = Path(os.environ["SINEW_RIGS"], "human.blend")
    pictures = [LISTING / f"{name}.webp" for name in names]
    words = ["run", "--factory-startup", human, "--python", HERE / script, "--", package, *pictures]
    screen = os.environ | {"SCREEN": "x".join(map(str, PICTURE))}
    subprocess.run(
        [os.environ["SINEW_FULL_BLENDER"], *words], check=True, env=screen, stdout=subprocess.DEVNULL
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("package", type=Path, help="the extension's zip, with a wheel for that Blender")
    parser.add_argument("--only", help="the name of one picture")
    options = parser.parse_args()
    drawn = {"icon.png": draw_icon, "top.webp": draw_top}
    for name, draw in drawn.items():
        if options.only in (None, name):
            draw(LISTING / name)
    for script, names in PHOTOGRAPHS.items():
        if options.only is None or options.only.removesuffix(".webp") in names:
            photograph(script, options.package.resolve(), names)


if __name__ == "__main__":
    main()
