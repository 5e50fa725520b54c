# SPDX-License-Identifier: GPL-3.0-or-later
"""Data with which engines can skin as Sinew does, in the files of Blender's glTF exporter:
docs/engines.md."""
