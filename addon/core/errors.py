# SPDX-License-Identifier: GPL-3.0-or-later
"""Exceptions whose message is one sentence for the user."""


class SinewError(Exception):
    """The message says what is wrong and what to do."""


class WrongUse(SinewError):  # noqa: N818
    """The arguments make no sense; nothing has been done."""
