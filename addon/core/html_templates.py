# SPDX-License-Identifier: GPL-3.0-or-later
"""HTML pages from the templates in templates/. Jinja2 comes with sinew-blender, not with the zip."""

from __future__ import annotations

import base64
import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import SinewError

if TYPE_CHECKING:
    import jinja2

FOLDER = Path(__file__).with_name("templates")
NO_PAGES = (
    "HTML pages need Jinja2, which this Python does not have; install sinew-blender in a Python of its own "
    "and run `sinew` with it"
)


def can_render() -> bool:
    """Whether this Python has Jinja2; Blender's own has not."""
    return importlib.util.find_spec("jinja2") is not None


def render(template: str, **values: object) -> str:
    """A page from a template of FOLDER, with `values` escaped where it does not say otherwise.

    Raises SinewError where Jinja2 is missing.
    """
    return environment().get_template(template).render(values) + "\n"


def environment() -> jinja2.Environment:
    """What templates are read with. Raises SinewError where Jinja2 is missing."""
    try:
        import jinja2
    except ImportError:
        raise SinewError(NO_PAGES) from None
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["data_url"] = _data_url
    return made


def _data_url(png: bytes) -> str:
    """A picture as an address that holds it."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
