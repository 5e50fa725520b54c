# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of the extension's page have the sizes that extensions.blender.org takes."""

from pathlib import Path

import pytest
from PIL import Image

LISTING = Path(__file__).parents[2] / "listing"
PICTURES = sorted(LISTING.glob("*.webp"))


@pytest.mark.parametrize("path", [LISTING / "icon.png", *PICTURES], ids=lambda path: path.name)
def test_a_picture_has_its_size(path):
    with Image.open(path) as picture:
        assert picture.size == ((256, 256) if path.stem == "icon" else (1920, 1080))


def test_there_are_five_beside_the_one_at_the_top():
    assert len(PICTURES) == 6
