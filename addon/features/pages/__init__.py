# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures shapes and renders pictures for the pages that commands write."""
