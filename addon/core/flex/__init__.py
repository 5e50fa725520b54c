# SPDX-License-Identifier: GPL-3.0-or-later
"""Flex: does a character deform well, and where not; docs/flex.md."""
