# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns of names, names as file names, and how names of bones begin that Sinew makes."""

import re
from fnmatch import fnmatchcase

# Path separators and drives, control characters, and text that unquote() would change. Other colons stay, as
# in "mixamorig:Body", a key of an archive that is typed; programs that unpack one on Windows replace them.
_NOT_IN_FILE_NAMES = re.compile(r"[/\\\x00-\x1f\x7f]|^\.+$|[. ]$|(?<=^[A-Za-z]):|%(?=[0-9A-Fa-f]{2})")
# Devices of Windows, whatever follows a dot.
_DEVICE = re.compile(
    r"(CON|PRN|AUX|NUL|CONIN\$|CONOUT\$|(COM|LPT)[0-9\u00b9\u00b2\u00b3]) *(\.|$)", re.IGNORECASE
)
# Then an underscore, and the bone that they follow.
MADE_BONES = HELPER, CENTRE, SEGMENT, NEUTRAL = "Helper", "Centre", "Segment", "Neutral"


def fits(name: str, pattern: str) -> bool:
    """Whether `name` matches a pattern such as "Cape*", or equals it, as a name can contain brackets."""
    return name == pattern or fnmatchcase(name, pattern)


def as_file_name(name: str) -> str:
    """Converts any name to a file name of every system: "a/b" becomes "a%2Fb", most names are unchanged. The
    inverse is urllib.parse.unquote."""
    name = _NOT_IN_FILE_NAMES.sub(lambda found: "".join(f"%{ord(char):02X}" for char in found[0]), name)
    return f"%{ord(name[0]):02X}{name[1:]}" if _DEVICE.match(name) else name
