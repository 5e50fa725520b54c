# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds sinew-blender: this folder is the package sinew_addon, each folder with __init__.py a subpackage."""

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py


class Modules(build_py):
    """All modules except this file, which setuptools leaves out only if it is run as a program."""

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        return [found for found in super().find_package_modules(package, package_dir) if found[1] != "setup"]


setup(
    packages=["sinew_addon", *(f"sinew_addon.{name}" for name in find_packages())],
    package_dir={"sinew_addon": "."},
    cmdclass={"build_py": Modules},
)
