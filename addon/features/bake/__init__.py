# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew shows, as data that plays without it: shape keys, point caches and exported files."""
