# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pages from Jinja2's templates."""

from pathlib import Path

from ...base.errors import SinewError


def require_jinja() -> None:
    """Raises SinewError where Jinja2 is missing, as in Blender's own Python."""
    try:
        import jinja2  # noqa: F401
    except ImportError:
        raise SinewError(
            "pages need Jinja2, which this Python does not have; install sinew-blender in a Python of its "
            "own and run `sinew` there"
        ) from None


def render(template: Path, **values: object) -> str:
    """Returns the page that a template makes of the values. Text is escaped."""
    require_jinja()
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(template.name).render(values)
