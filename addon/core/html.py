# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages from templates, by Jinja2, which Blender's own Python does not have."""

from pathlib import Path

from .errors import SinewError


def require_jinja() -> None:
    """Raises SinewError where Jinja2 is missing, as in Blender's own Python."""
    try:
        import jinja2  # noqa: F401
    except ImportError:
        raise SinewError(
            "pages need Jinja2, which this Python does not have; install sinew-blender in a Python of its "
            "own and run `sinew` there"
        ) from None


def render(template: str, **values: object) -> str:
    """Returns the page that a file of templates/ makes of the values. Text is escaped."""
    require_jinja()
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(template).render(values)
