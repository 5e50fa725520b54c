# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes measured and pictures rendered for the pages that commands write."""
