# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and patterns of names."""

from __future__ import annotations

from fnmatch import fnmatchcase


def fits(name: str, pattern: str) -> bool:
    """Whether `pattern`, as "Cape*", means `name`: also the very name, which can have brackets."""
    return name == pattern or fnmatchcase(name, pattern)
