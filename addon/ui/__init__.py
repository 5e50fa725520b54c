# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's main panel with its operators, and the preferences."""
