# SPDX-License-Identifier: GPL-3.0-or-later
"""The platforms that Blender supports extensions for, and their names for zig and Python."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# What `./dev test --platform` runs of each.
PARTS = {
    "linux-x64": ("native",),
    "linux-arm64": ("native", "python"),
    "windows-x64": ("native", "python", "blender"),
}


@dataclass(frozen=True)
class Platform:
    """
    name        Blender's name in a manifest's `platforms`
    zig         zig's name of the target, with the oldest supported system
    system      CMAKE_SYSTEM_NAME
    processor   CMAKE_SYSTEM_PROCESSOR
    wheel       the platform's tag in the name of a wheel
    module      what follows "_native." in a module's name; {tag} stands for cp311 and the like, {digits} for
                311
    """

    name: str
    zig: str
    system: str
    processor: str
    wheel: str
    module: str

    @property
    def is_windows(self) -> bool:
        return self.system == "Windows"

    @property
    def is_linux(self) -> bool:
        return self.system == "Linux"

    def module_suffix(self, version: str) -> str:
        """version: of Python, such as 3.11"""
        digits = version.replace(".", "")
        return "." + self.module.format(tag=f"cp{digits}", digits=digits)

    def wheel_tag(self, version: str) -> str:
        tag = "cp" + version.replace(".", "")
        return f"{tag}-{tag}-{self.wheel}"


# The version of the C library of Blender's own builds for Linux; its version of macOS is 11.2.
LINUX = "linux-gnu.2.28"
MACOS = "macos.11.0"

PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform(
            "linux-x64",
            f"x86_64-{LINUX}",
            "Linux",
            "x86_64",
            "manylinux_2_28_x86_64",
            "cpython-{digits}-x86_64-linux-gnu.so",
        ),
        Platform(
            "linux-arm64",
            f"aarch64-{LINUX}",
            "Linux",
            "aarch64",
            "manylinux_2_28_aarch64",
            "cpython-{digits}-aarch64-linux-gnu.so",
        ),
        Platform("windows-x64", "x86_64-windows-gnu", "Windows", "AMD64", "win_amd64", "{tag}-win_amd64.pyd"),
        Platform(
            "windows-arm64", "aarch64-windows-gnu", "Windows", "ARM64", "win_arm64", "{tag}-win_arm64.pyd"
        ),
        Platform(
            "macos-arm64",
            f"aarch64-{MACOS}",
            "Darwin",
            "arm64",
            "macosx_11_0_arm64",
            "cpython-{digits}-darwin.so",
        ),
        Platform(
            "macos-x64",
            f"x86_64-{MACOS}",
            "Darwin",
            "x86_64",
            "macosx_11_0_x86_64",
            "cpython-{digits}-darwin.so",
        ),
    )
}


def _state() -> str:
    """The commit, and whether files differ from it."""
    words = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()


def _record(name: str) -> Path:
    return ROOT / "build/platforms" / name / "tested"


def note_as_tested(name: str) -> None:
    """Its tests passed, all of them."""
    _record(name).write_text(_state())


def not_tested() -> list[str]:
    """The platforms whose tests have not passed here, all of them, as the files are."""
    state = _state()
    noted = {name: _record(name).read_text() for name in PARTS if _record(name).exists()}
    return [name for name in PARTS if noted.get(name) != state or state.endswith("-dirty")]
