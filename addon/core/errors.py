# SPDX-License-Identifier: GPL-3.0-or-later
"""The exceptions that carry a sentence for the user."""


class SinewError(Exception):
    """What is wrong and what to do, in one sentence."""


class WrongUse(SinewError):  # noqa: N818
    """What was asked for makes no sense; nothing has been done."""
