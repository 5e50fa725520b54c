# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and patterns of names."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase

# What leads to another folder or drive, what no file's name can have, and what would be read as one of these.
_NOT_IN_FILE_NAMES = re.compile(r"[/\\\x00-\x1f\x7f]|^\.+$|(?<=^[A-Za-z]):|%(?=[0-9A-Fa-f]{2})")


def fits(name: str, pattern: str) -> bool:
    """Whether `pattern`, as "Cape*", means `name`: also the very name, which can have brackets."""
    return name == pattern or fnmatchcase(name, pattern)


def as_file_name(name: str) -> str:
    """A name that people gave to something, as the name of a file: "a/b" is "a%2Fb". Most stay as they are;
    urllib.parse.unquote gives back each."""
    return _NOT_IN_FILE_NAMES.sub(lambda found: "".join(f"%{ord(char):02X}" for char in found[0]), name)
