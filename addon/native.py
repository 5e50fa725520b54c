# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds out whether the native library loads in this Blender and fits this extension, and if not, why."""

import platform
import sys
import tomllib
from pathlib import Path
from types import ModuleType

# The parts of the library that the extension uses; ./dev stub writes them.
NAMES = [
    "Binding",
    "BulgeLimit",
    "Deformer",
    "DeltaMush",
    "Lock",
    "Method",
    "Normals",
    "Parameter",
    "Precomputation",
    "SkinnedNormals",
    "Stage",
    "TwistSpread",
    "affine",
    "centres_of_rotation",
    "crossing_triangles",
    "direct_delta_mush",
    "dual_quat",
    "interpolate",
    "keep_thread_state",
    "methods",
    "quat",
    "quat_vec",
    "spline",
    "stages",
    "thread_id",
    "weights_in_memory",
]


def load_error() -> str | None:
    """Returns None where `sinew` imports and has what the extension needs, else one sentence for the
    panel."""
    try:
        import sinew
    except ImportError as error:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        return (
            f"Sinew's native library does not load in this Blender (Python {version}, {platform.system()} "
            f"{platform.machine()}): {error}. Install the Sinew zip made for this system"
        )
    return _age_error(sinew)


def _age_error(library: ModuleType) -> str | None:
    """Returns one sentence where the library is older than the extension."""
    own, found = _own_version(), getattr(library, "__version__", "")
    missing = [name for name in NAMES if not hasattr(library, name)]
    if not missing and (not own or _numbers(found) >= _numbers(own)):
        return None
    what = f" lacks {', '.join(missing)}, and" if missing else ""
    named = f"The library sinew {found or 'of no version'} in {Path(library.__file__ or '').parent}{what}"
    if found == own:
        return (
            f"{named} is of another build. Blender keeps it where the same version is installed again: "
            "remove the extension Sinew, restart Blender, and install it"
        )
    return (
        f"{named} is older than this extension ({own or 'of no version'}): install the one that comes with "
        "it, and restart Blender"
    )


def _own_version() -> str:
    """Returns the version of the extension; empty where its manifest is not beside it."""
    try:
        text = Path(__file__).with_name("blender_manifest.toml").read_text(encoding="utf-8")
        return str(tomllib.loads(text)["version"])
    except (OSError, KeyError, ValueError):
        return ""


def _numbers(version: str) -> tuple[int, ...]:
    """Returns numbers for comparison; parts that are not numbers count as less than any number."""
    return tuple(int(part) if part.isdigit() else -1 for part in version.split("."))
