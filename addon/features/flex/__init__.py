# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends each joint of characters, and says which deform well."""
