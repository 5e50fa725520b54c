# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blenders that are tested, as bpy, and the Python that each is built for."""

BLENDERS = {"4.2": "3.11", "4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13", "5.3": "3.13"}
OLDEST, NEWEST = "4.2", "5.3"
# Supported for months: what does not differ between versions is left to the others (conftest.py).
SHORT_TERM = ("5.0", "5.1")
# bpy requires numpy 1.
NUMPY_1 = ("4.5", "5.0")
