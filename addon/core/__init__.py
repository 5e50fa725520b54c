# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew computes around the library, without Blender: numpy in, numpy out."""
