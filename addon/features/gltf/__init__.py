# SPDX-License-Identifier: GPL-3.0-or-later
"""What engines need to skin as Sinew does, in the files of Blender's glTF exporter: docs/engines.md."""
