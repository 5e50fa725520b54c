# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the native library loads in this Blender, and why not."""

from __future__ import annotations

import platform
import sys


def load_error() -> str | None:
    """None where `sinew` imports, else one sentence for the panel."""
    try:
        import sinew  # noqa: F401
    except ImportError as error:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        return (
            f"Sinew's native library does not load in this Blender (Python {version}, {platform.system()} "
            f"{platform.machine()}): {error}. Install the Sinew zip made for this system"
        )
    return None
